"""Dry strength over slip speed: reference rows, no law without keys, wrong keys."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.film.point import simulate
from iceslide_fem.film.point_conditions import Conditions, Loading
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.film.strength_over_speed import RatedStrength, SpeedLaw
from iceslide_fem.relaxation.shift import NoShift, Shift, arrhenius
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.course import Course

pytestmark = pytest.mark.quick

CASE = Path(__file__).parent.parent / "cases" / "cold_point.toml"
ICE = {
    "conductivity": 2.25, "density": 916.0, "heat_capacity": 2220.0, "latent_heat": 330e3,
    "melting_temperature": 273.15,
}  # fmt: skip
CONTACT = {"k": 0.412996, "D": 36.4889e-6, "H_V": 1.69947e-6}
EV = 96485.33212  # J/mol of 1 eV


def bell(c, speed, shift=NoShift()):  # noqa: B008
    return SpeedLaw(speed, c**-0.5, (), shift, 273.15)


def thermal(energy, celsius):
    return arrhenius(energy * EV, ZERO_CELSIUS + celsius)


ROWS = SpeedLaw(
    1.0, np.inf, ((-6, 0.2), (-4, 0.6), (-2, 1.0), (0, 0.5), (1, 0.25)), thermal(0.5, -10.0)
)
# Numbers of another program, on the finest steps: tau_0 (MPa), softening (K), law, v (m/s),
# T (degC), time (s); mu at the end, mean; surface at the end (degC).
REFERENCE = {
    "slow": (0.5, 13.5, bell(0.1, 0.01), 1e-4, -30, 10.0, 0.69210, 0.69210, -29.9769),
    "warm": (0.5, 13.5, bell(0.1, 0.01), 0.01, -8, 2.0, 0.58208, 0.60376, -7.1108),
    "middle": (0.5, 13.5, bell(0.1, 0.01), 0.65, -10, 0.03, 0.33360, 0.39763, -5.5592),
    "thermal": (
        1.5, 10.0, bell(0.5, 0.3, thermal(1.0, -15.0)), 1.0, -30, 0.02, 1.36688, 1.89809, -4.0763,
    ),
    "wlf": (
        0.8, 10.0, bell(0.1, 1e3, Shift(7.4005, 121.6, 293.15)), 1.0, -30, 0.02, 1.30143, 1.53503,
        -7.8946,
    ),
    "rows": (0.5, 13.5, ROWS, 0.1, -15, 0.2, 0.68329, 0.72027, -11.6582),
}  # fmt: skip


def conditions(stress, softening, law, speed, celsius, time, residual=0.5):
    strength = ShearStrength.softening(1e6 * stress, softening, residual)
    return Conditions.of(
        strength=strength, rate=law, pressure=2e5, speed=speed, temperature=ZERO_CELSIUS + celsius,
        initial_height=0.0, duration=time, **CONTACT, **ICE,
    )  # fmt: skip


def run(given, **more):
    surface = []
    found = simulate(
        given, observe=lambda r: surface.append(r.ice.surface_temperature(r.state.ice)[0]), **more
    )
    return found, surface[-1] - ZERO_CELSIUS


@pytest.mark.parametrize(("tolerance", "error"), [(1e-3, 2e-4), (1e-5, 3e-5)])
@pytest.mark.parametrize("name", REFERENCE)
def test_reference_rows(name, tolerance, error):
    *given, end, mean, surface = REFERENCE[name]
    found, warm = run(conditions(*given), tolerance=tolerance)
    assert found.mu_end[0] == pytest.approx(end, rel=error)
    assert found.mu_mean[0] == pytest.approx(mean, rel=error)
    assert warm == pytest.approx(surface, abs=5.0 * error)


def test_reference_row_that_melts():
    given = conditions(0.5, 6.0, bell(0.1, 0.1, thermal(0.5, -10.0)), 8.0, -2, 2.5e-3, 1.0)
    found, _ = run(given, tolerance=1e-3)
    assert found.mu_end[0] == pytest.approx(0.08968, rel=2e-4)
    assert found.mu_mean[0] == pytest.approx(0.10421, rel=2e-4)
    assert found.melt_onset[0] == pytest.approx(0.200746e-3, rel=1e-3)
    assert found.film_height[0] == pytest.approx(111.690e-9, rel=1e-3)
    assert found.squeezed_height[0] == pytest.approx(0.4752e-6, rel=1e-3)


def test_reference_row_of_a_speed_that_rises():
    """From 1 mm/s to 1 m/s in 20 ms, then held."""
    given = conditions(0.5, 13.5, bell(0.1, 0.01, thermal(0.5, -20.0)), 1.0, -10, 0.03)
    speed = Course(Curve.of(((0.0, 1e-3), (0.02, 1.0), (0.03, 1.0))), 0.03)
    loading = Loading(None, speed, ConstantContact(*CONTACT.values()))
    found, warm = run(given, tolerance=1e-3, loading=loading)
    assert found.mu_end[0] == pytest.approx(0.31195, rel=2e-4)
    assert found.mu_mean[0] == pytest.approx(0.48958, rel=1e-3)
    assert warm == pytest.approx(-4.4980, abs=2e-3)


def test_a_wide_bell_is_the_law_without_speed():
    rows = REFERENCE["warm"]
    plain, _ = run(conditions(0.5, 13.5, None, *rows[3:6]))
    wide, _ = run(conditions(0.5, 13.5, bell(1e-12, 0.01), *rows[3:6]))
    assert wide.mu_mean[0] == pytest.approx(plain.mu_mean[0], rel=1e-6)


def test_a_stage_that_is_too_long_has_no_solution():
    """Where the strength rises with temperature a long stage would have three roots."""
    strength = ShearStrength.softening(1.5e6, 10.0, 0.5)
    rated = RatedStrength(strength, bell(0.5, 0.3, thermal(1.0, -15.0)), np.ones(1))
    one, power, drag = np.ones(1), np.full(1, 0.413 * 1.8e-3), np.full(1, 1.8e-3)
    short, long = (
        rated.balanced(np.full(1, 30.0), R * one, power, 0.0 * one, drag).strength[0]
        for R in (1e-8, 1e-3)
    )
    assert np.isfinite(short) and np.isnan(long)
    assert short == pytest.approx(rated(np.full(1, 30.0))[0], rel=0.05)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["film.dry_width=3"], ["film.dry_width needs film.dry_speed"]),
        (["film.dry_speed=1cm/s"], ["needs one of film.dry_width and film.dry_rows"]),
        (["film.dry_speed=1cm/s", "film.dry_rows=2"], ["film.dry_rows", "rows"]),
        (
            ["film.dry_speed=1cm/s", "film.dry_width=3", 'film.dry_shift={reference="-20 degC"}'],
            ["film.dry_shift needs activation_energy"],
        ),
        (["film.dry_speed=0", "film.dry_width=3"], ["film.dry_speed", "allowed"]),
    ],
)
def test_wrong_keys_are_one_sentence(changes, words):
    with pytest.raises(SceneError) as fault:
        load_scene(CASE, changes)
    assert all(word in str(fault.value) for word in words), fault.value


def test_a_scene_has_it():
    changes = ["film.dry_speed=1cm/s", "film.dry_width=3"]
    plain, rated = friction([load_scene(CASE, some) for some in ([], changes)]).mu_mean[:, 0]
    assert rated < 0.98 * plain
