"""Ice of a given depth below a footprint and a wheel: against points on the same ground."""

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
from iceslide_fem.scene.materials import ICE_DIFFUSIVITY

pytestmark = pytest.mark.quick

PIXELS, SPEED, TRANSIT = 80, 4.0, 20e-3
STEEL = {
    "name": "steel", "thickness": 1e-3, "conductivity": 50.0, "density": 7800.0,
    "heat_capacity": 460.0,
}  # fmt: skip


def scene(ice):
    return scene_from_dict(
        {
            "name": "thin",
            "model": "point",
            "rubber": {"compound": "B"},
            "load": {"pressure": 2e5, "speed": SPEED, "duration": TRANSIT},
            "ice": {"temperature": "-6 degC", "depth": 0.1e-3} | ice,
            "film": {"dry_stress": 4.5e5, "dry_softening": 13.5, "initial_height": 0.0},
        }
    )


@pytest.mark.parametrize(
    "ice",
    [
        {"base": "insulated"},
        {"base": "held"},
        {"base": "held", "base_temperature": "-10 degC"},
        {"layers": [STEEL]},
    ],
    ids=["insulated", "held", "colder", "steel"],
)
def test_a_uniform_line_is_a_point_on_the_same_ground(ice):
    given = scene(ice)
    _, entries = point_history(given)
    pressure = np.zeros((2, PIXELS))  # the second line does not touch
    pressure[0] = 2e5
    footprint = PressureMap(pressure, SPEED * TRANSIT / PIXELS, 1e-3)
    ride = Ride.of(given, SPEED, SPEED, given.ice.temperature)
    found = film_map(footprint, ride, given.contact_parameters, 1e-3)
    assert found.mean_friction(footprint) == pytest.approx(entries["mu_mean"], rel=3e-3)
    deep = film_map(
        footprint,
        Ride.of(scene({"depth": None}), SPEED, SPEED, 267.15),
        given.contact_parameters,
        1e-3,
    )
    assert deep.mean_friction(footprint) != pytest.approx(entries["mu_mean"], rel=5e-3)
    one = PressureMap(pressure[:1], footprint.dx, 1e-3)
    contact = FilmContact(ride, given.contact_parameters, 1e-3)
    (locked,) = friction(one, [Rolling(SPEED, 1.0)], Tread(7e7), contact)
    assert locked.mu == pytest.approx(entries["mu_mean"], rel=3e-3)


def test_the_base_is_as_cold_as_ice_of_another_temperature():
    ground = Ride.of(scene({"base": "held"}), SPEED, SPEED, 263.15).ground
    assert ground.held == 263.15


def test_in_a_gap_ice_cools_with_the_rate_of_its_slowest_mode():
    pressure = np.full((1, 90), 2e5)
    pressure[0, 30:60] = 0.0
    footprint = PressureMap(pressure, 1e-3, 1e-3)
    given = scene({"base": "held"})
    ride = Ride.of(given, SPEED, SPEED, given.ice.temperature)
    found = film_map(footprint, ride, given.contact_parameters, 1e-3)
    rise = found.temperature[0, 30:33] - ride.temperature  # the last pixels of the gap
    slowest = np.exp(-(np.pi**2) * ICE_DIFFUSIVITY * footprint.dx / SPEED / (4.0 * 0.1e-3**2))
    assert rise[:-1] / rise[1:] == pytest.approx(slowest, rel=2e-3)
