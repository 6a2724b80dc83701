"""Contradictions between tables of a scene, each a message with the allowed values."""

from __future__ import annotations

import numpy as np

from iceslide_fem.relaxation.doubts import FURTHEST_UNDETERMINED, outside
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.contact_age import check_contact_age
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.passes import check_passes
from iceslide_fem.scene.shape import check_room_across
from iceslide_fem.scene.tables import Tables
from iceslide_fem.scene.thermal_layers import HEATED_LAYERS
from iceslide_fem.scene.wet import check_voids

DEEPEST = 0.1  # allowed penetration over the height


_WEAKENS = (
    "film.dry_stress falls as the ice gets warmer, and rubber.inertia = false: dry friction that "
    "weakens by its own heat has no motion without inertia (docs/explanation/dry.md); allowed: "
    'rubber.inertia = true, model = "point", or a dry_stress that is the same at every temperature'
)


def check_contradictions(scene: Tables) -> None:
    """Raise ValueError with the first contradiction between tables of the `scene`."""
    nothing = scene.rubber.compound is None and scene.film.k is None and scene.film.contact is None
    if nothing and scene.friction.law == "film":
        raise ValueError(
            "film.k, film.D and film.H_V are missing; without a compound give them, or film.contact"
        )
    if scene.model == "point" and scene.ice.mesh is not None:
        raise ValueError(
            'ice.mesh and model = "point" contradict each other: below a point the ice is a '
            'column, and nothing says how deep; allowed: model = "slice" or "block", or '
            "ice.depth and ice.layers instead of ice.mesh"
        )
    if scene.model == "point" and scene.ice.motion == "sliding":
        _passes_below_a_point(scene)
    if scene.ice.heat == "half-space" and scene.ice.motion == "sliding":
        raise ValueError(
            'ice.heat = "half-space" and ice.motion = "sliding" contradict each other: the '
            "closed form holds for ice that stays under the rubber; "
            "allowed with sliding: 'column', 'continuum' or 'mesh'"
        )
    if scene.load.changes:
        _loads_may_change(scene)
    check_passes(scene)
    check_voids(scene)
    _rubber_relaxes_here(scene)
    if scene.film.contact_age:
        check_contact_age(scene)
    if scene.film.dry_stress is not None:
        _dry_shear_has_a_motion(scene)
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
        _rubber_can_take_heat(scene)
    elif scene.film.conductance is not None:
        raise ValueError(
            "film.conductance has a meaning only with heat in the rubber; "
            "leave it out, or set rubber.heat = true"
        )


def _dry_shear_has_a_motion(scene: Tables) -> None:
    """Raise ValueError if a limiting shear contradicts law, water, integrator or block."""
    film, integrator = scene.film, scene.numerics.film_integrator
    if scene.friction.law != "film":
        raise ValueError(
            f'film.dry_stress and friction.law = "{scene.friction.law}" contradict each other: it '
            'limits the shear of films; allowed: friction.law = "film"'
        )
    if scene.water.table is not None:
        raise ValueError(
            "film.dry_stress and rows of water.viscosity contradict each other; allowed: one "
            "viscosity"
        )
    if integrator == "explicit-euler":
        raise ValueError(
            'film.dry_stress and numerics.film_integrator = "explicit-euler" contradict each '
            "other: the stress follows the temperature that it makes; allowed: 'sdirk2', 'sdirk3' "
            "or 'implicit-euler'"
        )
    if scene.model != "point" and film.dry_shear.softens and not scene.rubber.inertia:
        raise ValueError(_WEAKENS)


def _rubber_relaxes_here(scene: Tables) -> None:
    """Raise ValueError if the time-temperature shift is unknown at the scene's temperature."""
    relaxation, temperature = scene.rubber.relaxation, scene.ice.temperature
    shift = None if relaxation is None else relaxation.shift
    if isinstance(shift, Shift) and not np.isfinite(shift(temperature)):
        coldest = shift.reference - shift.C2 - ZERO_CELSIUS
        given = "dma" if scene.rubber.wlf is None else "wlf"
        raise ValueError(
            f"rubber.{given} has no shift at {temperature - ZERO_CELSIUS:.4g} degC, as cold as "
            f"reference - C2 = {coldest:.4g} degC or colder; allowed: warmer ice, or "
            "arrhenius_below and activation_energy"
        )
    measured = scene.rubber.measured
    if measured is not None and not measured.determined:
        beyond = outside(measured.relaxation, temperature)
        if beyond > FURTHEST_UNDETERMINED:
            raise ValueError(
                f"rubber.dma says nothing about {temperature - ZERO_CELSIUS:.4g} degC: its "
                f"isotherms do not determine C1 and C2, and that is {beyond:.0f} K outside of "
                f"them; allowed: up to {FURTHEST_UNDETERMINED:g} K, isotherms that reach further, "
                "or rubber.wlf or rubber.shift_factors"
            )


def _loads_may_change(scene: Tables) -> None:
    """Raise ValueError if loads that change in time are not supported in this scene."""
    changing = "speed" if scene.load.pressures.is_constant else "pressure"
    if scene.model == "point" and scene.ice.motion == "sliding":
        raise ValueError(
            f'load.{changing} that changes in time and model = "point" contradict each other '
            "where ice slides: points that enter the contact one after the other see other "
            'loads; allowed: model = "slice" or "block", or ice.motion = "attached"'
        )
    if scene.film.pressure == "nominal" and not scene.load.pressures.is_constant:
        raise ValueError(
            'film.pressure = "nominal" and a load.pressure that changes in time contradict '
            "each other: k, D and H_V of one nominal pressure are held; "
            "allowed: 'local'"
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
    fault = None if scene.rubber.mesh is not None else too_soft(scene, scene.rubber.height)
    if fault is not None:
        raise ValueError(fault)
    ramp = scene.numerics.shear_ramp_pressure
    pressure = scene.load.pressures.smallest
    if ramp and ramp > pressure:
        raise ValueError(
            f"numerics.shear_ramp_pressure = {ramp / BAR:.3g} bar is above load.pressure = "
            f"{pressure / BAR:.3g} bar: friction would never reach its full value"
        )


def _passes_below_a_point(scene: Tables) -> None:
    """Raise ValueError if a point on sliding ice has a history older than the ice."""
    if scene.film.carrier == "rubber" and scene.friction.law != "coulomb":
        what = "films that stay" if scene.friction.law == "film" else "a history that stays"
        raise ValueError(
            'film.carrier = "rubber" and model = "point" contradict each other where ice '
            f"slides: {what} with the rubber, older than the ice below; "
            'allowed: model = "slice" or "block", or film.carrier = "ice"'
        )
    if scene.rubber.heat:
        raise ValueError(
            'rubber.heat = true and model = "point" contradict each other where ice slides: '
            'the rubber is older than the ice below it; allowed: model = "slice" or "block"'
        )
    if scene.film.water_speed < 1.0 and scene.friction.law == "film":
        raise ValueError(
            f'film.water_speed = {scene.film.water_speed:g} and model = "point" contradict each '
            "other where ice slides: water that lags behind the ice is older than the ice; "
            'allowed: model = "slice" or "block", or film.water_speed = 1'
        )


def _rubber_can_take_heat(scene: Tables) -> None:
    """Raise ValueError if heat in the rubber is not supported in this scene."""
    if scene.ice.heat == "half-space":
        raise ValueError(
            'ice.heat = "half-space" and rubber.heat = true contradict each other: the closed '
            "form gives the ice a flux that does not depend on the rubber; "
            "allowed with heat in the rubber: 'column', 'continuum' or 'mesh'"
        )
    if scene.rubber.heat == "mesh":
        _rubber_mesh_can_take_heat(scene)
        return
    needed = HEATED_LAYERS * (scene.rubber.solid.diffusivity * scene.load.duration) ** 0.5
    if scene.rubber.height < needed:
        raise ValueError(
            f"rubber.height = {1e3 * scene.rubber.height:.3g} mm is too thin for rubber.heat = "
            f"true, which takes the rubber as a half-space: heat reaches {1e3 * needed:.3g} mm "
            "deep within load.duration"
        )


def _rubber_mesh_can_take_heat(scene: Tables) -> None:
    """Raise ValueError if heat on the rubber's mesh is not supported in this scene."""
    if scene.model == "point":
        return  # a point has a column instead of a mesh
    if scene.ice.heat != "mesh":
        raise ValueError(
            f'rubber.heat = "mesh" and ice.heat = "{scene.ice.heat}" contradict each other: '
            "both meshes are solved together; allowed: ice.heat = 'mesh', or rubber.heat = true"
        )
    if scene.ice.has_rows:
        raise ValueError(
            'rubber.heat = "mesh" and rows of ice.conductivity or ice.heat_capacity contradict '
            "each other; allowed: numbers, or rubber.heat = true"
        )
    if scene.ice.motion == "sliding" and scene.film.carrier == "ice":
        raise ValueError(
            'rubber.heat = "mesh" and film.carrier = "ice" contradict each other: films that '
            "pass meet other points of the rubber in every step; allowed: "
            "film.carrier = 'rubber', ice.motion = 'attached', or rubber.heat = true"
        )
    if scene.friction.law != "film":
        raise ValueError(
            f'rubber.heat = "mesh" and friction.law = "{scene.friction.law}" contradict each '
            "other: only a film's heat is shared between meshes; allowed: rubber.heat = true"
        )
