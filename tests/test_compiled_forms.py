"""Compiled forms are kept, and made again where they are not whole; on processes of their own."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

pytestmark = [pytest.mark.fe, pytest.mark.versions]

SMALL_PROGRAM = """
from iceslide_fem.fenics.compat import MPI, form, scalar_space, ufl
from dolfinx.mesh import create_unit_interval
space = scalar_space(create_unit_interval(MPI.COMM_SELF, 2), 1)
form(ufl.TestFunction(space) * ufl.dx)
form(ufl.TrialFunction(space) * ufl.TestFunction(space) * ufl.dx)
"""


def compile_small(cache, **variables):
    environment = os.environ | {"ICESLIDE_CACHE": str(cache)} | variables
    words = [sys.executable, "-c", SMALL_PROGRAM]
    return subprocess.run(words, env=environment, capture_output=True, text=True)


def modules(cache):
    """When the library of every module was made."""
    return {path.name: path.stat().st_mtime_ns for path in cache.glob("forms-*/*.so")}


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    cache = tmp_path_factory.mktemp("cache")
    assert compile_small(cache).returncode == 0
    return cache


@pytest.mark.parametrize("suffix", [".c", ".c.cached", ".so", ".sealed"])
def test_a_module_that_lacks_a_file_is_compiled_again(compiled, suffix):
    """What a process leaves that is killed while it compiles, or that two have fought for."""
    before = modules(compiled)
    for path in compiled.glob(f"forms-*/libffcx_forms_*{suffix}"):
        path.unlink()
    done = compile_small(compiled)
    assert done.returncode == 0, done.stderr
    after = modules(compiled)
    assert after.keys() == before.keys()  # no form has got another name
    again = {name for name, time in after.items() if time != before[name]}
    assert again == {name for name in before if "_forms_" in name}


@pytest.mark.parametrize("keep", [0, 50, 5000])
def test_a_file_that_was_cut_is_made_again(compiled, keep):
    """A full disk or a crash: every run would fail until someone deletes it."""
    for path in compiled.glob("forms-*/*.so"):
        path.write_bytes(path.read_bytes()[:keep])
    for path in list(compiled.glob("forms-*/*.sealed"))[:1]:
        path.write_text("{")
    assert compile_small(compiled).returncode == 0
    assert all(path.stat().st_size > 5000 for path in compiled.glob("forms-*/*.so"))


def test_what_is_whole_stays(compiled):
    before = modules(compiled)
    assert compile_small(compiled).returncode == 0
    assert modules(compiled) == before


def test_without_a_compiler_there_is_one_sentence(tmp_path):
    done = compile_small(tmp_path, CC="no-such-compiler")
    last = done.stderr.strip().splitlines()[-1]
    assert 'need a C compiler, and "no-such-compiler" is not there: install one' in last


def test_what_a_compiler_says_is_in_the_sentence_and_nowhere_else(tmp_path):
    compiler = tmp_path / "cc"
    compiler.write_text(
        "#!/bin/sh\necho 'x.c:1: warning: odd' >&2\necho 'fatal error: no' >&2\nexit 1"
    )
    compiler.chmod(0o755)
    done = compile_small(tmp_path / "cache", CC=str(compiler))
    assert "warning: odd" not in done.stderr + done.stdout
    last = done.stderr.strip().splitlines()[-1]
    assert last.endswith(f'cannot be compiled by "{compiler}": fatal error: no')


@pytest.mark.study
def test_programs_that_compile_the_same_do_not_disturb_each_other(tmp_path):
    from scripts.studies.compile_races import one_round

    counts = set()
    for number in range(2):
        failures, count = one_round(tmp_path / str(number), (2, 1))
        assert not failures
        counts.add(count)
    assert len(counts) == 1
