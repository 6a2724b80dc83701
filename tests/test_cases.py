"""The case scripts as people run them: alone, under mpirun, with wrong input, without a way out."""

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")
from iceslide_fem.postprocess.results import field_files, read_run  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]
CASES = Path(__file__).parent.parent / "cases"
POINTS = ("friction_drum", "rough_ice")  # cases of a point alone
SCRIPTS = sorted(path.stem for path in CASES.glob("*.py") if path.stem not in POINTS)
SMALL = ["load.duration=0.2ms", "numerics.tolerance=1e-2", "numerics.refinement=0.5"]
SLICE = ["model=slice", *SMALL]
# The wheel has an mpirun of its own, and does not work with another.
MPIRUN = shutil.which("mpirun", path=Path(sys.executable).parent) or shutil.which("mpirun")


class Ended(NamedTuple):
    """How a case ended, and what it printed."""

    returncode: int
    stdout: str
    stderr: str


def run_case(script, changes, out, printed):
    """Run a case script with some changes in this process."""
    words = [word for change in changes for word in ("--set", change)]
    with pytest.MonkeyPatch.context() as patched, pytest.raises(SystemExit) as ended:
        patched.setattr(sys, "argv", ["", "--out", str(out), *words])
        runpy.run_path(str(CASES / f"{script}.py"), run_name="__main__")
    return Ended(ended.value.code or 0, *printed.readouterr())


def run_on_two(script, changes, out):
    """Run it as two processes."""
    words = [word for change in changes for word in ("--set", change)]
    command = [MPIRUN, "-n", "2", sys.executable, str(CASES / f"{script}.py"), "--out", str(out)]
    environment = os.environ | {
        "OMP_NUM_THREADS": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "OMPI_MCA_hwloc_base_binding_policy": "none",
        "OMPI_MCA_mpi_yield_when_idle": "1",
    }
    if os.getuid() == 0:
        environment |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    return subprocess.run(
        [*command, *words], env=environment, capture_output=True, text=True, timeout=300
    )


def check(out, done, scene):
    """A run that ended well and left all its files."""
    assert done.returncode == 0, done.stderr
    run = read_run(out)
    assert run.history["time_s"][-1] == pytest.approx(scene.load.duration)
    # The friction tester begins at 0.1 m/s and 1 bar: k eta v / (h0 p) = 0.0068. On wet ice it is
    # eta v / (W p) = 0.0018, where nothing is squeezed out yet.
    least = 0.0015 if scene.ice.water else 0.006
    assert np.isfinite(run.history["mu"]).all() and least < run.summary["mu_mean"] < 1.0
    assert run.summary["stopped"] is None
    assert set(run.preload["phase"]) == {"press", "ramp"}
    meshed = ("rubber", "interface", "ice")[: 3 if scene.ice.heat in ("continuum", "mesh") else 2]
    for name in meshed:
        files = field_files(out, name)
        assert len(files) > 5 and all(path.is_file() for _, path in files)
    assert (out / "report.png").stat().st_size > 10_000
    assert "report.png" in done.stdout
    return run


@pytest.mark.parametrize("script", SCRIPTS)
def test_a_case_in_two_dimensions(script, tmp_path, capsys):
    dry = load_scene(CASES / f"{script}.toml").film.dry_stress is not None
    changes = [*SLICE, "rubber.inertia=true"] if dry else SLICE
    scene = load_scene(CASES / f"{script}.toml", changes)
    run = check(tmp_path, run_case(script, changes, tmp_path, capsys), scene)
    assert run.scene == scene.as_dict()


def a_point(script, changes, out, printed):
    """The run of a case of a point."""
    done = run_case(script, changes, out, printed)
    assert done.returncode == 0, done.stderr
    run = read_run(out)
    assert run.scene == load_scene(CASES / f"{script}.toml", changes).as_dict()
    return run


def test_a_point_on_rough_ice(tmp_path, capsys):
    run = a_point("rough_ice", ["numerics.tolerance=1e-2"], tmp_path, capsys)
    assert 0.15 < run.summary["mu_end"] < run.summary["mu_mean"] < 0.35
    assert (run.history["hysteresis_heat_J"][1:] > 0.0).all()


def test_a_case_of_a_point(tmp_path, capsys):
    changes = ["load.passes=3", "numerics.tolerance=1e-2"]
    run = a_point("friction_drum", changes, tmp_path, capsys)
    assert run.summary["passes"] == run.passes["mu_mean"].size == 3
    assert 0.3 < run.passes["mu_mean"][-1] < run.passes["mu_mean"][0] < 0.34
    assert (tmp_path / "report.png").stat().st_size > 10_000


def test_a_case_in_three_dimensions(tmp_path, capsys):
    changes = ["load.duration=0.05ms", "numerics.tolerance=1e-2", "numerics.refinement=0.25"]
    scene = load_scene(CASES / "thesis_1bar.toml", changes)
    assert scene.model == "block"
    check(tmp_path, run_case("thesis_1bar", changes, tmp_path, capsys), scene)


@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_a_case_on_two_processes_gives_the_same(tmp_path, capsys):
    scene = load_scene(CASES / "thesis_5bar.toml", SLICE)
    together = check(tmp_path / "2", run_on_two("thesis_5bar", SLICE, tmp_path / "2"), scene)
    alone = check(tmp_path / "1", run_case("thesis_5bar", SLICE, tmp_path / "1", capsys), scene)
    assert (together.summary["ranks"], alone.summary["ranks"]) == (2, 1)
    for time in (0.0, 1e-4, 2e-4):
        assert together.at("mu", time) == pytest.approx(alone.at("mu", time), rel=1e-3)


def test_a_bad_scene_ends_with_2_and_writes_nothing(tmp_path, capsys):
    done = run_case("paper_1bar", ["load.pressure=1 kg"], tmp_path / "out", capsys)
    assert done.returncode == 2
    assert done.stderr.startswith('iceslide: load.pressure = "1 kg" has the wrong unit')
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_a_bad_scene_is_said_once_on_two_processes(tmp_path):
    done = run_on_two("paper_1bar", ["load.presure=1bar"], tmp_path / "out")
    assert done.returncode == 2
    assert done.stderr.count("did you mean load.pressure?") == 1
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("script", "change", "words"),
    [
        (
            "thesis_1bar",
            "rubber.height=4mm",
            "it is 4 times as tall as thick",
        ),
        ("thesis_5bar", "load.speed=100m/s", "the block finds no equilibrium when bringing it to"),
    ],
)
def test_a_block_without_equilibrium_ends_with_3_and_says_why(
    script, change, words, tmp_path, capsys
):
    done = run_case(script, [*SLICE, change], tmp_path, capsys)
    assert done.returncode == 3
    assert words in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr
    assert (tmp_path / "preload.csv").read_text().startswith("phase,")
    assert not (tmp_path / "summary.json").exists()


def test_every_scene_has_a_script():
    assert sorted([*SCRIPTS, *POINTS]) == sorted(path.stem for path in CASES.glob("*.toml"))
