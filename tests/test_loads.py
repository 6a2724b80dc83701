"""Loads that go in time: their course, what follows exactly from it, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp, trapezoid

from iceslide_fem.film.conditions import scene_conditions, scene_loading, simulation_settings
from iceslide_fem.film.point import simulate
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.curve import Curve, SmoothCurve
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene, scene_from_dict, unit_of
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.fingerprint import scene_hash
from iceslide_fem.scene.materials import ICE

pytestmark = pytest.mark.quick

MS = 1e-3
LOAD = {"pressure": "1 bar", "speed": "3 m/s", "duration": "2 ms"}
RAMP = [["0 ms", "1 m/s"], ["0.5 ms", "1 m/s"], ["1.5 ms", "4 m/s"]]
RISE = [["0 ms", "1 bar"], ["0.4 ms", "1 bar"], ["1.2 ms", "3 bar"]]
CONSTANT = {"k": 0.3, "D": "30 um", "H_V": "2 um"}


def scene(model="point", ice=None, film=None, rubber=None, numerics=None, **load):
    return scene_from_dict(
        {
            "name": "loads",
            "model": model,
            "rubber": {"compound": "B"} | (rubber or {}),
            "load": LOAD | load,
            "ice": {"temperature": "-1 degC"} | (ice or {}),
            "film": film or {},
            "numerics": {"tolerance": 1e-3} | (numerics or {}),
        }
    )


def point(scene, times):
    return simulate(scene_conditions(scene), times=times, **simulation_settings(scene))


# The course


@pytest.mark.parametrize("kind", [Curve, SmoothCurve])
def test_a_course_has_its_rows_an_exact_integral_and_holds_beyond(kind):
    course = Course(kind((1.0, 2.0, 4.0), (1.0, 3.0, 2.0)), 6.0)
    np.testing.assert_allclose(course([0.0, 1.0, 2.0, 4.0, 6.0]), [1.0, 1.0, 3.0, 2.0, 2.0])
    t = np.linspace(0.0, 6.0, 600_001)
    values = course(t)
    assert (values.min(), values.max()) == (1.0, 3.0)  # no overshoot
    way = trapezoid(values, t)
    assert course.integral(6.0) == pytest.approx(way, rel=1e-9)
    assert course.mean == pytest.approx(way / 6.0, rel=1e-9)
    assert course.mean_between(0.5, 3.0) == pytest.approx(
        np.mean(course(np.linspace(0.5, 3, 10**6))), rel=1e-5
    )
    assert course.slope(1.5) == pytest.approx(
        (course.at(1.5) - course.at(1.5 - 1e-7)) / 1e-7, rel=1e-5
    )
    assert course.slope(5.0) == 0.0
    assert course.corners == (1.0, 2.0, 4.0)
    bends = [course.bend(time) for time in (0.5, *course.corners, 5.0)]
    assert bends == ([0.0] * 5 if kind is SmoothCurve else [0.0, 2.0, -2.5, 0.5, 0.0])
    np.testing.assert_array_equal(course.next_corner([0.0, 1.0, 3.9, 4.0]), [1, 2, 4, np.inf])
    for end in (4.0, np.nextafter(4.0, 5.0), np.nextafter(4.0, 3.0), 3.0):  # where a run ends
        assert replace(course, duration=end).next_corner(2.5) == np.inf
    if kind is Curve:
        assert course.integral(6.0) == pytest.approx(1.0 + 2.0 + 5.0 + 4.0, rel=1e-14)


@pytest.mark.parametrize("near", [1e-1, 1e-2, 1e-3])
def test_steps_end_on_few_rows_of_a_log_and_lines_between_them_are_near_all(near):
    t = np.linspace(0.0, 1.0, 3001)
    noise = 1e-3 * np.random.default_rng(3).uniform(-1.0, 1.0, t.size)
    log = np.where(t < 0.7, 2.0 + np.sin(8.0 * t), 0.5) + noise  # it stops short at 0.7 s
    course = Course(Curve(tuple(t), tuple(log)), 1.0)
    few = course.sampled(near)
    ends = np.array([0.0, *few.corners, 1.0])
    off = np.abs(np.interp(t, ends, few(ends)) - log).max()
    assert off <= near * log.max() * (1.0 + 1e-12)
    assert len(few.corners) < {1e-1: 12, 1e-2: 40, 1e-3: 150}[near]
    np.testing.assert_array_equal(few(t), course(t))  # no value is changed
    assert (few.largest, few.integral(1.0)) == (course.largest, course.integral(1.0))
    assert course.sampled(1e-9).corners == course.corners


def test_a_log_of_ten_thousand_rows_takes_the_steps_of_its_curve():
    t = np.linspace(0.0, 7e-3, 10_000)
    log = [[time, 3.0 + np.sin(1e3 * time)] for time in t]
    coarse = [[time, 3.0 + np.sin(1e3 * time)] for time in t[:: 9999 // 99]]
    rows, summaries = [], []
    for speed in (log, coarse):
        found = point_history(scene(ice={"temperature": "-4 degC"}, speed=speed, duration=7e-3))
        rows.append(found[0])
        summaries.append(found[1])
    assert summaries[0]["steps"] < 400
    assert summaries[0]["mu_mean"] == pytest.approx(summaries[1]["mu_mean"], rel=5e-4)
    time, mu = np.array([(row.time_s, row.mu) for row in rows[0]]).T
    there = np.interp([row.time_s for row in rows[1]], time, mu)
    np.testing.assert_allclose(there, [row.mu for row in rows[1]], rtol=2e-3)


def test_a_smooth_course_is_level_at_its_ends():
    course = Course(SmoothCurve((1.0, 2.0), (1.0, 3.0)), 3.0)
    np.testing.assert_allclose(course([1.0, 1.25, 1.5, 2.0]), [1.0, 1.3125, 2.0, 3.0])
    assert course.slope(1.0 + 1e-9) == pytest.approx(0.0, abs=1e-7)
    assert course.slope(2.0) == pytest.approx(0.0, abs=1e-12)


def test_one_value_holds_throughout():
    course = Course(Curve.of(3.0), 2.0)
    assert course.is_constant and course.integral(0.5) == 1.5 and course.mean == 3.0
    assert course.at(7.0) == course.smallest == course.largest == 3.0 and course.slope(1.0) == 0.0


def test_tables_are_scaled_and_read_from_files(tmp_path):
    (tmp_path / "speed.csv").write_text("# braking\ntime (ms), speed (km/h)\n0, 3.6\n1.5, 14.4\n")
    (tmp_path / "case.toml").write_text(
        'name = "a"\nmodel = "point"\n[rubber]\ncompound = "B"\n[load]\nspeed = "speed.csv"\n'
        'pressure = "1 bar"\nduration = "2 ms"\npressure_scale = 2\nspeed_scale = 0.5\n'
    )
    found = load_scene(tmp_path / "case.toml")
    assert found.load.speed == ((0.0, 1.0), (1.5e-3, 4.0))
    assert found.load.pressures.first == 2e5 and found.load.speeds.largest == 2.0
    assert scene_from_dict(found.as_dict()) == found
    assert unit_of("load.speed") == "m/s"
    again = load_scene(tmp_path / "case.toml", ["load.interpolation=smooth"])
    assert scene_hash(again) != scene_hash(found)


@pytest.mark.parametrize(
    ("key", "header", "factor"),
    [
        ("speed", "time_ms,speed_m_per_s", 1.0),
        ("speed", "time [ms], v_x [km/h]", 1.0 / 3.6),
        ("speed", "time_ms , my_slow_speed_km_per_h", 1.0 / 3.6),
        ("pressure", "time_ms,nominal_pressure_Pa", 1.0),
        ("pressure", "time_ms,pressure_bar", 1e5),
    ],
)
def test_headers_of_tables_name_units_in_either_way(tmp_path, key, header, factor):
    values = (2e4, 3e4) if header.endswith("_Pa") else (2.0, 3.0)
    (tmp_path / "load.csv").write_text(f"{header}\n0,{values[0]}\n2,{values[1]}\n")
    times, found = zip(*getattr(scene(**{key: str(tmp_path / "load.csv")}).load, key), strict=True)
    assert times == pytest.approx((0.0, 2e-3))
    assert found == pytest.approx([factor * value for value in values])


@pytest.mark.parametrize(
    ("load", "words"),
    [
        ({"speed": [["1 ms", 3.0], ["1 ms", 2.0]]}, "load.speed = "),
        ({"speed": [["1 ms", 3.0], ["1 ms", 2.0]]}, "time must rise from row 1 to row 2"),
        ({"speed": [["1 ms", 3.0]]}, "has 1 row; allowed: a number, or 2 to"),
        ({"speed": [["1 ms", 3.0], ["2 ms", float("nan")]]}, "row 2"),
        ({"speed": [["1 ms", "3 bar"], ["2 ms", 1.0]]}, "has the wrong unit"),
        ({"speed": [["1 m", 3.0], ["2 ms", 1.0]]}, "has the wrong unit"),
        ({"speed": [["1 ms", 3.0], [2.0]]}, "row 2 is not a pair of time and value"),
        ({"speed": [["1 ms", "3 m/s"], ["2 ms", "-1 m/s"]]}, "load.speed is -1 m/s in row 2"),
        ({"speed": [["1 ms", 0.0], ["2 ms", 0.0]]}, "load.speed is 0 m/s throughout"),
        ({"pressure": [["1 ms", "1 bar"], ["2 ms", "0 bar"]]}, "is out of range"),
        ({"pressure": "nowhere.csv"}, "nowhere.csv"),
        ({"pressure": "99 bar", "pressure_scale": 2.0}, "load.pressure_scale = 2 leads out of"),
    ],
)
def test_a_bad_table_is_one_sentence(load, words):
    with pytest.raises(SceneError) as refusal:
        scene(**load)
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time, speed\n0, 1\n1, 2\n", "no header of two columns with units"),
        ("time_s,speed_bar\n0, 1\n1, 2\n", "no header of two columns with units"),
        ("time_s,speed_m_per_s,mu\n0,1,1\n1,2,1\n", "no header of two columns with units"),
        ("time (ms), speed (bar)\n0, 1\n1, 2\n", "has the wrong unit"),
        ("time (ms), speed (m/s)\n0, fast\n1, 2\n", "row 1"),
        ("time (ms), speed (m/s)\n0, 1, 2\n1, 2\n", "has 3 values"),
        ("time (ms), speed (m/s)\n0, nan\n1, 2\n", "row 1"),
        ("time,speed\n", "has no numbers in it"),
        ("", "has no numbers in it"),
    ],
)
def test_a_bad_file_is_one_sentence(tmp_path, text, words):
    (tmp_path / "speed.csv").write_text(text)
    with pytest.raises(SceneError) as refusal:
        scene(speed=str(tmp_path / "speed.csv"))
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_what_contradicts_a_load_that_changes_is_refused():
    with pytest.raises(SceneError, match='model = "point" contradict each other: where ice slides'):
        scene(speed=RAMP, ice={"motion": "sliding"})
    with pytest.raises(SceneError, match='film.pressure = "nominal" and a load.pressure'):
        scene("slice", pressure=RISE, film={"pressure": "nominal"})


# The point


def test_a_table_of_equal_values_gives_the_constant_point():
    times = np.linspace(0.0, 2e-3, 21)
    equal = scene(
        speed=[["0 ms", 3.0], ["1 ms", 3.0], ["3 ms", 3.0]], pressure=[[0, 1e5], [1, 1e5]]
    )
    mu, constant = (point(one, times).samples[1:-1, 0] for one in (equal, scene()))
    # a step ends on the row in the middle: steps differ, and so mu by their error
    np.testing.assert_allclose(mu, constant, rtol=1e-4)
    outside = scene(speed=[["0 ms", 3.0], ["3 ms", 3.0]])
    np.testing.assert_allclose(point(outside, times).samples[1:-1, 0], constant, rtol=1e-12)


def independent(courses, k, D, H_V, times, T_0, duration):
    """mu by SciPy's BDF on finite volumes of ice, melting by a surface that is held at T_m."""
    n, growth = 60, 1.13
    first = 5.0 * np.sqrt(ICE.diffusivity * duration) * (growth - 1) / (growth**n - 1)
    size = first * growth ** np.arange(n)
    centre = np.cumsum(size) - 0.5 * size
    capacity = ICE.density * ICE.heat_capacity * size
    between = ICE.conductivity / np.diff(centre)
    eta, held = 1.8e-3, ICE.conductivity / centre[0]

    def rates(t, state):
        y, squeezed, rise = state[0], state[1], state[2:]
        v, p = courses.speeds.at(t), courses.pressures.at(t)
        h = np.exp(y)
        power = k * eta * v**2 / h
        into_ice = min(power, held * (ICE.melting_temperature - T_0 - rise[0]))
        squeeze = 8.0 * p / (3.0 * eta * D**2) * h**3 if squeezed < H_V else 0.0
        flux = np.concatenate([[into_ice], -between * np.diff(rise), [0.0]])
        gain = (power - into_ice) / ICE.melting_enthalpy
        return np.concatenate([[(gain - squeeze) / h, squeeze], -np.diff(flux) / capacity])

    mu, start = [], np.concatenate([[np.log(70e-9), 0.0], np.zeros(n)])
    edges = [0.0, *courses.speeds.corners, duration]
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        wanted = times[(times > low) & (times <= high)]
        found = solve_ivp(rates, (low, high), start, "BDF", wanted, rtol=1e-6, atol=1e-9)
        start = found.y[:, -1] if wanted.size and wanted[-1] == high else None
        speed, pressure = courses.speeds(wanted), courses.pressures(wanted)
        mu.append(k * eta * speed / (pressure * np.exp(found.y[0])))
    return np.concatenate(mu)


@pytest.mark.parametrize("interpolation", ["linear", "smooth"])
def test_a_ramp_at_a_point_is_that_of_an_independent_integration(interpolation):
    ramps = {
        "speed": RAMP,
        "pressure": [["0 ms", "1 bar"], ["0.5 ms", "1 bar"], ["1.5 ms", "3 bar"]],
    }
    here = scene(**ramps, film=CONSTANT, interpolation=interpolation, numerics={"tolerance": 2e-4})
    times = np.array([0.25, 0.5, 0.8, 1.0, 1.25, 1.5, 1.8, 2.0]) * MS
    found = point(here, times)
    mu = np.append(found.samples[:-1, 0], found.mu_end)
    assert 1.0 * MS < found.melt_onset[0] < 1.5 * MS  # within the ramp
    exact = independent(here.load, 0.3, 30e-6, 2e-6, times, 272.15, 2e-3)
    np.testing.assert_allclose(mu, exact, rtol=2e-3)


def test_a_point_that_starts_from_rest_and_comes_to_rest():
    here = scene(speed=[["0 ms", 0.0], ["0.5 ms", "3 m/s"], ["1.5 ms", "3 m/s"], ["1.8 ms", 0.0]])
    rows, entries = point_history(here)
    assert rows[0].mu == 0.0 and rows[-1].mu == 0.0 and max(row.mu for row in rows) > 0.2
    assert rows[-1].slip_m == pytest.approx(3.0 * (0.25 + 1.0 + 0.15) * MS, rel=1e-12)
    assert abs(entries["energy_imbalance"]) < 1e-4
    times = np.array([row.time_s for row in rows])
    for corner in (0.5e-3, 1.5e-3, 1.8e-3):  # steps end there
        assert abs(times - corner).min() < 1e-15
    assert rows[-1].film_height_m < rows[-20].film_height_m  # nothing melts, squeezing goes on


def test_the_columns_and_the_work_of_a_point_follow_its_loads():
    here = scene(speed=RAMP, pressure=RISE)
    rows, entries = point_history(here)
    course = here.load
    for row in rows:
        assert row.speed_m_per_s == course.speeds.at(row.time_s)
        assert row.nominal_pressure_Pa == course.pressures.at(row.time_s)
        assert row.mu == pytest.approx(row.friction_force_N / row.normal_force_N)
    power = [row.friction_force_N * row.speed_m_per_s for row in rows]
    assert rows[-1].friction_work_J == pytest.approx(
        trapezoid(power, [row.time_s for row in rows]), rel=2e-3
    )
    mean = trapezoid([row.mu for row in rows], [row.time_s for row in rows]) / 2e-3
    assert entries["mu_mean"] == pytest.approx(mean, rel=2e-3)
    assert scene_loading(scene()) is None
