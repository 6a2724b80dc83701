"""The film under every pixel: against the point level, across gaps, line by line."""

import numpy as np
import pytest

from iceslide_fem import point
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import ReadFootprint
from iceslide_fem.preprocess.footprint.ride import Ride, WetIce
from iceslide_fem.preprocess.footprint.survey import survey
from iceslide_fem.preprocess.footprint.synthetic import Tread
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.materials import (
    CONTACT_TABLES,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
)

B = CONTACT_TABLES["B"]
LOCKED = Ride(4.0, 4.0, 269.15)


def case(**values):
    size = {"length": 0.1, "width": 0.1, "max_pressure": 5e5}
    return FootprintCase.of({"image": "x", "speed": 4.0, **size, **values})


def strip(pressure, pixels=80, length=20e-3):
    """Lines of uniform pressure (one for each value)."""
    return PressureMap(np.tile(pressure, (pixels, 1)).T.copy(), length / pixels, 1e-3)


def test_uniform_lines_are_the_point_level_in_time_of_contact():
    pressures = np.array([1e5, 2e5, 5e5])
    footprint = strip(pressures)
    passing = footprint.dx / LOCKED.speed
    times = passing * np.arange(1, 81)
    k, D, H_V, _ = B(pressures)
    exact = point.simulate(
        point.Conditions.of(
            pressure=pressures,
            speed=4.0,
            temperature=269.15,
            k=k,
            D=D,
            H_V=H_V,
            initial_height=70e-9,
            duration=80 * passing,
        ),
        tolerance=1e-6,
        times=times,
    )
    found = film_map(footprint, LOCKED, B, tolerance=1e-3)
    mu = k[:, None] * WATER_VISCOSITY * 4.0 / (found.height * pressures[:, None])
    assert mu[:, ::-1].T == pytest.approx(exact.samples, rel=2e-3)
    assert found.friction(footprint).mean(axis=1) == pytest.approx(exact.mu_mean, rel=2e-4)
    onset = passing * (80 - found.melting.sum(axis=1))
    assert onset == pytest.approx(exact.melt_onset, abs=1.5 * passing)
    assert found.saturated[2].any() and not found.saturated[0].any()


def test_tolerance_bounds_the_error_of_a_footprint():
    footprint = Tread().footprint((24, 120))
    fine = film_map(footprint, LOCKED, B, tolerance=1e-4)
    coarse = film_map(footprint, LOCKED, B, tolerance=1e-2)
    error = np.abs(coarse.shear / np.where(footprint.contact, fine.shear, 1.0) - 1.0)
    assert error[footprint.contact].max() < 1e-2
    assert coarse.mean_friction(footprint) == pytest.approx(fine.mean_friction(footprint), rel=5e-4)


def test_across_a_gap_the_film_stays_and_the_ice_cools():
    pressure = np.full((1, 90), 3e5)
    pressure[0, 30:60] = 0.0
    footprint = PressureMap(pressure, 0.25e-3, 1e-3)
    found = film_map(footprint, LOCKED, B)
    gap = slice(30, 60)
    assert np.ptp(found.height[0, gap]) == 0.0 and np.ptp(found.squeezed[0, gap]) == 0.0
    assert (found.shear[0, gap] == 0.0).all() and (found.friction(footprint)[0, gap] == 0.0).all()
    assert not found.melting[0, gap].any()
    cooling = found.temperature[0, gap]
    assert (np.diff(cooling) > 0.0).all()  # x falls along the path
    exact = film_map(footprint, LOCKED, B, tolerance=1e-5).temperature[0, gap]
    assert cooling == pytest.approx(exact, abs=2e-3)  # from melting to about -1 degC
    assert found.temperature[0, 61] == MELTING_TEMPERATURE


def test_ahead_of_the_contact_the_ice_is_fresh():
    pressure = np.zeros((1, 40))
    pressure[0, :20] = 2e5
    found = film_map(PressureMap(pressure, 0.5e-3, 1e-3), LOCKED, B)
    assert found.temperature[0, 20:] == pytest.approx(269.15)
    assert found.height[0, 20:] == pytest.approx(70e-9)
    assert found.height[0, 19] < 70e-9


def test_energy_and_water_are_conserved():
    footprint = Tread().footprint((12, 80))
    found = film_map(footprint, LOCKED, B, tolerance=1e-4)
    work = found.shear * LOCKED.sliding_speed * footprint.dx / LOCKED.speed
    assert work == pytest.approx(found.ice_heat + found.latent_heat)
    melted = found.latent_heat.sum(axis=1) / MELTING_ENTHALPY
    water = found.height[:, 0] + found.squeezed[:, 0] - 70e-9
    assert water == pytest.approx(melted, rel=1e-3, abs=1e-10)


def test_water_that_lags_behind_the_ice_fills_the_voids():
    """Steady: at half the speed voids fill as those of half the height do; a gap drains a half."""
    B_half = ConstantContact(0.3, 40e-6, 0.1e-6)
    B_whole = ConstantContact(0.3, 40e-6, 0.2e-6)
    even = strip(3e5)
    slow = film_map(even, LOCKED._replace(water_speed=0.5), B_whole, tolerance=1e-3)
    half = film_map(even, LOCKED, B_half, tolerance=1e-3)
    assert half.saturated.any()
    np.testing.assert_allclose(slow.shear, half.shear, rtol=1e-12)
    np.testing.assert_allclose(slow.squeezed, 2.0 * half.squeezed, rtol=1e-12)
    full = film_map(even, LOCKED._replace(water_speed=0.0), B_whole, tolerance=1e-3)
    assert full.saturated.all() and (full.squeezed == 0.2e-6).all()
    assert full.mean_friction(even) < slow.mean_friction(even)
    rolling = LOCKED._replace(sliding_speed=0.1 * LOCKED.speed, water_speed=0.5)
    assert rolling.water_fraction == pytest.approx(0.95)  # 0.9 V of the tread and half of 0.1 V
    pressure = np.full((1, 90), 3e5)
    pressure[0, 30:60] = 0.0
    gap = film_map(
        PressureMap(pressure, 0.25e-3, 1e-3), LOCKED._replace(water_speed=0.5), B, tolerance=1e-3
    ).squeezed[0]
    assert gap[45] == pytest.approx(0.5 * gap[60], rel=1e-12)
    assert 0.5 * gap[60] < gap[29] < 0.6 * gap[60]


WET = {"wet": WetIce(5e-6, 6e-3)}
DRY = {"strength": ShearStrength.softening(3.3e5, 10.0, 0.5), "initial_height": 0.0}


@pytest.mark.parametrize("changes", [{}, DRY, WET], ids=["film", "dry", "wet"])
def test_lines_do_not_depend_on_each_other(changes):
    """Many at a time and few: Newton's iterations end together."""
    rng, lines = np.random.default_rng(1), 2050
    footprint = PressureMap(rng.uniform(1e5, 5e5, (lines, 8)), 1e-3, 1e-3)
    here = LOCKED._replace(temperature=np.linspace(260.0, 272.9, lines), **changes)
    whole = film_map(footprint, here, B)
    for some in (np.arange(2), np.arange(lines - 4, lines)):
        few = PressureMap(footprint.pressure[some], 1e-3, 1e-3)
        for a, b in zip(whole, film_map(few, here.lines(some), B), strict=True):
            np.testing.assert_allclose(a[some], b, rtol=1e-6, atol=1e-15)


def test_the_first_height_may_be_rows_over_the_temperature_of_the_ice(tmp_path):
    """As film.initial_height of a scene; every point of a curve over temperature has its own."""
    file = tmp_path / "height.csv"
    file.write_text("temperature (degC), height (nm)\n-20, 20\n0, 80\n")
    rows, number = case(initial_height=str(file)), case(initial_height="68 nm")
    assert file in rows.files and rows.temperature == number.temperature == 269.15
    assert rows.ride().initial_height == pytest.approx(number.ride().initial_height)
    read = ReadFootprint(strip(2e5))
    by_rows, by_number = (survey(one, read).curves for one in (rows, number))
    there = np.isclose(by_rows.temperature, 269.15)
    np.testing.assert_allclose(by_rows.film[there], by_number.film[there], rtol=1e-9)
    assert abs(by_rows.film[0] / by_number.film[0] - 1.0) > 0.01
    with pytest.raises(SceneError, match="--initial-height = 0 m is out of range; allowed: 1 nm"):
        file.write_text("temperature (degC), height (nm)\n-20, 0\n0, 80\n")
        case(initial_height=str(file))


def test_a_contact_file_takes_the_compounds_place(tmp_path):
    file = tmp_path / "\N{SNOWFLAKE}\N{SNOWBOARDER}" / "contact.csv"
    file.parent.mkdir()
    file.write_text("pressure_Pa,k,D_m,H_V_m\n2e4,0.1,2e-5,6e-6\n2e6,0.8,9e-5,4e-7\n")
    own = case(contact=str(file))
    assert own.law.contact_parameters(2e4).k == pytest.approx(0.1)
    with pytest.raises(SceneError, match="--contact .*no column k"):
        file.write_text("pressure_Pa\n1e5\n")
        case(contact=str(file))
