"""Sliding contact of a wheel's case: its friction law, on its ice."""

from __future__ import annotations

from iceslide_fem.film.voids import lugs_of
from iceslide_fem.laws.table import law_of
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.contact import SlidingContact
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.law_contact import LawContact
from iceslide_fem.preprocess.wheel.tread import Tread, TreadStiffness
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict


def below_wheel(
    case: WheelCase, footprint: PressureMap, stiffness: TreadStiffness
) -> tuple[Tread, SlidingContact]:
    """Tread and sliding contact of one member of a family, as `friction.friction` takes them.

    The tread has the rubber's temperature, by default that of the ice. Raises SceneError.
    """
    tread = stiffness.tread(case.pattern, case.law.rubber.temperature or case.temperature)
    return tread, contact_of_case(case, footprint.contact_length)


def contact_of_case(case: WheelCase, length: float) -> SlidingContact:
    """Sliding contact of one member of a family; length: of the footprint, m.

    Raises SceneError if a law in a file needs what a wheel does not have, and if passes follow each
    other faster than the ice is below the wheel.
    """
    law, period = case.law, case.law.load.period
    transit = length / (case.end_speed if case.abs else case.rolling(0.0).forward)
    if period is not None and period < transit:
        raise SceneError(
            f"load.period = {period:g} s of --scene {case.scene} is shorter than the ice is below "
            f"the wheel; allowed: {transit:.4g} s or more"
        )
    if law.friction.law == "film":
        ride = case.ride_at(case.speed, 0.0, length)
        if case.scene is not None and ride.wet is not None:
            lugs = lugs_of(law.rubber, wide=law.model != "block")
            ride = ride._replace(wet=ride.wet._replace(lug=lugs.longest))
        return FilmContact(ride, case.contact_of, case.tolerance)
    tables = law.as_dict()
    here = scene_from_dict(tables | {"ice": tables["ice"] | {"temperature": case.temperature}})
    height, own = float(here.initial_height), law_of(here)
    if own.internal_at_start and own.frame("ice") == "rubber":
        raise SceneError(
            f'the friction law {own.name} has carrier = "rubber", and below a wheel the history of '
            'a law stays on the ice; allowed: carrier = "ice"'
        )
    ice = case.temperature, here.ice.solid
    return LawContact(own, *ice, height, case.tolerance, here.ice.ground)
