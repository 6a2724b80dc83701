"""A test that fails on one rank ends the tests of all, within seconds and with its message."""

import subprocess
import sys
from pathlib import Path

import pytest
from test_restart import ENVIRONMENT, under_mpi

pytest.importorskip("iceslide_fem.fenics.compat")
pytestmark = pytest.mark.fe

HEAD = """
import pytest
from iceslide_fem.fenics.compat import MPI
WORLD = MPI.COMM_WORLD
"""
WAYS = {
    "while the other waits for it": "WORLD.rank == 1 and fail()\n    WORLD.Barrier()",
    "and the other ends": "WORLD.rank == 1 and fail()",
    "on rank 0": "WORLD.rank == 0 and fail()\n    WORLD.allreduce(1)",
}


def run_on_two_ranks(folder, code):
    (folder / "conftest.py").write_text((Path(__file__).parent / "conftest.py").read_text())
    (folder / "test_some.py").write_text(HEAD + code)
    words = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "--color=no",
        "-p",
        "no:cacheprovider",
        str(folder),
    ]
    environment = ENVIRONMENT | {
        "PYTHONPATH": f"{Path(__file__).parent}:{Path(__file__).parents[1]}",
        "PATIENCE_OF_RANKS": "2",
    }
    return subprocess.run(
        under_mpi(2, words), env=environment, capture_output=True, text=True, timeout=60
    )


@pytest.mark.parametrize("way", WAYS)
def test_a_failure_on_one_rank_ends_all_with_its_message(way, tmp_path):
    code = (
        "def fail():\n    raise ValueError('what went wrong')\n"
        f"def test_it():\n    {WAYS[way]}\n"
        "def test_next():\n    WORLD.Barrier()\n"
    )
    done = run_on_two_ranks(tmp_path, code)
    assert done.returncode != 0
    rank = 0 if way == "on rank 0" else 1
    assert f"rank {rank} alone: " in done.stderr
    assert "test_it fails in its call" in done.stderr and "what went wrong" in done.stderr


def test_a_fixture_that_fails_on_one_rank_ends_all(tmp_path):
    code = (
        "@pytest.fixture\n"
        "def given():\n    assert WORLD.rank == 0, 'no fixture'\n"
        "def test_it(given):\n    WORLD.Barrier()\n"
    )
    done = run_on_two_ranks(tmp_path, code)
    assert done.returncode != 0
    assert "test_it fails in its setup" in done.stderr and "no fixture" in done.stderr


def test_a_skip_on_one_rank_ends_all(tmp_path):
    code = "def test_it():\n    WORLD.rank == 0 and pytest.skip('not here')\n    WORLD.Barrier()\n"
    done = run_on_two_ranks(tmp_path, code)
    assert done.returncode != 0
    assert "rank 0 alone: " in done.stderr
    assert "test_it is skipped in its call" in done.stderr and "not here" in done.stderr


def test_a_module_that_one_rank_cannot_import_ends_all(tmp_path):
    done = run_on_two_ranks(tmp_path, "assert WORLD.rank == 0\ndef test_it():\n    pass\n")
    assert done.returncode != 0
    assert "collects 0 tests with 1 errors" in done.stderr


def test_what_fails_on_all_ranks_lets_the_next_test_run(tmp_path):
    code = "def test_it():\n    assert False\ndef test_next():\n    WORLD.Barrier()\n"
    done = run_on_two_ranks(tmp_path, code)
    assert "1 failed, 1 passed" in done.stdout and "alone" not in done.stderr
