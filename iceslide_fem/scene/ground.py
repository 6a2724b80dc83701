"""The layers below the ice, and checks of their description in a scene."""

from __future__ import annotations

from typing import Annotated, Any, Protocol

from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import Layer, Solid
from iceslide_fem.scene.units import Name, Quantity, Table

ICE = "ice"  # name of the ice region of a mesh


class GroundLayer(Table):
    """A layer below the ice: name, conductivity, density, heat capacity, and thickness.

    Units are W/(m K), kg/m3, J/(kg K) and m. A user's mesh has the thickness itself.
    """

    name: Name | None = None
    thickness: Annotated[float, Quantity("m", "1 um", "1 m")] | None = None
    conductivity: Annotated[float, Quantity("W/m/K", "0.001 W/m/K", "3000 W/m/K")]
    density: Annotated[float, Quantity("kg/m^3", "1 kg/m^3", "25000 kg/m^3")]
    heat_capacity: Annotated[float, Quantity("J/kg/K", "10 J/kg/K", "10000 J/kg/K")]

    @property
    def as_layer(self) -> Layer:
        """The layer with its thermal properties. Name and (without a mesh) thickness are given."""
        assert self.name is not None  # by `check_ground`
        solid = Solid(self.conductivity, self.density, self.heat_capacity)
        return Layer(self.name, self.thickness or 0.0, solid)


class Grounded(Protocol):
    """What `check_ground` reads of a scene's ice; lengths in m, temperatures in K."""

    @property
    def heat(self) -> str: ...
    @property
    def motion(self) -> str: ...
    @property
    def depth(self) -> float | None: ...
    @property
    def base(self) -> str: ...
    @property
    def base_temperature(self) -> float | None: ...
    @property
    def temperature(self) -> float: ...
    @property
    def melting_temperature(self) -> float: ...
    @property
    def layers(self) -> tuple[GroundLayer, ...]: ...
    @property
    def mesh(self) -> object: ...
    @property
    def conductivity(self) -> Any: ...
    @property
    def heat_capacity(self) -> Any: ...


def check_ground(ice: Grounded) -> None:
    """Raise ValueError if the scene's description of the ground is not possible."""
    _check_heat(ice)
    _check_mesh(ice)
    _check_layers(ice)
    _check_base(ice)


def _check_heat(ice: Grounded) -> None:
    """Check models with half-space ice, and properties that need a mesh."""
    if ice.heat in ("half-space", "continuum"):
        keys = ("depth", "layers", "base_temperature")
        given = [key for key in keys if getattr(ice, key)] + ["base"] * (ice.base == "held")
        if given:
            raise ValueError(
                f'ice.heat = "{ice.heat}" takes the ice as a half-space and contradicts '
                f"ice.{given[0]}; allowed with it: ice.heat = 'column' or 'mesh'"
            )
    if ice.heat != "mesh":
        for key in ("conductivity", "heat_capacity"):
            if isinstance(getattr(ice, key), tuple):
                raise ValueError(
                    f'rows of ice.{key} over the temperature and ice.heat = "{ice.heat}" '
                    "contradict each other; allowed with rows: ice.heat = 'mesh'"
                )


def _check_mesh(ice: Grounded) -> None:
    if ice.mesh is None:
        return
    if ice.heat != "mesh":
        raise ValueError(
            f'ice.mesh and ice.heat = "{ice.heat}" contradict each other; allowed with a mesh of '
            "one's own: ice.heat = 'mesh'"
        )
    if ice.motion == "sliding":
        raise ValueError(
            'ice.mesh and ice.motion = "sliding" contradict each other: ice that passes is a '
            "window of equal cells; allowed with a mesh of one's own: ice.motion = 'attached'"
        )
    if ice.depth is not None:
        raise ValueError("ice.mesh and ice.depth contradict each other: the mesh has the depth")


def _check_layers(ice: Grounded) -> None:
    names: list[str] = []
    for number, layer in enumerate(ice.layers, start=1):
        if layer.name is None:
            raise ValueError(
                f'layer {number} of ice.layers has no name; give it one, as in name = "steel"'
            )
        if layer.name == ICE or layer.name in names:
            raise ValueError(
                f'ice.layers has the name "{layer.name}" twice (the ice itself is "{ICE}"); '
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


def _check_base(ice: Grounded) -> None:
    if ice.base == "insulated":
        if ice.base_temperature is not None:
            raise ValueError(
                'ice.base_temperature has no effect with ice.base = "insulated"; '
                "allowed with it: ice.base = 'held'"
            )
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
