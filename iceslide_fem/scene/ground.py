"""Checks of the layers below the ice, and of its base."""

from __future__ import annotations

from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.ice import REGION, Ice


def check_ground(ice: Ice) -> None:
    """Raise ValueError if the description of the ground below the `ice` is not possible."""
    _check_layers(ice)
    _check_base(ice)


def _check_layers(ice: Ice) -> None:
    names: list[str] = []
    for number, layer in enumerate(ice.layers, start=1):
        if layer.name is None:
            raise ValueError(
                f'layer {number} of ice.layers has no name; give it one, as in name = "steel"'
            )
        if layer.name == REGION or layer.name in names:
            raise ValueError(
                f'ice.layers has the name "{layer.name}" twice (the ice itself is "{REGION}"); '
                "allowed: a different name for each layer"
            )
        names.append(layer.name)
        if ice.mesh is not None and layer.thickness is not None:
            raise ValueError(
                f'ice.mesh and the thickness of layer "{layer.name}" contradict each other: the '
                "mesh has it"
            )
        if ice.mesh is None and layer.thickness is None:
            raise ValueError(f'layer "{layer.name}" of ice.layers has no thickness')
    if names and ice.depth is None and ice.mesh is None:
        raise ValueError(
            f'ice.depth is missing: layer "{names[0]}" lies below ice of a certain depth'
        )


def _check_base(ice: Ice) -> None:
    if ice.base == "insulated":
        return
    if ice.depth is None and ice.mesh is None:
        raise ValueError(
            'ice.base = "held" needs ice.depth: ice without one has no base that heat reaches'
        )
    warm = ice.base_temperature
    if warm is not None and warm != ice.temperature and ice.motion == "sliding":
        raise ValueError(
            'ice.base_temperature and ice.motion = "sliding" contradict each other: ice that comes '
            "in has been above its base before; allowed: a base as warm as ice.temperature"
        )
    if warm is not None and warm >= ice.melting_temperature:
        raise ValueError(
            f"ice.base_temperature = {warm - ZERO_CELSIUS:.6g} degC is not below "
            f"ice.melting_temperature = {ice.melting_temperature - ZERO_CELSIUS:.6g} degC: the ice "
            "would melt from below"
        )
