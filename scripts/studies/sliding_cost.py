"""What a step of the sliding tread block costs, part by part, and how that grows.

Prints processor seconds per step of the rubber's contact, its assembly (forces and tangents), their
factors and the solves with them, of heat in ice and rubber, transfer between them, film and output
on 1 and 2 ranks, and the cost and memory of 100 mm of sliding against those of 10 mm.
What a step spends where is sampled every millisecond of it: time belongs to the part of the
innermost module that has one. On 2 ranks it is that of the one that is busier with steps, with its
waiting: ranks that wait ask again and again.
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
from time import process_time
from types import FrameType
from typing import Any

from scripts.studies.common import ROOT, case, on_ranks, options

MECHANICS = ("contact", "assembly", "factors", "solves")
PARTS = (*MECHANICS, "heat", "transfer", "film", "output", "other")
SPEED = 4.0  # m/s, of the case
INTERVAL = 1e-3  # s of processor time
# Folders and modules of the package, and the part that the time in them and below belongs to; the
# longest name that fits counts.
MODULES = {
    "rubber": "contact",
    "rubber.hyperelasticity": "assembly",
    "rubber.tangent": "solves",
    "film": "film",
    "film.ice_heat": "heat",
    "film.rubber_heat": "heat",
    "interface": "transfer",
    "interface.ice_columns": "heat",
    "interface.ice_continuum": "heat",
    "interface.ice_modes": "heat",
    "interface.ice_surface": "heat",
    "output": "output",
    "coupling": "other",
}
FACTORISE = ("rubber.tangent", "factorise")  # whose solve is hardly more than new factors
# What a step consists of: the rest of a run is no part of it.
STEP = {
    ("coupling.sliding", "advance"),
    ("output.block_fields", "grids"),
    ("output.fields", "write"),
    ("output.history", "slide_row"),
    ("output.table", "row"),
}


def part_of(module: str) -> str | None:
    """The part of a module of the package, None of another."""
    inside, _, name = module.partition("iceslide_fem.")
    folder = name.partition(".")[0]
    return MODULES.get(name, MODULES.get(folder)) if not inside else None


class Sampler:
    """Seconds of each part while a step is made, from where the program is at every tick.

    A tick that comes while compiled code runs is seen when that returns: it takes what has passed.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._before = process_time()

    def __enter__(self) -> Sampler:
        self._before = process_time()
        signal.signal(signal.SIGPROF, self._tick)
        signal.siginterrupt(signal.SIGPROF, False)  # no system call fails for it
        signal.setitimer(signal.ITIMER_PROF, INTERVAL, INTERVAL)
        return self

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0.0)

    def _tick(self, _: int, frame: FrameType | None) -> None:
        now = process_time()
        part, within = None, False
        while frame is not None and not within:
            module = frame.f_globals.get("__name__", "")
            part = part or part_of(module)
            place = (module.removeprefix("iceslide_fem."), frame.f_code.co_name)
            if place == FACTORISE and part == "solves":
                part = "factors"
            within = place in STEP
            frame = frame.f_back
        if part is not None and within:
            self.seconds[part] += now - self._before
        self._before = now


def child(arguments: argparse.Namespace) -> None:
    """One run in this process (or several under mpirun), timed by part; rank 0 writes it."""
    from iceslide_fem import simulate
    from iceslide_fem.fenics.compat import MPI

    scene, comm = case("tread_block", *arguments.set), MPI.COMM_WORLD
    begun = process_time()
    with Sampler() as watch:
        summary = simulate.run(scene, Path(arguments.child).with_suffix(".run"), force=True)
    spent = comm.gather((process_time() - begun, dict(watch.seconds)))
    if spent is not None:
        seconds = max(each for each, _ in spent)
        parts = max((each for _, each in spent), key=lambda each: sum(each.values()))
        result = {
            "parts": parts,
            "steps": summary["steps"],
            "seconds": seconds,
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
        print(f"whole run: {alone:.1f} processor seconds on 1 rank, {together:.1f} on each of 2: "
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
