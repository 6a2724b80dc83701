"""Throughput of sweeps: cases per hour of slices on 1 and 2 processes, the fraction of compiling
forms, and points per second.

The slice sweep runs with an empty cache first, so that its forms are compiled, and then twice with
what is in it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

from iceslide_fem.workflow.sweep import read_sweep
from scripts.studies.common import ROOT, iceslide_words, options, silently

SCENE = ROOT / "cases" / "thesis_1bar.toml"


def sweep(out: Path, environment: dict[str, str], *words: str) -> float:
    """Seconds that a sweep of the scene takes."""
    started = time.perf_counter()
    silently(iceslide_words("sweep", str(SCENE), "--out", str(out), *words), env=environment)
    return time.perf_counter() - started


def compiling(out: Path, environment: dict[str, str]) -> float:
    """Seconds that one call of the program that compiles a case's forms takes."""
    scene = next(out.glob("cases/*/scene.toml"))
    words = [sys.executable, "-m", "iceslide_fem.workflow.sweep.compile_forms", str(scene)]
    started = time.perf_counter()
    silently(words, env=environment)
    return time.perf_counter() - started


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--cases", type=int, default=8)
    parser.add_argument("--tolerance", default="1e-2")
    parser.add_argument("--duration", default="7ms")
    arguments = parser.parse_args()
    slices = ["--set", "model=slice", "--set", f"numerics.tolerance={arguments.tolerance}"]
    slices += ["--set", f"load.duration={arguments.duration}"]
    slices += ["--vary", f"load.pressure=1bar:5bar:{arguments.cases}"]
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        environment = os.environ | {"ICESLIDE_CACHE": str(root / "cache")}
        one = ["--cases-at-a-time", "1"]
        sweep(root / "plan", environment, *slices, "--no-run")
        cold = compiling(root / "plan", environment)
        warm = compiling(root / "plan", environment)
        jit = cold - warm
        print(f"compiling the forms of a slice: {jit:.1f} s, once per sweep")
        rates = {}
        for processes, words in ((1, one), (2, ["--cases-at-a-time", "2"])):
            out = root / str(processes)
            seconds = sweep(out, environment, *slices, *words)
            inside = float(read_sweep(out)["wall_s"].sum())
            rates[processes] = 3600.0 * arguments.cases / seconds
            print(
                f"{arguments.cases} slices at a tolerance of {arguments.tolerance}, {processes} at "
                f"a time: {seconds:.1f} s ({inside:.1f} s within the runs), "
                f"{rates[processes]:.0f} cases per hour; compiling them first: "
                f"{jit / (seconds + jit):.1%} of the time, once per case it would be "
                f"{jit * arguments.cases / (seconds + jit * arguments.cases):.0%}"
            )
        print(f"efficiency of 2 processes: {rates[2] / rates[1] / 2.0:.0%}")
        points = ["--set", "model=point", "--set", "ice.heat=column"]
        for count in (100, 10_000, 50_000):
            varied = ["--vary", f"load.pressure=1bar:5bar:{count // 10}"]
            varied += ["--vary", "load.speed=1:5:10"]
            seconds = sweep(root / f"points{count}", environment, *points, *varied)
            inside = float(read_sweep(root / f"points{count}")["wall_s"].sum())
            print(
                f"{count} points at a tolerance of 1e-3: {seconds:.1f} s as a command, "
                f"{inside:.1f} s of it simulated: {count / seconds:.0f} "
                f"and {count / inside:.0f} points per second"
            )


if __name__ == "__main__":
    main()
