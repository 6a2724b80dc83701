"""Sweeps over several scenes, and over keys that go together."""

import json

import numpy as np
import pytest
from program import exit_code

import iceslide_fem
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.workflow.report import page_of
from iceslide_fem.workflow.sweep import make_plan

pytestmark = pytest.mark.quick

SCENE = """
name = "first"
model = "point"
[rubber]
C10 = "0.2 MPa"
C01 = "0.1 MPa"
nu = 0.49
length = "2 mm"
[load]
pressure = "1 bar"
speed = "2 m/s"
duration = "1 ms"
[film]
k = 0.3
D = "600 um"
H_V = "2 um"
"""
ROWS = """\
name, rubber.C10 (MPa), rubber.C01, film.k
soft, 0.1, 0.05 MPa, 0.4
hard, 0.4, 0.2 MPa,
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "first.toml").write_text(SCENE, encoding="utf-8")
    second = 'base = "first.toml"\nname = "second"\n[load]\nspeed = "4 m/s"\n'
    (tmp_path / "second.toml").write_text(second, encoding="utf-8")
    (tmp_path / "compounds.csv").write_text(ROWS, encoding="utf-8")
    return tmp_path


def test_several_scenes_are_a_dimension(folder, capsys):
    words = ["sweep", "first.toml", "second.toml", "--vary", "ice.temperature=-8degC,-4degC"]
    assert exit_code(*words, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["folder"] == "results/scenes-sweep"
    names = [case["case"] for case in found["cases"]]
    assert names[0] == "scene=first__temperature=-8degC" and len(names) == 4
    data = iceslide_fem.read_sweep("results/scenes-sweep")
    assert data["mu_mean"].dims == ("scene", "ice.temperature")
    alone = iceslide_fem.run("second.toml", pictures=False).attrs["mu_mean"]
    mine = data["mu_mean"].sel({"scene": "second", "ice.temperature": 269.15})
    assert float(mine) == pytest.approx(alone)
    again = str(page_of([folder / "results" / "scenes-sweep"]))
    assert "iceslide sweep first.toml second.toml" in again
    assert exit_code(*words, "-q") == 0


def test_keys_that_go_together_are_rows_of_a_table(folder, capsys):
    words = ["sweep", "first.toml", "--rows", "compounds.csv", "--vary", "load.speed=1,2"]
    assert exit_code(*words) == 0 and "4 cases" in capsys.readouterr().out
    data = iceslide_fem.read_sweep("results/first-sweep")
    assert data["mu_mean"].dims == ("load.speed", "compounds")
    assert list(data["compounds"].values) == ["soft", "hard"]
    np.testing.assert_allclose(data["rubber.C10"], [1e5, 4e5])
    np.testing.assert_allclose(data["film.k"], [0.4, 0.3])  # an empty cell is the scene's value
    assert data["rubber.C01"].attrs["units"] == "Pa" and data["rubber.C01"].dims == ("compounds",)
    assert "--rows compounds.csv" in str(page_of([folder / "results" / "first-sweep"]))
    python = iceslide_fem.sweep("first.toml", rows="compounds.csv", out="python")
    same = data["mu_mean"].sel({"load.speed": 2.0})
    np.testing.assert_array_equal(python["mu_mean"], same)


def test_keys_that_go_together_are_a_tuple_in_python(folder):
    vary = {("rubber.C10", "film.k"): [("0.1 MPa", 0.4), (4e5, np.float64(0.3))]}
    found = iceslide_fem.sweep(["first.toml", "second.toml"], vary)
    assert found["mu_mean"].dims == ("scene", "rubber.C10,film.k")
    np.testing.assert_allclose(found["rubber.C10"], [1e5, 4e5])
    assert list(found["rubber.C10,film.k"].values) == ["0.1 MPa, 0.4", "400000.0, 0.3"]
    cases = found["case"].values.ravel()
    assert cases[0] == "scene=first__C10-k=0.1-MPa-0.4"
    one = found["mu_mean"].sel({"scene": "first"}).isel({"rubber.C10,film.k": 1})
    base = iceslide_fem.load_scene("first.toml", {"rubber.C10": 4e5})
    alone = iceslide_fem.run(base, "alone", pictures=False)
    assert float(one) == pytest.approx(alone.attrs["mu_mean"])


def test_files_in_a_table_are_relative_to_it(folder):
    (folder / "tables").mkdir()
    (folder / "tables" / "load.csv").write_text("time (ms), pressure (bar)\n0, 1\n1, 3\n")
    (folder / "tables" / "loads.csv").write_text("load.pressure;load.speed\nload.csv;1\n1 bar;2\n")
    plan = make_plan([folder / "first.toml"], [], [], [folder / "tables" / "loads.csv"])
    first, second = (case.scene.load for case in plan.cases)
    assert first.pressures.largest == pytest.approx(3e5) and second.pressure == 1e5


@pytest.mark.parametrize(
    "table, words",
    [
        ("rubber.C10\n", "has no rows below its headings"),
        ("rubber.C11\n1\n", "rubber.C11 is not a known key"),
        ("rubber C10\n1\n", 'has the heading "rubber C10"; allowed: a key'),
        ("rubber.C10,rubber.C01\n1\n", "row 2 of .*table.csv has 1 cells; allowed: 2"),
        ("rubber.C10\n1 MPa\n1 MPa\n", "table has the row 1 MPa twice"),
        ("rubber.C10\n1 K\n", "rubber.C10 = "),
        ("load.speed,film.k\n1,0.2\n", "load.speed is varied twice"),
    ],
)
def test_a_table_that_cannot_be_is_one_sentence(folder, table, words):
    (folder / "table.csv").write_text(table, encoding="utf-8")
    with pytest.raises(SceneError, match=words):
        make_plan([folder / "first.toml"], [], ["load.speed=1,2"], [folder / "table.csv"])


def test_scenes_and_rows_that_cannot_be_told_apart(folder):
    first, second = folder / "first.toml", folder / "second.toml"
    with pytest.raises(SceneError, match="two scenes are named first"):
        make_plan([first, second, first], [], [])
    with pytest.raises(SceneError, match="a sweep varies something"):
        make_plan([first], [], [])
    (folder / "status.csv").write_text("film.k\n0.2\n")
    with pytest.raises(SceneError, match="has a name status of its own; give the rows another"):
        make_plan([first], [], [], [folder / "status.csv"])
    with pytest.raises(SceneError, match=r"has the row \[1, 2\]; allowed: 1 values"):
        iceslide_fem.sweep(first, {("film.k",): [(1, 2)]})
    with pytest.raises(SceneError, match="cannot read the table of rows .*none.csv"):
        iceslide_fem.sweep(first, rows="none.csv")
