"""Passes over the same ice, described before a run: number, period, and temperature."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.conditions import exposure, scene_passes
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene import Scene


class Row(NamedTuple):
    """One line of the table: group, name, value with unit, and meaning."""

    group: str
    quantity: str
    value: str
    meaning: str


_BETWEEN = {
    "all": "between them water freezes as far as the rest lets it",
    "film": "between them films freeze as far as the rest lets it, and other water stays",
    "drain": "between them the water is gone",
    "nothing": "between them the water stays liquid",
}


def single_pass(scene: Scene) -> Scene:
    """The scene without passes and rows."""
    load = scene.load.model_copy(update={"passes": 1, "period": None})
    rubber = scene.rubber.model_copy(update={"rows": 1, "row_pitch": None})
    return scene.model_copy(update={"load": load, "rubber": rubber})


def describe_passes(scene: Scene) -> list[Row]:
    """Number and period of passes or rows, and the ice temperature before the last one."""
    if not scene.several_passes:
        return []
    passes = scene_passes(scene)
    rows = scene.rubber.rows > 1
    between = _BETWEEN[passes.between]
    return [
        Row(
            "passes",
            "rows" if rows else "passes",
            f"{passes.number}, one every {readable(passes.period, 's')}",
            f"row_pitch / v; {between}" if rows else between,
        ),
        Row(
            "passes",
            "surface before the last pass",
            f"about {surface_before_last(scene) - ZERO_CELSIUS:.2g} degC",
            "by the mean power of the first pass, in deep ice or steady above a held base",
        ),
    ]


def surface_before_last(scene: Scene) -> float:
    """Estimated surface temperature (K) before the last pass.

    Each pass, of the time t_c, heats a half-space with the flux q of the first pass. q is the
    friction power if water freezes, else the part of it that warms the ice:

        dT = 2 q / (e sqrt(pi)) sum over passes of (sqrt(a) - sqrt(a - t_c)),

    with the time a since the start of each pass. Water W on the ice is part of q only if it is
    kept. If it freezes, its heat adds rho L W / (e sqrt(pi a)), with a since the first pass. Above
    a held base the rise is at most the steady mean q t_c R / period, with the resistance R of ice
    and layers. The temperature is at most the melting point.
    """
    passes, time = scene_passes(scene), exposure(scene)
    once, brought = single_pass(scene), scene.ice.water
    load = once.load.model_copy(update={"duration": time})
    water = brought if passes.between in ("film", "nothing") else 0.0
    ice = once.ice.model_copy(update={"motion": "attached", "water": water})
    last = point_history(once.model_copy(update={"load": load, "ice": ice}))[0][-1]
    heat = last.friction_work_J if passes.between == "all" else last.ice_heat_J
    flux = heat / (scene.rubber.length * scene.rubber.width * time)
    since = passes.period * np.arange(1, passes.number)
    roots = float(np.sum(np.sqrt(since) - np.sqrt(since - time)))
    solid = scene.ice.solid
    rise = 2.0 * flux / (solid.effusivity * np.sqrt(np.pi)) * roots
    if passes.between == "all":
        rise += solid.melting_enthalpy * brought / (solid.effusivity * np.sqrt(np.pi * since[-1]))
    if scene.ice.ground.held is not None:
        layers = scene.ice.ground.stack(scene.ice.solid)
        resistance = sum(layer.thickness / layer.solid.conductivity for layer in layers)
        rise = min(rise, flux * time / passes.period * resistance)
    return min(scene.ice.temperature + float(rise), scene.ice.melting_temperature)
