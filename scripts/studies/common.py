"""What studies share: options, timing, tables, scenes with changes, conditions, commands."""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from statistics import median
from time import process_time
from typing import Any, TypeVar

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from iceslide_fem.film.point import Conditions
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results" / "studies"
FAULTS = ("iceslide: ", "SimulationStopped: ")  # before the sentence of commands, of Python
Result = TypeVar("Result")

# --- options and pictures


def options(description: str | None) -> argparse.ArgumentParser:
    """Parser of a study's options that shows its docstring as help."""
    return argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def picture_options(parser: argparse.ArgumentParser, tracked: str = "docs/pictures") -> None:
    """Add `pictures`, the folder to draw in: one of results, or with --update-docs that of docs."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--pictures", type=Path, default=RESULTS, help="folder to draw in")
    where.add_argument(
        "--update-docs", dest="pictures", action="store_const", const=ROOT / tracked,
        help=f"draw the pictures of the pages anew, in {tracked}",
    )  # fmt: skip


def draw(figure: Figure, path: Path, dpi: int = 110) -> None:
    """Write a figure and say where."""
    path.parent.mkdir(parents=True, exist_ok=True)
    FigureCanvasAgg(figure).print_figure(path, dpi=dpi)
    print(f"drawn: {path}")


# --- tables and numbers


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a Markdown table, every row as soon as it is there."""
    print("| " + " | ".join(head) + " |")
    print("|" + len(head) * "---|", flush=True)
    for row in rows:
        print("| " + " | ".join(map(str, row)) + " |", flush=True)


def timed(task: Callable[[], Result], repeats: int = 3) -> tuple[Result, float]:
    """The result of `task` and the median of its processor seconds."""
    seconds = []
    for _ in range(repeats):
        started = process_time()
        result = task()
        seconds.append(process_time() - started)
    return result, median(seconds)


def largest(values: Array, exact: Array) -> float:
    """Largest relative difference."""
    return float(np.max(np.abs(values / exact - 1.0)))


# --- scenes and conditions


def case(name: str, *changes: str) -> Scene:
    """A scene of the folder `cases` with changes such as "load.speed=2m/s"."""
    return load_scene(ROOT / "cases" / f"{name}.toml", changes)


def conditions(
    bar: ArrayLike,
    speed: ArrayLike,
    duration: ArrayLike = 7e-3,
    celsius: ArrayLike = -4.0,
    initial_height: ArrayLike = 70e-9,
) -> Conditions:
    """Points of compound B; pressure in bar, m/s, s, degC, m. Arguments broadcast."""
    pressure = np.asarray(bar, dtype=float) * BAR
    k, D, H_V, _ = CONTACT_TABLES["B"](pressure)
    return Conditions.of(
        pressure=pressure, speed=speed, temperature=ZERO_CELSIUS + np.asarray(celsius),
        k=k, D=D, H_V=H_V, initial_height=initial_height, duration=duration,
    )  # fmt: skip


def fields_of(instance: Any) -> dict[str, Any]:
    """The fields of a dataclass by their names, without what it has cached beside them."""
    return {part.name: getattr(instance, part.name) for part in fields(instance)}


# --- commands


def run_words(
    scene: Path | str, out: Path | str, *changes: str, ranks: int = 1, more: Sequence[str] = ()
) -> list[str]:
    """Command line of `iceslide run`, whatever `out` holds; mpirun is that of scripts/env.sh."""
    sets = [word for change in changes for word in ("--set", change)]
    words = iceslide_words("run", str(scene), *sets, "--force", "--out", str(out), *more)
    return on_ranks(words, ranks)


def iceslide_words(*words: str) -> list[str]:
    """Command line of `iceslide`, by this Python."""
    return [sys.executable, "-m", "iceslide_fem.cli", *words]


def on_ranks(words: list[str], ranks: int) -> list[str]:
    """The command line on several processes."""
    return (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + words


def fault(stderr: str) -> str:
    """Why a run has failed, as it says itself; "fails" where it says nothing."""
    lines = stderr.splitlines()
    told = (line.partition(mark)[2] for line in lines for mark in FAULTS if mark in line)
    return next(told, "fails")


def processor_seconds(words: Sequence[str], **options: Any) -> float:
    """Run a command whose output does not matter; processor seconds of all its processes."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run(words, stdout=subprocess.DEVNULL, **options)
    after = getrusage(RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def silently(words: list[str], **options: Any) -> None:
    """Run a command whose output does not matter. Raises CalledProcessError if it fails."""
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL, cwd=ROOT, **options)
