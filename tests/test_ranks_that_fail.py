"""One rank fails alone: all end within seconds, and what it failed of is said and written down."""

import subprocess
import sys
import time

import pytest
from test_restart import CASE, ENVIRONMENT, SMALL, begin, under_mpi

pytest.importorskip("iceslide_fem.fenics.compat")
pytestmark = pytest.mark.fe

# Called with the rank that fails and what: replaces a function by one that fails there.
HEAD = """
import sys
from iceslide_fem.runtime.errors import OutputError, SceneError, SimulationStopped
from iceslide_fem.fenics.compat import MPI

def failing(module, name, error, rank, calls=1):
    original, seen = getattr(module, name), []

    def fails(*args, **kwargs):
        seen.append(name)
        if MPI.COMM_WORLD.rank == rank and len(seen) >= calls:
            raise error
        return original(*args, **kwargs)

    setattr(module, name, fails)

"""
COMMAND = "from iceslide_fem.cli import main\nmain(sys.argv[1:])\n"
WAYS = {
    "a rank cannot read the mesh": (
        "from iceslide_fem.mechanics import block\n"
        "failing(block, 'default_penalty', SceneError('mesh x cannot be read'), 1)\n",
        2,
        "mesh x cannot be read",
    ),
    "rank 0 cannot write the fields": (
        "from iceslide_fem.output.fields import Fields\n"
        "failing(Fields, 'write', OutputError('cannot write: disk full'), 0, 2)\n",
        3,
        "cannot write: disk full",
    ),
    "a rank finds no film": (
        "from iceslide_fem.coupling.coupled_step import CoupledStep\n"
        "failing(CoupledStep, 'attempt', SimulationStopped('no film at a point'), 1, 3)\n",
        3,
        "no film at a point",
    ),
    "a fault of the program": (
        "from iceslide_fem.coupling.coupled_step import CoupledStep\n"
        "failing(CoupledStep, 'attempt', ZeroDivisionError('a fault'), 1, 3)\n",
        1,
        "a fault",
    ),
    "rank 0 cannot draw": (
        "from iceslide_fem import simulate\n"
        "failing(simulate, 'draw_run', OSError(28, 'No space left on device'), 0)\n",
        3,
        "No space left on device",
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_no_rank_waits_for_one_that_failed(way, tmp_path):
    code, exit_code, sentence = WAYS[way]
    script = tmp_path / "fails.py"
    script.write_text(HEAD + code + COMMAND)
    out = tmp_path / "out"
    words = [sys.executable, str(script), "run", *begin(out, "load.duration=0.2ms")]
    done = subprocess.run(
        under_mpi(2, words), env=ENVIRONMENT, capture_output=True, text=True, timeout=90
    )
    assert done.returncode == exit_code, done.stderr
    assert sentence in done.stderr
    if exit_code == 2:
        assert not out.exists() or not [*out.glob("[!.]*")]
    elif way != "rank 0 cannot draw":  # then everything else is there
        assert sentence in (out / "stopped.txt").read_text()


def test_no_rank_of_a_ladder_waits_for_one_that_failed(tmp_path):
    script = tmp_path / "fails.py"
    code = (
        "from iceslide_fem.workflow.ladder import runs\n"
        "failing(runs, 'simplifications', SceneError('mesh x cannot be read'), 1)\n"
    )
    script.write_text(HEAD + code + COMMAND)
    words = [sys.executable, str(script), "ladder", str(CASE), "--out", str(tmp_path / "out")]
    done = subprocess.run(
        under_mpi(2, words), env=ENVIRONMENT, capture_output=True, text=True, timeout=90
    )
    assert done.returncode == 2 and "mesh x cannot be read" in done.stderr


def test_from_python_a_failing_rank_ends_all(tmp_path):
    script = tmp_path / "fails.py"
    code = WAYS["a rank finds no film"][0]
    script.write_text(
        f"{HEAD}{code}"
        "from iceslide_fem.scene import load_scene\n"
        "from iceslide_fem.simulate import run\n"
        f"run(load_scene({str(CASE)!r}, {[*SMALL, 'load.duration=0.2ms']}), sys.argv[1])\n"
    )
    begun = time.monotonic()
    words = under_mpi(2, [sys.executable, str(script), str(tmp_path / "out")])
    done = subprocess.run(words, env=ENVIRONMENT, capture_output=True, text=True, timeout=90)
    assert done.returncode == 3 and time.monotonic() - begun < 60.0
    assert "iceslide: no film at a point" in done.stderr


def test_what_stops_all_ranks_is_said_once_and_written_down(tmp_path):
    script = tmp_path / "fails.py"
    code = (
        "from iceslide_fem.coupling.coupled_step import CoupledStep\n"
        "error = SimulationStopped('no film at any point')\n"
        "failing(CoupledStep, 'attempt', error, MPI.COMM_WORLD.rank, 3)\n"
    )
    script.write_text(HEAD + code + COMMAND)
    out = tmp_path / "out"
    words = [sys.executable, str(script), "run", *begin(out)]
    done = subprocess.run(
        under_mpi(2, words), env=ENVIRONMENT, capture_output=True, text=True, timeout=90
    )
    assert done.returncode == 3 and done.stderr.count("no film at any point") == 1
    assert (out / "stopped.txt").read_text() == "no film at any point\n"
    assert "no film at any point" in (out / "summary.json").read_text()


@pytest.mark.parametrize("ranks", [1, 2])
def test_petsc_takes_its_options_before_it_starts(ranks, tmp_path):
    out = tmp_path / "out"
    words = [sys.executable, "-m", "iceslide_fem.cli", "run", *begin(out, "load.duration=0.1ms")]
    words += ["--", "-log_view", "-kps_type", "cg"]
    done = subprocess.run(
        under_mpi(ranks, words), env=ENVIRONMENT, capture_output=True, text=True, timeout=90
    )
    assert done.returncode == 0, done.stderr
    assert "PETSC ERROR" not in done.stdout + done.stderr
    assert "KSPSolve" in done.stdout and "MatLUFactorNum" in done.stdout
    notes = [line for line in done.stdout.splitlines() if "has no effect" in line]
    assert len(notes) == 1 and "-kps_type" in notes[0]
