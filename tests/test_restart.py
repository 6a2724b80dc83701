"""Checkpoints and restarts: the same curve, on any number of ranks, or a clear sentence."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

from program import rows_of, run  # noqa: E402
from slides import quarrelling  # noqa: E402

import iceslide_fem  # noqa: E402
from iceslide_fem.coupling.layouts import GridLayout, PointLayout  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.interface.surface_grid import OwnNodes  # noqa: E402
from iceslide_fem.output.table import Table  # noqa: E402
from iceslide_fem.postprocess.results import field_files, read_run  # noqa: E402
from iceslide_fem.runs.checkpoint import (  # noqa: E402
    FILE,
    FINISHED,
    read_changed,
    read_checkpoint,
    same_scene,
    write_checkpoint,
)
from iceslide_fem.runs.interruption import Interruption  # noqa: E402
from iceslide_fem.runs.schedule import Schedule  # noqa: E402
from iceslide_fem.runs.summary import Results  # noqa: E402
from iceslide_fem.runtime.errors import Interrupted, OutputError, SceneError  # noqa: E402
from iceslide_fem.runtime.files import replace_file  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe

# Python's own copy of the environment: MPI, started in this process, adds to the system's.
ENVIRONMENT = os.environ | {
    "OMP_NUM_THREADS": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}
if os.getuid() == 0:
    ENVIRONMENT |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
SMALL = ["model=slice", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]
STATE = {
    "sliding": {
        "time": 1e-3,
        "step": 1e-5,
        "steady": True,
        "nodes": {"now": np.arange(6.0).reshape(2, 3)},
    },
    "results": {"rows": [[0.0, 0.5], [1e-3, 0.25]], "melt_onset": None},
    "fields": [{"time": 0.0, "rubber": "rubber-0-000000.pvtu"}],
}


def small_scene(*changes):
    return load_scene(CASE, [*SMALL, *changes])


@pytest.fixture
def shared(tmp_path_factory):
    """One directory for all ranks."""
    comm = MPI.COMM_WORLD
    path = comm.bcast(tmp_path_factory.mktemp("shared") if comm.rank == 0 else None)
    yield path
    comm.Barrier()


def stopped_after(rows, scene, out, **how):
    """The checkpoint of a run of `scene` that is asked to stop after so many rows."""
    left = iter(range(rows - 1, -1, -1))
    with pytest.raises(Interrupted, match="stopped by the caller's progress function"):
        run(scene, out, progress=lambda row: next(left) > 0, **how)
    return read_checkpoint(out)


def curves(directory, *columns):
    history = read_run(directory).history
    times = np.linspace(0.0, history["time_s"][-1], 200)
    return [np.interp(times, history["time_s"], history[name]) for name in columns]


def contents(directory):
    """All files of a run by their names."""
    return {path.name: path.read_bytes() for path in directory.rglob("*") if path.is_file()}


ATTACHED, PASSING = "load.duration=1ms", ["ice.motion=sliding", "load.duration=0.2ms"]

SIPE = "rubber.sipes=[{position='0.3 mm', width='20 um', depth='2 mm'}]"
CLOSED_SIPE = ["rubber.length=4mm", "rubber.height=3mm", SIPE, "rubber.wall_friction=0.3"]
DRY = ["film.dry_stress=3.3bar", "film.dry_softening=10K", "film.initial_height=0nm"]
AGED = ["film.contact_age=true", "rubber.prony=[[0.3, '0.1 ms'], [0.2, '2 ms']]"]
AGED = [*AGED, "rubber.modulus_is=instantaneous", "ice.heat=column"]
DRY = [*DRY, "ice.heat=column", "rubber.inertia=true"]
FROM_REST = "load.speed=[['0 ms', '0 m/s'], ['0.05 ms', '1 m/s'], ['0.2 ms', '1 m/s']]"

RELAXES = ["rubber.prony=[[0.2,'0.2 ms'],[0.3,'5 ms']]", "rubber.modulus_is=long-term"]


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param([ATTACHED, "ice.heat=continuum"], marks=pytest.mark.mpi),
        pytest.param([ATTACHED, "ice.heat=mesh"], marks=pytest.mark.mpi),
        pytest.param([*PASSING, "ice.heat=mesh"], marks=pytest.mark.mpi),
        pytest.param([ATTACHED, "ice.heat=mesh", "rubber.heat=mesh"], marks=pytest.mark.mpi),
        [*PASSING, "ice.heat=mesh", "film.carrier=rubber", "rubber.heat=mesh"],
        [ATTACHED, "ice.heat=column"],
        [ATTACHED, "ice.heat=half-space"],
        pytest.param([*PASSING, "ice.heat=column"], marks=pytest.mark.mpi),
        [*PASSING, "ice.heat=continuum"],
        ["load.duration=0.3ms", "ice.heat=column", "rubber.inertia=true"],
        [*PASSING, "ice.heat=column", "film.carrier=rubber"],
        [*PASSING, "ice.heat=column", "film.carrier=rubber", "rubber.heat=true"],
        [*PASSING, "ice.heat=continuum", "rubber.heat=true"],
        [*PASSING, "ice.heat=column", *CLOSED_SIPE],
        ["load.duration=0.3ms", *DRY],
        pytest.param([*PASSING, *DRY], marks=pytest.mark.mpi),
        pytest.param([*PASSING, *DRY, FROM_REST], marks=pytest.mark.mpi),
        pytest.param([ATTACHED, "ice.heat=column", *RELAXES], marks=pytest.mark.mpi),
        [ATTACHED, "ice.heat=mesh", "rubber.heat=mesh", *RELAXES],
        [*PASSING, *DRY, "film.carrier=rubber"],
        pytest.param([*PASSING, *AGED], marks=pytest.mark.mpi),
        [*PASSING, *AGED, "film.carrier=rubber"],
        [ATTACHED, *AGED, "water.viscosity=[['-10 degC', '2.6 mPa*s'], ['0 degC', '1.8 mPa*s']]"],
    ],
    ids=" ".join,
)
def test_a_run_that_goes_on_gives_the_same_curve(changes, shared):
    scene = small_scene(*changes)
    whole = run(scene, shared / "whole")
    # early: new factors take other iterations, which may lead to other steps
    checkpoint = stopped_after(12, scene, shared / "parts")
    assert 0.0 < checkpoint.state["sliding"]["time"] < scene.load.duration
    parts = run(scene, shared / "parts", resumed=checkpoint)
    MPI.COMM_WORLD.Barrier()  # rank 0 writes the summary and removes the checkpoint
    columns = ("mu", "film_height_m", "friction_work_J", "ice_heat_J", "elastic_energy_J")
    for name, one, two in zip(
        columns, curves(shared / "whole", *columns), curves(shared / "parts", *columns), strict=True
    ):
        # with inertia steps differ, each within the tolerance
        share = 5e-3 if scene.rubber.inertia else 1e-3
        if name == "elastic_energy_J":  # it is that of 1e-7 m, which other factors leave otherwise
            share = max(share, 2e-3)
        assert np.abs(two - one).max() <= share * np.abs(one).max(), name
    assert parts["steps"] == pytest.approx(whole["steps"], rel=0.1)
    assert abs(parts["energy_imbalance"]) < 1e-2
    if scene.rubber.cuts:  # its walls press on each other from before to after the stop
        assert parts["sipe_opening_m"] == pytest.approx(whole["sipe_opening_m"], rel=0.01)
        assert whole["sipe_opening_m"] < 0.0
        one, two = (curves(shared / part, "wall_heat_J")[0] for part in ("whole", "parts"))
        assert two[-1] == pytest.approx(one[-1], rel=1e-2) and one[-1] > 0.0
    assert not (shared / "parts" / FILE).exists()
    for name in ("rubber", "interface"):
        one, two = (field_files(shared / part, name) for part in ("whole", "parts"))
        assert len(one) == len(two) and all(path.is_file() for _, path in two)


@pytest.mark.mpi
def test_places_know_nothing_of_ranks():
    comm = MPI.COMM_WORLD
    dice = np.random.default_rng(1)
    everywhere = dice.random((12, 2))
    mine = np.array_split(np.arange(12), comm.size)[comm.rank]
    ghosts = np.append(mine, (mine[-1] + 1) % 12) if comm.size > 1 else mine
    points = PointLayout(everywhere[ghosts], len(mine), comm)
    kept = comm.allgather(points.kept({"value": np.stack([ghosts, 10.0 * ghosts])}))
    assert sum(part["value"].shape[1] for part in kept) == 12
    np.testing.assert_array_equal(points.own(kept)["value"], [ghosts, 10 * ghosts])
    # other points, in another order, find the same values
    other = PointLayout(everywhere[::-1], 12, comm)
    np.testing.assert_array_equal(other.own(kept)["value"][0], np.arange(12)[::-1])
    with pytest.raises(SceneError, match="does not fit the mesh"):
        PointLayout(everywhere + 1e-3, 12, comm).own(kept)
    grid = GridLayout(OwnNodes(mine, 12))
    kept = comm.allgather(grid.kept({"value": 2.0 * mine}))
    np.testing.assert_array_equal(grid.own(kept)["value"], 2.0 * mine)
    everything = GridLayout(OwnNodes(np.arange(12)[::-1], 12)).own(kept)
    np.testing.assert_array_equal(everything["value"], 2.0 * np.arange(12)[::-1])
    with pytest.raises(SceneError, match="does not fit the ice"):
        GridLayout(OwnNodes(mine, 13)).own(kept)


def test_a_checkpoint_gives_back_what_it_was_given(tmp_path):
    scene = small_scene()
    write_checkpoint(tmp_path, scene, STATE)
    found = read_checkpoint(tmp_path)
    assert found.scene == scene
    assert found.state["results"] == STATE["results"]
    assert found.state["fields"] == STATE["fields"]
    assert found.state["sliding"]["steady"] is True
    np.testing.assert_array_equal(
        found.state["sliding"]["nodes"]["now"], STATE["sliding"]["nodes"]["now"]
    )
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_a_damaged_or_foreign_checkpoint_is_one_sentence(tmp_path, monkeypatch):
    scene = small_scene()
    write_checkpoint(tmp_path, scene, STATE)
    path, whole = tmp_path / FILE, (tmp_path / FILE).read_bytes()
    with pytest.raises(SceneError, match="load.pressure is 100000.0 there and 200000.0 here"):
        same_scene(small_scene("load.pressure=2bar"), read_checkpoint(tmp_path), tmp_path)
    same_scene(small_scene("name=other"), read_checkpoint(tmp_path), tmp_path)
    for place in (0, 30, 95, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        with pytest.raises(SceneError, match="damaged|not a checkpoint"):
            read_checkpoint(tmp_path)
    for size in (0, 10, 60, 200, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(SceneError, match="damaged|not a checkpoint"):
            read_checkpoint(tmp_path)
    path.write_bytes(whole)
    monkeypatch.setattr(iceslide_fem, "__version__", "0.0.1")
    with pytest.raises(SceneError, match="another version"):
        read_checkpoint(tmp_path)
    path.unlink()
    with pytest.raises(SceneError, match="holds no checkpoint"):
        read_checkpoint(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        lambda header: header.pop("scene"),
        lambda header: header.update(scene=[1, 2]),
        lambda header: header.update(numbers=7),
        lambda header: header["numbers"].update({"sliding.time": -1.0}),
        lambda header: header["numbers"].update({"sliding.time": "now"}),
        lambda header: header["numbers"].update({"sliding.step": float("nan")}),
        lambda header: header["numbers"].update({"sliding": 3}),
        lambda header: header["numbers"].pop("sliding.time"),
    ],
)
def test_a_forged_checkpoint_is_one_sentence(change, tmp_path):
    """Its checksum fits, and what it holds is nothing that a run writes."""
    write_checkpoint(tmp_path, small_scene(), STATE)
    first, _, line, packed = (tmp_path / FILE).read_bytes().split(b"\n", 3)
    header = json.loads(line)
    change(header)
    body = json.dumps(header).encode() + b"\n" + packed
    digest = hashlib.sha256(body).hexdigest().encode()
    (tmp_path / FILE).write_bytes(first + b"\n" + digest + b"\n" + body)
    with pytest.raises(SceneError) as caught:
        read_checkpoint(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_checkpoint_without_its_state_is_one_sentence(tmp_path):
    scene = small_scene("load.duration=1ms")
    state = stopped_after(14, scene, tmp_path, pictures=True).state
    del state["ledger"]
    write_checkpoint(tmp_path, scene, state)
    forged = read_checkpoint(tmp_path)
    before = contents(tmp_path)
    assert {"history.csv", "summary.json", "report.png"} <= set(before)
    with pytest.raises(SceneError, match="does not hold what a run writes"):
        run(scene, tmp_path, resumed=forged)
    assert contents(tmp_path) == before


def test_lists_name_no_fields_that_are_gone(tmp_path, capsys):
    scene = small_scene("load.duration=1ms")
    checkpoint = stopped_after(25, scene, tmp_path)
    shutil.rmtree(tmp_path / "fields")
    run(scene, tmp_path, resumed=checkpoint)
    assert (
        "has lost ice_000000.vtu: fields are written from here on only" in capsys.readouterr().out
    )
    for name in ("rubber", "interface"):
        files = field_files(tmp_path, name)
        assert files and all(path.is_file() for _, path in files)


@pytest.mark.parametrize(
    "changes",
    [
        ["load.duration=1ms", "ice.heat=column"],
        pytest.param(["load.duration=1ms", "ice.heat=mesh"], marks=pytest.mark.mpi),
        ["load.duration=1ms", "ice.heat=mesh", "rubber.heat=mesh"],
        ["load.duration=1ms", "ice.heat=continuum", "rubber.heat=true"],
        pytest.param(
            ["load.duration=0.3ms", "ice.motion=sliding", "ice.heat=continuum", "rubber.heat=true"],
            marks=pytest.mark.mpi,
        ),
    ],
    ids=" ".join,
)
def test_a_finished_run_goes_on_longer(changes, shared):
    """Heat comes deeper: ice and rubber go on below; the curve is that of one longer run."""
    scene = small_scene(*changes, "output.probes.foot=[0, 0, 0]")
    duration = scene.load.duration
    longer, often = f"load.duration={2.0 * duration}", f"output.times={0.2 * duration}"
    run(small_scene(*changes, longer, often), shared / "whole")
    run(small_scene(*changes, often, "output.probes.foot=[0, 0, 0]"), shared / "parts")
    MPI.COMM_WORLD.Barrier()
    first = read_checkpoint(shared / "parts", FINISHED).state["sliding"]
    with pytest.raises(SceneError, match="does not let the run in .* longer than its"):
        read_changed(shared / "parts", ["output.times=3"])
    with pytest.raises(SceneError, match="load.speed cannot be changed"):
        read_changed(shared / "parts", ["load.speed=4"])
    going_on = read_changed(shared / "parts", [longer])
    summary = run(going_on.scene, shared / "parts", resumed=going_on)
    MPI.COMM_WORLD.Barrier()
    columns = ("mu", "film_height_m", "friction_work_J", "ice_heat_J")
    for one, two in zip(
        *(curves(shared / part, *columns) for part in ("whole", "parts")), strict=True
    ):
        assert np.abs(two - one).max() <= 3e-3 * np.abs(one).max()
    assert abs(summary["energy_imbalance"]) < 1e-3
    history = read_run(shared / "parts").history
    assert history["time_s"][-1] == 2.0 * duration and len(history["mu"]) == summary["steps"] + 1
    assert len((shared / "parts" / "probes.csv").read_text().splitlines()) == summary["steps"] + 2
    times = [
        [time for time, _ in field_files(shared / part, "rubber")] for part in ("whole", "parts")
    ]
    assert len(times[0]) == len(times[1]) == 11 and times[1] == sorted(times[1])
    slid = read_checkpoint(shared / "parts", FINISHED).state["sliding"]
    body = "rubber" if scene.rubber.heat is True else "ice"  # its mesh is kept with the ice
    assert slid["layers_for"] == duration
    assert len(slid[body]["rise"]) > len(first[body]["rise"])


def test_the_state_of_another_mesh_is_refused(tmp_path):
    scene = small_scene("load.duration=1ms")
    state = stopped_after(14, scene, tmp_path).state
    write_checkpoint(tmp_path, small_scene("load.duration=1ms", "rubber.length=2mm"), state)
    foreign, before = read_checkpoint(tmp_path), contents(tmp_path)
    with pytest.raises(SceneError, match="does not fit the mesh"):
        run(foreign.scene, tmp_path, resumed=foreign)
    write_checkpoint(tmp_path, scene, state)
    (tmp_path / "history.csv").write_text("time_s\n")
    with pytest.raises(SceneError, match="history.csv has other columns"):
        run(scene, tmp_path, resumed=read_checkpoint(tmp_path))
    assert before.keys() == contents(tmp_path).keys()


class TwoColumns(NamedTuple):
    a: int
    b: float


class OtherColumns(NamedTuple):
    a: int
    c: float


def test_a_table_goes_on_after_the_rows_that_are_kept(tmp_path):
    path = tmp_path / "table.csv"
    with Table(path, TwoColumns, 0) as table:
        for number in range(4):
            table.row(TwoColumns(number, 0.5))
    with Table(path, TwoColumns, 0, keep=2) as table:
        table.row(TwoColumns(7, 0.25))
    assert path.read_text() == "a,b\n0,0.5\n1,0.5\n7,0.25\n"
    with pytest.raises(SceneError, match="has 3 rows, and its checkpoint comes after 5"):
        Table(path, TwoColumns, 0, keep=5)
    with pytest.raises(SceneError, match="other columns"):
        Table(path, OtherColumns, 0, keep=1)
    with pytest.raises(SceneError, match="cannot read"):
        Table(tmp_path / "nothing.csv", TwoColumns, 0, keep=1)


def test_a_file_that_cannot_grow_keeps_whole_rows(tmp_path):
    code = (
        "import resource, sys\n"
        "from collections import namedtuple\n"
        "from pathlib import Path\n"
        "from iceslide_fem.runtime.errors import OutputError\n"
        "from iceslide_fem.runtime.files import replace_end, replace_file\n"
        "from iceslide_fem.output.table import Table\n"
        "folder = Path(sys.argv[1])\n"
        "replace_file(folder / 'whole', 'old')\n"
        "replace_file(folder / 'list', 'one end')\n"
        "replace_end(folder / 'list', 4, b'two end')\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))\n"
        "try:\n"
        "    replace_file(folder / 'whole', 'new' * 100)\n"
        "except OutputError as error:\n"
        "    print(error)\n"
        "try:\n"
        "    replace_end(folder / 'list', 8, b'three ' * 100 + b'end')\n"
        "except OutputError as error:\n"
        "    print(error)\n"
        "Row = namedtuple('Row', 'a b')\n"
        "with Table(folder / 'table.csv', Row, 0) as table:\n"
        "    for number in range(100):\n"
        "        table.row(Row(number, 1e-9 * number))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path], capture_output=True, text=True)
    refused = done.stdout.splitlines()
    assert [Path(line.split(":")[0]).name for line in refused] == ["whole", "list"]
    assert refused[0].startswith("cannot write") and refused[0].endswith("File too large")
    assert refused[1].startswith("cannot write") and refused[1].endswith("No space left on device")
    assert "OutputError: cannot write" in done.stderr and "table.csv" in done.stderr
    lines = (tmp_path / "table.csv").read_text().split("\n")
    assert lines[-1] == "" and len(lines) > 8
    assert all(line.count(",") == 1 for line in lines[:-1])
    assert (tmp_path / "whole").read_text() == "old"
    assert (tmp_path / "list").read_text() == "one two end"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["list", "table.csv", "whole"]


def test_what_cannot_be_written_is_named(tmp_path):
    with pytest.raises(OutputError, match="cannot write .*nowhere/file: No such file"):
        replace_file(tmp_path / "nowhere" / "file", "text")


def test_checkpoints_at_chosen_times(tmp_path):
    times = []

    def look(row):
        state = read_checkpoint(tmp_path).state if (tmp_path / FILE).is_file() else {}
        times.append(state["sliding"]["time"] if state else None)

    schedule = Schedule(1e9, (0.3e-3, 0.6e-3))
    run(small_scene("load.duration=1ms"), tmp_path, schedule=schedule, progress=look)
    none, start, first, second, end = dict.fromkeys(times)
    assert (none, start, end) == (None, 0.0, 1e-3)
    assert 0.3e-3 <= first < 0.4e-3 and 0.6e-3 <= second < 0.7e-3
    assert read_checkpoint(tmp_path, FINISHED).state["sliding"]["time"] == 1e-3


def test_results_go_on():
    results = Results()
    results.rows, results.iterations, results.melt_onset = [(0.0, 0.5), (1e-3, 0.25)], 2, 0.0
    others = Results()
    others.restore(results.state())
    assert others.entries() == results.entries() and others.rows == results.rows


def words_of(ranks, *options):
    words = [sys.executable, "-m", "iceslide_fem.cli", "run", "--checkpoint-every", "0", *options]
    return under_mpi(ranks, words)


def under_mpi(ranks, words):
    if ranks == 1:
        return words
    path = str(Path(sys.executable).parent) + os.pathsep + os.environ["PATH"]
    mpirun = shutil.which("mpirun", path=path)
    if mpirun is None:
        pytest.skip("no mpirun")
    return [mpirun, "-n", str(ranks), *words]


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_disk_that_fills_ends_all_ranks(ranks, tmp_path):
    """One rank writes the history: the others must not wait for it."""
    code = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from iceslide_fem.scene import load_scene\n"
        "from iceslide_fem.simulate import run\n"
        "from iceslide_fem.runtime.errors import OutputError\n"
        "history, rows = Path(sys.argv[1]) / 'history.csv', []\n"
        "def fill(row):\n"
        "    rows.append(row)\n"
        "    if len(rows) == 30:\n"
        "        most = history.stat().st_size + 10\n"
        "        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))\n"
        "try:\n"
        "    run(load_scene(sys.argv[2], sys.argv[3:]), sys.argv[1], progress=fill)\n"
        "except OutputError as error:\n"
        "    print(error, file=sys.stderr)\n"
        "    sys.exit(3)\n"
    )
    words = [sys.executable, "-c", code, str(tmp_path / "run"), str(CASE), *SMALL]
    done = subprocess.run(
        under_mpi(ranks, words), env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 3
    assert done.stderr.count("history.csv: File too large") == 1
    assert "Traceback" not in done.stderr
    assert len((tmp_path / "run" / "preload.csv").read_text().split("\n")) > 2


def begin(directory, *more):
    changes = [word for change in (*SMALL, *more) for word in ("--set", change)]
    return [str(CASE), *changes, "--out", str(directory)]


def interrupted_after(words, directory, rows, number):
    """Start a command, send the signal when so many rows are there, return its exit code."""
    nowhere = subprocess.DEVNULL
    process = subprocess.Popen(words, env=ENVIRONMENT, stdout=nowhere, stderr=nowhere)
    history, end = directory / "history.csv", time.monotonic() + 200.0
    while time.monotonic() < end and process.poll() is None:
        if history.is_file() and history.read_text().count("\n") > rows:
            break
        time.sleep(0.02)
    ranks = psutil.Process(process.pid).children(recursive=True)
    for one in (process, *ranks):
        one.send_signal(number)
    psutil.wait_procs(ranks)
    return process.wait()


def test_a_signal_that_comes_while_ranks_agree_is_not_lost():
    class Comm:
        """One rank; a signal arrives while its ranks agree that none has."""

        asked = iter([True, False])

        def allreduce(self, number, op):
            if next(self.asked):
                os.kill(os.getpid(), signal.SIGTERM)
            return number

    with Interruption(Comm()) as interruption:
        assert not interruption.requested()
        os.kill(os.getpid(), signal.SIGTERM)  # a queue repeats it
        assert interruption.requested()
        assert "stopped by SIGTERM here" in str(interruption.error("here", "folder"))


def test_a_signal_is_heard_between_trials(tmp_path):
    """A run whose every trial is refused stops at the last accepted step, with a checkpoint."""
    heard = "signal.getsignal(signal.SIGTERM) and os.kill(os.getpid(), signal.SIGTERM)"
    law = quarrelling(tmp_path, 0.3e-3, heard)
    with pytest.raises(Interrupted, match=r"stopped by SIGTERM at t = 0\.[23]"):
        run(small_scene("load.duration=1ms", law), tmp_path / "out")
    state, (*_, last) = (
        read_checkpoint(tmp_path / "out").state,
        rows_of(tmp_path / "out/history.csv"),
    )
    assert float(last["time_s"]) == pytest.approx(state["sliding"]["time"], rel=1e-9)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGHUP])
def test_a_signal_leaves_a_checkpoint_and_exit_code_4(number, tmp_path):
    begun = begin(tmp_path, "load.duration=7ms", "numerics.tolerance=1e-3")
    code = interrupted_after(words_of(1, *begun), tmp_path, 5, number)
    assert code == 4
    assert "<h2" in (tmp_path / "report.html").read_text("utf-8")
    stopped = read_run(tmp_path).summary["stopped"]
    assert f"stopped by {number.name} at t = " in stopped and "--restart" in stopped
    state = read_checkpoint(tmp_path).state
    assert len(state["results"]["rows"]) == len(read_run(tmp_path).history["time_s"])


@pytest.mark.mpi
def test_no_rank_keeps_what_others_have(shared):
    comm, scene = MPI.COMM_WORLD, small_scene("load.duration=0.3ms", "ice.heat=mesh")
    run(scene, shared / "run")
    comm.Barrier()
    whole = read_checkpoint(shared / "run", FINISHED)
    assert len(whole.parts) == comm.size - 1
    assert {path.name for path in (shared / "run").glob("checkpoint.*")} == {
        part.path.name for part in whole.parts
    }
    tables = whole.state["sliding"]["ice"], *(part.table("sliding", "ice") for part in whole.parts)
    sizes = [table["rise"].size for table in tables]
    assert max(sizes) < 0.8 * sum(sizes) or comm.size == 1
    comm.Barrier()
    if comm.rank == 0 and whole.parts:
        path = whole.parts[0].path
        content = path.read_bytes()
        path.write_bytes(content[:-1] + b"?")
        with pytest.raises(SceneError, match="a part of the checkpoint, is damaged"):
            read_checkpoint(shared / "run", FINISHED)
        path.unlink()
        with pytest.raises(SceneError, match="a part of the checkpoint: No such file"):
            read_checkpoint(shared / "run", FINISHED)
    comm.Barrier()


@pytest.mark.parametrize("ranks", [(1, 2), (2, 1)], ids=str)
def test_killed_runs_go_on_with_another_number_of_ranks(ranks, tmp_path):
    short = ["ice.heat=continuum", "load.duration=3ms"]
    run(small_scene(*short), tmp_path / "whole")
    out = tmp_path / "killed"
    for rows, options in ((4, begin(out, *short)), (12, ["--restart", str(out)])):
        code = interrupted_after(words_of(ranks[0], *options), out, rows, signal.SIGKILL)
        assert code == -signal.SIGKILL
    words = words_of(ranks[1], "--restart", str(out))
    subprocess.run(words, env=ENVIRONMENT, check=True, capture_output=True)
    (whole,), (killed,) = curves(tmp_path / "whole", "mu"), curves(out, "mu")
    np.testing.assert_allclose(killed, whole, rtol=0.01)
    assert read_run(out).summary["ranks"] == ranks[1]
