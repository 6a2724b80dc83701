"""The tables of a scene, and their contradictions, each a message with the allowed values."""

from __future__ import annotations

from typing import Literal

import numpy as np

from iceslide_fem.relaxation.doubts import FURTHEST_UNDETERMINED, outside
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.units import celsius, readable
from iceslide_fem.scene.film import Film, Friction
from iceslide_fem.scene.ground import check_ground
from iceslide_fem.scene.ice import Ice, Water
from iceslide_fem.scene.layers import check_layers
from iceslide_fem.scene.load import Load
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.numerics import Numerics, Output
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.rules import check_rules
from iceslide_fem.scene.shape import check_room_across, check_shape
from iceslide_fem.scene.units import Name, Table, key

DEEPEST = 0.1  # allowed penetration over the height


class Tables(Table):
    """The model level of a scene, and all its data.

    With model "auto" a run uses the cheapest sufficient level (`runs.model_levels`).
    """

    name: Name = key(..., "Name of the results: `results/<name>`.")
    model: Literal["point", "slice", "block", "auto"] = key(
        ...,
        "`point`, `slice` (plane strain) or `block` (three dimensions). `auto` takes the "
        "cheapest one whose simplifications stay below the tolerance.",
    )
    rubber: Rubber
    load: Load
    ice: Ice = Ice()
    water: Water = Water()
    film: Film = Film()
    friction: Friction = Friction()
    numerics: Numerics = Numerics()
    output: Output = Output()
    uncertainty: dict[str, str] = key(
        {},
        "How uncertain inputs are, by their keys, for `iceslide uncertainty`: a normal spread "
        "(`0.3+-10%`), an even one (`1bar..2bar`), or a log-normal one around the scene's value "
        "(`~10%`).",
    )

    @property
    def rubber_temperature(self) -> float:
        """Temperature of the rubber at t = 0, K: its own, or that of the ice."""
        own = self.rubber.temperature
        return self.ice.temperature if own is None else own


def check_contradictions(scene: Tables) -> None:
    """Raise ValueError with the first contradiction between tables of the `scene`."""
    check_rules(scene)
    nothing = scene.rubber.compound is None and scene.film.k is None and scene.film.contact is None
    if nothing and scene.friction.law == "film":
        raise ValueError(
            "film.k, film.D and film.H_V are missing; without a compound give them, or film.contact"
        )
    check_shape(scene.rubber)
    check_layers(scene.rubber)
    _rows_are_apart(scene)
    fault = None if scene.rubber.is_drawn else too_short(scene, scene.rubber.length)
    if fault is not None:
        raise ValueError(fault)
    check_ground(scene.ice)
    _rubber_relaxes_here(scene)
    if scene.film.contact_age and scene.rubber.relaxation is None:
        raise ValueError(
            "film.contact_age needs rubber that relaxes: k grows with its creep; give "
            "rubber.prony or rubber.dma"
        )
    _rough_ice_is_known(scene)
    _water_has_its_frame(scene)
    _contact_is_stiff(scene)
    if scene.model in ("block", "auto"):
        check_room_across(scene.rubber)
    below = [name for name, place in scene.output.probes.items() if place[2] < 0.0]
    if below and scene.ice.heat == "half-space":
        raise ValueError(
            f'output.probes.{below[0]} lies in the ice, and ice.heat = "half-space" has no '
            "temperature below its surface; allowed: 'column', 'continuum' or 'mesh'"
        )
    if (late := scene.output.latest) > scene.load.duration:
        raise ValueError(
            f"output.times has {1e3 * late:.4g} ms, after the end of the run; allowed: up to "
            f"load.duration = {1e3 * scene.load.duration:.4g} ms"
        )
    if scene.rubber.heat:
        _heat_stays_in_the_rubber(scene)


def _rows_are_apart(scene: Tables) -> None:
    """Raise ValueError where passes or rows have no distance, or one that is too short."""
    load, rubber, taken = scene.load, scene.rubber, scene.load.duration
    for given, repeated, spacing, unit in (
        (load.passes > 1, "load.passes", "load.period", load.period),
        (rubber.rows > 1, "rubber.rows", "rubber.row_pitch", rubber.row_pitch),
    ):
        if given and unit is None:
            raise ValueError(f"{spacing} is missing; it says how far apart {repeated} are")
        if unit is not None and not given:
            raise ValueError(f"{spacing} has a meaning only with {repeated} of more than 1")
    if rubber.row_pitch is not None and not rubber.row_pitch > rubber.length:
        raise ValueError(
            f"rubber.row_pitch = {readable(rubber.row_pitch, 'm')} is not more than "
            f"rubber.length = {readable(rubber.length, 'm')}; it goes from leading edge to "
            "leading edge"
        )
    if rubber.row_pitch is not None and not rubber.row_pitch / load.speeds.mean > taken:
        raise ValueError(
            f"load.duration = {readable(taken, 's')} is not less than the "
            f"{readable(rubber.row_pitch / load.speeds.mean, 's')} from row to row; "
            "rubber.length / load.speed is enough"
        )
    if load.period is not None and not load.period > taken:
        raise ValueError(
            f"load.period = {readable(load.period, 's')} is not more than the "
            f"{readable(taken, 's')} that a pass takes; it goes from beginning to beginning"
        )


def _rough_ice_is_known(scene: Tables) -> None:
    """Raise ValueError if nothing says what rough ice costs this rubber."""
    roughness, rubber = scene.ice.roughness, scene.rubber
    if not roughness.is_rough:
        return
    if rubber.relaxation is None:
        raise ValueError(
            "ice.roughness needs rubber that relaxes: hysteresis is its loss on the waves of the "
            "ice; give rubber.prony or rubber.dma"
        )
    found = roughness.spectrum
    assert found is not None
    if scene.model != "point" and not rubber.is_drawn and found.longest > rubber.length:
        raise ValueError(
            f"ice.roughness has waves up to {readable(found.longest, 'm')}, longer than "
            f"rubber.length = {readable(rubber.length, 'm')}: they tilt the block and do not "
            "indent it; allowed: up to that length"
        )


def _water_has_its_frame(scene: Tables) -> None:
    """Raise ValueError if rows of water over x do not pass below a block that carries films."""
    ice = scene.ice
    on_nodes = ice.motion == "sliding" and scene.film.carrier == "ice" and scene.model != "point"
    if isinstance(ice.water, tuple) and not on_nodes:
        raise ValueError(
            "ice.water has rows over x, which need ice that passes below a slice or a block and "
            'carries the films; allowed: ice.motion = "sliding" and film.carrier = "ice", or a '
            "number"
        )


def _rubber_relaxes_here(scene: Tables) -> None:
    """Raise ValueError if the time-temperature shift is unknown at the rubber's temperature."""
    temperature = scene.rubber_temperature
    for compound in scene.rubber.compounds.values():
        relaxation = compound.relaxation
        shift = None if relaxation is None else relaxation.shift
        if not isinstance(shift, Shift) or np.isfinite(shift(temperature)):
            continue
        given = "dma" if compound.wlf is None else "wlf"
        raise ValueError(
            f"{compound.place}.{given} has no shift at {celsius(temperature)}, as cold as "
            f"reference - C2 = {celsius(shift.reference - shift.C2)} or colder; allowed: warmer "
            "rubber, or arrhenius_below and activation_energy"
        )
    measured = scene.rubber.measured
    if measured is not None and not measured.determined:
        beyond = outside(measured.relaxation, temperature)
        if beyond > FURTHEST_UNDETERMINED:
            raise ValueError(
                f"rubber.dma says nothing about {celsius(temperature)}: its isotherms do not "
                f"determine C1 and C2, and that is {beyond:.0f} K outside of them; allowed: up to "
                f"{FURTHEST_UNDETERMINED:g} K, isotherms that reach further, or rubber.wlf or "
                "rubber.shift_factors"
            )


def too_short(scene: Tables, length: float) -> str | None:
    """Message if no ice passes below all of a block of `length` (m) in a pass, else None."""
    load = scene.load
    if load.passes == 1 or scene.ice.motion == "attached" or scene.model == "point":
        return None
    transit = length / load.speeds.mean
    if load.duration >= transit * (1.0 - 1e-9):
        return None
    return (
        f"load.duration = {readable(load.duration, 's')} is too short for load.passes: the next "
        "pass meets ice that has been below all of the rubber; allowed: at least its length over "
        f"load.speed, {readable(transit, 's')}"
    )


def too_soft(scene: Tables, height: float) -> str | None:
    """Message if the user's penalty is too soft for a block of `height` (m), else None."""
    penalty, pressure = scene.numerics.penalty, scene.load.pressures.largest
    least = pressure / (DEEPEST * height)
    if not penalty or penalty >= least:
        return None
    return (
        f"numerics.penalty = {1e-9 * penalty:.3g} MPa/mm is too soft: the block would sink "
        f"{1e3 * pressure / penalty:.3g} mm into the ice; allowed: at least "
        f"{1e-9 * least:.3g} MPa/mm, with which it sinks in by a tenth of its height"
    )


def _contact_is_stiff(scene: Tables) -> None:
    """Raise ValueError if the user's penalty or shear ramp is too soft."""
    fault = None if scene.rubber.is_drawn else too_soft(scene, scene.rubber.height)
    if fault is not None:
        raise ValueError(fault)
    ramp = scene.numerics.shear_ramp_pressure
    pressure = scene.load.pressures.smallest
    if ramp and ramp > pressure:
        raise ValueError(
            f"numerics.shear_ramp_pressure = {ramp / BAR:.3g} bar is above load.pressure = "
            f"{pressure / BAR:.3g} bar: friction would never reach its full value"
        )


def _heat_stays_in_the_rubber(scene: Tables) -> None:
    """Raise ValueError if heat reaches the plate, or a layer, of rubber that is taken as a
    half-space.
    """
    needed = scene.rubber.solid.heated_depth(scene.load.heated_for)
    ends = [(height, "`above` of rubber.layers") for height in scene.rubber.heights]
    height, end = min([(scene.rubber.height, "rubber.height"), *ends])
    if scene.rubber.heat != "mesh" and height < needed:
        raise ValueError(
            f"{end} = {1e3 * height:.3g} mm is too thin for rubber.heat = true, which takes the "
            f"rubber as a half-space: heat reaches {1e3 * needed:.3g} mm deep within "
            f"{'load.duration' if scene.load.passes == 1 else 'all passes'}"
        )
