"""Contact of rough rubber with rough ice: areas, gaps, tables, and every model that has them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import erf, erfinv

from iceslide_fem.film.voids import Voids
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runs.many_points import friction as many_points
from iceslide_fem.runs.notes import notes
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import load_scene
from iceslide_fem.surfaces.combined_contact import CombinedContact, gap
from iceslide_fem.surfaces.power_spectrum import self_affine
from iceslide_fem.surfaces.rough_ice import INCOMPRESSIBLE, Moduli, waves_of

CASES = Path(__file__).parent.parent / "cases"
OWN = ["rms=4.95um", "hurst=0.99", "longest=91.7um", "shortest=11.6um"]
ROUGH = [f"rubber.roughness.{one}" for one in OWN]
SHIFT = Shift(7.4005, 121.6, 20.0 + ZERO_CELSIUS)
RUBBER = Moduli(2e6, 0.6e6 * 1.9 ** np.arange(1, 10), 10.0 ** -np.arange(1.0, 10.0))
PRESSURE = np.array([1e5, 2e5, 4e5])
ALONE = 0.224  # P of a rubber alone


def own():
    """The waves of a rubber that touches `ALONE` of smooth ice at 2 bar."""
    some = self_affine(1e-5, 0.8, 2e-3, 2e-6)
    slope = np.sqrt(2.0) * INCOMPRESSIBLE * 2e5 / (RUBBER.long_term * erfinv(ALONE))
    return some.scaled(1e-5 * slope / some.slope)


def both(rms=3e-6):
    """It on ice of an rms height, m."""
    ice = self_affine(rms, 0.8, 2e-3, 2e-6)
    return CombinedContact(ice, own(), RUBBER, SHIFT, RUBBER.long_term)


def case(*changes):
    return load_scene(CASES / "rough_ice.toml", changes)


@pytest.mark.parametrize(
    ("speed", "celsius", "area"),
    [(1e-3, -2.0, 0.146), (0.1, -2.0, 0.053), (5.0, -2.0, 0.019), (5.0, -20.0, 0.009)],
)
def test_area_of_both_is_that_of_another_program(speed, celsius, area):
    """P of both is P of the rubber alone at the pressure that `Change` gives."""
    change = both().exact(speed * SHIFT(celsius + ZERO_CELSIUS), PRESSURE)
    assert erf(erfinv(ALONE) * change.pressure[1]) == pytest.approx(area, abs=5e-4)


@pytest.mark.parametrize(
    ("rms", "speed", "celsius"),
    [(2.5e-6, 1e-3, -2.0), (0.7e-6, 0.1, -2.0), (0.25e-6, 5.0, -2.0), (0.12e-6, 5.0, -20.0)],
)
def test_ice_counts_as_smooth_below_a_height(rms, speed, celsius):
    """There its waves weigh as much as the rubber's: the pressure is that over sqrt(2)."""
    change = both(rms).exact(speed * SHIFT(celsius + ZERO_CELSIUS), PRESSURE)
    assert change.pressure[1] == pytest.approx(np.sqrt(0.5), rel=0.03)


def test_slow_rubber_touches_the_sum_of_both_surfaces():
    ice, rubber = self_affine(2e-6, 0.8, 1e-4, 1e-5), self_affine(4e-6, 0.8, 1e-4, 1e-5)
    found = CombinedContact(ice, rubber, RUBBER, SHIFT, 2e6).exact(1e-15, PRESSURE)
    assert found.pressure == pytest.approx(rubber.slope / np.hypot(rubber.slope, ice.slope))
    assert found.width == pytest.approx(1.0)  # both have the same waves
    q, weights = waves_of(ice, rubber)
    waves = [rubber(q), rubber(q) + ice(q)]
    alone, whole = (gap(C * 2e6, C * 4e12, q, weights, PRESSURE) for C in waves)
    assert found.gap == pytest.approx(whole - alone)
    assert (np.diff(alone) < 0.0).all() and (np.diff(whole) < 0.0).all()


def test_the_gap_of_light_contact_is_logarithmic():
    """du / d ln p is constant there (B. N. J. Persson, Phys. Rev. Lett. 99 (2007) 125502)."""
    rubber = self_affine(4e-6, 0.8, 1e-4, 1e-5)
    q, weights = waves_of(rubber)
    found = gap(rubber(q) * 2e6, rubber(q) * 4e12, q, weights, np.geomspace(1.0, 1e3, 4))
    steps = -np.diff(found) / np.log(10.0)
    assert steps == pytest.approx(steps[0], rel=0.02)
    assert 0.3 * rubber.rms < steps[0] < rubber.rms


def test_the_table_is_the_theory():
    contact = both()
    for speed in (1e-6, 3e-3, 0.7, 12.0):
        table = contact.at(PRESSURE, speed, 268.15)
        exact = contact.exact(speed * float(SHIFT(268.15)), PRESSURE)
        for found, wanted in zip(table, exact, strict=True):
            assert found == pytest.approx(wanted, rel=3e-3, abs=1e-9)


def test_a_scene_has_the_contact_of_its_speed():
    smooth, slow, fast = (
        case(*changes).contact_parameters(PRESSURE)
        for changes in ([], [*ROUGH, "load.speed=1mm/s"], ROUGH)
    )
    assert (smooth.k > slow.k).all() and (slow.k > 2.0 * fast.k).all()
    assert (smooth.D > slow.D).all() and (slow.D > fast.D).all()
    assert (smooth.H_V <= slow.H_V).all() and (smooth.H_V <= fast.H_V).all()
    assert (np.diff(fast.H_V) < 0.0).all()
    hysteresis = case(*ROUGH, "ice.roughness.rms=0um").contact_parameters(PRESSURE)
    np.testing.assert_array_equal(hysteresis.k, smooth.k)


def test_constants_follow_the_ice_too():
    scene = case(*ROUGH)
    film = scene.film.model_copy(update={"k": 0.2, "D": 2e-5, "H_V": 1e-6, "contact": None})
    found = scene.model_copy(update={"film": film}).contact_parameters(2e5)
    assert found.k < 0.1 and found.D < 2e-5 and found.H_V > 1e-6


def test_water_of_the_ice_passes_with_it():
    carry = ["film.voids=carry", "ice.water=5um"]
    fast = [*ROUGH, "load.speed=50m/s"]
    speeds = [case(*carry, *more).water_speed for more in ([], ROUGH, fast)]
    assert speeds[0] == 0.5 < speeds[1] < speeds[2] < 1.0
    assert case(*carry, *ROUGH, "film.water_speed=0.3").water_speed == 0.3


def test_old_contact_has_softer_waves_of_its_own():
    scene = case(*ROUGH)
    film = scene.film.model_copy(update={"contact_age": True})
    aged = scene.model_copy(update={"film": film})
    assert aged.rough_contact.own_modulus > scene.rough_contact.own_modulus
    longer = aged.model_copy(update={"load": aged.load.model_copy(update={"duration": 10.0})})
    assert longer.rough_contact.own_modulus < aged.rough_contact.own_modulus


def test_voids_hold_what_they_carry():
    scene = case(*ROUGH)
    p = np.array([1.2e5, 2e5, 3e5])
    change = scene.rough_contact.at(p, 0.5, 268.15)
    voids = Voids(scene.touching_table, rough=change)
    assert voids.carried(voids.held(p)) == pytest.approx(p)
    k, D = voids.contact(p)
    direct = scene.touching_table.changed(p, change)
    assert k == pytest.approx(direct.k) and D == pytest.approx(direct.D)


@pytest.mark.parametrize("water", [None, "5um"])
def test_a_locked_wheel_is_a_point(water):
    """On a uniform line every pixel has the point's speed, pressure and contact."""
    changes = [*ROUGH, "film.dry_stress=0.2MPa"]
    if water is not None:
        # Its lug is that of the point, and water moves as below it.
        changes += ["film.voids=carry", f"ice.water={water}", "film.refreeze=nothing",
                    "film.water_speed=1"]  # fmt: skip
    scene = case(*changes)
    point = float(many_points([scene]).mu_mean[0, 0])
    speed, length = 1.0, 20e-3
    footprint = PressureMap(np.full((1, 100), 2e5), length / 100, 1e-3)
    ride = Ride.of(scene, speed, speed, scene.ice.temperature, length)
    mean = film_map(footprint, ride, scene.contact_on_smooth_ice, 1e-3).mean_friction(footprint)
    assert mean == pytest.approx(point, rel=3e-3)
    contact = FilmContact(ride, scene.contact_on_smooth_ice, 1e-3)
    (locked,) = friction(footprint, [Rolling(speed, 1.0)], Tread(7e7), contact)
    assert locked.mu == pytest.approx(mean, rel=3e-3)
    slower = replace(contact, ride=ride._replace(rough=None))
    (smooth,) = friction(footprint, [Rolling(speed, 1.0)], Tread(7e7), slower)
    assert smooth.mu > 1.2 * locked.mu


def test_a_changing_speed_is_refused():
    with pytest.raises(SceneError, match="those of one speed"):
        case(*ROUGH, 'load.speed=[["0 ms", "1 m/s"], ["20 ms", "2 m/s"]]')


def test_roughness_of_rubber_on_smooth_ice_has_no_effect_and_it_is_said():
    said = [one for one in notes(case(*ROUGH, "ice.roughness.rms=0um")) if "roughness" in one]
    assert said and "no effect" in said[0]
