"""The film law of a scene, with the components that its keys ask for."""

from __future__ import annotations

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.film.hysteresis import hysteresis_of
from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.shear_strength import shear_strength
from iceslide_fem.film.strength_over_speed import shearing_height, speed_law
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.film.voids import Voids, WetVoids, lugs_of
from iceslide_fem.laws.film import FilmLaw, First
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contact_table import ContactTable

# Shear fades in up to this fraction of the nominal pressure. It fades in more slowly if its slope
# with pressure would exceed this friction coefficient: points that touch and lift under a
# coefficient of hundreds have several equilibria.
RAMP_SHARE, STEEPEST_RAMP = 0.05, 10.0


def film_law(scene: Scene) -> FilmLaw:
    """The film law of the scene, with its components."""
    strength, table, speeds = shear_strength(scene), scene.water.table, scene.load.speeds
    contact, limit, wet = scene.contact_parameters, None, None
    height = scene.initial_height
    if strength is not None:
        freezes = scene.refreeze != "nothing"
        rate = speed_law(scene)
        limit = LimitingShear.of(strength, scene.viscosity, speeds.largest, freezes, rate)
        height = shearing_height(scene, speeds.largest)
    passes = scene.model == "point" and scene.ice.motion == "sliding"
    if scene.film.voids == "carry":
        assert isinstance(contact, ContactTable)  # by the scene's validation
        lugs = lugs_of(scene.rubber, wide=scene.model != "block")
        wet = WetVoids(Voids(contact, lugs.longest), lugs, scene.ice.water_at)
    return FilmLaw(
        contact,
        scene.load.pressures.first if scene.film.pressure == "nominal" else None,
        scene.numerics.shear_ramp_pressure or default_ramp(scene, height),
        scene.viscosity,
        First(
            scene.ice.temperature,
            scene.rubber_temperature,
            speeds.first,
            scene.initial_height,
            scene.ice.melting_temperature,
        ),
        None if table is None else VariableViscosity(table, scene.viscosity),
        limit,
        contact_age(scene),
        wet,
        scene.refreeze,
        scene.water_speed if passes else 1.0,
        hysteresis_of(scene),
    )


def default_ramp(scene: Scene, height: float) -> float:
    """Pressure (Pa) over which shear fades in, at most the nominal pressure.

    It follows from the initial shear k eta v / h with the initial `height` h (m). For loads that
    change in time it uses the least pressure and the largest speed.
    """
    if not height:
        return scene.load.pressures.smallest
    pressure, speed = scene.load.pressures.smallest, scene.load.speeds.largest
    k = float(scene.contact_parameters(pressure).k)
    shear = k * scene.viscosity * speed / height
    return min(max(RAMP_SHARE * pressure, shear / STEEPEST_RAMP), pressure)
