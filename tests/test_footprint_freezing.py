"""Water that freezes below a footprint and a wheel: against points under the same pressures."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
PIXELS, SPEED, TRANSIT = 200, 4.0, 5e-3
HIGH, LOW = 8e5, 0.5e5  # Pa; ice melts below the first half and what has melted freezes below both
DRY = {"dry_stress": 4.5e5, "dry_softening": 13.5, "initial_height": 0.0}
HARD = {"dry_stress": 3e5, "initial_height": 0.0}
WET = {"voids": "carry"}


def scene(film, celsius, water, refreeze):
    return scene_from_dict(
        {
            "name": "freezes",
            "model": "point",
            "rubber": {"compound": "B", "length": 20e-3, "width": 20e-3, "height": 8e-3},
            "load": {
                "pressure": [
                    [0.0, HIGH], [0.5 * TRANSIT, HIGH], [0.50002 * TRANSIT, LOW], [TRANSIT, LOW],
                ],
                "speed": SPEED, "duration": TRANSIT,
            },
            "ice": {"temperature": 273.15 + celsius, "water": water},
            "film": {"contact": str(FILE), "refreeze": refreeze} | film,
        }
    )  # fmt: skip


def footprint():
    pressure = np.full((1, PIXELS), HIGH)
    pressure[:, : PIXELS // 2] = LOW  # the ice enters at the last column
    return PressureMap(pressure, SPEED * TRANSIT / PIXELS, 1e-3)


def ride_of(given):
    ride = Ride.of(given, SPEED, SPEED, given.ice.temperature, given.rubber.length)
    return ride._replace(water_speed=1.0)  # as at a point


@pytest.mark.parametrize(
    ("film", "celsius", "water", "refreeze"),
    [
        (HARD, -10.0, 0.0, "film"), (HARD, -10.0, 0.0, "all"),
        (WET, -6.0, 4e-6, "area"), (WET | DRY, -6.0, 4e-6, "area"),
    ],
    ids=["film", "all", "area", "dry area"],
)  # fmt: skip
def test_a_line_of_two_pressures_is_a_point_that_passes(film, celsius, water, refreeze):
    given = scene(film, celsius, water, refreeze)
    rows, _ = point_history(given)
    work, latent = rows[-1].friction_work_J / 4e-4, rows[-1].latent_heat_J / 4e-4
    map_, ride, contact_of = footprint(), ride_of(given), given.contact_parameters
    found = film_map(map_, ride, contact_of, 1e-3)
    passing = TRANSIT / PIXELS
    assert found.shear.sum() * SPEED * passing == pytest.approx(work, rel=3e-3)
    assert found.latent_heat.sum() == pytest.approx(latent, rel=3e-3, abs=3e-3 * work)
    squeezed = rows[-1].squeezed_height_m
    assert found.squeezed[0, 0] == pytest.approx(squeezed, rel=3e-3, abs=1e-10)
    stays = film_map(map_, ride._replace(refreeze="nothing"), contact_of, 1e-3)
    assert found.latent_heat.sum() < stays.latent_heat.sum() - 0.01 * work
    wheel = FilmContact(ride, contact_of, 1e-3)
    (locked,) = friction(map_, [Rolling(SPEED, 1.0)], Tread(7e7), wheel)
    assert locked.mu == pytest.approx(found.mean_friction(map_), rel=1e-9)
