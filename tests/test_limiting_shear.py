"""A limiting shear stress of dry rubber on ice: exact solutions, limits, tangents, conservation."""

from itertools import pairwise

import numpy as np
import pytest

from iceslide_fem import reference
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import Surface
from iceslide_fem.film.limited_stage import limited_stage
from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.loads import FilmLoads
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import ICE, MELTING_TEMPERATURE

pytestmark = pytest.mark.quick

NEVER_MELTS = ShearStrength.softening(3e5, 10.0, 0.0)
MELTS = ShearStrength.softening(3.3e5, 10.0, 0.5)
# Speed (m/s), duration (s), mu at the end, mean mu, surface (degC); k 0.4, 2 bar, -4 degC.
EXACT = (
    (4.0, 1e-3, 0.125324, 0.153897, -2.08873),
    (4.0, 5e-3, 0.073906, 0.104702, -1.23177),
    (0.1, 0.2, 0.184725, 0.201258, -3.07875),
    (0.01, 2.0, 0.219939, 0.226397, -3.66566),
)


def conditions(strength, speed=4.0, duration=5e-3, celsius=-4.0, height=0.0, **others):
    """A point of k 0.4 under 2 bar."""
    contact = {"k": 0.4, "D": 50e-6, "H_V": 5e-6} | others
    return Conditions.of(
        strength=strength,
        pressure=2e5,
        speed=speed,
        temperature=celsius + ZERO_CELSIUS,
        initial_height=height,
        duration=duration,
        **contact,
    )


def scene(**film):
    """A scene of a point on compound B."""
    return scene_from_dict(
        {
            "name": "cold",
            "model": "point",
            "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01},
            "load": {"pressure": 2e5, "speed": 4.0, "duration": 5e-3},
            "ice": {"temperature": 269.15},
            "film": {"dry_stress": 3.3e5, "dry_softening": 10.0, "initial_height": 0.0} | film,
        }
    )


@pytest.mark.parametrize(("speed", "duration", "end", "mean", "celsius"), EXACT)
def test_dry_contact_warms_as_the_exact_solution(speed, duration, end, mean, celsius):
    found = simulate(conditions(NEVER_MELTS, speed, duration), tolerance=1e-3)
    assert found.mu_end[0] == pytest.approx(end, rel=1e-3)
    assert found.mu_mean[0] == pytest.approx(mean, rel=1e-3)
    exact = reference.dry_softening_friction(np.array([duration]), 2e5, speed, 0.4, 3e5, 10.0, -4.0)
    np.testing.assert_allclose(
        [part[0] for part in exact], [end, mean, celsius], rtol=2e-5, atol=2e-5
    )


@pytest.mark.parametrize(("integrator", "order"), [("sdirk2", 2.0), ("sdirk3", 3.0)])
def test_integrators_keep_their_order(integrator, order):
    """With equal steps, on one column."""
    point = conditions(NEVER_MELTS, 4.0, 5e-3)
    column = Column(point.temperature, 5e-3)

    def end(steps):
        return simulate(point, column, integrator=integrator, fixed_step=5e-3 / steps).mu_end[0]

    exact = end(2560)
    errors = [abs(end(steps) - exact) for steps in (20, 40, 80)]
    for coarse, fine in pairwise(errors):
        assert np.log2(coarse / fine) == pytest.approx(order, abs=0.3)


def test_a_high_strength_leaves_the_film_law():
    strong = ShearStrength.softening(1e30, 10.0, 0.5)
    limited, film = (simulate(conditions(one, height=70e-9)) for one in (strong, None))
    for name in ("mu_mean", "mu_end", "mu_peak", "film_height", "melt_onset"):
        np.testing.assert_allclose(getattr(limited, name), getattr(film, name), rtol=1e-12)


def test_slow_contact_has_the_strength_of_cold_ice():
    slow = simulate(conditions(MELTS, np.array([1e-6, 1e-5, 1e-4]), 1e-2))
    np.testing.assert_allclose(slow.mu_end, 0.4 * 3.3e5 * 0.45 / 2e5, rtol=1e-3)


def test_thick_films_are_viscous():
    """Of a height h >> eta v / tau_b."""
    strong = ShearStrength.softening(3e7, 10.0, 5.0)
    limited, film = (simulate(conditions(one, 0.1, height=1e-6)) for one in (strong, None))
    np.testing.assert_allclose(limited.mu_mean, film.mu_mean, rtol=2e-4)


def test_melt_onset_is_continuous():
    """The shear has no jump where melting begins, and mu(t) keeps the tolerance through it."""
    times = np.linspace(0.0, 5e-3, 2001)
    point = conditions(MELTS, 4.0, 5e-3, -1.0)
    exact = simulate(point, tolerance=1e-6, times=times)
    onset = exact.melt_onset[0]
    assert 0.0 < onset < 5e-3
    mu = exact.samples[:, 0]
    near = np.searchsorted(times, onset)
    jumps = np.abs(np.diff(mu[near - 5 : near + 5]))
    assert jumps.max() < 2e-3 * mu[near]
    for tolerance in (1e-2, 1e-3):
        found = simulate(point, tolerance=tolerance, times=times)
        assert found.melt_onset[0] == pytest.approx(onset, rel=tolerance)
        assert np.abs(found.samples / exact.samples - 1.0).max() < tolerance


def test_friction_work_is_heat():
    rows, entries = point_history(scene(dry_residual=5.0))
    last = rows[-1]
    assert last.melted_fraction == 1.0
    assert last.film_height_m > 0.0
    taken = last.ice_heat_J + last.rubber_heat_J + last.latent_heat_J
    assert last.friction_work_J == pytest.approx(taken, rel=1e-4)
    assert abs(entries["energy_imbalance"]) < 1e-4


def one_stage(offset, height=20e-9, resistance=3e-6, speed=3.0):
    limit = LimitingShear.of(MELTS, 1.8e-3, 4.0)
    n = np.size(offset)
    loads = FilmLoads(
        0.3 * 1.8e-3 * np.full(n, speed), np.full(n, speed), np.full(n, 1e15), np.full(n, 1e-6)
    )
    ice = Surface.of(np.asarray(offset, dtype=float), np.full(n, resistance), ICE)
    start = limit.log_height(np.full(n, height))
    return limited_stage(limit, start, np.zeros(n), 1e-5, loads, ice), ice


def test_a_stage_is_consistent_and_its_slope_is_the_derivative():
    """tau_b is that of the surface's own temperature, and the ice's flux falls as it says."""
    offset = MELTING_TEMPERATURE - np.array([30.0, 12.0, 8.0, 4.0, 1.5, 0.002])
    stage, ice = one_stage(offset)
    surface = ice.offset + ice.resistance * stage.ice_flux
    np.testing.assert_allclose(
        stage.internal[1], MELTS(np.maximum(MELTING_TEMPERATURE - surface, 0.0)), rtol=1e-9
    )
    assert stage.melting.any()
    assert not stage.melting.all()
    change = 1e-4
    warmer, _ = one_stage(offset + change)
    slope = -(warmer.ice_flux - stage.ice_flux) / change * ice.resistance
    np.testing.assert_allclose(stage.ice_slope, slope, rtol=1e-3, atol=1e-6)


def test_the_tangent_of_the_shear_is_its_derivative():
    law = law_of(scene())
    log_height, squeezed, internal = law.initial(20e-9, 3)
    internal[1] = 1e4, 1e5, 3e5
    state = InterfaceState(log_height, squeezed, np.zeros((0, 3)), internal=internal)
    sheared = law.sheared(state, lambda: np.full(3, 270.0))
    pressure, speed = np.array([1.2e5, 2e5, 3.1e5]), np.array([0.5, 2.0, -3.0])
    shear, by_pressure, by_speed = sheared(pressure, speed)
    for index, derivative in enumerate((by_pressure, by_speed)):
        change = np.array([1.0, 1e-5])[index]
        ends = [
            sheared(pressure + sign * change * (index == 0), speed + sign * change * (index == 1))
            for sign in (1.0, -1.0)
        ]
        slope = (ends[0][0] - ends[1][0]) / (2.0 * change)
        np.testing.assert_allclose(derivative, slope, rtol=1e-5, atol=1e-9 * abs(shear).max())


def test_rows_are_the_same_as_the_number_that_they_follow():
    rows = ShearStrength.of_rows(((263.65, 3.3e5), (273.65, 0.0)), 273.15)
    depth = np.linspace(0.0, 20.0, 41)
    np.testing.assert_allclose(rows(depth), MELTS(depth), rtol=1e-12)
    one, other = (simulate(conditions(strength, celsius=-1.0)) for strength in (MELTS, rows))
    np.testing.assert_allclose(one.mu_mean, other.mu_mean, rtol=1e-9)


def test_many_points_are_as_each_alone():
    speeds, celsius = np.array([0.01, 1.0, 8.0]), np.array([-20.0, -5.0, -0.8])
    together = simulate(conditions(MELTS, speeds, celsius=celsius))
    for i in range(3):
        alone = simulate(conditions(MELTS, speeds[i], celsius=celsius[i]))
        np.testing.assert_allclose(together.mu_mean[i], alone.mu_mean[0], rtol=2e-4)


@pytest.mark.parametrize(
    ("film", "words"),
    [
        ({"dry_stress": None, "dry_softening": None}, "initial_height"),
        ({"dry_stress": [[263.15, 1e5], [273.15, 2e5]], "dry_softening": None}, "rises from row 1"),
        ({"dry_stress": [[263.15, 0.0], [273.15, 0.0]], "dry_softening": None}, "0 in all rows"),
        ({"dry_stress": [[263.15, 2e5], [273.15, 1e5]]}, "film.dry_softening and rows"),
        ({"dry_stress": -1.0}, "film.dry_stress"),
    ],
)
def test_bad_dry_shear_is_one_sentence(film, words):
    with pytest.raises(SceneError, match=words):
        scene(**film)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"model": "slice"}, "rubber.inertia"),
        ({"numerics": {"film_integrator": "explicit-euler", "max_step": 1e-6}}, "explicit-euler"),
        ({"friction": {"law": "coulomb", "mu": 0.3}}, "friction.law"),
    ],
)
def test_what_contradicts_dry_shear_is_one_sentence(tables, words):
    whole = scene().as_dict()
    with pytest.raises(SceneError, match=words):
        scene_from_dict(whole | tables)


@pytest.mark.parametrize("refreeze", ["nothing", "film", "all"])
def test_nothing_implausible_comes_out_at_any_point(refreeze):
    """Over all of the range: mu at most k tau_0 / p, no negative height, no ice above T_m."""
    rng = np.random.default_rng(3)
    n = 300
    heights = rng.choice([0.0, 1e-9, 70e-9, 1e-6], n) if refreeze == "nothing" else 0.0
    point = Conditions.of(
        strength=MELTS,
        refreeze=refreeze,
        pressure=10.0 ** rng.uniform(3.5, 6.5, n),
        speed=10.0 ** rng.uniform(-5.5, 1.5, n),
        temperature=ZERO_CELSIUS - 10.0 ** rng.uniform(-1.5, 1.7, n),
        k=rng.uniform(0.01, 1.0, n),
        D=10.0 ** rng.uniform(-6.0, -3.0, n),
        H_V=10.0 ** rng.uniform(-8.0, -4.0, n),
        initial_height=heights,
        duration=10.0 ** rng.uniform(-4.0, 1.0, n),
    )
    seen = []

    def observe(record):
        kelvin = record.ice.surface_temperature(record.step.state.ice)
        height = record.loads.height(record.step.state.log_height)
        seen.append((kelvin[record.good].max(initial=0.0), height[record.good].min(initial=1.0)))

    found = simulate(point, tolerance=1e-2, observe=observe)
    most = point.k * MELTS.strength.max() / point.pressure
    assert (found.mu_peak <= most * (1.0 + 1e-9)).all()
    assert (found.mu_mean > 0.0).all()
    hottest, thinnest = np.array(seen).T
    assert hottest.max() < MELTING_TEMPERATURE + 1e-6
    assert thinnest.min() >= 0.0
    assert found.squeezed_height.min() >= 0.0
    assert (found.squeezed_height <= point.H_V * (1.0 + 1e-2)).all()
