"""Seconds and memory of the 3-D tread block against its unknowns: direct and
iterative, 1 and 2 ranks, where the time goes, the exponents, and what two million unknowns would
take.

Each run presses the block and slides it for a moment, in a process of its own. Seconds are per
step of the slide, memory is that of one process. What stands for more unknowns than were run is
calculated from the largest runs, by the exponents between the last two and by how each part grows,
and printed as such. Every run is kept in results/studies/limits.jsonl as it comes, from where
--go-on takes it.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.mesh.size import unknowns
from scripts.studies.common import (
    RESULTS,
    ROOT,
    case,
    draw,
    fault,
    on_ranks,
    options,
    picture_options,
    table,
)
from scripts.studies.sliding_cost import PARTS

SOLVERS = {
    "direct": "",
    "iterative": "-rubber_ksp_type fgmres -rubber_ksp_rtol 1e-3 -rubber_ksp_max_it 400 "
    "-rubber_ksp_gmres_restart 100 -rubber_pc_type gamg",
}
SIZES = (5e3, 1.2e4, 3e4, 6e4, 1.2e5, 2.5e5)
QUICK_SIZES = (2e3, 5e3)
CLUSTER = 2e6  # unknowns, calculated from runs with at least so many
ENOUGH = 5e4
# How parts grow with the unknowns in space, with factors in nested dissection's order, n log n
# counted as n (A. George, SIAM J. Numer. Anal. 10 (1973) 345; R. J. Lipton, D. J. Rose and
# R. E. Tarjan, ibid. 16 (1979) 346); memory as solves at most.
GROWTH = {"factors": 2.0, "solves": 4.0 / 3.0}
# What the calculation assumes of it: cores as fast as this one, so many, and their efficiency.
CORES, EFFICIENCY = 64, 0.5
KEPT = RESULTS / "limits.jsonl"
BLANK = ("",) * (len(PARTS) + 2)  # of the row of a run that fails


class Point(NamedTuple):
    """One run: its solver, ranks and unknowns of rubber; per step seconds of parts; MB."""

    solver: str
    ranks: int
    rubber: int
    steps: int
    parts: dict[str, float]
    seconds: float
    memory: float


def changes_for(size: float) -> list[str]:
    """Changes of the scene with which its rubber has `size` unknowns, or a few more."""
    low, high = 0.05, 4.0
    for _ in range(30):
        middle = (low * high) ** 0.5
        found = unknowns(case("tread_block", "model=block", f"numerics.refinement={middle}"))
        low, high = (middle, high) if found.rubber < size else (low, middle)
    return ["model=block", f"numerics.refinement={math.ceil(1e4 * high) / 1e4}"]


def measured(solver: str, ranks: int, size: float, duration: str, limit: float) -> Point | str:
    """The run, or why there is none: it fails, or takes longer than `limit` (s)."""
    # Fields would be written every few of these short steps, and are not what is asked.
    changes = [*changes_for(size), f"load.duration={duration}", "output.times=1"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.json"
        words = [sys.executable, "-m", "scripts.studies.sliding_cost", "--child", str(path)]
        words += [word for change in changes for word in ("--set", change)]
        environment = os.environ | {"PETSC_OPTIONS": SOLVERS[solver]}
        try:
            done = subprocess.run(
                on_ranks(words, ranks),
                cwd=ROOT,
                env=environment,
                capture_output=True,
                text=True,
                timeout=limit,
            )
        except subprocess.TimeoutExpired:
            return f"takes longer than {limit:.0f} s"
        if done.returncode:
            return fault(done.stderr)
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    steps = found["steps"]
    parts = {name: seconds / steps for name, seconds in found["parts"].items()}
    rubber = unknowns(case("tread_block", *changes)).rubber
    total = sum(parts.values())
    return Point(solver, ranks, rubber, steps, parts, total, found["memory"])


def kept() -> dict[tuple[object, ...], Point]:
    """Runs of earlier calls by solver, ranks, size and duration."""
    lines = KEPT.read_text(encoding="utf-8").splitlines() if KEPT.is_file() else []
    return {tuple(place): Point(*found) for place, found in map(json.loads, lines)}


def exponent(points: list[Point], value: str) -> float:
    """Of `value` in the unknowns, between the two largest runs."""
    one, other = points[-2:]
    grown = np.log(getattr(other, value) / getattr(one, value))
    return float(grown / np.log(other.rubber / one.rubber))


def by_parts(point: Point, size: float) -> float:
    """Seconds per step with `size` unknowns, each part grown by itself."""
    grown = size / point.rubber
    return sum(own * grown ** GROWTH.get(part, 1.0) for part, own in point.parts.items())


def picture(series: dict[tuple[str, int], list[Point]]) -> Figure:
    """Seconds and memory against unknowns."""
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    for axes, value, name in zip(
        figure.subplots(1, 2), ("seconds", "memory"), ("s per step", "MB per process"), strict=True
    ):
        for (solver, ranks), points in series.items():
            axes.loglog(
                [point.rubber for point in points],
                [getattr(point, value) for point in points],
                "o-" if solver == "direct" else "s--",
                label=f"{solver}, {ranks} rank{'s' if ranks > 1 else ''}",
            )
        unknowns = sorted({point.rubber for points in series.values() for point in points})
        axes.set_xticks(unknowns, [f"{number:,}" for number in unknowns])
        axes.set_xticks([], minor=True)
        axes.set(xlabel="unknowns of the rubber", ylabel=name)
        axes.grid(which="both", alpha=0.3)
        axes.legend(fontsize=8)
    return figure


def main() -> None:
    parser = options(__doc__)
    picture_options(parser, "docs/accuracy")
    parser.add_argument("--quick", action="store_true", help="two small meshes, direct, one rank")
    parser.add_argument("--sizes", type=float, nargs="+", default=SIZES)
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--solvers", nargs="+", choices=tuple(SOLVERS), default=tuple(SOLVERS))
    parser.add_argument("--duration", default="2ms", help="of the slide")
    parser.add_argument("--limit", type=float, default=1800.0, help="seconds for one run")
    parser.add_argument("--go-on", action="store_true", help="keep what an earlier call has found")
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.sizes, arguments.ranks, arguments.solvers = QUICK_SIZES, [1], ["direct"]
        arguments.duration = "0.02ms"
    known = kept() if arguments.go_on else {}
    series: dict[tuple[str, int], list[Point]] = {}

    def rows() -> Any:
        for solver in arguments.solvers:
            for ranks in arguments.ranks:
                for size in arguments.sizes:
                    place = (solver, ranks, size, arguments.duration)
                    point = known.get(place) or measured(*place, arguments.limit)
                    if isinstance(point, str):
                        yield solver, ranks, f"{size:.0f}", point, *BLANK
                        break
                    if place not in known:
                        KEPT.parent.mkdir(parents=True, exist_ok=True)
                        with KEPT.open("a", encoding="utf-8") as file:
                            file.write(json.dumps([place, point]) + "\n")
                    series.setdefault((solver, ranks), []).append(point)
                    shares = (point.parts.get(part, 0.0) / point.seconds for part in PARTS)
                    yield (
                        solver, ranks, point.rubber, point.steps, f"{point.seconds:.3g}",
                        *(f"{share:.0%}" for share in shares), f"{point.memory:.0f}",
                    )  # fmt: skip

    head = ("solver", "ranks", "unknowns of the rubber", "steps", "s per step", *PARTS, "MB")
    table(head, rows())
    for (solver, ranks), points in series.items():
        if len(points) > 1:
            print(f"{solver}, {ranks} ranks: seconds as n^{exponent(points, 'seconds'):.2f}, "
                  f"memory as n^{exponent(points, 'memory'):.2f}")  # fmt: skip
    for (solver, ranks), points in series.items():
        if ranks > 1 or len(points) < 2 or points[-1].rubber < ENOUGH:
            continue
        grown = CLUSTER / points[-1].rubber
        memory = points[-1].memory * grown ** exponent(points, "memory") / 1e3
        most = points[-1].memory * grown ** GROWTH["solves"] / 1e3
        print(f"calculated, not run: {CLUSTER:.0f} unknowns, {solver}: {memory:.0f} GB in all "
              f"by the exponent, {most:.0f} GB if all grows as factors do")  # fmt: skip
        seconds = {"by the exponent": points[-1].seconds * grown ** exponent(points, "seconds")}
        if solver != "iterative":
            large = (point for point in points if point.rubber >= ENOUGH)
            seconds |= {f"part by part from {one.rubber}": by_parts(one, CLUSTER) for one in large}
        for way, alone in seconds.items():
            print(f"{way}: {alone:.0f} s per step on one core, {alone / (CORES * EFFICIENCY):.0f} "
                  f"s on {CORES} cores at an efficiency of {EFFICIENCY:.0%}")  # fmt: skip
    if series:
        draw(picture(series), arguments.pictures / "limits.png")


if __name__ == "__main__":
    main()
