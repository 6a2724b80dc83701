"""Sweeps: what is varied, what is computed again, what is written, and how failures are told."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from program import rows_of

import iceslide_fem
from iceslide_fem.runs.checkpoint import write_checkpoint
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.folders import claimed
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.fingerprint import fingerprint, scene_hash, sources_hash
from iceslide_fem.simulate import run as simulate_run
from iceslide_fem.workflow.sweep import make_plan, read_sweep, run_sweep, share_cores
from iceslide_fem.workflow.sweep.plan import value_of
from iceslide_fem.workflow.sweep.plots import charts_of_sweep, plot_sweep
from iceslide_fem.workflow.sweep.processes import Cores, take_over, write_scene
from iceslide_fem.workflow.sweep.report_page import warnings_of
from iceslide_fem.workflow.sweep.table import read_outcome

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
POINT = ["model=point", "ice.heat=column"]
SLICE = ["model=slice", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]


def point_plan(*varied, overrides=()):
    return make_plan([CASE], [*POINT, *overrides], varied)


@pytest.mark.quick
def test_cases_are_all_combinations_the_last_key_fastest():
    plan = point_plan(
        "load.pressure=1bar:5bar:3", "load.speed=1,2 m/s", "ice.heat=column,half-space"
    )
    assert plan.axes["load.pressure"] == (1e5, 3e5, 5e5)
    assert plan.axes["load.speed"] == (1.0, 2.0)
    assert plan.axes["ice.heat"] == ("column", "half-space")
    assert plan.shape == (3, 2, 2)
    loads = [(c.scene.load.pressure, c.scene.load.speed, c.scene.ice.heat) for c in plan.cases]
    assert loads[:3] == [(1e5, 1, "column"), (1e5, 1, "half-space"), (1e5, 2, "column")]
    assert len({case.name for case in plan.cases}) == 12
    assert plan.cases[1].name == "pressure=100kPa__speed=1__heat=half-space"
    close = ["numerics.tolerance=0.01,0.01000000001", "ice.temperature=-4degC,-10degC"]
    assert [case.name for case in point_plan(*close).cases][1:3] == [
        "tolerance=0.01__temperature=-10degC",
        "tolerance=0.01000000001__temperature=-4degC",
    ]


@pytest.mark.quick
def test_a_wider_sweep_takes_over_cases_under_their_new_names(tmp_path):
    """Also unfinished ones; a checkpoint of another scene under a name is removed."""
    (narrow,) = make_plan([CASE], SLICE, ["load.speed=3"]).cases
    wide = make_plan([CASE], SLICE, ["load.speed=3,4", "load.pressure=1bar,2bar"]).cases
    for name, scene in ((narrow.name, narrow.scene), (wide[1].name, wide[2].scene)):
        (tmp_path / "cases" / name).mkdir(parents=True)
        write_checkpoint(tmp_path / "cases" / name, scene, {})
    take_over(tmp_path, wide)
    assert (tmp_path / "cases" / wide[0].name / "checkpoint").is_file()
    assert not (tmp_path / "cases" / narrow.name).exists()
    assert not (tmp_path / "cases" / wide[1].name / "checkpoint").exists()


def test_ranges_carry_units_with_an_offset():
    temperatures = point_plan("ice.temperature=-15degC:-1degC:8").axes["ice.temperature"]
    np.testing.assert_allclose(temperatures, 273.15 + np.arange(-15, 0, 2), rtol=1e-12)


@pytest.mark.quick
@pytest.mark.parametrize(
    ("varied", "words"),
    [
        ([], "give --vary"),
        (["load.presure=1bar,2bar"], "did you mean load.pressure?"),
        (["load.presure=1bar:2bar:3"], "did you mean load.pressure?"),
        (["load.pressure"], "not of the form"),
        (["load.pressure=1bar:2bar"], "first:last:count"),
        (["load.pressure=1bar:2bar:x"], "first:last:count"),
        (["load.pressure=1bar:2bar:1"], "one value from 1bar to 2bar, because a range is first:"),
        (["load.speed=1:0.5:1"], 'write "1" for one value'),
        (["load.speed=0.1:0.3:1"], 'or "0.1:1:4" for 0.1 to 1 in steps of 0.3'),
        (["load.pressure=1bar:2bar:0"], "count of 2 to 100000"),
        (["load.pressure=1bar:2m:3"], 'load.pressure = "2m" has the wrong unit'),
        (["load.pressure=1bar:200bar:3"], "is out of range"),
        (["load.pressure=1bar,"], "load.pressure"),
        (["load.pressure=1bar,1e5"], "is given twice"),
        (["load.pressure=1bar,2bar", "load.pressure=3bar"], "is varied twice"),
        (["model=a:b:3"], "is not a number"),
        (["name=a,b"], "name cannot be varied"),
        (["ice.heat=column,half-space", "ice.motion=attached,sliding"], "contradict each other"),
    ],
)
def test_bad_sweeps_are_one_sentence(varied, words):
    with pytest.raises(SceneError) as caught:
        point_plan(*varied)
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.quick
def test_a_fingerprint_is_of_everything_but_the_name(monkeypatch, tmp_path):
    scene = load_scene(CASE)
    first = fingerprint(scene)
    assert fingerprint(load_scene(CASE, ["name=other"])) == first
    assert fingerprint(load_scene(CASE, ["load.pressure=100 kPa"])) == first
    assert fingerprint(load_scene(CASE, ["load.pressure=1.0001bar"])) != first
    mesh = tmp_path / "a.msh"
    mesh.write_text("one")
    with_mesh = load_scene(CASE, [f"rubber.mesh={mesh}"])
    one = fingerprint(with_mesh)
    mesh.write_text("two")
    assert fingerprint(with_mesh) != one
    table = tmp_path / "contact.csv"
    table.write_text("pressure_Pa,k,D_m,H_V_m\n1e5,0.2,3e-5,3e-6\n5e5,0.4,4e-5,1e-6\n")
    with_table = load_scene(CASE, [f"film.contact={table}"])
    one = fingerprint(with_table)
    table.write_text(table.read_text().replace("0.2", "0.3"))
    assert fingerprint(with_table) != one
    monkeypatch.setattr(iceslide_fem, "__version__", "99")
    assert fingerprint(scene) != first


def test_a_fingerprint_knows_the_sources(monkeypatch, tmp_path):
    """Whoever changes the program gets no results of the old one."""
    scene = load_scene(CASE, POINT)
    first, of_scene, of_sources = fingerprint(scene), scene_hash(scene), sources_hash()
    package = tmp_path / "iceslide_fem"
    shutil.copytree(Path(iceslide_fem.__file__).parent, package)
    monkeypatch.setattr(iceslide_fem, "__file__", str(package / "__init__.py"))
    sources_hash.cache_clear()
    assert sources_hash() == of_sources  # wherever they lie
    with open(package / "film" / "law.py", "a") as file:
        file.write("\n# another law\n")
    sources_hash.cache_clear()
    assert sources_hash() != of_sources
    assert fingerprint(scene) != first and scene_hash(scene) == of_scene
    monkeypatch.undo()
    sources_hash.cache_clear()
    assert fingerprint(scene) == first


def test_points_are_those_of_single_runs(tmp_path):
    plan = point_plan("load.pressure=1bar,5bar", "load.duration=3ms,5ms", "load.speed=3,4")
    dataset = run_sweep(plan, tmp_path, None)
    for case in plan.cases:
        at = {key: value_of(case.scene, key) for key in plan.axes}
        found, (rows, single) = dataset.sel(at), point_history(case.scene)
        for name in ("mu_peak", "mu_mean", "mu_end", "melt_onset_s"):
            expected = np.nan if single[name] is None else single[name]
            assert float(found[name]) == pytest.approx(expected, rel=2e-3, nan_ok=True), name
        assert abs(float(found["energy_imbalance"])) < 1e-4
        time = found["time_share"].values * case.scene.load.duration
        curve = np.interp(time, [row.time_s for row in rows], [row.mu for row in rows])
        np.testing.assert_allclose(found["mu"], curve, rtol=2e-2)
        height = np.interp(
            time, *([getattr(row, key) for row in rows] for key in ("time_s", "film_height_m"))
        )
        np.testing.assert_allclose(found["film_height_m"], height, rtol=2e-2)


@pytest.mark.quick
def test_table_has_a_row_per_case_with_inputs_and_results(tmp_path):
    run_sweep(point_plan("load.pressure=1bar,2bar", "ice.heat=column,half-space"), tmp_path, None)
    rows = rows_of(tmp_path / "sweep.csv")
    assert [row["load.pressure"] for row in rows] == ["100000", "100000", "200000", "200000"]
    assert {row["status"] for row in rows} == {"done"}
    assert all(float(row["mu_peak"]) > 0.2 and row["rubber.compound"] == "B" for row in rows)
    assert all(row["steps"].isdigit() for row in rows)
    dataset = read_sweep(tmp_path)
    assert dataset["mu"].dims == ("load.pressure", "ice.heat", "time_share")
    assert dataset["load.pressure"].attrs["units"] == "Pa"
    assert dataset["mu"].sel({"ice.heat": "column"}).notnull().all()


def test_again_computes_only_what_is_missing(tmp_path):
    five, said = "load.pressure=1bar:5bar:5", []
    first, again, wider = (
        run_sweep(point_plan(*varied), tmp_path, None, said.append)
        for varied in ([five], [five], [five, "load.speed=3,4"])
    )
    counts = [(5, 0), (5, 5), (10, 5)]
    assert said == [f"{all_} cases, {done} of them done before" for all_, done in counts]
    for name in ("mu", "wall_s"):  # the seconds of another run would be others
        np.testing.assert_array_equal(first[name], again[name])
        np.testing.assert_array_equal(first[name], wider[name].sel({"load.speed": 3.0}))
    assert list(first.data_vars) == list(again.data_vars)


def test_points_that_fail_do_not_stop_the_others(tmp_path):
    explicit = ["numerics.film_integrator=explicit-euler", "numerics.max_step=50us"]
    plan = point_plan("load.pressure=1bar:50bar:8", overrides=explicit)
    dataset = run_sweep(plan, tmp_path, None)
    status = dataset["status"].values
    assert set(status) == {"done", "failed"} and status[0] == "done"
    assert np.isnan(dataset["mu_mean"].values[status == "failed"]).all()
    assert all("cannot be advanced" in why for why in dataset["reason"].values[status == "failed"])


def test_cores_are_not_oversubscribed(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(4)))
    assert share_cores(2, None) == Cores(2, 2)
    assert share_cores(1, 3) == Cores(1, 3)
    for wrong in ((2, 3), (5, None), (5, 1)):
        with pytest.raises(SceneError, match="allowed here: 4"):
            share_cores(*wrong)


def test_sweeps_are_not_started_under_mpirun(tmp_path):
    command = [
        sys.executable,
        "-m",
        "iceslide_fem.cli",
        "sweep",
        str(CASE),
        "--vary",
        "model=point",
    ]
    done = subprocess.run(
        command, env=os.environ | {"OMPI_COMM_WORLD_SIZE": "1"}, capture_output=True, text=True
    )
    assert done.returncode == 2 and "--cores-per-case" in done.stderr


def test_pictures_of_one_two_and_three_varied_keys(tmp_path):
    varied = ["load.pressure=1bar,3bar,5bar", "load.speed=2,4", "ice.temperature=-9degC:-1degC:3"]
    for count in (1, 2, 3):
        folder = tmp_path / str(count)
        dataset = run_sweep(point_plan(*varied[:count]), folder, None)
        pictures = plot_sweep(dataset, folder)
        assert len(pictures) == {1: 1, 2: 3, 3: 6}[count]
        assert all(picture.stat().st_size > 10_000 for picture in pictures)


def test_a_chart_says_how_many_of_the_curves_it_shows(tmp_path):
    varied = ["load.speed=1:5:14", "ice.temperature=-15degC:-1degC:3"]
    charts = charts_of_sweep(run_sweep(point_plan(*varied), tmp_path, None))
    (chart,) = charts["mu_by_ice.temperature"]
    assert len(chart.curves) == 12 and chart.says.endswith("12 of 14 combinations are drawn")
    assert [chart.curves[end].name for end in (0, -1)] == ["speed 1 m/s", "speed 5 m/s"]
    mu, height, onset = charts["map_load.speed_ice.temperature"]
    assert np.shape(mu.values) == np.shape(onset.values) == (3, 14)
    assert list(mu.places[1]) == pytest.approx([-15.0, -8.0, -1.0])


def test_auto_chooses_ice_and_model_of_every_case(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(CASE.read_text().replace('heat = "continuum"', 'margin = "0.3 mm"'))
    plan = make_plan([scene], ["model=auto"], ["load.pressure=1bar,2bar"])
    alone = resolved(load_scene(scene, ["model=auto"]))
    assert plan.cases[0].scene == alone and alone.ice.heat == "continuum"
    write_scene(tmp_path / "written.toml", plan.cases[0].scene)
    written = load_scene(tmp_path / "written.toml")
    assert written.ice.heat == "continuum" and written.model == alone.model


def test_pictures_do_not_depend_on_the_order_of_values(tmp_path):
    shown = []
    for values in ("3,1,2", "1,2,3"):
        folder = tmp_path / values
        varied = (f"load.speed={values}", "load.pressure=1bar,3bar")
        plot_sweep(run_sweep(point_plan(*varied), folder, None), folder)
        shown.append((folder / "map_load.speed_load.pressure.png").read_bytes())
    assert shown[0] == shown[1]


def test_what_a_case_left_behind(tmp_path):
    scene = load_scene(CASE, SLICE)
    assert read_outcome(tmp_path, scene).status == "not run"
    (tmp_path / "log.txt").write_text(
        "Note: x\niceslide: it broke\n\niceslide: ended by exit code 3\n"
    )
    outcome = read_outcome(tmp_path, scene)
    assert (outcome.status, outcome.reason) == ("failed", "it broke")
    (tmp_path / "stopped.txt").write_text("the block has left its ice\n")
    assert read_outcome(tmp_path, scene).reason == "the block has left its ice"


def test_another_sweep_is_not_replaced(tmp_path):
    run_sweep(point_plan("load.pressure=1bar:5bar:5"), tmp_path, None)
    plot_sweep(read_sweep(tmp_path), tmp_path)
    table, pictures = (tmp_path / "sweep.csv").read_bytes(), sorted(tmp_path.glob("*.png"))
    narrower = point_plan("load.pressure=1bar,3bar")
    other = point_plan("load.pressure=1bar:5bar:5", overrides=["film.initial_height=80nm"])
    for plan, count in ((narrower, 3), (other, 5)):
        with pytest.raises(SceneError, match=f"holds another sweep \\(of {count} other cases\\)"):
            run_sweep(plan, tmp_path, None)
    assert (tmp_path / "sweep.csv").read_bytes() == table
    assert sorted(tmp_path.glob("*.png")) == pictures
    run_sweep(narrower, tmp_path, None, force=True)
    assert read_sweep(tmp_path).sizes["load.pressure"] == 2 and not [*tmp_path.glob("*.png")]


def test_two_sweeps_do_not_share_a_folder(tmp_path):
    with claimed(tmp_path), pytest.raises(SceneError, match="in use: process"):
        run_sweep(point_plan("load.pressure=1bar,2bar"), tmp_path, None)
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("cut", [0, 100, 3000])
def test_damaged_arrays_are_computed_again(cut, tmp_path):
    plan, said = point_plan("load.pressure=1bar,2bar"), []
    first = run_sweep(plan, tmp_path, None)
    arrays = tmp_path / "sweep.nc"
    arrays.write_bytes(arrays.read_bytes()[:cut])
    again = run_sweep(plan, tmp_path, None, said.append)
    np.testing.assert_array_equal(first["mu"], again["mu"])
    assert "Points are computed again" in said[0] and "0 of them done before" in said[1]


def test_files_that_no_run_of_the_case_wrote_are_none(tmp_path):
    """mu = 42, another pressure, a shorter history, another program: the case runs again."""
    scene = load_scene(CASE, POINT)
    simulate_run(scene, tmp_path)
    assert read_outcome(tmp_path, scene).status == "done"
    summary, history = tmp_path / "summary.json", tmp_path / "history.csv"
    whole, rows = summary.read_text(), history.read_bytes()
    for old, new in (('"mu_peak": 0', '"mu_peak": 42'), ("100000.0", "300000.0")):
        assert old in whole
        summary.write_text(whole.replace(old, new))
        assert read_outcome(tmp_path, scene).status == "not run"
    summary.write_text(whole)
    history.write_bytes(b"".join(rows.splitlines(keepends=True)[:50]))
    assert read_outcome(tmp_path, scene).status == "not run"
    history.write_bytes(rows)
    assert read_outcome(tmp_path, scene).status == "done"
    assert read_outcome(tmp_path, load_scene(CASE, [*POINT, "load.speed=1"])).status == "not run"


@pytest.mark.fe
def test_every_mesh_is_looked_at_before_a_case_runs(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    (tmp_path / "second.msh").write_text("nonsense")
    meshes = (
        f"rubber.mesh={CASE.parent.parent / 'meshes' / 'siped_block.msh'},{tmp_path / 'second.msh'}"
    )
    plan = make_plan([CASE.parent / "user_mesh.toml"], [], [meshes])
    with pytest.raises(SceneError, match="second.msh"):
        run_sweep(plan, tmp_path / "out", Cores(1, 1))
    assert not (tmp_path / "out").exists()


@pytest.mark.fe
def test_slices_run_in_processes_and_failures_are_listed(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    # a rubber of E = 12 kPa carries no pressure of 1 bar: nothing can make it converge
    constants = 'C10 = "0.6 MPa"\nC01 = "1 kPa"\nnu = 0.49'
    film = '\n[film]\nk = 0.32\nD = "36 um"\nH_V = "0.5 um"\n'
    scene = tmp_path / "scene.toml"
    scene.write_text(CASE.read_text().replace('compound = "B"', constants) + film)
    varied = ["--vary", "rubber.C10=0.6MPa,1kPa", "--vary", "load.pressure=1bar"]
    command = [sys.executable, "-m", "iceslide_fem.cli", "sweep", str(scene), *varied]
    for change in [*SLICE, "load.duration=20us"]:
        command += ["--set", change]
    command += ["--out", str(tmp_path), "--cases-at-a-time", "1"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 3, done.stderr
    assert "1 of 2 cases are not done" in done.stderr
    assert "no equilibrium" in done.stdout
    dataset = read_sweep(tmp_path)
    assert dataset["status"].values.tolist() == [["done"], ["failed"]]
    assert np.isfinite(dataset["mu"].values[0]).all()
    times = {path: path.stat().st_mtime for path in tmp_path.glob("cases/*/summary.json")}
    assert len(times) == 1
    again = subprocess.run(command, capture_output=True, text=True)
    assert "1 of them done before" in again.stdout and "1 to run" in again.stdout
    assert times == {path: path.stat().st_mtime for path in tmp_path.glob("cases/*/summary.json")}


DEADLY = """
import os, signal
import numpy as np
from iceslide_fem import Response


class Deadly:
    fields = {}

    def __init__(self, mu=0.3):
        self.mu = mu

    def respond(self, contact, state, surface, dt):
        if self.mu == 0.2:
            os.kill(os.getpid(), signal.SIGKILL)
        return Response(self.mu * contact.pressure, np.full_like(contact.pressure, self.mu))
"""


@pytest.mark.fe
@pytest.mark.parametrize("cores", [1, 2])
def test_a_case_that_kills_its_process_costs_one_case(cores, tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    law = tmp_path / "deadly.py"
    law.write_text(DEADLY)
    changes = [*SLICE, "load.duration=20us", f"friction.law={law}:Deadly"]
    plan = make_plan([CASE], changes, ["friction.parameters.mu=0.1,0.2,0.3"])
    found = run_sweep(plan, tmp_path / "out", Cores(cores, 1))
    assert found["status"].values.tolist() == ["done", "failed", "done"]
    assert "ended by" in str(found["reason"].values[1])
    np.testing.assert_allclose(found["mu_mean"].values[[0, 2]], [0.1, 0.3], rtol=1e-3)


def test_a_sweep_before_any_case_is_done_has_a_page(tmp_path):
    scenes = ["--set", SLICE[0], "--vary", "load.pressure=1bar,2bar"]
    words = [sys.executable, "-m", "iceslide_fem.cli", "sweep", str(CASE), *scenes]
    done = subprocess.run(
        [*words, "--no-run", "--out", str(tmp_path)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "2 not run: not computed yet" in done.stdout and "No variable" not in done.stdout
    assert "0 of them done" in (tmp_path / "report.html").read_text()


def test_it_is_said_where_the_film_law_has_no_dry_friction(tmp_path):
    plan = point_plan("load.speed=0.003,3 m/s", overrides=["ice.temperature=-25degC"])
    for _ in range(2):  # computed, and found
        said = []
        run_sweep(plan, tmp_path, None, said.append)
        assert sum("in 2 of 2 cases the ice does not melt" in line for line in said) == 1
        warnings = [row["warnings"] for row in rows_of(tmp_path / "sweep.csv")]
        assert all("no dry friction" in text for text in warnings)
    said = []
    run_sweep(point_plan("load.speed=3,4 m/s"), tmp_path / "warm", None, said.append)
    assert not any("does not melt" in line for line in said)


def test_the_page_names_the_worst_case_of_a_warning():
    sentences = [f"on {part}% of the contact the ice does not melt: dry" for part in (13, 8, 30)]
    status, reason = (xr.DataArray([text] * 3) for text in ("done", ""))
    data = xr.Dataset({"status": status, "reason": reason})
    (said,) = warnings_of(data, pd.DataFrame({"warnings": sentences}))
    assert said.words.startswith("3 of 3 cases: on 30% of the contact") and "(case 3)" in said.words
    assert "least in case 2: on 8% of the contact" in said.words
