"""The point: reference values, tolerance, events, conservation, failure, and its histories."""

from functools import partial

import numpy as np
import pytest

from iceslide_fem import reference
from iceslide_fem.film.law import explicit_stage
from iceslide_fem.film.point import Conditions, Record, simulate
from iceslide_fem.film.point_conditions import Loading
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import CONTACT_TABLES, MELTING_ENTHALPY, MELTING_TEMPERATURE

BAR = 1e5
FOUR_CASES = ((1, 3), (1, 4), (5, 3), (5, 4))
TIMES = np.linspace(0.0, 7e-3, 141)


def conditions(cases=FOUR_CASES, duration=7e-3, **changes) -> Conditions:
    pressure, speed = (np.array(column, dtype=float) for column in zip(*cases, strict=True))
    k, D, H_V, _ = CONTACT_TABLES["B"](pressure * BAR)
    values = {
        "pressure": pressure * BAR,
        "speed": speed,
        "temperature": 269.15,
        "k": k,
        "D": D,
        "H_V": H_V,
        "initial_height": 70e-9,
        "duration": duration,
    }
    return Conditions.of(**{**values, **changes})


def assert_near(value, printed: str) -> None:
    """Within 0.2 % of a number that is printed rounded."""
    number, rounding = float(printed), 0.5 * 10.0 ** -len(printed.partition(".")[2])
    assert abs(value - number) <= 2e-3 * number + rounding


@pytest.mark.parametrize(
    "case, onset, peak, early, middle, late, saturation",
    [
        (0, "3.297", "0.5307", "0.3166", "0.306", "0.255", None),
        (1, "1.681", "0.540", "0.4222", "0.249", "0.231", None),
        (2, "1.535", "0.155", "0.1200", "0.068", "0.0635", None),
        (3, "0.776", "0.1581", "0.1516", "0.0426", "0.0319", "4.44"),
    ],
)
def test_reference_values(case, onset, peak, early, middle, late, saturation):
    result = simulate(conditions(FOUR_CASES[case : case + 1]), times=(0.8e-3, 5e-3, 7e-3))
    assert_near(1e3 * result.melt_onset[0], onset)
    assert_near(result.mu_peak[0], peak)
    for mu, printed in zip(result.samples[:, 0], (early, middle, late), strict=True):
        assert_near(mu, printed)
    if saturation is None:
        assert np.isnan(result.saturation[0])
    else:
        assert_near(1e3 * result.saturation[0], saturation)


@pytest.mark.parametrize(
    "case, middle, late, saturation",
    [(0, "0.261", "0.235", None), (2, "0.0661", "0.0625", None), (3, "0.0393", None, "4.17")],
)
def test_reference_values_with_the_closed_form_flux(case, middle, late, saturation):
    here = conditions(FOUR_CASES[case : case + 1])
    result = simulate(here, ice="half-space", times=(5e-3, 7e-3))
    assert_near(result.samples[0, 0], middle)
    if late:
        assert_near(result.samples[1, 0], late)
    if saturation:
        assert_near(1e3 * result.saturation[0], saturation)


@pytest.fixture(scope="module", params=["column", "half-space"])
def exact(request):
    """The heat model, and mu of the four cases at TIMES."""
    return request.param, simulate(conditions(), request.param, 1e-7, times=TIMES).samples


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5])
def test_achieved_error_is_within_the_tolerance_asked(exact, tolerance):
    ice, mu = exact
    error = np.abs(simulate(conditions(), ice, tolerance, times=TIMES).samples / mu - 1.0).max()
    assert error <= tolerance
    assert error > 0.01 * tolerance  # and the work is not wasted


def test_tolerance_holds_over_pressure_speed_and_temperature():
    rng = np.random.default_rng(3)
    n = 60
    pressure = rng.uniform(1.0, 5.0, n)
    cases = list(zip(pressure, rng.uniform(0.5, 8.0, n), strict=True))
    here = conditions(cases, temperature=rng.uniform(253.15, 272.15, n))
    exact = simulate(here, tolerance=1e-6, times=TIMES).samples
    for tolerance in (1e-2, 1e-3):
        error = simulate(here, tolerance=tolerance, times=TIMES).samples / exact - 1.0
        assert np.abs(error).max() <= tolerance


@pytest.mark.parametrize("integrator", ["sdirk2", "sdirk3"])
def test_tolerance_holds_where_the_flux_jumps(integrator):
    """Over the half-space mu turns at the onset within a hundredth of the time until then.

    Stages in which it came melted from their start, and mu missed the tolerance by 4.4 times.
    """
    here = conditions(((1.196, 4.667), (2.923, 3.0)), temperature=[253.15, 260.75])
    times = 1e-3 * np.array([6.0, 6.699, 6.7, 6.702, 6.71, 6.748, 6.75, 6.76, 6.8, 7.0])
    exact = simulate(here, "half-space", 1e-6, times=times).samples
    for tolerance in (1e-2, 1e-3):
        found = simulate(here, "half-space", tolerance, integrator, times=times).samples
        assert np.abs(found / exact - 1.0).max() <= tolerance


def test_many_conditions_at_once_are_each_of_them_alone():
    together = simulate(conditions(), times=TIMES)
    for i in range(4):
        alone = simulate(conditions(FOUR_CASES[i : i + 1]), times=TIMES)
        np.testing.assert_allclose(together.samples[:, i], alone.samples[:, 0], rtol=1e-9)
        assert together.steps[i] == alone.steps[0]


@pytest.mark.parametrize("ice", ["column", "half-space"])
def test_energy_water_and_complementarity_at_every_step(ice):
    here = conditions(((5, 4),), duration=5e-3)
    totals = {"work": 0.0, "ice": 0.0, "latent": 0.0}

    def observe(record: Record) -> None:
        step = record.step
        totals["work"] += step.friction_work[0]
        totals["ice"] += step.ice_heat[0]
        totals["latent"] += step.latent_heat[0]
        assert step.last.friction_power == pytest.approx(
            step.last.ice_flux + step.last.melt_power, rel=1e-13
        )
        assert step.last.melt_power >= 0.0
        assert step.last.melting == (step.last.melt_power > 0.0)
        assert step.state.squeezed_height <= here.H_V
        if step.last.saturated:
            assert step.state.squeezed_height == here.H_V

    result = simulate(here, ice, observe=observe)
    assert totals["work"] == pytest.approx(totals["ice"] + totals["latent"], rel=1e-12)
    # The mean of mu is the work of friction.
    assert totals["work"] == pytest.approx(result.mu_mean[0] * 5 * BAR * 4.0 * 5e-3, rel=1e-12)


def test_water_balance_closes_with_the_step():
    """h + H_s - h0 is what has melted; the log form conserves it to the order of the method."""
    here = conditions(((5, 4),), duration=5e-3)
    gaps = []
    for steps in (100, 200, 400):
        latent = []
        result = simulate(
            here,
            fixed_step=5e-3 / steps,
            tolerance=1e-9,
            observe=lambda record, latent=latent: latent.append(record.step.latent_heat[0]),
        )
        water = result.film_height[0] + result.squeezed_height[0] - 70e-9
        gaps.append(abs(water - sum(latent) / MELTING_ENTHALPY) / water)
    orders = np.log2(np.array(gaps[:-1]) / gaps[1:])
    assert (orders > 1.7).all(), orders
    assert gaps[-1] < 1e-4


@pytest.mark.parametrize("ice", ["column", "half-space"])
def test_a_molecular_film_at_thirty_metres_per_second(ice):
    here = conditions(((1, 30), (5, 30)), initial_height=1e-9)
    heights = []
    result = simulate(
        here, ice, observe=lambda record: heights.append(np.exp(record.step.state.log_height).min())
    )
    assert np.isfinite(result.mu_end).all() and min(heights) > 0.0
    assert (result.squeezed_height <= here.H_V).all()


@pytest.mark.parametrize("ice", ["column", "half-space"])
def test_steps_find_the_onset_and_saturation_at_once(ice):
    """Where they were found by cutting steps that had gone past them, 5 to 19 were refused."""
    result = simulate(conditions([*FOUR_CASES, (2.7, 6), (5, 6)]), ice, tolerance=1e-2)
    assert np.isfinite(result.melt_onset).all() and np.isfinite(result.saturation[3:]).all()
    assert (result.rejected <= (4 if ice == "column" else 6)).all()


def loaded(pressures, here=(5, 4), **changes):
    """The point under a pressure (bar) that has these values at even times, at 4 m/s."""
    duration, bars = 14e-3, tuple(BAR * one for one in pressures)
    pressure = Course(Curve(tuple(np.linspace(0.0, duration, len(bars))), bars), duration)
    loading = Loading(pressure, Course(Curve.of(4.0), duration), CONTACT_TABLES["B"])
    return simulate(conditions((here,), duration), loading=loading, **changes)


def test_what_is_full_does_not_fill_anew_under_a_pressure_that_falls():
    """H_V rises, and every step ended on the moment when H_s had come up with it: 1,399 of them."""
    result, exact = (loaded((5, 5, 4.5), tolerance=tolerance) for tolerance in (1e-1, 1e-3))
    assert result.saturation[0] == pytest.approx(4.44e-3, rel=1e-3)
    assert result.steps[0] + result.rejected[0] <= 40
    assert result.mu_mean == pytest.approx(exact.mu_mean, rel=2e-3)


def test_loads_in_time_are_those_of_the_start_too():
    """Conditions that said other ones kept steps from ever finding the onset."""
    one, other = (loaded((3, 3), here, tolerance=1e-2) for here in ((3, 4), (1, 1)))
    assert one.mu_peak == other.mu_peak and one.mu_mean == other.mu_mean


def test_cold_slow_sliding_only_squeezes():
    result = simulate(conditions(((1, 0.01),), temperature=200.0), tolerance=1e-5)
    K3 = reference.squeeze_coefficient(1e5, 29e-6)
    assert result.film_height[0] == pytest.approx(
        reference.squeezed_film(70e-9, K3, 7e-3), rel=1e-5
    )
    assert np.isnan(result.melt_onset[0]) and np.isnan(result.saturation[0])
    assert result.mu_peak_time[0] == pytest.approx(7e-3)


def test_explicit_euler_needs_short_steps():
    """Its errors grow with the step, also beyond the linear limit.

    Squeeze-out alone takes h K3 h^2 dt of h in a step: half of it, which is refused, from 0.75
    times the linear limit on, and all of it from 1.5 times the limit on.
    """
    here = conditions(((5, 4),), duration=4e-3)
    exact = simulate(here, tolerance=1e-5)
    K1 = float(reference.melt_coefficient(0.405, 4.0))
    K3 = float(reference.squeeze_coefficient(5e5, 46.5e-6))
    thinnest = 0.405 * 1.8e-3 * 4.0 / exact.mu_peak[0] / 5e5
    limit = 2.0 / (K1 / thinnest**2 + 3.0 * K3 * thinnest**2)
    errors = []
    for share in (0.125, 0.25, 1.5):
        result = simulate(here, integrator="explicit-euler", fixed_step=share * limit)
        errors.append(abs(result.mu_mean[0] / exact.mu_mean[0] - 1.0))
    assert errors[0] < 0.6 * errors[1] and errors[1] < errors[2] < 0.03
    thick = here._replace(initial_height=np.full(1, 300e-9))
    limit = 2.0 / (3.0 * K3 * 300e-9**2)
    simulate(thick, integrator="explicit-euler", fixed_step=0.7 * limit)
    with pytest.raises(SimulationStopped, match="4 m/s cannot be advanced beyond t = .* too long"):
        simulate(thick, integrator="explicit-euler", fixed_step=0.8 * limit)
    unguarded = partial(explicit_stage, largest_change=np.inf)
    method = INTEGRATORS["explicit-euler"]._replace(stage=unguarded)
    simulate(thick, integrator=method, fixed_step=1.4 * limit)
    with pytest.raises(SimulationStopped, match="too long"):
        simulate(thick, integrator=method, fixed_step=1.6 * limit)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("temperature", -4.0),
        ("temperature", 273.15),
        ("pressure", -1e5),
        ("pressure", 0.0),
        ("k", 2.0),
        ("D", 0.0),
        ("H_V", np.nan),
        ("speed", np.inf),
        ("duration", [7e-3, -1.0]),
    ],
)
def test_impossible_conditions_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} = .* is not possible; allowed: .* to "):
        conditions(**{name: value})


def test_misspelt_and_missing_conditions_are_refused():
    with pytest.raises(ValueError, match="h0 is unknown"):
        conditions(h0=70e-9)
    with pytest.raises(ValueError, match="is missing"):
        Conditions.of(pressure=1e5)


@pytest.mark.parametrize("name", ["tolerance", "fixed_step", "max_step"])
def test_impossible_steps_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} = 0 is not possible"):
        simulate(conditions(), **{name: 0.0})


@pytest.mark.parametrize("changes", [{"estimate": (np.nan, np.nan)}, {"allowed": 1e-30}])
def test_a_step_that_no_shortening_mends_ends_the_run(changes):
    """Also where the error stays finite: it was shortened for ever."""
    hopeless = INTEGRATORS["sdirk2"]._replace(**changes)
    with pytest.raises(SimulationStopped, match="cannot be advanced beyond t = 0 s"):
        simulate(conditions(), integrator=hopeless)


def test_unknown_names_are_refused():
    with pytest.raises(ValueError, match='ice = "continuum" is unknown; allowed: column, half-sp'):
        simulate(conditions(), "continuum")
    with pytest.raises(
        ValueError, match='integrator = "euler" is unknown; allowed: sdirk2, sdirk3'
    ):
        simulate(conditions(), integrator="euler")


def test_an_integrator_without_estimate_wants_a_fixed_step():
    with pytest.raises(ValueError, match="give fixed_step"):
        simulate(conditions(), integrator="implicit-euler")


def test_longest_step_bounds_the_steps():
    longest = []
    simulate(conditions(), max_step=2e-5, observe=lambda r: longest.append(r.dt[r.places].max()))
    assert max(longest) <= 2e-5


def scene(**changes):
    data = {
        "name": "point",
        "model": "point",
        "rubber": {"compound": "B", "length": "2 mm", "width": "3 mm"},
        "load": {"pressure": "5 bar", "speed": "4 m/s", "duration": "5 ms"},
    }
    for key, value in changes.items():
        data.setdefault(key, {}).update(value)
    return scene_from_dict(data)


def test_heat_of_the_water_that_there_is_closes_the_energy_balance_as_steps_shorten():
    missing = []
    for tolerance in (1e-2, 1e-3, 1e-4):
        _, entries = point_history(scene(numerics={"tolerance": tolerance}))
        missing.append(abs(entries["energy_imbalance"]))
    assert 1e-9 < missing[2] < 0.2 * missing[1] < 0.04 * missing[0] < 4e-6


@pytest.mark.parametrize("heat", ["column", "half-space"])
def test_history_of_a_scene(heat):
    rows, results = point_history(scene(ice={"heat": heat}))
    time = np.array([row.time_s for row in rows])
    assert time[0] == 0.0 and time[-1] == pytest.approx(5e-3) and (np.diff(time) > 0.0).all()
    np.testing.assert_allclose(np.diff(time), [row.step_s for row in rows[1:]], rtol=1e-6)
    first, last = rows[0], rows[-1]
    assert first.film_height_m == pytest.approx(70e-9)
    assert first.surface_temperature_C == pytest.approx(-4.0)
    assert first.friction_work_J == 0.0
    assert last.normal_force_N == pytest.approx(5e5 * 6e-6)
    assert last.friction_force_N == pytest.approx(last.mu * last.normal_force_N)
    assert last.slip_m == pytest.approx(0.02)
    assert last.saturated_fraction == last.melted_fraction == last.contact_fraction == 1.0
    parts = last.ice_heat_J + last.latent_heat_J
    assert last.friction_work_J == pytest.approx(parts, rel=1e-4)
    assert abs(results["energy_imbalance"]) < 1e-4
    assert results["mu_end"] == pytest.approx(last.mu)
    assert results["mu_peak"] == pytest.approx(max(row.mu for row in rows))
    assert results["steps"] == len(rows) - 1
    melted = next(row.time_s for row in rows if row.melted_fraction)
    filled = next(row.time_s for row in rows if row.saturated_fraction)
    assert results["melt_onset_s"] == pytest.approx(melted)
    assert results["saturation_s"] == pytest.approx(filled)
    work = results["mu_mean"] * last.normal_force_N * last.slip_m
    assert work == pytest.approx(last.friction_work_J)


def test_history_says_none_where_nothing_melts():
    rows, results = point_history(scene(load={"speed": "0.1 m/s"}))
    assert results["melt_onset_s"] is None and results["saturation_s"] is None
    assert max(row.surface_temperature_C for row in rows) < 0.0 < MELTING_TEMPERATURE


@pytest.mark.parametrize("integrator", ["implicit-euler", "explicit-euler"])
def test_history_without_error_control_has_equal_steps(integrator):
    rows, results = point_history(scene(numerics={"film_integrator": integrator}))
    assert 2000 <= results["steps"] <= 2010
    better, _ = point_history(scene())
    assert rows[-1].mu == pytest.approx(better[-1].mu, rel=5e-3)
    numerics = {"film_integrator": integrator, "max_step": "10 us"}
    _, results = point_history(scene(numerics=numerics))
    assert 500 <= results["steps"] <= 510


def test_sample_times_must_ascend():
    with pytest.raises(ValueError, match="ascend"):
        simulate(conditions(), times=[2e-3, 1e-3])


def test_below_a_point_continuum_ice_is_a_column():
    column, continuum = (scene(ice={"heat": heat}) for heat in ("column", "continuum"))
    assert point_history(column) == point_history(continuum)
    assert any("the ice is a column" in note for note in notes(continuum))
    assert not any("the ice is a column" in note for note in notes(column))


def test_ice_that_slides_below_a_point_passes():
    """2 mm at 4 m/s: half a millisecond, then nothing changes; its mean is the sample's (5.35)."""
    rows, results = point_history(scene(ice={"motion": "sliding"}))
    mean = simulate(conditions(((5, 4),), duration=0.5e-3)).mu_mean[0]
    time, mu = np.array([(row.time_s, row.mu) for row in rows]).T
    assert time[-1] == pytest.approx(5e-3) and mu[0] == pytest.approx(
        0.405 * 1.8e-3 * 4.0 / 70e-9 / 5e5
    )
    np.testing.assert_allclose(mu[time >= 0.5e-3], mean, rtol=1e-9)
    assert results["mu_end"] == pytest.approx(mean) and results["steps"] == len(rows) - 1
    assert abs(results["energy_imbalance"]) < 1e-4
    work = np.sum(0.5 * (mu[1:] + mu[:-1]) * np.diff(time)) * 5e5 * 6e-6 * 4.0
    assert rows[-1].friction_work_J == pytest.approx(work, rel=1e-4)


def test_films_of_some_molecules_and_friction_out_of_sight_are_said():
    assert point_history(scene())[1]["warnings"] == []
    thin = {"initial_height": "1 nm", "k": 0.9, "D": "0.1 um", "H_V": "1 um"}
    _, results = point_history(scene(film=thin))
    film, friction = results["warnings"]
    assert "nm thin: below 1 nm" in film and f"mu rises to {results['mu_peak']:.3g}" in friction
