"""The point model of a scene: its conditions, the rubber above it, settings of the integration."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.film.hysteresis import hysteresis_of
from iceslide_fem.film.passes import Passes
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.rubber_heat import INSULATED, HalfFilm, Insulated, RubberColumns
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.shear_strength import DRY, shear_strength
from iceslide_fem.film.strength_over_speed import speed_law
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import SAMPLED, Course
from iceslide_fem.scene.materials import Ground

# Number of steps of a run with fixed steps, unless numerics.max_step is given.
FIXED_STEPS = 2000


def transit_time(scene: Scene) -> float:
    """L / v (s): time for which a point of sliding ice is below the rubber, at the mean speed."""
    return scene.rubber.length / scene.load.speeds.mean


def exposure(scene: Scene) -> float:
    """Time of friction of one point of the ice (s): the duration, or less for sliding ice."""
    return float(exposures(scene, scene.load.speeds.mean, scene.load.duration))


def exposures(scene: Scene, speed: ArrayLike, duration: ArrayLike) -> Array:
    """The same (s) at speeds (m/s) and durations (s), which broadcast."""
    if scene.ice.motion == "attached":
        return np.asarray(duration, dtype=float)
    return np.asarray(np.minimum(duration, scene.rubber.length / np.asarray(speed)))


def ice_model(scene: Scene) -> str | Ground:
    """Ice below a point: `half-space`, or the ground of a column.

    A column also replaces continuum and meshed ice, because lateral conduction needs a block.
    """
    return "half-space" if scene.ice.heat == "half-space" else scene.ice.ground


def simulation_settings(scene: Scene) -> dict[str, Any]:
    """Ice model, tolerance, integrator and steps of `scene`, as arguments of `point.simulate`."""
    numerics = scene.numerics
    if not INTEGRATORS[numerics.film_integrator].estimate:
        fixed, largest = numerics.max_step or exposure(scene) / FIXED_STEPS, np.inf
    else:
        fixed, largest = None, numerics.max_step or np.inf
    return {
        "ice": ice_model(scene),
        "tolerance": numerics.tolerance,
        "integrator": numerics.film_integrator,
        "fixed_step": fixed,
        "max_step": largest,
        "loading": scene_loading(scene),
        "water": scene.water.table,
    }


def rubber_columns(
    scene: Scene, duration: float | Array | None = None
) -> RubberColumns | Insulated:
    """Thermal model of the rubber above the contact points, at its initial temperature.

    duration: for which its columns are made (see `Column`), s; by default the scene's.
    """
    if not scene.rubber.heat:
        return INSULATED
    return RubberColumns(
        scene.rubber_temperature,
        scene.load.duration if duration is None else duration,
        scene.rubber.solid,
        half_film(scene),
        scene.ice.melting_temperature,
    )


def half_film(scene: Scene) -> HalfFilm:
    """Conductance from the middle of the film to each body."""
    return HalfFilm(scene.film.conductance, scene.water.conductivity)


def scene_conditions(scene: Scene) -> Conditions:
    """The condition of `scene` at t = 0, from its nominal pressure.

    The speed is 0 for a start from rest; `Conditions.of` itself does not accept 0.
    """
    load, speed = scene.load, scene.load.speeds.first
    duration, fastest = exposure(scene), load.speeds.largest
    here = conditions_at(scene, load.pressures.first, speed or 1.0, duration, fastest=fastest)
    return here if speed else here._replace(speed=np.zeros(1))


def conditions_at(
    scene: Scene, pressure: ArrayLike, speed: float, duration: float, **more: Any
) -> Conditions:
    """Conditions of `scene` at some `pressure` (Pa) and `speed` (m/s) for a `duration` (s).

    more: other arguments of `Conditions.of`, which replace those of the scene.
    """
    k, D, H_V, _ = scene.contact_parameters(pressure)
    given = scene.ice.solid._asdict() | {
        "temperature": scene.ice.temperature,
        "initial_height": scene.initial_height,
        "viscosity": scene.viscosity,
        "strength": shear_strength(scene),
        "refreeze": scene.refreeze if scene.film.voids == "stop" else "nothing",
        "hysteresis": hysteresis_of(scene),
        "rate": speed_law(scene),
    }
    contact = {"k": k, "D": D, "H_V": H_V}
    ridden = {"pressure": pressure, "speed": speed, "duration": duration}
    return Conditions.of(**contact | ridden | given | more)


def varied_conditions(scene: Scene, **varied: ArrayLike) -> Conditions:
    """Conditions of the point of `scene`, with some values `varied`.

    varied: arguments of `Conditions.of`, and for dry shear dry_stress (Pa), dry_softening and
    dry_residual (K). They broadcast to one dimension. k, D and H_V follow the pressure, the first
    height the temperature, and the time on sliding ice the speed, unless they are varied. Raises
    ValueError as `Conditions.of`, if k, D or H_V is varied under contact age, and if voids carry.
    """
    if scene.film.voids == "carry":
        raise ValueError('conditions have no voids that carry (film.voids = "carry"): sweep scenes')
    constants = sorted({"k", "D", "H_V"} & {*varied})
    if scene.film.contact_age and constants:
        raise ValueError(f"{constants[0]} follows the contact's age (film.contact_age)")
    count = np.broadcast_shapes((1,), *map(np.shape, varied.values()))
    strength = shear_strength(scene, **{key: varied.pop(key) for key in DRY if key in varied})
    fixed: dict[str, Any] = scene_conditions(scene)._asdict()
    for component in ("limit", "refreeze", "hysteresis", "rough"):
        del fixed[component]
    k, D, H_V, _ = scene.contact_parameters(varied.get("pressure", fixed["pressure"]))
    height = scene.height_on(varied.get("temperature", fixed["temperature"]))
    fixed |= {"k": k, "D": D, "H_V": H_V, "initial_height": height}
    fixed["duration"] = np.broadcast_to(
        exposures(scene, varied.get("speed", fixed["speed"]), scene.load.duration), count
    )
    components: dict[str, Any] = {"refreeze": scene.refreeze, "hysteresis": hysteresis_of(scene)}
    components |= {"strength": strength, "rate": speed_law(scene)}
    return Conditions.of(**components | fixed | varied)


def scene_passes(scene: Scene) -> Passes:
    """Passes of the scene over the same ice, or of rows of blocks."""
    rubber, load = scene.rubber, scene.load
    carried = scene.water_speed if scene.ice.motion == "sliding" else 1.0
    if rubber.row_pitch is not None:
        return Passes(rubber.rows, rubber.row_pitch / load.speeds.mean, scene.between, carried)
    return Passes(load.passes, load.period or load.duration, scene.between, carried)


def scene_loading(scene: Scene) -> Loading | None:
    """Time dependence of the scene's loads and contact; None if all is constant."""
    load, age = scene.load, contact_age(scene)
    if not load.changes and age is None:
        return None
    courses: tuple[Course | None, Course | None] = (None, None)
    if load.changes:
        near = SAMPLED * scene.numerics.tolerance
        courses = load.pressures.sampled(near), load.speeds.sampled(near)
    return Loading(*courses, scene.contact_parameters, age, scene.rubber.temperature)
