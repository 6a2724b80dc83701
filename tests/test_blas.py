"""OpenBLAS's kernels follow what the processor can do."""

import os
import platform
import subprocess
import sys

import pytest

from iceslide_fem.blas import choose_kernels

AVX512 = "fma avx2 avx512f avx512dq avx512cd avx512bw avx512vl"


@pytest.mark.parametrize(
    ("flags", "kernels"),
    [
        (AVX512, "SkylakeX"),
        ("sse3 fma avx2 avx512f", "Haswell"),  # one of 2016 that lacks the rest of AVX-512
        ("sse3 avx", None),
    ],
)
def test_kernels_are_those_that_the_processor_can_run(tmp_path, monkeypatch, flags, kernels):
    monkeypatch.setattr(os, "environ", {})
    cpuinfo = tmp_path / "cpuinfo"
    one = f"model name\t: of tomorrow\nflags\t\t: {flags}\n"
    cpuinfo.write_text(f"processor\t: 0\n{one}\nprocessor\t: 1\n{one}")
    choose_kernels(cpuinfo)
    assert os.environ.get("OPENBLAS_CORETYPE") == kernels


def test_kernels_that_the_user_has_set_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "environ", {"OPENBLAS_CORETYPE": "Zen"})
    (tmp_path / "cpuinfo").write_text(f"flags\t\t: {AVX512}\n")
    choose_kernels(tmp_path / "cpuinfo")
    assert os.environ["OPENBLAS_CORETYPE"] == "Zen"


def test_where_nothing_tells_the_processor_openblas_finds_its_kernels(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "environ", {})
    choose_kernels(tmp_path / "nothing")
    (tmp_path / "cpuinfo").write_text("model name: something else\n")
    choose_kernels(tmp_path / "cpuinfo")
    assert "OPENBLAS_CORETYPE" not in os.environ


def test_a_command_chooses_before_numpy_is_loaded(monkeypatch):
    code = "import os, sys, iceslide_fem.cli as _\n"
    code += "print('numpy' in sys.modules, os.environ.get('OPENBLAS_CORETYPE'))"
    unset = {key: value for key, value in os.environ.items() if key != "OPENBLAS_CORETYPE"}
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, env=unset, capture_output=True, text=True, check=True)
    monkeypatch.setattr(os, "environ", {})
    choose_kernels()
    assert done.stdout.split() == ["False", str(os.environ.get("OPENBLAS_CORETYPE"))]


def test_other_processors_and_odd_names_are_left_alone(tmp_path, monkeypatch):
    cpuinfo, environment = tmp_path / "cpuinfo", {}
    monkeypatch.setattr(os, "environ", environment)
    cpuinfo.write_bytes(b"model name: \xe9\nflags: sse3\n")
    choose_kernels(cpuinfo)
    assert environment == {}
    cpuinfo.write_text(f"flags: {AVX512}\n")
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    choose_kernels(cpuinfo)
    assert environment == {}
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    choose_kernels(cpuinfo)
    assert environment == {"OPENBLAS_CORETYPE": "SkylakeX"}
