"""k, D and H_V at the contact's own age: the hereditary integral, points, sweeps, wrong input."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad

from iceslide_fem.film.conditions import (
    scene_conditions,
    scene_loading,
    simulation_settings,
    varied_conditions,
)
from iceslide_fem.film.contact_age import ContactAge, contact_age
from iceslide_fem.film.point import simulate
from iceslide_fem.film.point_conditions import Loading
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import as_map
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.survey import survey
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene, scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import CONTACT_TABLES
from iceslide_fem.workflow.planning.info import describe
from iceslide_fem.workflow.sweep.points import simulate_points
from iceslide_fem.workflow.sweep.table import SAMPLES

pytestmark = pytest.mark.quick

TAU, G = 5e-3, 0.3
ONE = Prony((G,), (TAU,))
TABLE = CONTACT_TABLES["B"]
STANDARD = ContactAge(TABLE, Relaxation(ONE))
AGED = {"contact_age": True}
SURFACE = str(Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv")


def scene(arms=((G, TAU),), pressure=2e5, celsius=-4.0, film=AGED, load=(), rubber=(), **tables):
    """A point of compound B whose table has Young's modulus 3 G0 exactly."""
    return scene_from_dict(
        {
            "name": "aged",
            "model": "point",
            "rubber": {"compound": "B", "prony": arms, "modulus_is": "instantaneous"}
            | dict(rubber),
            "load": {"pressure": pressure, "speed": 4.0, "duration": 5e-3} | dict(load),
            "ice": {"temperature": celsius + 273.15},
            "film": dict(film),
            **tables,
        }
    )


def creep(time):
    """E_0 J of the standard linear solid."""
    return 1.0 + G / (1.0 - G) * -np.expm1(-np.asarray(time) * (1.0 - G) / TAU)


def aged(times, pressures, age=STANDARD, temperature=273.15):
    """The contact's history at the end of lines between pressures (Pa) at times (s)."""
    history = age.after(age.fresh(1), *np.full((2, 1), pressures[0]), np.zeros(1))
    for i in range(1, len(times)):
        start, end = np.array([pressures[i - 1]]), np.array([pressures[i]])
        reduced = age.relaxation.reduced(np.array([times[i] - times[i - 1]]), temperature)
        history = age.after(history, start, end, reduced)
    return history


@pytest.mark.parametrize(("time", "expected"), [(0.0, 1.0), (TAU, 1.215749), (1e3, 1.428571)])
def test_a_step_of_pressure_creeps_as_the_standard_linear_solid(time, expected):
    assert creep(time) == pytest.approx(expected, abs=1e-6)
    history = aged([0.0, 0.0, time], [0.0, 2e5, 2e5])
    felt = STANDARD.so_far(history).equivalent(np.array([2e5]))
    assert felt == pytest.approx(2e5 * expected, rel=1e-6)
    here = STANDARD.under_constant(np.array([2e5]), np.array([time]), np.array([270.0]))
    assert here.k == pytest.approx(TABLE(felt).k, rel=1e-12)


@pytest.mark.parametrize("time", [2.5e-3, 5e-3, 20e-3])
def test_a_ramp_in_5_ms_is_the_hereditary_integral(time):
    """Also of a sphere of 1 mm: a^3 = (3/16) R F J of a ramp to 10 mN."""
    rate, ends = 1.0 / 5e-3, min(time, 5e-3)
    expected = quad(lambda s: rate * creep(time - s), 0.0, ends)[0]
    times, forces = [0.0, 5e-3, 20e-3], [0.0, 1.0, 1.0]
    before = [t for t in times if t < time]
    history = aged([*before, time], [*forces[: len(before)], ends * rate])
    felt = float(STANDARD.so_far(history).equivalent(np.array([ends * rate]))[0])
    assert felt == pytest.approx(expected, rel=1e-12)
    radius = {2.5e-3: 122.3610e-6, 5e-3: 156.6950e-6, 20e-3: 168.4072e-6}[time]
    sphere = (3.0 / 16.0 * 1e-3 * 10e-3 * felt / 546e3) ** (1.0 / 3.0)
    assert sphere == pytest.approx(radius, rel=1e-6)


def test_falling_pressure_keeps_the_largest_contact_until_it_opens():
    loaded = aged([0.0, 1e-3], [2e5, 2e5])
    largest = float(loaded[0, 0])
    falling = aged([0.0, 1e-3, 2e-3], [2e5, 2e5, 1e5])
    assert falling[0, 0] == largest == pytest.approx(2e5 * creep(1e-3))
    contact = STANDARD.so_far(falling)
    k, slope = contact.contact_area(np.array([1e5]))
    assert (k, slope) == (TABLE(largest).k, 0.0)
    again = aged([0.0, 1e-3, 2e-3, 3e-3, 4e-3], [2e5, 2e5, 0.0, 0.0, 1e5])
    assert again[0, 0] == pytest.approx(1e5 + G / (1.0 - G) * again[1, 0])
    assert again[0, 0] < largest
    passing = replace(STANDARD, holds=False)
    assert aged([0.0, 1e-3, 2e-3], [2e5, 2e5, 1e5], passing)[0, 0] == 0.0


def test_k_follows_a_rising_pressure_as_its_derivative_says():
    history = aged([0.0, 1e-3, 2e-3], [1e5, 1.5e5, 2e5])
    contact, p = STANDARD.so_far(history), np.array([2e5])
    (up, slope), (down, _) = contact.contact_area(p + 10.0), contact.contact_area(p - 10.0)
    assert down == contact.contact_area(p)[0]  # the largest is held
    assert slope == pytest.approx((up - contact.contact_area(p)[0]) / 10.0, rel=1e-4)


def test_cold_rubber_is_younger():
    shift = Shift(7.4005, 121.6, 293.15)
    age = ContactAge(TABLE, Relaxation(ONE, shift))
    p, t = np.full(2, 2e5), np.full(2, 0.1)
    k = age.under_constant(p, t, np.array([253.15, 269.15])).k
    ratio = 10.0 ** (3.628 - 1.820)
    assert k[0] == pytest.approx(
        float(age.under_constant(p[:1], t[:1] / ratio, np.array([269.15])).k[0]), rel=1e-4
    )
    assert TABLE(2e5).k < k[0] < k[1]


class Reference(Loading):
    """k, D and H_V at p_e(t), from nothing but the closed form of the compliance."""

    def at(self, here, time, age):
        modulus = CONTACT_TABLES["B"].youngs_modulus
        k, D, H_V, _ = TABLE(modulus / (3.0 * 546e3) * here.pressure * creep(time))
        return here._replace(k=k, D=D, H_V=H_V)


def test_a_point_is_that_with_k_over_time():
    here = scene(numerics={"tolerance": 1e-4})
    settings = simulation_settings(here) | {"times": np.linspace(0.0, 5e-3, 11)}
    found = simulate(scene_conditions(here), **settings)
    fine = settings | {"loading": Reference(None, None, TABLE), "fixed_step": 5e-6}
    expected = simulate(scene_conditions(here), **fine)
    np.testing.assert_allclose(found.samples, expected.samples, rtol=1e-3)
    assert found.mu_mean == pytest.approx(expected.mu_mean, rel=1e-4)


def test_steps_keep_the_tolerance():
    arms = [[0.2, 1e-6], [0.2, 1e-4], [0.2, 1e-2]]
    times = np.linspace(0.0, 5e-3, 21)
    exact = simulate(
        scene_conditions(fine := scene(arms, numerics={"tolerance": 1e-5})),
        **simulation_settings(fine) | {"times": times},
    ).samples
    for tolerance in (1e-2, 1e-3):
        here = scene(arms, numerics={"tolerance": tolerance})
        found = simulate(scene_conditions(here), **simulation_settings(here) | {"times": times})
        assert np.abs(found.samples / exact - 1.0).max() < 1.2 * tolerance


def test_arms_of_any_time_can_be_stepped_over():
    """Fifty of them, most faster than anything that happens: they are in the modulus at first."""
    arms = [[0.019, time] for time in np.geomspace(1e-15, 1e10, 50)]
    _, results = point_history(scene(arms, numerics={"tolerance": 1e-4}))
    assert results["steps"] < 1000
    rows = [[0.0, 2e5], [5e-3, 2.000001e5]]
    _, course = point_history(scene(arms, load={"pressure": rows}))
    assert course["mu_mean"] == pytest.approx(results["mu_mean"], rel=1e-3)


@pytest.mark.parametrize("dry", [{}, {"dry_stress": 3.3e5, "dry_softening": 10.0}])
def test_rubber_of_one_modulus_is_elastic(tmp_path, dry):
    """As slow as never, and as fast as at once: the film law with E_0, and with E_inf."""
    for tau, share in ((1e12, 1.0), (1e-14, 1.0 - G)):
        table = TABLE.at_modulus(share * 3.0 * 546e3)
        columns = [table.pressure, table.k.values, table.D.values, table.H_V.values]
        lines = [",".join(map(repr, row)) for row in zip(*columns, strict=True)]
        (tmp_path / "t.csv").write_text("pressure_Pa,k,D_m,H_V_m\n" + "\n".join(lines))
        elastic = scene(film={"contact": str(tmp_path / "t.csv"), **dry}, celsius=-10.0)
        slow = scene([[G, tau]], film=AGED | dry, celsius=-10.0)
        (one, first), (two, second) = (point_history(each) for each in (slow, elastic))
        assert first["mu_mean"] == pytest.approx(second["mu_mean"], rel=1e-3)
        assert first["mu_end"] == pytest.approx(second["mu_end"], rel=1e-3)


def test_a_course_of_pressure_is_its_hereditary_integral():
    """Rising by lines, with a hold; and held where it falls."""
    rows = [[0.0, 1e5], [2e-3, 3e5], [4e-3, 3e5], [5e-3, 1.5e5]]
    here = scene(load={"pressure": rows})
    found, _ = point_history(here)
    time, k = np.array([(row.time_s, row.contact_area_fraction) for row in found]).T

    def felt(t):
        rate = 1e5 / 1e-3
        return 1e5 * creep(t) + quad(lambda s: rate * creep(t - s), 0.0, min(t, 2e-3))[0]

    expected = here.contact_parameters(np.array([felt(min(t, 4e-3)) for t in time]))
    rising = time <= 4e-3
    assert np.count_nonzero(rising) > 20
    np.testing.assert_allclose(k[rising], expected.k[rising], rtol=1e-6)
    np.testing.assert_allclose(k[~rising], expected.k[~rising], rtol=1e-3)
    assert (np.diff(k) >= 0.0).all()


def test_a_viscosity_over_temperature_and_the_age_go_together():
    water = {"viscosity": [[263.15, 2.6e-3], [273.15, 1.8e-3]]}
    rows, results = point_history(scene(water=water))
    _, young = point_history(scene([[G, 1e9]], water=water))
    assert young["mu_mean"] < results["mu_mean"] < 1.1 * young["mu_mean"]
    assert rows[-1].contact_area_fraction == pytest.approx(
        float(scene().contact_parameters(2e5 * creep(5e-3)).k)
    )


def test_every_pass_begins_a_contact():
    rows, _ = point_history(scene(load={"passes": 2, "period": 1e-2}))
    starts = [row.contact_area_fraction for row in rows if row.step_s == 0.0]
    assert starts == pytest.approx([float(scene().contact_parameters(2e5).k)] * 2)


def test_a_call_of_many_is_each_alone():
    scenes = [scene(pressure=p, celsius=T) for p in (1e5, 3e5) for T in (-2.0, -10.0)]
    scenes += [scene([[G, 1e-3]]), scene(film={})]
    outcomes = simulate_points(scenes)
    # those of a call share its seconds
    calls = Counter(outcome.summary["wall_s"] for outcome in outcomes)
    assert sorted(calls.values()) == [1, 1, 4]
    for one, outcome in zip(scenes, outcomes, strict=True):
        rows, single = point_history(one)
        assert outcome.summary["mu_mean"] == pytest.approx(single["mu_mean"], rel=1e-3)
        time = np.linspace(0.0, 5e-3, SAMPLES)
        film = np.interp(time, [r.time_s for r in rows], [r.film_height_m for r in rows])
        np.testing.assert_allclose(outcome.curves["film_height_m"], film, rtol=1e-2)


def test_conditions_vary_with_an_age_of_their_own():
    wlf = {"wlf": {"C1": 7.4005, "C2": 121.6, "reference": 293.15}}
    base, pressures, kelvin = scene(rubber=wlf), [1e5, 3e5], [271.15, 258.15]
    many = varied_conditions(base, pressure=pressures, temperature=kelvin)
    found = simulate(many, loading=scene_loading(base))
    for number, (p, T) in enumerate(zip(pressures, kelvin, strict=True)):
        one = scene(pressure=p, celsius=T - 273.15, rubber=wlf)
        _, single = point_history(one)
        assert found.mu_mean[number] == pytest.approx(single["mu_mean"], rel=2e-3)
    with pytest.raises(ValueError, match="k follows the contact's age"):
        varied_conditions(base, k=0.3)


def test_a_table_says_its_modulus_or_the_scene_does(tmp_path):
    head, rows = "pressure_Pa,k,D_m,H_V_m", ["1e5,0.3,3e-5,3e-6", "5e5,0.5,4e-5,1e-6"]
    file = tmp_path / "t.csv"
    file.write_text("\n".join([f"{head},youngs_modulus_Pa", *(f"{row},2e6" for row in rows)]))
    found = scene(film=AGED | {"contact": str(file)}).contact_parameters
    assert found.pressure == pytest.approx([1e5 * 3 * 546e3 / 2e6, 5e5 * 3 * 546e3 / 2e6])
    file.write_text("\n".join([head, *rows]))
    film = AGED | {"contact": str(file), "contact_modulus": "2 MPa"}
    assert scene(film=film).contact_parameters.pressure == found.pressure
    long_term = scene(film=film, rubber={"modulus_is": "long-term"})
    assert long_term.contact_parameters.pressure[0] == pytest.approx(found.pressure[0] / 0.7)
    assert contact_age(scene(film={})) is None


OWN = {"compound": None, "C10": 1.6e6, "C01": 1.0e6, "nu": 0.49, "prony": None, "modulus_is": None}
SOFT = OWN | {"prony": [[0.3, "1 ms"], [0.2, "1 s"]]}


def test_a_table_of_another_rubber_is_read_at_the_same_p_over_e(tmp_path):
    """Without an age contact is old: at the long-term modulus, as the age is after a long time."""
    surface = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
    table, film = read_contact_table(surface, "it"), {"contact": str(surface)}
    stiff = scene(film=film, rubber=OWN).contact_parameters
    for p in (2e4, 2e5):
        at_p, like = stiff(p), table(p * 1.64e6 / (6.0 * 2.6e6))
        np.testing.assert_allclose(at_p[:3], like[:3], rtol=1e-12)
    for modulus_is, left in (("long-term", 1.0), ("instantaneous", 0.5)):
        rubber = SOFT | {"modulus_is": modulus_is}
        old = float(scene(film=film, rubber=rubber).contact_parameters(2e5).k)
        assert old == pytest.approx(float(table(2e5 * 1.64e6 / (left * 6.0 * 2.6e6)).k), rel=1e-12)
        age = contact_age(scene(film=film | AGED, rubber=rubber))
        aged = age.under_constant(*(np.array([value]) for value in (2e5, 1e9, 269.15)))
        assert old == pytest.approx(aged.k[0], rel=1e-9)
    # A table that says nothing of its rubber stands, and so does that of a compound.
    bare = tmp_path / "bare.csv"
    bare.write_text("pressure_Pa,k,D_m,H_V_m\n1e5,0.3,3e-5,3e-6\n5e5,0.5,4e-5,1e-6\n")
    assert scene(film={"contact": str(bare)}, rubber=OWN).contact_parameters(1e5).k == 0.3
    said = {"contact": str(bare), "contact_modulus": "15.6 MPa"}
    assert scene(film=said, rubber=OWN).contact_parameters(1e5).k == pytest.approx(0.3, rel=1e-9)
    own = {"compound": "B", "prony": None, "modulus_is": None}
    assert scene(film={}, rubber=own).contact_parameters == CONTACT_TABLES["B"]
    assert scene(film=film, rubber=own).contact_parameters == table
    scaled = [
        row.value for row in describe(scene(film=film, rubber=OWN)) if "scaled" in row.quantity
    ]
    assert scaled == ["1.64 MPa to 15.6 MPa"]
    assert not any("scaled" in row.quantity for row in describe(scene(film=film, rubber=own)))
    both = {"contact": str(surface), "contact_modulus": "2 MPa"}
    with pytest.raises(SceneError, match="given: both of the file's column"):
        scene(film=both, rubber=OWN)


def test_wrong_input_is_one_sentence(tmp_path):
    file = tmp_path / "t.csv"
    file.write_text("pressure_Pa,k,D_m,H_V_m\n1e5,0.3,3e-5,3e-6\n5e5,0.5,4e-5,1e-6\n")
    constants = {"k": 0.3, "D": 3e-5, "H_V": 3e-6}
    for changes, said in (
        ({"rubber": {"prony": None, "modulus_is": None}}, "give rubber.prony"),
        ({"film": AGED | constants}, "film.contact_age = true and film.k contradict"),
        ({"friction": {"law": "coulomb", "mu": 0.2}}, 'friction.law = "coulomb" contradict'),
        ({"film": AGED | {"contact": str(file)}}, "given: none of the file's column"),
        ({"film": {"contact_modulus": 1e6}}, "is that of film.contact, which is missing"),
        ({"film": AGED | {"contact_modulus": 1e6}}, "is that of film.contact, which is missing"),
        ({"film": {"contact_age": "yes"}}, "film.contact_age"),
    ):
        with pytest.raises(SceneError, match=said) as error:
            scene(**changes)
        assert "\n" not in str(error.value)
    file.write_text(
        "pressure_Pa,k,D_m,H_V_m,youngs_modulus_Pa\n1e5,0.3,3e-5,3e-6,1e6\n5e5,0.5,4e-5,1e-6,2e6\n"
    )
    with pytest.raises(SceneError, match="the same in all rows"):
        scene(film=AGED | {"contact": str(file)})


def test_a_written_scene_keeps_its_keys(tmp_path):
    given = scene()
    assert scene_from_dict(given.as_dict()) == given
    (tmp_path / "s.toml").write_text(
        'name = "a"\nmodel = "point"\n[rubber]\ncompound = "B"\nprony = [[0.3, "5 ms"]]\n'
        'modulus_is = "instantaneous"\n[load]\npressure = "2 bar"\nspeed = "4 m/s"\n'
        'duration = "5 ms"\n[film]\ncontact_age = true\n'
    )
    assert load_scene(tmp_path / "s.toml").film.contact_age


ARMS = [[0.2, 1e-5], [0.2, 1e-3]]
RIDE = Ride(4.0, 4.0, 269.15)


def passed(line, here, tolerance=1e-4, dx=1e-4, ride=RIDE):
    """mu of every pixel of a line (Pa) that ice meets from the right, as it meets them."""
    ride = ride._replace(age=replace(contact_age(here), holds=False))
    footprint = as_map(line, dx)
    found = film_map(footprint, ride, here.contact_parameters, tolerance)
    return found.friction(footprint)[0, ::-1]


@pytest.mark.parametrize("arms", [ARMS, [[0.4, 1e-14]]])
def test_a_footprint_of_one_pressure_is_a_point(arms):
    """The rubber passes through it with nine tenths of the speed of the ice."""
    slower = [[g, tau / 0.9] for g, tau in arms]
    here = scene(arms, numerics={"tolerance": 1e-4})
    times = (np.arange(2000.0) + 0.5) * 2.5e-6
    ride, young = RIDE._replace(speed=10.0 * RIDE.sliding_speed), scene(slower)
    mu = passed(np.full(200, 2e5), young, dx=1e-3, ride=ride)
    settings = simulation_settings(here) | {"times": times}
    exact = simulate(scene_conditions(here), **settings).samples[:, 0]
    np.testing.assert_allclose(mu, exact.reshape(200, 10).mean(axis=1), rtol=1e-3)


def test_pixels_of_any_size_creep_alike_also_behind_a_gap():
    """Pressure in steps, and a gap in which the rubber recovers: sampled twice as finely."""
    here = scene(ARMS, film=AGED | {"contact": SURFACE})
    line = np.repeat([2e5, 3e5, 0.0, 1e5, 2e5], 20)[::-1]
    coarse, fine = passed(line, here), passed(np.repeat(line, 2), here, dx=5e-5)
    pairs = fine.reshape(-1, 2).mean(axis=1)
    np.testing.assert_allclose(coarse, pairs, rtol=5e-3)
    elastic = scene([[1e-9, 1.0]], film=AGED | {"contact": SURFACE})
    assert (coarse[:20] > 1.05 * passed(line, elastic)[:20]).all()


def test_the_command_takes_the_age_of_a_scene(tmp_path):
    scenes = {"aged": 'contact_age = true\ncontact = "surface.csv"', "plain": ""}
    (tmp_path / "surface.csv").write_bytes(Path(SURFACE).read_bytes())
    for name, film in scenes.items():
        (tmp_path / f"{name}.toml").write_text(
            'name = "a"\nmodel = "point"\n[rubber]\ncompound = "B"\nprony = [[0.3, "0.1 ms"]]\n'
            'modulus_is = "instantaneous"\nwlf = {C1 = 7.4, C2 = 121.6, reference = "20 degC"}\n'
            '[load]\npressure = "2 bar"\nspeed = "4 m/s"\nduration = "5 ms"\n[film]\n' + film
        )
    aged, plain = (str(tmp_path / f"{name}.toml") for name in scenes)
    pressure = np.zeros((12, 40))
    pressure[:, 2:20], pressure[:, 24:38] = 2e5, 2.5e5
    np.savetxt(tmp_path / "map.csv", pressure, delimiter=",")
    given = {"pressure_map": str(tmp_path / "map.csv"), "length": "40mm", "width": "12mm"}
    case = FootprintCase.of(given | {"contact_age": aged})
    assert not case.ride().age.holds
    assert case.law.contact_parameters == load_scene(aged).contact_parameters
    same = FootprintCase.of(given | {"contact": SURFACE})
    older, young = (survey(one, read_footprint(one)).mu_mean for one in (case, same))
    assert older > 1.01 * young
    for wrong, said in (
        ({"contact_age": plain}, "does not age"),
        ({"contact_age": aged, "contact": SURFACE}, "--contact and --contact-age contradict"),
        ({"contact_age": str(tmp_path / "none.toml")}, "--contact-age"),
    ):
        with pytest.raises(SceneError, match=said):
            FootprintCase.of(given | wrong)


def test_info_says_k_at_both_ends():
    rows = {row.quantity: row for row in describe(scene())}
    k = [float(scene().contact_parameters(2e5 * creep(t)).k) for t in (0.0, 5e-3)]
    assert [rows[name].value for name in ("k", "k at the end")] == [f"{one:.3g}" for one in k]
    assert "5 ms old" in rows["k at the end"].meaning
    assert rows["compliance at the end"].value == "1.22"
    passing = scene(ice={"motion": "sliding", "temperature": 269.15}, rubber={"length": 4e-3})
    rows = {row.quantity: row for row in describe(passing)}
    assert "1 ms old" in rows["k at the end"].meaning


def test_shipped_tables_say_their_modulus():
    for name, modulus in (("A", 1.10e6), ("B", 1.64e6), ("C", 2.04e6)):
        file = Path(SURFACE).with_name(f"compound_{name}.csv")
        assert read_contact_table(file, "table").youngs_modulus == modulus


def test_a_table_that_begins_too_high_for_fresh_contact_is_in_doubt():
    """Fresh contact at 2 bar is that of a fiftieth of it in long-term rubber."""
    stiff = scene(((0.98, TAU),), rubber={"modulus_is": "long-term"})
    assert "decides k of fresh contact: a table from 0.04 bar on" in str(stiff.outside_table())
    assert scene().outside_table() is None
