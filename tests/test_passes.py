"""Rubber over the same ice again and again: exact warming, water between passes, tables."""

import numpy as np
import pytest
from program import rows_of, run
from scipy.integrate import trapezoid

from iceslide_fem import reference
from iceslide_fem.film.conditions import rubber_columns, scene_conditions, scene_passes
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.passes import Passes, column_for, frozen, next_start, simulate_passes
from iceslide_fem.film.point_conditions import Conditions
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.point import point_history
from iceslide_fem.runs.point_pass import one_pass
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import BOTTOMLESS, ICE, MELTING_TEMPERATURE, Ground

pytestmark = pytest.mark.quick
FLUX, TIME = 160e3, 5e-3  # W/m2, s


def constant_flux(celsius=-80.0):
    """A point whose friction power is FLUX: its water is so viscous that it rubs as dry contact."""
    k, speed = 0.4, 4.0
    return Conditions.of(
        strength=ShearStrength.softening(FLUX / (k * speed), np.inf, 0.5),
        pressure=2e5,
        speed=speed,
        temperature=MELTING_TEMPERATURE + celsius,
        k=k,
        D=1e-2,
        H_V=1e-2,
        initial_height=0.0,
        duration=TIME,
        viscosity=10.0,
    )


def rises(conditions, passes, ground=BOTTOMLESS, tolerance=1e-3):
    """Of the surface (K) before every next pass, and the mean rise (K) of columns to a base."""
    ice = column_for(conditions, passes, tolerance, ground)
    surface, mean = [], []
    for found in simulate_passes(conditions, passes, ice, tolerance=tolerance):
        heat = next_start(found.state, conditions, ice, passes, 0.0, TIME).ice
        surface.append(ice.surface_temperature(heat)[0] - conditions.temperature[0])
        mean.append(ice.heat(heat)[0] / (ICE.density * ICE.heat_capacity * ground.depth))
    return np.array(surface), np.array(mean)


@pytest.mark.parametrize(
    ("period", "exact"),
    [
        (1.0, {1: 0.2113, 10: 1.0600, 100: 3.9232}),
        (7e-3, {1: 3.2871, 2: 5.2666, 3: 6.8215, 10: 13.9398}),
    ],
)
def test_ice_warms_from_pass_to_pass_as_the_exact_series(period, exact):
    passes = Passes(max(exact), period, "drain")
    surface, _ = rises(constant_flux(), passes)
    for number, rise in exact.items():
        assert surface[number - 1] == pytest.approx(rise, rel=5e-3)
        series = reference.rise_before_pass(FLUX, TIME, period, number)
        assert series == pytest.approx(rise, rel=3e-4)


def test_an_insulated_base_keeps_all_heat():
    """q t_c / (rho c d) in every pass: 0.01967 K of 20 mm."""
    _, mean = rises(constant_flux(), Passes(20, 1.0, "drain"), Ground(depth=0.02))
    np.testing.assert_allclose(np.diff(mean), 0.01967, rtol=5e-3)


def test_a_held_base_lets_the_surface_warm_to_a_steady_mean():
    """q t_c d / (lambda period) = 7.1111 K at the surface, in the mean over a period."""
    depth, period = 0.02, 1.0
    conditions = constant_flux()
    ground = Ground(depth=depth, held=float(conditions.temperature[0]))
    ice = column_for(conditions, Passes(2000, period, "drain"), 1e-3, ground)
    heat, given = ice.initial(1), FLUX * TIME
    for _ in range(2000):
        heat = ice.cooled(heat + given, [period])  # what a pass leaves, a period later
    steady = FLUX * TIME * depth / (ICE.conductivity * period)
    assert steady == pytest.approx(7.1111, rel=1e-5)
    times = np.geomspace(1e-7, period, 2001)
    surface = [ice.surface_temperature(ice.cooled(heat + given, [time]))[0] for time in times]
    rises_of = np.array(surface) - conditions.temperature[0]
    assert trapezoid(rises_of, times) / period == pytest.approx(steady, rel=5e-3)


def test_water_freezes_as_far_as_the_rest_is_long():
    """A surface that jumps to T_m takes 2 e dT sqrt(t / pi); all heat is kept."""
    ice = Column(MELTING_TEMPERATURE - 4.0, np.array([1e-4, 1.0]))
    water, rest = np.array([2e-6, 50e-9]), np.array([1e-3, 1e-3])
    heat, left, remaining = frozen(ice.initial(2), water, rest, ice)
    taken = 2.0 * ICE.effusivity * 4.0 * np.sqrt(1e-3 / np.pi) / ICE.melting_enthalpy
    assert taken < 2e-6
    assert left[0] == pytest.approx(2e-6 - taken, rel=1e-4)
    assert remaining[0] == pytest.approx(0.0, abs=1e-12)
    assert left[1] == 0.0
    assert remaining[1] == pytest.approx(1e-3 * (1.0 - (50e-9 / taken) ** 2), rel=1e-4)
    np.testing.assert_allclose(ice.heat(heat), ICE.melting_enthalpy * (water - left), rtol=1e-9)
    assert (ice.surface_temperature(heat) <= MELTING_TEMPERATURE + 1e-6).all()


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4])
def test_frozen_water_is_as_exact_as_the_tolerance(tolerance):
    conditions, passes = constant_flux(), Passes(2, 10.0, "freeze")
    ice = column_for(conditions, passes, tolerance, BOTTOMLESS)
    colder = MELTING_TEMPERATURE - float(conditions.temperature[0])
    rest, water = np.array([1e-2, 0.1, 1.0]), np.full(3, 1e-3)
    _, left, _ = frozen(ice.initial(3), water, rest, ice)
    exact = 2.0 * ICE.effusivity * colder * np.sqrt(rest / np.pi) / ICE.melting_enthalpy
    np.testing.assert_allclose(water - left, exact, rtol=tolerance)


def test_ice_on_a_held_base_freezes_water_without_end():
    """Late the flux is the steady one, lambda dT / depth."""
    ground = Ground(depth=1e-3, held=MELTING_TEMPERATURE - 4.0)
    ice = Column(MELTING_TEMPERATURE - 4.0, np.array([1e-2, 100.0]), ground=ground)
    times, water = np.array([50.0, 100.0]), np.full(2, 1.0)
    _, left, _ = frozen(ice.initial(2), water, times, ice)
    rate = ICE.conductivity * 4.0 / 1e-3 / ICE.melting_enthalpy
    assert left[0] - left[1] == pytest.approx(50.0 * rate, rel=1e-6)


def scene(model="point", **tables):
    whole = {
        "name": "passes",
        "model": model,
        "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01},
        "load": {"pressure": 2e5, "speed": 4.0, "duration": TIME, "passes": 4, "period": 1.0},
        "ice": {"temperature": 269.15, "motion": "sliding"},
        "numerics": {"tolerance": 1e-2},
    }
    for table, values in tables.items():
        whole[table] = whole.get(table, {}) | values
    return scene_from_dict(whole)


def test_friction_falls_from_pass_to_pass():
    """Warm ice and water that stays lower it: liquid water most, drained water least."""
    films = {
        "drain": {"between": "drain"},
        "freeze": {"between": "freeze"},
        "liquid": {"between": "keep", "refreeze": "nothing"},
    }
    means = {}
    for name, film in films.items():
        found = []
        point_history(scene(film=film), found.append)
        means[name] = [row.mu_mean for row in found]
        assert (np.diff(means[name]) < 0.0).all()
    assert means["liquid"][-1] < means["freeze"][-1] < means["drain"][-1]
    first = {values[0] for values in means.values()}
    alone = point_history(scene(load={"passes": 1, "period": None}))[1]["mu_mean"]
    assert max(first) == pytest.approx(alone, rel=1e-3)


def test_water_that_stays_freezes_to_cold_ice():
    """A film of 100 s on -20 degC ice is ice: it begins again as high as the first one."""
    cold = {"temperature": 253.15}
    means = {}
    for between in ("freeze", "keep"):
        found = []
        film = {"between": between}
        point_history(scene(film=film, load={"period": 100.0}, ice=cold), found.append)
        means[between] = [row.mu_mean for row in found]
    assert means["keep"] == means["freeze"]
    assert means["keep"] == pytest.approx(means["keep"][:1] * 4, rel=1e-2)


def test_a_viscosity_over_temperature_goes_on_from_pass_to_pass():
    """One that hardly varies is as a number; one that falls begins at the rested temperature."""
    alike, falls = [[263.15, 1.8e-3], [273.15, 1.8e-3]], [[263.15, 2.64e-3], [273.15, 1.79e-3]]
    means = []
    for viscosity in (1.8e-3, alike, falls):
        found = []
        point_history(scene(water={"viscosity": viscosity}), found.append)
        means.append([row.mu_mean for row in found])
    np.testing.assert_allclose(means[1], means[0], rtol=1e-3)
    assert (np.diff(means[2]) < 0.0).all()


def test_rubber_keeps_its_heat_between_passes():
    """Its surface as a pass begins: the flux of the pass before, superposed on a half-space."""
    given = scene(
        rubber={"heat": True, "height": 20e-3}, ice={"motion": "attached"},
        film={"dry_stress": 3e5, "initial_height": 0.0, "dry_softening": 10.0},
        load={"passes": 2, "period": 0.1}, numerics={"tolerance": 1e-3},
    )  # fmt: skip
    law, times = law_of(given), np.array([TIME, 0.2])
    conditions, passes = scene_conditions(given), scene_passes(given)
    ice, rubber = column_for(conditions, passes, 1e-3, BOTTOMLESS), rubber_columns(given, times)
    rows, end = one_pass(given, law, ice, None, False, rubber)
    after = next_start(end.state, law, ice, passes, given.initial_height, TIME, rubber)
    area = given.rubber.length * given.rubber.width
    heat, t = (
        np.array([getattr(row, name) for row in rows]) for name in ("rubber_heat_J", "time_s")
    )
    flux, until = np.diff(heat) / area / np.diff(t), np.sqrt(0.1 - t)
    rise = (
        2.0 / (given.rubber.solid.effusivity * np.sqrt(np.pi)) * (flux @ (until[:-1] - until[1:]))
    )
    found = float(rubber.surface_temperature(after.rubber)[0]) - given.ice.temperature
    assert found == pytest.approx(rise, rel=5e-3) and rise > 0.2
    means = []
    point_history(given, lambda row: means.append(row.mu_mean))
    assert means[1] < 0.99 * means[0]


def test_rows_of_blocks_are_passes_one_pitch_apart():
    """Each block meets the films and the water that the one before has left."""
    alone = {"passes": 1, "period": None}
    found = []
    rubber = {"rows": 4, "row_pitch": 0.028}
    rows, entries = point_history(scene(load=alone, rubber=rubber), found.append)
    assert entries["passes"] == 4
    np.testing.assert_allclose([row.start_s for row in found], 7e-3 * np.arange(4))
    again = []
    short = {"passes": 4, "period": 7e-3}
    point_history(scene(load=short, film={"between": "keep"}), again.append)
    np.testing.assert_allclose(
        [row.mu_mean for row in found], [row.mu_mean for row in again], rtol=1e-9
    )


def test_tables_of_a_run(tmp_path):
    """history.csv says which pass a row is of, passes.csv has a row for each."""
    summary = run(scene(), tmp_path)
    history = rows_of(tmp_path / "history.csv")
    passes = rows_of(tmp_path / "passes.csv")
    assert [row["pass"] for row in passes] == ["1", "2", "3", "4"]
    assert {row["pass"] for row in history} == {"1", "2", "3", "4"}
    times = np.array([float(row["time_s"]) for row in history])
    assert (np.diff(times) > 0.0).all()
    assert 3.0 <= times[-1] <= 3.0 + TIME * 1.001
    assert summary["passes"] == 4
    assert summary["mu_mean"] == pytest.approx(np.mean([float(row["mu_mean"]) for row in passes]))
    assert float(passes[1]["surface_start_C"]) > float(passes[0]["surface_start_C"])


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"load": {"period": None}}, "load.period is missing"),
        ({"load": {"passes": 1}}, "load.period has a meaning only"),
        ({"load": {"period": 1e-3}}, "load.period = 1 ms"),
        ({"rubber": {"rows": 2, "row_pitch": 0.03}}, "load.passes and rubber.rows"),
        ({"load": {"passes": 1, "period": None}, "rubber": {"rows": 2}}, "row_pitch is missing"),
        (
            {"load": {"passes": 1, "period": None}, "rubber": {"rows": 2, "row_pitch": 0.01}},
            "rubber.row_pitch = 10 mm",
        ),
        ({"ice": {"heat": "half-space", "motion": "attached"}}, "half-space"),
        ({"friction": {"law": "coulomb", "mu": 0.3}}, "friction.law"),
    ],
)
def test_what_contradicts_passes_is_one_sentence(tables, words):
    with pytest.raises(SceneError, match=words):
        scene(**tables)
