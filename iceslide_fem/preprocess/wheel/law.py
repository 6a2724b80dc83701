"""Choice of the friction law of a wheel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.laws.table import law_of
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.contact import FilmContact, SlidingContact
from iceslide_fem.preprocess.wheel.law_contact import LawContact
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, scene_from_dict


def contact_of_case(case: WheelCase, length: float) -> SlidingContact:
    """Sliding contact of one member of a family; length: of the footprint, m.

    Raises SceneError if the scene's law needs features that a wheel does not have.
    """
    scene = case.law_scene
    if scene is None:
        ride = case.ride_at(case.speed, 0.0)._replace(wet=case.wet_ice(length))
        return FilmContact(ride, case.contact_table, case.tolerance)
    if scene.friction.law == "film" and scene.film.voids == "stop":
        return _film_of(scene, case)
    here = scene_from_dict(scene.as_dict() | {"ice": _ice_of(scene, case)})
    height = float(here.initial_height)
    solid = here.ice.solid
    return LawContact(law_of(here), case.temperature, solid, height, case.tolerance)


def _ice_of(scene: Scene, case: WheelCase) -> dict[str, Any]:
    """The scene's ice as keys, with the case's temperature."""
    ice: dict[str, Any] = scene.as_dict()["ice"]
    return ice | {"temperature": case.temperature}


def _film_of(scene: Scene, case: WheelCase) -> FilmContact:
    """The film law of a scene, at the case's ice temperature."""
    film, age = scene.film, contact_age(scene)
    for unfit, key, allowed in (
        (film.refreeze != "nothing", f'film.refreeze = "{film.refreeze}"', '"nothing"'),
        (scene.ice.depth is not None, "ice.depth", "ice as deep as heat reaches"),
        (scene.ice.mesh is not None, "ice.mesh", "ice as deep as heat reaches"),
    ):
        if unfit:
            raise SceneError(
                f"{key} of --scene {case.scene} is not computed below a wheel; allowed: {allowed}"
            )
    ride = Ride(
        case.speed,
        0.0,
        case.temperature,
        float(scene.height_on(case.temperature)),
        scene.ice.solid,
        scene.water.table or scene.water.viscosity,
        film.water_speed,
        scene.shear_strength,
        age and replace(age, holds=False),
    )
    return FilmContact(ride, scene.contact_parameters, case.tolerance)
