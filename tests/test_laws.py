"""Friction laws: Coulomb's number, a memory, the film by the protocol, and laws that are none."""

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from iceslide_fem.laws.coulomb import Coulomb, read_table
from iceslide_fem.laws.protocol import Contact, Surface
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.point import point_history
from iceslide_fem.runs.simplifications import simplifications
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.scene import load_scene, scene_from_dict
from iceslide_fem.scene.fingerprint import scene_hash
from iceslide_fem.workflow.planning.info import describe
from iceslide_fem.workflow.sweep.plan import make_plan
from iceslide_fem.workflow.sweep.points import simulate_points

ROOT = Path(__file__).parent.parent
LAWS = ROOT / "cases" / "laws"


def history(name, *changes):
    """Columns of a case on the point level."""
    rows, entries = point_history(load_scene(LAWS / f"{name}.toml", ["model=point", *changes]))
    columns = zip(*rows, strict=True)
    return dict(zip(rows[0]._fields, map(np.array, columns), strict=True)), entries


def test_coulomb_is_its_number():
    found, entries = history("coulomb", "friction.mu=0.173")
    np.testing.assert_allclose(found["mu"], 0.173, rtol=1e-15)
    assert entries["mu_mean"] == pytest.approx(0.173, rel=1e-12)
    heat = 0.173 * 1e5 * 3.0 * 2e-3 * 1e-6  # all of it into the ice, which stays below T_m
    assert found["ice_heat_J"][-1] == pytest.approx(heat, rel=1e-12)


def test_ice_melts_under_a_law_that_knows_no_water():
    found, entries = history("coulomb", "friction.mu=1", "load.pressure=3bar")
    assert found["surface_temperature_C"].max() <= 1e-9
    assert found["latent_heat_J"][-1] > 0.1 * found["friction_work_J"][-1]
    assert abs(entries["energy_imbalance"]) < 1e-12 and entries["melt_onset_s"] > 0.0


def test_friction_that_falls_with_temperature_ends_where_its_heat_and_its_warmth_agree():
    found, _ = history("falls_with_temperature", "numerics.tolerance=1e-4")
    expected = 0.03 + 0.27 * -found["surface_temperature_C"] / 4.0
    np.testing.assert_allclose(found["mu"], expected, rtol=1e-6)
    coarse, _ = history("falls_with_temperature", "numerics.tolerance=1e-2")
    off = np.interp(coarse["time_s"], found["time_s"], found["mu"]) / coarse["mu"] - 1.0
    assert np.abs(off[3:]).max() < 1e-2


def test_steps_that_a_point_refuses_are_counted():
    _, entries = history("film_law", "numerics.tolerance=1e-4")
    assert 1 <= entries["rejected_steps"] < 50


@pytest.mark.parametrize("pressure", ["1 bar", "5 bar"])
def test_the_film_law_by_the_protocol_is_the_built_in_one(pressure):
    same = (f"load.pressure={pressure}", "numerics.tolerance=1e-4")
    own, _ = history("film_law", *same)
    built_in, _ = history("film_law", "friction.law=film", *same)
    for column in ("mu", "ice_heat_J", "latent_heat_J"):
        here = np.interp(built_in["time_s"], own["time_s"], own[column])
        scale = built_in[column].max()
        assert np.abs(here - built_in[column])[20:].max() < 1e-3 * scale, column


def test_a_table_is_read_and_interpolated(tmp_path):
    path = tmp_path / "mu.csv"
    rows = [(t, v, 0.1 - 0.02 * t + 0.01 * v) for t in (-10, 0) for v in (0, 4)]
    path.write_text("temperature_C,speed_m_s,mu\n" + "".join(f"{t},{v},{m}\n" for t, v, m in rows))
    law = Coulomb(read_table(path))
    mu = law.coefficient(np.array([268.15, 263.15, 250.0]), np.array([2.0, 4.0, 9.0]))
    np.testing.assert_allclose(mu, [0.22, 0.34, 0.34])
    surface = Surface(np.array([268.15]), np.array([1e-5]), 273.15, np.array([5e5]))
    answer = law.respond(Contact(np.array([1e5]), np.array([2.0])), {}, surface, 1e-4)
    warm = surface.temperature(answer.shear * 2.0) - 273.15
    np.testing.assert_allclose(answer.by_pressure, 0.1 - 0.02 * warm + 0.02, rtol=1e-9)
    path.write_text("temperature_C,speed_m_s,mu\n0,0,0.1\n1,1,0.2\n")
    with pytest.raises(SceneError, match="every combination"):
        read_table(path)


def page_law(folder):
    """The law of the tutorial, in a file."""
    text = (ROOT / "docs" / "tutorials" / "law.md").read_text(encoding="utf-8")
    code = re.search(r"%%writefile polishing.py\n(.*?)```", text, re.DOTALL)[1]
    (folder / "polishing.py").write_text(code, encoding="utf-8")
    return f"friction.law={folder / 'polishing.py'}:Polishing"


def test_the_law_of_the_page_is_exact_and_has_its_column(tmp_path):
    """mu of the work: d work / dt = mu(work) p v has a closed form."""
    changes = [page_law(tmp_path), "friction.parameters.capacity=200.0", "numerics.tolerance=1e-4"]
    scene = load_scene(ROOT / "cases" / "thesis_1bar.toml", ["model=point", *changes])
    rows, _ = point_history(scene)
    time, mu = np.array([(row.time_s, row.mu) for row in rows]).T
    c, worn, rise = 200.0, 0.1, 0.3
    # u = exp(work / c): du/dt = (worn u + rise) P / c, from u = 1
    u = ((worn + rise) * np.exp(worn * 3e5 * time / c) - rise) / worn
    np.testing.assert_allclose(mu, worn + rise / u, rtol=1e-4)
    np.testing.assert_allclose(
        [row.law_work_J_m2 for row in rows], c * np.log(u), rtol=1e-3, atol=1e-3
    )


BAD = """
import numpy as np
from iceslide_fem.laws.protocol import Response

class Law:
    fields = {{"time_s": 0.0}}
    def respond(self, contact, state, surface, dt):
        time = state["time_s"] + dt
        p = contact.pressure
        late = time.max(initial=0.0) > 1e-4
        {fault}
        return Response(0.1 * p, 0.1 + 0.0 * p, {{"time_s": time}})
"""
FAULTS = {
    "if late: p = p * np.nan": "returns a shear that is not finite at 1 points",
    "if late: raise OSError('no data')": "raises OSError: no data",
    "if late: p = p[:0]": r"returns a shear of shape \(0,\); it must be \(1,\)",
    "if late: return 0.1 * p": "returns ndarray instead of a Response",
    "if late: return Response(0.1 * p, 0.1 + 0.0 * p)": "returns another state than its fields",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_law_that_fails_is_named(tmp_path, fault):
    path = tmp_path / "bad.py"
    path.write_text(BAD.format(fault=fault), encoding="utf-8")
    case = ROOT / "cases" / "thesis_1bar.toml"
    scene = load_scene(case, ["model=point", f"friction.law={path}:Law"])
    with pytest.raises(SimulationStopped, match=f"friction law bad.py:Law {FAULTS[fault]}"):
        point_history(scene)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("class Law:\n    fields = {}\n", "has no respond"),
        ("class Law:\n    def respond(self): ...\n", "has no fields"),
        ("class Law:\n    fields = {'a b': 1}\n    def respond(self): ...\n", "needs fields"),
        ("class Other: ...\n", "has no class Law"),
        ("import nowhere\n", "cannot be loaded: ModuleNotFoundError"),
        ("class Law\n", "cannot be loaded: SyntaxError"),
        ("class Law:\n    def __init__(self, a): ...\n", "cannot be made with"),
    ],
)
def test_a_file_that_is_no_law_is_refused(tmp_path, text, words):
    path = tmp_path / "law.py"
    path.write_text(text, encoding="utf-8")
    scene = load_scene(ROOT / "cases" / "thesis_1bar.toml", [f"friction.law={path}:Law"])
    with pytest.raises(SceneError, match=words):
        law_of(scene)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["friction.law=film2"], 'friction.law = "film2" is not known'),
        (["friction.law=none.py:Law"], "there is no file none.py"),
        (["friction.law=coulomb"], "needs one of friction.mu and friction.table"),
        (["friction.mu=0.2"], 'is of friction.law = "coulomb"'),
        (["friction.parameters.a=1"], "of a law in a file"),
    ],
)  # fmt: skip
def test_a_scene_that_names_no_law_is_refused(changes, words):
    with pytest.raises(SceneError, match=words):
        load_scene(ROOT / "cases" / "thesis_1bar.toml", changes)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("-10,2,", r"row 2 \(line 3\): mu = nan; needs finite numbers, and mu of 0 to 10"),
        (",2,0.3", r"row 2 \(line 3\): temperature_C = nan; needs"),
        ("-10,2,11", r"row 2 \(line 3\): mu = 11; needs"),
    ],
)
def test_a_table_with_a_value_that_is_missing_or_too_large_names_its_row(row, words, tmp_path):
    path = tmp_path / "mu.csv"
    path.write_text(f"temperature_C,speed_m_per_s,mu\n-10,1,0.2\n{row}\n", encoding="utf-8")
    with pytest.raises(SceneError, match=words):
        read_table(path)


def test_another_text_of_a_law_is_another_scene(tmp_path):
    path = tmp_path / "law.py"
    hashes = []
    for text in ("class Law: ...\n", "class Law:\n    a = 1\n"):
        path.write_text(text, encoding="utf-8")
        case = ROOT / "cases" / "thesis_1bar.toml"
        hashes.append(scene_hash(load_scene(case, [f"friction.law={path}:Law"])))
    assert hashes[0] != hashes[1]


AGEING = """
import numpy as np
from iceslide_fem.laws.protocol import Response

class Ageing:
    fields = {"fresh": 1.0}
    carrier = "CARRIER"
    def __init__(self, time=1e-3):
        self.time = time
    def respond(self, contact, state, surface, dt):
        touches = contact.pressure > 0.0
        fresh = state["fresh"] / (1.0 + np.where(touches, dt, 0.0) / self.time)
        mu = 0.1 + 0.3 * fresh
        return Response(mu * contact.pressure, mu, {"fresh": fresh})
"""


def ageing(folder, carrier="ice"):
    """A law whose friction falls with the time that a place has been in contact."""
    (folder / "ageing.py").write_text(AGEING.replace("CARRIER", carrier), encoding="utf-8")
    return f"friction.law={folder / 'ageing.py'}:Ageing"


def aged(time, transit, share=1e-3):
    """Its mu below an even block over fresh ice: the mean over ages from 0 to t, or L / v."""
    oldest = np.minimum(time, transit)
    whole = share * (1.0 - np.exp(-oldest / share)) + (transit - oldest) * np.exp(-oldest / share)
    return 0.1 + 0.3 * whole / transit


PASSING = ("model=point", "ice.motion=sliding", "ice.heat=column", "rubber.length=6mm")


def test_a_point_of_passing_ice_has_the_memory_of_its_time_in_contact(tmp_path):
    case = ROOT / "cases" / "thesis_1bar.toml"
    scene = load_scene(case, [*PASSING, ageing(tmp_path), "numerics.tolerance=1e-4"])
    rows, entries = point_history(scene)
    time, mu, fresh = np.array([(row.time_s, row.mu, row.law_fresh) for row in rows]).T
    np.testing.assert_allclose(mu, aged(time, 2e-3), rtol=2e-4)
    np.testing.assert_allclose(0.1 + 0.3 * fresh, aged(time, 2e-3), rtol=1e-3)
    assert entries["mu_mean"] == pytest.approx(trapezoid(mu, time) / 7e-3, rel=1e-3)
    assert rows[-1].nominal_pressure_Pa == 1e5 and rows[-1].speed_m_per_s == 3.0


def test_a_point_of_passing_ice_has_no_memory_of_the_rubber(tmp_path):
    case = ROOT / "cases" / "thesis_1bar.toml"
    with pytest.raises(SceneError, match='Ageing has carrier = "rubber", which contradicts'):
        law_of(load_scene(case, [*PASSING, ageing(tmp_path, "rubber")]))
    with pytest.raises(SceneError, match="and so is its history"):
        load_scene(case, [*PASSING, ageing(tmp_path), "film.carrier=rubber"])
    with pytest.raises(SceneError, match="has carrier = 'water'; allowed"):
        law_of(load_scene(case, [ageing(tmp_path, "water")]))
    coulomb = ("friction.law=coulomb", "friction.mu=0.2", "film.carrier=rubber")
    rows, _ = point_history(load_scene(case, [*PASSING, *coulomb]))
    np.testing.assert_allclose([row.mu for row in rows], 0.2, rtol=1e-12)


def test_what_a_law_does_not_use_is_not_demanded():
    """Rubber without a compound has no k, D and H_V; Coulomb's friction needs none."""
    tables = {
        "name": "c", "model": "slice",
        "rubber": {"C10": "0.2 MPa", "C01": "0.1 MPa", "nu": 0.49},
        "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "1 ms"},
        "friction": {"law": "coulomb", "mu": 0.2},
    }  # fmt: skip
    scene = scene_from_dict(tables)
    found = {row.quantity: row.value for row in describe(scene)}
    assert found["friction at t = 0"] == "0.2" and "k" not in found
    assert notes(scene) == [] and simplifications(scene).bending.effect < 1e-9
    rows, _ = point_history(scene_from_dict(tables | {"model": "point"}))
    assert rows[-1].mu == pytest.approx(0.2)
    with pytest.raises(SceneError, match="film.k, film.D and film.H_V are missing"):
        scene_from_dict(tables | {"friction": {}})


def test_estimates_are_those_of_the_law():
    """Friction that falls with the temperature is higher where the pressure is lower."""
    scene = load_scene(LAWS / "falls_with_temperature.toml", ["model=slice", "load.duration=0.2ms"])
    found = simplifications(scene)
    assert 1e-3 < found.bending.effect < 0.3
    without = load_scene(LAWS / "coulomb.toml", ["friction.mu=0"])
    assert all(abs(one.effect) < 0.1 for one in simplifications(without))


def test_parameters_of_a_law_are_varied_by_a_sweep(tmp_path):
    case = ROOT / "cases" / "thesis_1bar.toml"
    given = ["model=point", "load.duration=1ms", page_law(tmp_path)]
    varied = ["friction.parameters.capacity=50:200:2", "load.pressure_scale=1,2"]
    plan = make_plan([case], given, varied)
    assert plan.axes == {
        "friction.parameters.capacity": (50.0, 200.0),
        "load.pressure_scale": (1.0, 2.0),
    }
    found = [case.summary["mu_mean"] for case in simulate_points([c.scene for c in plan.cases])]
    assert found[0] > found[1] and found[2] > found[3]  # more work polishes more
    assert found[2] > found[0] and len({case.name for case in plan.cases}) == 4
    laws = make_plan(
        [case], given[:2], [f"friction.law=film,{page_law(tmp_path).partition('=')[2]}"]
    )
    assert [c.scene.friction.law[-9:] for c in laws.cases] == ["film", "Polishing"]
    for wrong, words in (
        ("friction.parameters.capacitty=1,2", "unexpected keyword argument 'capacitty'"),
        ("friction.parameters.capacity=nan,2", "input should be a finite number"),
        ("friction.parameters.capacity=1J,2", 'friction.parameters.capacity = "1J" is not'),
    ):
        with pytest.raises(SceneError, match=words):
            make_plan([case], given, [wrong])
