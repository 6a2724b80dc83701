"""Beside other programs: the press and the slide of a 1 mm cube here, in CalculiX and in NGSolve.

The half of a cube of compound B, its plate held sideways, is pressed on a plane without friction,
or under a constant friction coefficient with all of it slipping one way. The programs get the same
mesh, the same penalty and one thread, and are used where they are: CalculiX if `ccx` is found,
NGSolve if `--ngsolve` names a Python that has it. The error is that of the plate's displacement.
Seconds are of the processor, from the mesh and compiled forms to the answer; CalculiX's are of all
it does. The start-up is told beside. An element's meshes are tried from coarse to fine until one
takes long or finds no answer.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.mechanics.contact import default_penalty
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, outer_facets
from iceslide_fem.scene.materials import BAR
from scripts.studies import common, peers_calculix
from scripts.studies.press_elements import (
    DEFAULT,
    ELEMENTS,
    MATERIAL,
    SIZE,
    extrapolated,
    half_cube,
    in_tetrahedra,
    pressed,
)

AREA = SIZE**2 / 2  # of the plate of the half cube
TOLERANCE = 1e-2  # what the penalty is made for
PENALTY = default_penalty(MATERIAL, SIZE, TOLERANCE)
AIM = 0.01  # error of the plate's displacement at which seconds are compared
LONG, LONGEST = 1.0, 8.0  # s of the processor: no finer mesh after that; no answer after that
NUMBERS = {"quadratic": (2, 4, 6, 8, 12), "linear": (4, 8, 12), "cubic": (2, 4)}


class Reference(NamedTuple):
    """How a plate's displacement was found: an element's meshes, gathered at the edges, of which
    the limit or (if they are too far from it) the last is taken; in m, as `--references` prints it.
    """

    element: str
    gathered: float
    numbers: tuple[int, ...]
    extrapolated: bool
    displacement: float


class Problem(NamedTuple):
    """Pressure (Pa), friction coefficient, and what the plate's displacement is."""

    pressure: float
    mu: float
    reference: Reference

    @property
    def title(self) -> str:
        """In words."""
        kind = f"slide, mu = {self.mu:g}" if self.mu else "press without friction"
        return f"{self.pressure / BAR:g} bar, {kind}"


class Answer(NamedTuple):
    """Displacement of the plate (m, NaN without an answer), unknowns, processor seconds without
    and with the start-up."""

    displacement: float
    unknowns: int
    seconds: float
    with_start: float


# What solves a problem with so many cells along x.
Solver = Callable[[int, Problem], Answer]


class Contestant(NamedTuple):
    """A program's element: its family of meshes and what solves with it."""

    program: str
    element: str
    meshes: str
    solve: Solver


PROBLEMS = (
    Problem(5 * BAR, 0.0, Reference("Q2/P1 mixed", 0.47, (2, 4, 6), True, 202.48e-6)),
    Problem(1 * BAR, 0.5, Reference("Q2", 0.47, (4, 8, 12), False, 48.58e-6)),
    Problem(5 * BAR, 0.12, Reference("Q2/P1 mixed", 0.4, (2, 4, 6), True, 207.60e-6)),
)
OWN = "iceslide_fem"
OURS = {DEFAULT: f"{DEFAULT}, the default", "Q2": "Q2", "Q2/P1 mixed": "Q2/P1 mixed"}
CALCULIX = ("C3D8", "C3D8I", "C3D8R", "C3D10", "C3D20R", "C3D20")
NGSOLVE = {"order 2": (2, False), "order 2, mixed": (2, True), "order 3": (3, False)}

# --- programs


def limited(words: Sequence[str]) -> list[str]:
    """The command, ended after LONGEST seconds of the processor."""
    return ["prlimit", f"--cpu={LONGEST:g}", *words]


def printed(words: Sequence[str]) -> Answer:
    """Answer that a command prints as JSON; none if it fails."""
    done = subprocess.run(
        limited(words), cwd=common.ROOT, env=os.environ | {"OMP_NUM_THREADS": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        return Answer(np.nan, 0, LONGEST, LONGEST)
    answer = Answer(*json.loads(done.stdout.splitlines()[-1]))
    return answer._replace(displacement=answer.displacement or np.nan)


def of_ours(element: str) -> Solver:
    """This program with one of `press_elements`."""

    def solve(n: int, problem: Problem) -> Answer:
        words = ["--alone", element, str(n), repr(problem.pressure), repr(problem.mu)]
        return printed([sys.executable, "-m", "scripts.studies.peers", *words])

    return solve


def alone(element: str, n: int, pressure: float, mu: float) -> list[float | None]:
    """An `Answer` of this program on a process of its own: the child's side of `of_ours`."""
    found = pressed(ELEMENTS[element], half_cube(n), pressure, mu, tolerance=TOLERANCE)
    displacement = found.displacement if found.reached == 1.0 else None
    return [displacement, found.dofs, found.seconds, process_time()]


def of_calculix(program: str, element: str) -> Solver:
    """CalculiX with one of its elements."""

    def solve(n: int, problem: Problem) -> Answer:
        mesh = in_tetrahedra(half_cube(n)) if element == "C3D10" else half_cube(n)
        cube = peers_calculix.Cube(mesh, element, MATERIAL, problem.pressure, problem.mu, PENALTY)
        with tempfile.TemporaryDirectory() as folder:
            found = peers_calculix.solved(limited([program]), Path(folder), cube)
        return Answer(*found, found.seconds)

    return solve


def of_ngsolve(python: str, order: int, mixed: bool) -> Solver:
    """NGSolve by that Python."""

    def solve(n: int, problem: Problem) -> Answer:
        mesh = half_cube(n)
        options = {
            "order": order, "mixed": mixed, "penalty": PENALTY, "area": AREA, "mu": problem.mu,
            "force": problem.pressure * AREA, **vars(MATERIAL),
            "strain": problem.pressure / MATERIAL.youngs_modulus,
        }  # fmt: skip
        script = str(Path(__file__).with_name("peers_ngsolve.py"))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "mesh.npz"
            arrays: dict[str, Any] = {"points": mesh.points, "cells": mesh.cells, **mesh.facets}
            np.savez(path, free=free(mesh), **arrays)
            return printed([python, script, str(path), json.dumps(options)])

    return solve


def free(mesh: TaggedMesh) -> IntArray:
    """Outer facets without a name."""
    named = {tuple(sorted(facet)) for part in mesh.facets.values() for facet in part.tolist()}
    outer = outer_facets(mesh)
    return outer[[tuple(sorted(facet)) not in named for facet in outer.tolist()]]


def contestants(ngsolve: str | None, quick: bool) -> list[Contestant]:
    """Those that are installed; says which program is not. Fewer elements if `quick`."""
    found = [Contestant(OWN, OURS[one], "quadratic", of_ours(one)) for one in OURS]
    if ccx := shutil.which("ccx"):
        for element in CALCULIX[-2:-1] if quick else CALCULIX:
            meshes = "linear" if element.startswith("C3D8") else "quadratic"
            found.append(Contestant("CalculiX", element, meshes, of_calculix(ccx, element)))
    else:
        print("CalculiX is not here: no `ccx` is found.")
    if ngsolve:
        for name, kind in list(NGSOLVE.items())[: 1 if quick else None]:
            meshes = "cubic" if kind[0] == 3 else "quadratic"
            found.append(Contestant("NGSolve", name, meshes, of_ngsolve(ngsolve, *kind)))
    else:
        print("NGSolve is not here: --ngsolve names no Python that has it.")
    return found


# --- errors

Found = dict[Contestant, dict[int, Answer]]


def print_reference(problem: Problem) -> None:
    """Find what the reference of a problem is, and the meshes before it."""
    element, gathered, numbers, to_limit, _ = problem.reference
    values = [
        pressed(
            ELEMENTS[element], half_cube(n, gathered), problem.pressure, problem.mu,
            tolerance=TOLERANCE,
        ).displacement
        for n in numbers
    ]  # fmt: skip
    told = ", ".join(f"{1e6 * value:.2f}" for value in values)
    limit, order = extrapolated(numbers, values)
    taken = f"limit {1e6 * limit:.2f} of order {order:.1f}" if to_limit else "the last"
    print(f"{problem.title}: {element}, n = {numbers}: {told} um; {taken}", flush=True)


def timed(who: Contestant, n: int, problem: Problem, repeats: int) -> Answer:
    """An answer; one that takes little is found `repeats` times, and its seconds are medians."""
    answer = who.solve(n, problem)
    if not answer.seconds < LONG / 2:
        return answer
    times = [answer[2:], *(who.solve(n, problem)[2:] for _ in range(repeats - 1))]
    return Answer(*answer[:2], *np.median(times, axis=0).tolist())


def tried(who: Contestant, problem: Problem, count: int | None, repeats: int) -> dict[int, Answer]:
    """Answers on the `count` coarsest meshes, up to one that takes long or has none."""
    answers = {}
    for n in NUMBERS[who.meshes][:count]:
        answers[n] = timed(who, n, problem, repeats)
        if not answers[n].seconds < LONG or np.isnan(answers[n].displacement):
            break
    return answers


def with_errors(answers: dict[int, Answer], exact: float) -> tuple[list[Answer], list[float]]:
    """The answers that were found, and their relative errors."""
    given = [one for one in answers.values() if np.isfinite(one.displacement)]
    return given, [abs(one.displacement / exact - 1.0) for one in given]


def at_aim(answers: dict[int, Answer], exact: float) -> tuple[str, float | None]:
    """Seconds to an error of AIM, in words and as a number if they lie between two meshes."""
    given, errors = with_errors(answers, exact)
    if not given:
        return "no answer", None
    if errors[0] <= AIM:
        return f"< {given[0].seconds:.2f} ({errors[0]:.1%})", given[0].seconds
    for i in range(1, len(given)):
        if errors[i] <= AIM:
            ends = np.log([errors[i], errors[i - 1]])
            spent = np.log([given[i].seconds, given[i - 1].seconds])
            seconds = float(np.exp(np.interp(np.log(AIM), ends, spent)))
            return f"{seconds:.2f}", seconds
    return f"{errors[-1]:.1%} in {given[-1].seconds:.1f}", None


# --- output


def print_answers(problem: Problem, found: Found) -> None:
    """Table of all meshes of one problem."""
    exact = problem.reference.displacement
    print(f"\n### {problem.title}: plate displacement {1e6 * exact:.2f} um\n")
    rows = []
    for who, answers in found.items():
        for n, one in answers.items():
            known = np.isfinite(one.displacement)
            plate = f"{1e6 * one.displacement:.2f}" if known else "no answer"
            error = f"{one.displacement / exact - 1.0:+.2%}" if known else ""
            work = (one.unknowns or "", f"{one.seconds:.2f}", f"{one.with_start:.2f}")
            rows.append((who.program, who.element, n, work[0], plate, error, *work[1:]))
    head = ("program", "element", "cells along x", "unknowns", "plate, um", "error")
    common.table((*head, "s", "s with start-up"), rows)


def print_seconds(results: dict[Problem, Found]) -> None:
    """Table of the seconds at the aim, and how many times those of our default element."""
    print(f"\n### Seconds to an error of {AIM:.0%}, and how many times those of {OWN}\n")
    columns = []
    for problem, found in results.items():
        exact = problem.reference.displacement
        aims = {who: at_aim(answers, exact) for who, answers in found.items()}
        here = [seconds for who, (_, seconds) in aims.items() if seconds and who.program == OWN]
        columns.append(
            [
                f"{words}, {seconds / min(here):.1f} times" if seconds and here else words
                for words, seconds in aims.values()
            ]
        )
    names = [(who.program, who.element) for who in next(iter(results.values()))]
    rows = [(*name, *cells) for name, cells in zip(names, zip(*columns, strict=True), strict=True)]
    common.table(("program", "element", *(problem.title for problem in results)), rows)


def draw(results: dict[Problem, Found], path: Path) -> None:
    """Chart of the error against the seconds, one panel for each problem."""
    figure = Figure(figsize=(13.0, 4.4), layout="constrained")
    colours = {OWN: "C0", "CalculiX": "C1", "NGSolve": "C2"}
    panels = figure.subplots(1, len(results), sharey=True, squeeze=False)[0]
    for panel, (problem, found) in zip(panels, results.items(), strict=True):
        exact = problem.reference.displacement
        for place, (who, answers) in enumerate(found.items()):
            given, errors = with_errors(answers, exact)
            panel.loglog(
                [one.seconds for one in given], errors, "osd^vD*Xph<>"[place % 12] + "-",
                color=colours[who.program], label=f"{who.program} {who.element}",
                markersize=5, linewidth=1.0, alpha=0.85,
            )  # fmt: skip
        panel.axhline(AIM, color="0.4", linewidth=0.8, linestyle=":")
        panel.set(title=problem.title, xlabel="processor seconds")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("relative error of the plate's displacement")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center",
                  fontsize="small")  # fmt: skip
    common.draw(figure, path)


def main() -> None:
    """Print the tables and draw the chart."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="two coarse meshes of the press")
    parser.add_argument("--ngsolve", metavar="PYTHON", help="a Python that has NGSolve")
    parser.add_argument("--repeats", type=int, default=1, help="of what takes little: medians")
    parser.add_argument("--alone", nargs=4, metavar=("ELEMENT", "N", "PA", "MU"),
                        help="one press of this program, printed as JSON")  # fmt: skip
    known_by = "find the displacements that errors refer to, ten minutes"
    parser.add_argument("--references", action="store_true", help=known_by)
    common.picture_options(parser)
    options = parser.parse_args()
    if options.alone:
        element, n, pressure, mu = options.alone
        print(json.dumps(alone(element, int(n), float(pressure), float(mu))))
        return
    if options.references:
        for problem in PROBLEMS:
            print_reference(problem)
        return
    known = contestants(options.ngsolve, options.quick)
    for element in OURS:
        pressed(ELEMENTS[element], half_cube(2), 1 * BAR)  # compiles its forms
    results: dict[Problem, Found] = {}
    for problem in PROBLEMS[: 1 if options.quick else None]:
        count = 2 if options.quick else None
        results[problem] = {who: tried(who, problem, count, options.repeats) for who in known}
        print_answers(problem, results[problem])
    print_seconds(results)
    draw(results, options.pictures / "peers.png")


if __name__ == "__main__":
    main()
