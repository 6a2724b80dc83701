"""Many runs in one program: memory, threads, ranks with runs of their own, a caller's gmsh."""

import shlex
import subprocess
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gmsh
import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import iceslide_fem  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mesh.rubber import tagged_rubber  # noqa: E402
from iceslide_fem.runtime.errors import Interrupted, SceneError  # noqa: E402
from iceslide_fem.runtime.launch import environment_of_one, module_words  # noqa: E402
from iceslide_fem.scene import as_toml  # noqa: E402

pytestmark = pytest.mark.fe
SHORT = {"model": "slice", "load.duration": "0.05 ms", "output.times": 1}
SHORT |= {"numerics.refinement": 0.5, "numerics.tolerance": 1e-2}
RESIDENT = Path("/proc/self/statm")


def scene(**changes):
    changes = {key.replace("__", "."): value for key, value in changes.items()}
    return iceslide_fem.load_scene(case="thesis_1bar", overrides=SHORT | changes)


def mu(out, pressure, **how):
    found = iceslide_fem.run(scene(load__pressure=pressure), out, pictures=False, **how)
    return found.attrs["mu_mean"]


@pytest.mark.skipif(not RESIDENT.exists(), reason="this system does not tell a process's memory")
@pytest.mark.parametrize("stopped", [False, True], ids=["whole", "stopped"])
def test_runs_in_one_process_leave_no_memory_behind(stopped, tmp_path):
    def one():
        progress = (lambda row: "time_s" not in row) if stopped else None
        try:
            mu(tmp_path, 1e5, force=True, progress=progress)
        except Interrupted:
            assert stopped

    def megabytes_of(runs):
        before = int(RESIDENT.read_text().split()[1])
        for _ in range(runs):
            one()
        return 4096e-6 * (int(RESIDENT.read_text().split()[1]) - before)

    megabytes_of(3)
    assert megabytes_of(5) < 2.0  # 10 MB if PETSc's objects stay


def test_threads_run_one_after_the_other(tmp_path):
    """Also in threads that cannot handle signals; each has the result of the main thread."""
    pressures = 1e5, 3e5
    alone = [mu(tmp_path / f"alone{p:g}", p) for p in pressures]
    with ThreadPoolExecutor(2) as threads:
        together = list(threads.map(lambda p: mu(tmp_path / f"thread{p:g}", p), pressures))
    assert together == alone


def test_a_caller_sees_every_row_and_ends_the_run(tmp_path):
    rows, ends = [], threading.Event()

    def progress(row):
        rows.append(row)
        if row.get("time_s", 0.0) > 1e-5:
            ends.set()
        return not ends.is_set()

    with pytest.raises(Interrupted, match="stopped by the caller's progress function at t = "):
        mu(tmp_path, 1e5, progress=progress)
    found = iceslide_fem.read_run(tmp_path)
    slid = [row for row in rows if "time_s" in row]
    np.testing.assert_allclose([row["mu"] for row in slid], found["mu"], rtol=1e-8)
    assert [row["phase"] for row in rows if "phase" in row] == [
        *iceslide_fem.read_run(tmp_path, "preload")["phase"].values
    ]
    assert slid[-2]["time_s"] <= 1e-5 < slid[-1]["time_s"] < 5e-5
    assert "progress function" in found.attrs["stopped"] and (tmp_path / "checkpoint").is_file()


def test_a_callers_gmsh_changes_no_mesh_and_is_not_changed():
    sipe = {"sipes": 1, "sipe_width": "0.1 mm", "sipe_depth": "0.8 mm", "edge_radius": "0.08 mm"}
    shape = scene(**{f"rubber__{key}": value for key, value in sipe.items()})
    expected = tagged_rubber(shape)
    options = {"Mesh.ElementOrder": 2, "Mesh.SubdivisionAlgorithm": 1, "Mesh.Algorithm": 5}
    gmsh.initialize(interruptible=False)
    try:
        gmsh.model.add("callers")
        gmsh.option.setNumber("General.Terminal", 0)
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        found = tagged_rubber(shape)
        assert gmsh.model.getCurrent() == "callers"
        assert {name: gmsh.option.getNumber(name) for name in options} == options
        assert gmsh.option.getNumber("Mesh.RecombinationAlgorithm") == 1
    finally:
        gmsh.finalize()
    np.testing.assert_array_equal(found.cells, expected.cells)
    np.testing.assert_allclose(found.points, expected.points, atol=1e-12)


@pytest.fixture
def shared(tmp_path_factory):
    """One folder for all ranks."""
    comm = MPI.COMM_WORLD
    yield comm.bcast(tmp_path_factory.mktemp("shared") if comm.rank == 0 else None)
    comm.Barrier()


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["point", "slice"])
def test_each_rank_runs_its_own_scene(model, shared):
    """A farm over ranks, again with other speeds: no rank gets another rank's old folder."""
    rank = MPI.COMM_WORLD.rank
    for speed in (1.0, 3.0):
        own = scene(model=model, load__pressure=1e5 * (1 + rank), load__speed=speed)
        found = iceslide_fem.run(
            own, shared / f"{rank}", force=True, pictures=False, comm=MPI.COMM_SELF
        )
        assert f"speed = {speed}" in found.attrs["scene"]
        assert f"pressure = {1e5 * (1 + rank)}" in found.attrs["scene"]
        assert found.attrs.get("ranks", 1) == 1


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["point", "slice"])
def test_ranks_with_different_runs_are_refused_together(model, shared):
    comm = MPI.COMM_WORLD
    if comm.size == 1:
        pytest.skip("needs a second rank")
    other = scene(model=model, load__pressure=1e5 * (1 + comm.rank))
    with pytest.raises(SceneError, match=r"ranks 0 and 1 .* \(load.pressure is 2.*MPI.COMM_SELF"):
        iceslide_fem.run(other, shared / "run")
    with pytest.raises(SceneError, match=r"the folder is .*/1 there and .*/0 here"):
        iceslide_fem.run(scene(model=model), shared / f"{comm.rank}")
    assert not [*shared.iterdir()]


def test_a_run_goes_on_in_another_folder_that_has_a_gmsh_of_its_own(tmp_path, monkeypatch):
    """Files of a scene are found from anywhere; a gmsh.py in the working folder is not imported."""
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
    monkeypatch.chdir(here)
    (here / "contact.csv").write_text("pressure (bar),k,D (um),H_V (um)\n1,0.1,20,1\n5,0.2,30,1\n")
    text = as_toml({**scene().as_dict(), "film": {"contact": "contact.csv"}})
    (here / "scene.toml").write_text(text, encoding="utf-8")
    given = iceslide_fem.load_scene("scene.toml")
    with pytest.raises(Interrupted):
        iceslide_fem.run(given, here / "out", progress=lambda row: False)
    monkeypatch.chdir(there)
    (there / "gmsh.py").write_text("raise SystemExit('not the library')\n", encoding="utf-8")
    words = module_words("iceslide_fem.cli", "run", "--restart", str(here / "out"), "--no-report")
    done = subprocess.run(words, env=environment_of_one(), capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert iceslide_fem.read_run(here / "out").attrs["stopped"] == ""


def test_values_of_numpy_are_values():
    whole = scene(load__passes=np.int64(2), load__period="1 s", load__speed=np.float32(3.0))
    assert whole.load.passes == 2 and whole.load.speed == 3.0
    rows = np.array([[0.0, 1e5], [1e-3, 2e5]])
    assert scene(load__pressure=rows).load.pressure == ((0.0, 1e5), (1e-3, 2e5))


def test_a_working_folder_that_is_gone_is_one_sentence(tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    words = module_words("iceslide_fem.cli", "cases")
    script = f"cd '{gone}' && rmdir '{gone}' && exec {shlex.join(words)}"
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith("iceslide: the working folder is gone")
