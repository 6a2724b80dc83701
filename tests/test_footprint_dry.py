"""Dry shear under every pixel: against the point level, across gaps."""

import numpy as np
import pytest

from iceslide_fem import point
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.preprocess.footprint.synthetic import Tread
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import CONTACT_TABLES, MELTING_ENTHALPY

pytestmark = pytest.mark.quick

B = CONTACT_TABLES["B"]
STRENGTH = ShearStrength.softening(3.3e5, 10.0, 0.5)
DRY = Ride(4.0, 4.0, 272.65, 0.0, strength=STRENGTH)
KEYS = {"dry_stress": "3.3bar", "dry_softening": "10K", "initial_height": "0nm"}


def strip(pressure, pixels=80, length=20e-3):
    """Lines of uniform pressure (one for each value)."""
    return PressureMap(np.tile(pressure, (pixels, 1)).T.copy(), length / pixels, 1e-3)


def case(**values):
    return FootprintCase.of({"gaussian": "180mm,4bar", "speed": 4.0} | values)


@pytest.mark.parametrize("celsius", [-4.0, -0.5])
def test_uniform_lines_are_the_point_level_in_time_of_contact(celsius):
    pressures = np.array([1e5, 2e5, 5e5])
    footprint, ride = strip(pressures), DRY._replace(temperature=273.15 + celsius)
    passing, parts = footprint.dx / ride.speed, 20
    k, D, H_V, _ = B(pressures)
    conditions = point.Conditions.of(
        strength=STRENGTH,
        pressure=pressures,
        speed=4.0,
        temperature=ride.temperature,
        k=k,
        D=D,
        H_V=H_V,
        initial_height=0.0,
        duration=80 * passing,
    )
    times = passing * (np.arange(80 * parts) + 0.5) / parts
    exact = point.simulate(conditions, tolerance=1e-5, times=times)
    found = film_map(footprint, ride, B, tolerance=1e-3)
    pixels = exact.samples.reshape(80, parts, 3).mean(axis=1)
    mu = found.friction(footprint)
    assert mu[:, ::-1].T == pytest.approx(pixels, rel=1e-3)
    assert mu.mean(axis=1) == pytest.approx(exact.mu_mean, rel=2e-5)
    assert found.height[:, 0] == pytest.approx(exact.film_height, rel=1e-4)
    assert found.melting.any() == (celsius == -0.5)
    if celsius == -0.5:
        onset = passing * (80 - found.melting.sum(axis=1))
        assert onset == pytest.approx(exact.melt_onset, abs=1.5 * passing)


def test_a_high_strength_leaves_the_film_law():
    footprint = Tread().footprint((6, 80))
    wet = DRY._replace(initial_height=70e-9, strength=None)
    strong = wet._replace(strength=ShearStrength.softening(1e30, 10.0, 0.5))
    for limited, film in zip(*(film_map(footprint, r, B) for r in (strong, wet)), strict=True):
        np.testing.assert_allclose(limited, film, rtol=1e-9, atol=1e-18)


def test_energy_and_water_are_conserved():
    footprint = Tread().footprint((6, 80))
    found = film_map(footprint, DRY, B, tolerance=1e-4)
    work = found.shear * DRY.sliding_speed * footprint.dx / DRY.speed
    assert work == pytest.approx(found.ice_heat + found.latent_heat)
    melted = found.latent_heat.sum(axis=1) / MELTING_ENTHALPY
    assert melted.max() > 1e-9
    assert found.height[:, 0] + found.squeezed[:, 0] == pytest.approx(melted, rel=1e-3, abs=1e-12)


def test_after_a_gap_the_ice_is_warmer_and_so_shears_less():
    pressure = np.full((1, 90), 3e5)
    pressure[0, 30:60] = 0.0
    footprint = PressureMap(pressure, 0.25e-3, 1e-3)
    ride = DRY._replace(temperature=263.15)
    mu = film_map(footprint, ride, B).friction(footprint)[0]
    assert 0.0 < mu[29] < mu[89]  # the first pixels behind the gap and of all
    assert mu[29] > mu[60]  # the ice has cooled in the gap
    fine = film_map(footprint, ride, B, tolerance=1e-5).friction(footprint)[0]
    assert mu == pytest.approx(fine, rel=2e-3)


def test_a_line_takes_it_too():
    keys = {"gaussian": "40mm,2bar,8mm", "speed": 4.0, "temperature": "-0.5 degC"}
    line = FootprintCase.of(keys | KEYS)
    read = read_footprint(line)
    found, alone = survey(line, read).film, film_map(read.pressure_map, DRY, B, line.tolerance)
    np.testing.assert_allclose(found.shear, alone.shear, rtol=1e-12)


def test_rows_of_a_file_are_the_number_that_they_follow(tmp_path):
    file = tmp_path / "dry.csv"
    file.write_text("temperature (degC), stress (bar)\n-9.5, 3.3\n0.5, 0\n")
    with pytest.raises(SceneError, match="--dry-stress"):  # ice is not warmer than it melts
        case(dry_stress=str(file))
    file.write_text("temperature (degC), stress (bar)\n-9.5, 3.3\n0, 0.165\n")
    rows, number = case(dry_stress=str(file), initial_height=0.0), case(**KEYS)
    assert rows.files == [file]
    depth = np.linspace(0.0, 20.0, 41)
    by_rows, by_number = (one.ride().strength(depth) for one in (rows, number))
    np.testing.assert_allclose(by_rows, by_number, rtol=1e-12)


def test_the_summary_does_not_doubt_dry_friction():
    keys = {"gaussian": "60mm,2bar,20mm", "temperature": "-20degC"}
    cases = [FootprintCase.of(keys | more) for more in (KEYS, {})]
    dry, film = (summary(survey(case, read_footprint(case))) for case in cases)
    assert any("does not melt" in warning for warning in film["warnings"])
    assert not any("melt" in warning or "film gets" in warning for warning in dry["warnings"])
    assert cases[0].model_dump(mode="json")["dry_softening"] == 10.0


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"initial_height": "0nm"}, "--initial-height = 0 m is out of range"),
        ({"dry_softening": "10K"}, "--dry-softening and no --dry-stress"),
        ({"dry_residual": "1K"}, "--dry-residual and no --dry-stress"),
        ({"dry_stress": "0Pa"}, '--dry-stress = "0Pa" is out of range'),
        ({"dry_stress": "none.csv"}, "--dry-stress"),
        ({"dry_stress": "dry.csv", "dry_softening": 1.0}, "--dry-softening and rows of --dry"),
        ({"dry_stress": "wrong.csv"}, "--dry-stress rises from row 1 to row 2"),
    ],
)
def test_bad_dry_shear_is_one_sentence(values, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dry.csv").write_text("T (degC), tau (bar)\n-9, 3\n0, 1\n")
    (tmp_path / "wrong.csv").write_text("T (degC), tau (bar)\n-9, 1\n0, 3\n")
    (tmp_path / "water.csv").write_text("T (degC), eta (mPa*s)\n-9, 3\n0, 1\n")
    with pytest.raises(SceneError) as refusal:
        case(**values)
    assert words in str(refusal.value) and "\n" not in str(refusal.value)
