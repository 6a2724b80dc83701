"""Rubber that takes heat below a footprint and a wheel: against points, and a march of its own."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
SURFACE = read_contact_table(FILE, "the surface")
PIXELS, SLIDES, TRANSIT, PRESSURE = 60, 4.0, 5e-3, 2e5
RUBBER = {"compound": "B", "length": 20e-3, "height": 10e-3}
HEAT, DRY = {"heat": True}, {"dry_stress": 4.5e5, "dry_softening": 13.5, "initial_height": 0.0}
WET = {"voids": "carry", "initial_height": 0.0, "dry_stress": 4.5e5, "dry_softening": 13.5}


def scene(rubber=HEAT, film=DRY, ice=None, load=None):
    return scene_from_dict(
        {
            "name": "warm",
            "model": "point",
            "rubber": RUBBER | rubber,
            "load": {"pressure": PRESSURE, "speed": SLIDES, "duration": TRANSIT} | (load or {}),
            "ice": {"temperature": "-4 degC"} | (ice or {}),
            "film": {"contact": str(FILE)} | film,
        }
    )


def line(given, slip, pressure=PRESSURE, pixels=PIXELS, tolerance=1e-3):
    """A line whose ice passes in the duration, and whose rubber slides everywhere."""
    slides, transit = given.load.speeds.first, given.load.duration
    pressure = np.broadcast_to(pressure, (1, pixels)).copy()
    footprint = PressureMap(pressure, slides / slip * transit / pixels, 1e-3)
    ride = Ride.of(given, slides / slip, slides, given.ice.temperature, given.rubber.length)
    ride = ride._replace(water_speed=1.0)  # as at a point
    return footprint, film_map(footprint, ride, given.contact_parameters, tolerance)


def into_rubber(found, footprint, slip=1e-4):
    """Fraction of the friction work that goes into the rubber."""
    work = found.shear.sum() * slip * footprint.dx
    return 1.0 - (found.ice_heat.sum() + found.latent_heat.sum()) / work


@pytest.mark.parametrize(
    ("film", "ice"), [(DRY, {}), ({}, {}), (WET, {"water": 5e-6})], ids=["dry", "film", "wet"]
)
@pytest.mark.parametrize("slip", [1e-4, 0.5])
def test_a_uniform_line_is_a_point_below_rubber_of_less_density(film, ice, slip):
    point = HEAT | {"density": scene().rubber.density * (1.0 - slip)}
    rows, entries = point_history(scene(point, film, ice))
    footprint, found = line(scene(film=film, ice=ice), slip)
    assert found.mean_friction(footprint) == pytest.approx(entries["mu_mean"], rel=3e-3)
    part = rows[-1].rubber_heat_J / rows[-1].friction_work_J
    assert into_rubber(found, footprint, slip) == pytest.approx(part, rel=3e-3)


@pytest.mark.parametrize("celsius", [10.0, -15.0])
def test_rubber_that_enters_at_its_own_temperature_is_that_of_a_point(celsius):
    own = HEAT | {"temperature": celsius + 273.15}
    rows, entries = point_history(scene(own))
    footprint, found = line(scene(own), 1e-4)
    assert found.mean_friction(footprint) == pytest.approx(entries["mu_mean"], rel=3e-3)
    gained = -rows[-1].rubber_heat_J / rows[-1].friction_work_J
    assert into_rubber(found, footprint) == pytest.approx(-gained, rel=3e-3)


def test_at_small_slip_the_pair_of_ice_and_rubber_stays_together():
    """A half-space by convolution: 0.56435, and 0.20745 into the rubber; insulated 0.49484."""
    film = {
        "contact": None, "k": 0.4, "D": 40e-6, "H_V": 2e-6, "initial_height": 0.0,
        "dry_stress": [[253.15, 5e5], [265.15, 3.5e5], [270.15, 0.0]],
    }  # fmt: skip
    load, ice = {"speed": 1.0, "duration": 20e-3}, {"temperature": 261.15}
    (footprint, found), (_, insulated) = (
        line(scene(heat, film, ice, load), 1e-4) for heat in (HEAT, {})
    )
    assert found.mean_friction(footprint) == pytest.approx(0.56435, rel=1e-3)
    assert into_rubber(found, footprint) == pytest.approx(0.20745, rel=1e-3)
    assert insulated.mean_friction(footprint) == pytest.approx(0.49484, rel=1e-3)


def test_the_rubber_below_a_locked_wheel_takes_no_heat():
    (footprint, found), (_, insulated) = line(scene(), 1.0), line(scene({}), 1.0)
    mu, due = (one.mean_friction(footprint) for one in (found, insulated))
    assert mu == pytest.approx(due, rel=1e-4)


def test_the_rubbers_surface_is_that_of_a_half_space_in_its_own_time():
    """Its flux by superposition, each pixel for 1 / (1 - S) of the ice's time; nothing melts, so
    both surfaces are equally warm.
    """
    slip, given = 0.5, scene()
    footprint, found = line(given, slip)
    passing = TRANSIT / PIXELS
    flux = found.shear * SLIDES - (found.ice_heat + found.latent_heat) / passing
    ages = np.sqrt(passing / (1.0 - slip) * np.arange(PIXELS, -1.0, -1.0))
    step = 2.0 / (given.rubber.solid.effusivity * np.sqrt(np.pi))
    rise = step * (flux[0, ::-1] * (ages[:-1] - ages[1:])).sum()
    assert rise == pytest.approx(found.temperature[0, 0] - given.ice.temperature, rel=0.01)


def test_behind_a_gap_the_rubber_is_cold():
    pressure = np.full(PIXELS, PRESSURE)
    pressure[20:40] = 0.0
    _, found = line(scene(), 1e-3, pressure)
    footprint, fine = line(scene(), 1e-3, np.repeat(pressure, 8), 8 * PIXELS, 1e-4)
    assert found.shear.sum() == pytest.approx(fine.shear.sum() / 8.0, rel=1e-3)
    work = fine.shear[0, ::-1] * SLIDES * TRANSIT / 480.0
    ice = (fine.ice_heat + fine.latent_heat)[0, ::-1]
    part = 1.0 - np.divide(ice, work, out=np.zeros_like(work), where=work > 0.0)
    assert part[1:160] == pytest.approx(part[80], rel=0.01)
    assert part[321] > 1.5 * part[159]
