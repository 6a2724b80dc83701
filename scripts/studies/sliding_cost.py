"""What a step of the sliding tread block costs, part by part, and how that grows.

Prints seconds per step of mechanics, ice heat, transfer between rubber and ice, film and output on
1 and 2 ranks with the parallel efficiency, and the cost and memory of 100 mm of sliding against
those of 10 mm. What a step spends where is sampled every millisecond: time belongs to the part of
the innermost module that has one.
"""

from __future__ import annotations

import argparse
import json
import resource
import signal
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from time import perf_counter
from types import FrameType
from typing import Any

from scripts.studies.common import ROOT, case, on_ranks, options

PARTS = ("mechanics", "ice heat", "transfer", "film", "output", "rest")
SPEED = 4.0  # m/s, of the case
INTERVAL = 1e-3  # s
MODULES = {  # of the package, and the part that the time in them and below belongs to
    "rubber.block": "mechanics",
    "rubber.equilibrium": "mechanics",
    "interface.ice_continuum": "ice heat",
    "interface.ice_columns": "ice heat",
    "film.ice_heat": "ice heat",
    "interface.surface_grid": "transfer",
    "film.integrators": "film",
    "film.law": "film",
    "output.fields": "output",
    "output.table": "output",
    "coupling.sliding": "rest",
}
# What a step consists of: the rest of a run is no part of it.
STEP = {("coupling.sliding", "advance"), ("output.fields", "write"), ("output.table", "row")}


class Sampler:
    """Seconds of each part while a step is made, from where the program is at every tick.

    A tick that comes while compiled code runs is seen when that returns: it takes what has passed.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._before = perf_counter()

    def __enter__(self) -> Sampler:
        self._before = perf_counter()
        signal.signal(signal.SIGALRM, self._tick)
        signal.siginterrupt(signal.SIGALRM, False)  # no system call fails for it
        signal.setitimer(signal.ITIMER_REAL, INTERVAL, INTERVAL)
        return self

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)

    def _tick(self, _: int, frame: FrameType | None) -> None:
        now = perf_counter()
        part, within = None, False
        while frame is not None and not within:
            module = frame.f_globals.get("__name__", "").removeprefix("iceslide_fem.")
            part = part or MODULES.get(module)
            within = (module, frame.f_code.co_name) in STEP
            frame = frame.f_back
        if part is not None and within:
            self.seconds[part] += now - self._before
        self._before = now


def child(arguments: argparse.Namespace) -> None:
    """One run in this process (or several under mpirun), timed by part; rank 0 writes it."""
    from iceslide_fem import simulate
    from iceslide_fem.fenics.compat import MPI

    scene = case("tread_block", *arguments.set)
    with Sampler() as watch:
        summary = simulate.run(scene, Path(arguments.child).with_suffix(".run"), force=True)
    if MPI.COMM_WORLD.rank == 0:
        result = {
            "parts": dict(watch.seconds),
            "steps": summary["steps"],
            "seconds": summary["wall_s"],
            "dofs": summary["dofs"],
            "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }
        Path(arguments.child).write_text(json.dumps(result), encoding="utf-8")


def measure(folder: str, ranks: int, changes: list[str]) -> dict[str, Any]:
    """Result of `child` in processes of its own, after its forms were compiled."""
    path = Path(folder) / f"{ranks}.json"
    words = [sys.executable, "-m", "scripts.studies.sliding_cost", "--child", str(path)]
    words += [word for change in changes for word in ("--set", change)]
    words = on_ranks(words, ranks)
    warm = [*words, "--set", "load.duration=50us"]
    for command in (warm, words):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(done.stderr)
    result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return result


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--model", choices=("slice", "block"), default="slice")
    parser.add_argument("--skip-distance", action="store_true")
    parser.add_argument("--set", action="append", default=[], help="change of the scene")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        child(arguments)
        return
    changes = [f"model={arguments.model}", *arguments.set]
    with tempfile.TemporaryDirectory() as folder:
        found = {ranks: measure(folder, ranks, changes) for ranks in (1, 2)}
        print(f"tread_block, {arguments.model}, {found[1]['dofs']} unknowns")
        print("ms per step".ljust(14) + "".join(part.rjust(11) for part in (*PARTS, "whole run")))
        for ranks, result in found.items():
            parts = [1e3 * result["parts"].get(part, 0.0) / result["steps"] for part in PARTS]
            whole = 1e3 * result["seconds"] / result["steps"]
            row = "".join(f"{value:11.2f}" for value in (*parts, whole))
            print(f"{ranks} rank{'s' if ranks > 1 else ' '}".ljust(14) + row)
        alone, together = found[1]["seconds"], found[2]["seconds"]
        print(f"whole run: {alone:.1f} s on 1 rank, {together:.1f} s on 2: "
              f"parallel efficiency {alone / (2 * together):.0%}")  # fmt: skip
        if arguments.skip_distance:
            return
        runs = {}
        for distance in (10, 100):
            duration = f"load.duration={distance / SPEED:g} ms"
            runs[distance] = measure(folder, 1, [*changes, duration])
        near, far = runs[10], runs[100]
        print(f"100 mm against 10 mm: {far['steps'] / near['steps']:.2f} times the steps, "
              f"{far['seconds'] / near['seconds']:.2f} times the seconds "
              f"({near['seconds']:.1f} s, {far['seconds']:.1f} s), memory "
              f"{near['memory']:.0f} MB, {far['memory']:.0f} MB")  # fmt: skip


if __name__ == "__main__":
    main()
