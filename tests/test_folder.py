"""What may be replaced in a folder: repeats only; never what is no result, nor what is in use."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from program import exit_code

from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.folders import check_folder, claimed, clear_results
from iceslide_fem.scene import load_scene
from iceslide_fem.simulate import run

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
POINT = ["model=point", "ice.heat=column", "numerics.tolerance=1e-2"]
WORDS = [word for change in POINT for word in ("--set", change)]


def point(*changes):
    return load_scene(CASE, [*POINT, *changes])


def content(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_same_scene_again_replaces_its_results(tmp_path):
    for _ in range(2):
        assert exit_code("run", CASE, *WORDS, "--out", tmp_path / "out") == 0
    assert not (tmp_path / "out" / ".lock").exists()


def test_another_scene_is_refused_and_named(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert exit_code("run", CASE, *WORDS) == 0
    before = content(tmp_path)
    assert exit_code("run", CASE, *WORDS, "--set", "load.pressure=3bar") == 2
    said = capsys.readouterr().err
    assert "load.pressure is 100000.0 there and 300000.0 here" in said
    assert "--out" in said and "--force" in said and said.count("\n") == 1
    assert content(tmp_path) == before
    assert exit_code("run", CASE, *WORDS, "--set", "load.pressure=3bar", "--force") == 0
    assert read_run("results/thesis_1bar").scene["load"]["pressure"] == 3e5


def test_what_is_replaced_goes_as_a_whole(tmp_path):
    """Pictures, films, fields and the checkpoint of a block never lie beside a point's numbers."""
    run(point(), tmp_path)
    (tmp_path / "fields").mkdir()
    for name in ("view_peak.png", "view.mp4", "preload.csv", "fields/rubber.pvd", "stopped.txt"):
        (tmp_path / name).write_text("old")
    run(point(), tmp_path)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["history.csv", "report.png", "summary.json"]


def test_a_run_that_has_not_finished_is_kept(tmp_path):
    run(point(), tmp_path)
    (tmp_path / "checkpoint").write_text("all there is")
    before = content(tmp_path)
    with pytest.raises(SceneError, match="has not finished .* rows.: iceslide run --restart"):
        run(point(), tmp_path)
    assert content(tmp_path) == before
    run(point(), tmp_path, force=True)
    assert not (tmp_path / "checkpoint").exists()


def test_a_run_that_has_not_slid_yet_keeps_nobody_out(tmp_path):
    (tmp_path / "checkpoint").write_text("the undeformed block")
    (tmp_path / "preload.csv").write_text("phase\npress\n")
    (tmp_path / "stopped.txt").write_text("no equilibrium")
    (tmp_path / "report.html").write_text("a page that says so")
    run(point(), tmp_path)
    assert not (tmp_path / "preload.csv").exists()


@pytest.mark.parametrize("force", [False, True])
def test_a_folder_of_other_things_is_never_touched(force, tmp_path):
    (tmp_path / "mu.png").mkdir()  # called like a result, and none
    with pytest.raises(SceneError, match="holds other files than results .mu.png."):
        run(point(), tmp_path, force=force)
    (tmp_path / "mu.png").rmdir()
    (tmp_path / "thesis.tex").write_text("years of work")
    before = content(tmp_path)
    with pytest.raises(SceneError, match="holds other files than results .thesis.tex."):
        run(point(), tmp_path, force=force)
    assert content(tmp_path) == before and len([*tmp_path.iterdir()]) == 1


def test_scenes_and_logs_may_lie_beside(tmp_path):
    for name in ("scene.toml", "log.txt", "slurm-12.out", ".DS_Store"):
        (tmp_path / name).write_text("mine")
    run(point(), tmp_path)
    run(point("load.speed=1"), tmp_path, force=True)
    assert all((tmp_path / name).read_text() == "mine" for name in ("scene.toml", ".DS_Store"))


def test_one_run_at_a_time(tmp_path):
    script = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from iceslide_fem.runtime.folders import claimed\n"
        "with claimed(Path(sys.argv[1])):\n"
        "    print('here', flush=True)\n"
        "    time.sleep(100)\n"
    )
    words = [sys.executable, "-c", script, str(tmp_path / "out")]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        with pytest.raises(SceneError, match=f"in use: process {other.pid} on "):
            run(point(), tmp_path / "out")
        other.kill()  # nothing is cleared up, and nobody is kept out
        other.wait()
        assert (tmp_path / "out" / ".lock").exists()
        run(point(), tmp_path / "out")
    assert not (tmp_path / "out" / ".lock").exists()


def test_a_claim_without_results_leaves_nothing(tmp_path):
    with claimed(tmp_path / "a" / "b"):
        assert (tmp_path / "a" / "b" / ".lock").is_file()
    assert not (tmp_path / "a").exists()


def test_a_link_is_removed_and_not_what_it_leads_to(tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "data").write_text("kept")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "fields").symlink_to(tmp_path / "elsewhere")
    check_folder(tmp_path / "out", lambda _: None, force=True)
    clear_results(tmp_path / "out")
    assert (tmp_path / "elsewhere" / "data").read_text() == "kept"
    assert not os.path.lexists(tmp_path / "out" / "fields")


def test_results_of_another_command_are_kept(tmp_path, capsys):
    (tmp_path / "summary.json").write_text(json.dumps({"film": {}, "case": {"image": "tyre.png"}}))
    (tmp_path / "footprint.vti").write_text("maps")
    before = content(tmp_path)
    assert exit_code("run", CASE, *WORDS, "--out", tmp_path) == 2
    words = ("--vary", "load.speed=1,2", "--out", tmp_path)
    assert exit_code("sweep", CASE, *WORDS, *words) == 2
    assert capsys.readouterr().err.count("holds results of another command") == 2
    assert content(tmp_path) == before


def test_what_a_command_reads_is_never_removed(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("line.csv").write_text("x_mm,pressure_bar\n0,1\n1,2\n2,1\n")
    Path("contact.csv").write_text(
        "pressure_Pa,k,D_m,H_V_m\n1e5,0.2,3e-5,3e-6\n5e5,0.4,4e-5,1e-6\n"
    )
    before = content(tmp_path)
    here = ["--out", ".", "--force"]
    with_table = ["--set", "film.contact=contact.csv", *WORDS]
    for words in (
        ["footprint", "--line", "line.csv", *here],
        ["run", CASE, *with_table, *here],
        ["sweep", CASE, *with_table, "--vary", "load.pressure=1bar,2bar", *here],
        ["ladder", CASE, *with_table, *here],
    ):
        assert exit_code(*words) == 2
        said = capsys.readouterr().err
        assert "which is read and would be removed" in said and said.count("\n") == 1
        assert content(tmp_path) == before


def test_another_footprint_is_kept(tmp_path, capsys):
    picture = CASE.parent.parent / "docs" / "pictures" / "footprint_picture.jpg"
    words = [picture, "--legend", "556,42,583,378", "--crop", "0,0,540,420", "--length", "180mm"]
    words += ["--width", "140mm", "--tolerance", "0.1", "--out", tmp_path / "tyre"]
    assert exit_code("footprint", *words, "--max-pressure", "4bar") == 0
    assert exit_code("footprint", *words, "--max-pressure", "4bar") == 0
    before = content(tmp_path)
    assert exit_code("footprint", *words, "--max-pressure", "5bar") == 2
    assert "max_pressure is 400000.0 there and 500000.0 here" in capsys.readouterr().err
    assert content(tmp_path) == before
