"""Work-precision diagrams: error against seconds, one chart and one table for each question.

Seconds are of the processor, on one process unless ranks are named, forms compiled before. The full
form takes about an hour, --quick a few minutes.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.coupling.limits import LIMITS
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.rubber.build import build_block
from iceslide_fem.rubber.contact import default_penalty
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.equilibrium import Equilibrium
from iceslide_fem.rubber.press import press
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from iceslide_fem.scene.thermal_layers import FIRST_LAYER, HEATED_LAYERS, LAYER_RATIO
from scripts.studies import common, press_elements
from scripts.studies.blocks import Slide, slid
from scripts.studies.common import largest, timed

SCENE = common.ROOT / "cases" / "thesis_1bar.toml"
TIMES = 500
MARKS = "os^vD*Px<>ph"


class Dot(NamedTuple):
    """One run: seconds, relative error, what it was, and more columns of the table."""

    seconds: float
    error: float
    label: str
    more: tuple[str, ...] = ()


class Chart(NamedTuple):
    """A question on one problem: its curves (name -> dots), and the headings of `more`."""

    name: str
    question: str
    problem: str
    curves: dict[str, list[Dot]]
    headings: tuple[str, ...] = ()
    default: str = ""

    @property
    def title(self) -> str:
        """Of the picture."""
        return f"{self.question}: {self.problem}"

    @property
    def rows(self) -> Iterator[tuple[str, ...]]:
        """Of the table of the question."""
        for name, dots in self.curves.items():
            for dot in dots:
                ended = np.isfinite(dot.seconds)
                values = (f"{dot.error:.1e}", f"{dot.seconds:.3g}") if ended else ("", "")
                yield (self.problem, titled(name, self), dot.label, *values, *dot.more)


# --- the film law alone


def fifty(bar: float, speed: float, duration: float) -> Conditions:
    """50 equal points, so that overhead counts as it does in a block."""
    return common.conditions(np.full(50, bar), speed, duration)


def samples(here: Conditions, **options: Any) -> Array:
    """mu at TIMES times of the first point."""
    times = np.linspace(0.0, here.duration[0], TIMES)
    return simulate(here, times=times, **options).samples[:, 0]


def film(quick: bool) -> Iterable[Chart]:
    """Integrators at fixed and at adaptive steps."""
    for name, here in (
        ("1 bar, 3 m/s, 7 ms", fifty(1.0, 3.0, 7e-3)),
        ("5 bar, 4 m/s, 5 ms: melts and saturates", fifty(5.0, 4.0, 5e-3)),
    ):
        exact = samples(here, integrator="sdirk2", tolerance=1e-6)
        duration = float(here.duration[0])
        curves: dict[str, list[Dot]] = {}
        for method in INTEGRATORS:
            for steps in (50, 200, 800) if quick else (25, 50, 100, 200, 400, 800, 1600):
                try:
                    fixed = partial(samples, here, integrator=method, fixed_step=duration / steps)
                    mu, seconds = timed(fixed)
                except SimulationStopped:
                    curves.setdefault(f"{method}, fixed", []).append(
                        Dot(np.nan, np.nan, f"{steps} steps: unstable")
                    )
                    continue
                dot = Dot(seconds, largest(mu, exact), f"{steps} steps")
                curves.setdefault(f"{method}, fixed", []).append(dot)
            if not INTEGRATORS[method].estimate:
                continue
            for tolerance in (1e-2, 1e-3) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5):
                adaptive = partial(samples, here, integrator=method, tolerance=tolerance)
                mu, seconds = timed(adaptive)
                dot = Dot(seconds, largest(mu, exact), f"tolerance {tolerance:g}")
                curves.setdefault(f"{method}, adaptive", []).append(dot)
        yield Chart(f"film_{name[0]}bar", "Film integrators", name, curves,
                    default="sdirk2, adaptive")  # fmt: skip


def ice(quick: bool) -> Iterable[Chart]:
    """Ice heat on the point: closed form, first layer, ratio and depth of the columns."""
    here = fifty(1.0, 3.0, 7e-3)
    tolerance = 1e-4

    def below(first_layer: float, ratio: float, depth: float) -> Column:
        return Column(here.temperature, here.duration, first_layer, ratio, depth)

    def on_column(tolerance: float, layers: dict[str, float]) -> Array:
        return samples(here, ice=below(**layers), tolerance=tolerance)

    exact = on_column(1e-5, {"first_layer": 0.004, "ratio": 1.15, "depth": 8.0})
    usual = {"first_layer": FIRST_LAYER, "ratio": LAYER_RATIO, "depth": HEATED_LAYERS}
    tries = {
        "first_layer": (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125),
        "ratio": (4.0, 2.5, 2.0, 1.7, 1.4, 1.2),
        "depth": (1.0, 2.0, 3.0, 4.0, 6.0),
    }
    curves: dict[str, list[Dot]] = {}
    for key, values in tries.items():
        for value in values[1::2] if quick else values:
            layers = usual | {key: value}
            unknowns = str(below(**layers).rates.size)
            mu, seconds = timed(partial(on_column, tolerance, layers))
            default = " (default)" if value == usual[key] else ""
            dot = Dot(seconds, largest(mu, exact), f"{value:g}{default}", (unknowns,))
            curves.setdefault(f"column: {key.replace('_', ' ')}", []).append(dot)
    mu, seconds = timed(lambda: samples(here, ice="half-space", tolerance=tolerance))
    curves["closed form"] = [Dot(seconds, largest(mu, exact), "half-space", ("",))]
    yield Chart("ice_column", "Columns of ice", "1 bar, 3 m/s, tolerance 1e-4", curves,
                ("unknowns",))  # fmt: skip

    uniform = {
        "name": "uniform", "model": "slice",
        "rubber": {"C10": "200 MPa", "C01": "0 MPa", "nu": 0.0, "height": "0.05 mm"},
        "load": {"pressure": "5 bar", "speed": "4 m/s", "duration": "5 ms"},
        "film": {"k": 0.405, "D": 46.5e-6, "H_V": 0.56e-6},
        "numerics": {"penalty": 1e12},
    }  # fmt: skip
    curves = {}
    one = fifty(5.0, 4.0, 5e-3)
    for kind in ("column", "continuum"):
        for refinement in (0.5,) if quick else (0.5, 1.0, 2.0):
            for tolerance in (1e-2, 1e-3):
                scene = scene_from_dict(
                    uniform
                    | {"ice": {"heat": kind}}
                    | {
                        "numerics": {
                            "penalty": 1e12,
                            "refinement": refinement,
                            "tolerance": tolerance,
                        }
                    }
                )
                run = slid(scene)
                exact = simulate(one, times=run.time, tolerance=1e-6).samples[:, 0]
                error = largest(run.mu, exact)
                dot = Dot(run.seconds, error, f"mesh x {refinement:g}", (str(run.steps),))
                curves.setdefault(f"{kind}, tolerance {tolerance:g}", []).append(dot)
    yield Chart("ice_slice", "Ice below a slice", "even pressure, 5 bar, 4 m/s", curves,
                ("steps",))  # fmt: skip


# --- whole slides


def compared(run: Slide, exact: Slide) -> tuple[float, float]:
    """Largest and rms relative difference of mu at 2000 times and the run's own, after a step."""
    even = np.linspace(run.time[1], run.time[-1], 2000)
    times = np.union1d(even, run.time[1:])
    reference = np.interp(times, exact.time, exact.mu)
    change = np.interp(times, run.time, run.mu) / reference - 1.0
    return float(np.abs(change).max()), float(np.sqrt(np.mean(change**2)))


def scenes(quick: bool) -> Iterable[Chart]:
    """Defaults at three tolerances: is the error below the tolerance asked?"""
    tolerances = ("1e-2", "1e-3") if quick else ("1e-2", "1e-3", "1e-4")
    short = ["load.duration=2ms"] if quick else []
    for case, changes in (
        ("thesis_1bar", ["ice.heat=column"]),
        ("thesis_5bar", ["ice.heat=column"]),
        ("thesis_sliding_1bar", ["load.duration=1ms"]),
        ("thesis_1bar", ["ice.heat=continuum"]),
    )[:: 3 if quick else 1]:
        mesh = "numerics.refinement=0.5"
        changes = [*changes, mesh, *short]
        finest = "2e-4" if quick else "2e-5"
        exact = slid(common.case(case, "model=slice", *changes, f"numerics.tolerance={finest}"))
        curves: dict[str, list[Dot]] = {}
        for method in ("sdirk2", "sdirk3"):
            for tolerance in tolerances:
                run = slid(
                    common.case(case, "model=slice", *changes, f"numerics.tolerance={tolerance}",
                           f"numerics.film_integrator={method}")
                )  # fmt: skip
                error, rms = compared(run, exact)
                more = (f"{rms:.1e}", str(run.steps), str(run.rejected), str(run.iterations))
                dot = Dot(run.seconds, error, f"tolerance {tolerance}", more)
                curves.setdefault(method, []).append(dot)
        ice_kind = "continuum" if "ice.heat=continuum" in changes else "column"
        yield Chart(
            f"scene_{case}_{ice_kind}",
            "Error of the time steps",
            f"{case}, slice x 0.5, {ice_kind}",
            curves,
            ("rms", "steps", "rejected", "Newton"),
            INTEGRATOR,
        )


INTEGRATOR = Scene.model_fields["numerics"].default.film_integrator


def controlled(**changes: Any) -> Callable[[Scene], Slide]:
    """Slides whose block and film are coupled in another way."""
    return partial(slid, limits=replace(LIMITS, **changes))


def full_newton(scene: Scene) -> Slide:
    """A slide with a new tangent in every iteration."""
    block = build_block(scene, MPI.COMM_SELF)
    solver = Equilibrium(block.rubber, block.surface, block.equilibrium.penalty, lag=0)
    return slid(scene, replace(block, equilibrium=solver))


def coupling(quick: bool) -> Iterable[Chart]:
    """How block and film are coupled, and how the block is solved."""
    changes = ["ice.heat=column", "numerics.refinement=0.5"] + (
        ["load.duration=2ms"] if quick else []
    )
    finest = "2e-4" if quick else "2e-5"
    exact = slid(
        common.case("thesis_1bar", "model=slice", *changes, f"numerics.tolerance={finest}")
    )
    ways: dict[str, Callable[[Scene], Slide]] = {
        "default": slid,
        "one pass per step": controlled(agreement=np.inf),
        "iterated to 1 % of the tolerance": controlled(agreement=0.01, passes=12),
        "block in every step": controlled(quiet=0.0),
        "block when shear moved by the tolerance": controlled(quiet=1.0),
        "full Newton": full_newton,
    }
    curves: dict[str, list[Dot]] = {}
    for name, way in ways.items():
        for tolerance in ("1e-2",) if quick else ("3e-2", "1e-2", "1e-3", "1e-4"):
            asked = f"numerics.tolerance={tolerance}"
            run = way(common.case("thesis_1bar", "model=slice", *changes, asked))
            error, rms = compared(run, exact)
            more = (f"{rms:.1e}", str(run.steps), str(run.rejected), str(run.iterations))
            curves.setdefault(name, []).append(
                Dot(run.seconds, error, f"tolerance {tolerance}", more)
            )
    yield Chart("coupling", "Coupling", "thesis_1bar, slice x 0.5, columns", curves,
                ("rms", "steps", "rejected", "Newton"), "default")  # fmt: skip


SOLVERS = {
    "direct (default)": [],
    "direct, unsymmetric factors": ["-rubber_pc_type", "lu", "-rubber_pc_factor_mat_solver_type",
                                    "mumps"],
    "GMRES, ILU of the blocks": ["-rubber_ksp_type", "gmres", "-rubber_ksp_rtol", "1e-8",
                                 "-rubber_pc_type", "bjacobi", "-rubber_sub_pc_type", "ilu",
                                 "-rubber_sub_pc_factor_levels", "2", "-rubber_ksp_max_it", "500"],
    "GMRES, multigrid (GAMG)": ["-rubber_ksp_type", "gmres", "-rubber_ksp_rtol", "1e-8",
                                "-rubber_pc_type", "gamg", "-rubber_ksp_max_it", "500"],
}  # fmt: skip


def solvers(quick: bool) -> Iterable[Chart]:
    """Direct against iterative, 1 and 2 ranks, on whole runs of the command."""
    cases = (
        (("slice", "1", "0.2ms"),) if quick else (("slice", "2", "1ms"), ("block", "1", "0.5ms"))
    )
    for model, refinement, duration in cases:
        curves: dict[str, list[Dot]] = {}
        exact = None
        for name, options in SOLVERS.items():
            for ranks in (1, 2):
                changes = (
                    f"model={model}",
                    "ice.heat=column",
                    "numerics.tolerance=1e-2",
                    f"numerics.refinement={refinement}",
                    f"load.duration={duration}",
                )
                given = ["--", *(options or ["-no_option"])]
                with tempfile.TemporaryDirectory() as folder:
                    ended = subprocess.run(
                        common.run_words(SCENE, folder, *changes, ranks=ranks, more=given),
                        # as Python found it: MPI, started here, has put more into it
                        env=dict(os.environ),
                        capture_output=True, text=True,
                    )  # fmt: skip
                    if ended.returncode:
                        told = common.fault(ended.stderr)[:100]
                        curves[f"{name}, {ranks}"] = [Dot(np.nan, np.nan, told, ("", ""))]
                        continue
                    summary = json.loads((Path(folder) / "summary.json").read_text())
                exact = exact or summary["mu_mean"]
                error = abs(summary["mu_mean"] / exact - 1.0)
                more = (str(summary["steps"]), str(summary["newton_iterations"]))
                dot = Dot(summary["wall_s"], error, f"{ranks} ranks", more)
                curves.setdefault(name, []).append(dot)
        problem = f"{model} x {refinement}, {duration}, wall seconds"
        yield Chart(f"solver_{model}", "Linear solver", problem, curves, ("steps", "Newton"),
                    "direct (default)")  # fmt: skip


# --- contact enforcement


@dataclass(frozen=True)
class Augmented(ContactSurface):
    """A contact surface whose gaps are lowered by multiplier over penalty: p = <l - eps z>."""

    shift: Array

    def heights(self, u: Array) -> Array:
        return super().heights(u) - self.shift


def enforcement(quick: bool) -> Iterable[Chart]:
    """Penalty against augmented Lagrangian in the press of a slice."""
    for bars in (1.0,) if quick else (1.0, 5.0):
        scene = scene_from_dict(
            {"name": "press", "model": "slice", "rubber": {"compound": "B"},
             "load": {"pressure": bars * BAR, "speed": 3.0, "duration": 1e-3},
             "numerics": {"tolerance": 1e-3, "refinement": 0.5 if quick else 1.0}}
        )  # fmt: skip
        unit = default_penalty(COMPOUNDS["B"], 1e-3, 0.1) / 100.0  # E/H
        exact = _enforced(scene, 1e5 * unit, 8)
        curves: dict[str, list[Dot]] = {}
        for name, augmentations, factors in (
            ("penalty", 0, (10.0, 100.0, 1e3, 1e4, 1e5)),
            ("augmented Lagrangian, 1 update", 1, (10.0, 100.0, 1e3)),
            ("augmented Lagrangian, 5 updates", 5, (10.0, 100.0, 1e3)),
        ):
            for factor in factors:
                try:
                    found = _enforced(scene, factor * unit, augmentations)
                except (NotConverged, SimulationStopped) as reason:
                    dot = Dot(np.nan, np.nan, f"{factor:g} E/H: {reason}"[:60], ("", "", ""))
                    curves.setdefault(name, []).append(dot)
                    continue
                error = abs(found.plate / exact.plate - 1.0)
                rms = float(np.sqrt(np.mean((found.pressure - exact.pressure) ** 2)) / (bars * BAR))
                more = (f"{found.depth / exact.plate:.1e}", f"{rms:.1e}", str(found.iterations))
                dot = Dot(found.seconds, error, f"{factor:g} E/H", more)
                curves.setdefault(name, []).append(dot)
        headings = ("penetration / plate", "pressure, rms / p", "Newton")
        yield Chart(f"contact_{bars:g}bar", "Plate displacement", f"press by {bars:g} bar", curves,
                    headings, "penalty")  # fmt: skip


class Enforced(NamedTuple):
    """Plate displacement (m), pressure at the points (Pa), penetration (m), iterations, seconds."""

    plate: float
    pressure: Array
    depth: float
    iterations: int
    seconds: float


def _enforced(scene: Scene, penalty: float, updates: int) -> Enforced:
    started = process_time()
    block = build_block(scene, MPI.COMM_SELF)
    surface = block.surface
    augmented = Augmented(**common.fields_of(surface), shift=np.zeros(surface.weights.shape))
    solver = Equilibrium(block.rubber, augmented, penalty)
    block = replace(block, surface=augmented, equilibrium=solver)
    counts: list[int] = []
    press(block, lambda point: counts.append(point.solution.iterations))
    for _ in range(updates):
        augmented.shift[:] = block.contact.pressure / penalty
        counts.append(block.balance(block.static).iterations)
    contact = block.contact
    depth = float((-(contact.gap + augmented.shift)).max())
    return Enforced(
        block.equilibrium.plate_displacement(), contact.pressure.ravel(), depth, sum(counts),
        process_time() - started,
    )  # fmt: skip


# --- rubber


def elements(quick: bool) -> Iterable[Chart]:
    """Elements and mesh size in the frictionless press."""
    for bars in (1.0,) if quick else (1.0, 5.0):
        presses = press_elements.frictionless(bars * BAR, 3 if quick else 5)
        exact, _ = press_elements.limit(presses, press_elements.REFERENCE)
        curves = {
            name: [
                Dot(p.seconds, abs(p.displacement / exact - 1.0), f"n = {n}",
                    (str(p.dofs), str(p.iterations), str(p.tangents)))
                for n, p in meshes.items()
            ]
            for name, meshes in presses.items()
        }  # fmt: skip
        problem, headings = f"press by {bars:g} bar", ("dofs", "Newton", "tangents")
        yield Chart(f"elements_{bars:g}bar", "Elements, plate displacement", problem, curves,
                    headings, press_elements.DEFAULT)  # fmt: skip


# --- output

QUESTIONS: dict[str, Callable[[bool], Iterable[Chart]]] = {
    "film": film,
    "ice": ice,
    "elements": elements,
    "contact": enforcement,
    "coupling": coupling,
    "solvers": solvers,
    "scenes": scenes,
}


def report(charts: Iterable[Chart], folder: Path) -> None:
    """Print a question's charts as they come, one table if their columns agree; then draw them."""
    come: list[Chart] = []

    def rows(group: Iterable[Chart]) -> Iterator[tuple[str, ...]]:
        for chart in group:
            come.append(chart)
            yield from chart.rows

    for headings, group in groupby(charts, key=lambda chart: chart.headings):
        print()
        common.table(("problem", "method", "with", "largest", "s", *headings), rows(group))
    for chart in come:
        draw(chart, folder / f"{chart.name}.png")


def titled(name: str, chart: Chart) -> str:
    """The name of a curve; the default one says so."""
    return f"{name} (default)" if name == chart.default and "default" not in name else name


def draw(chart: Chart, path: Path) -> None:
    """Draw error against seconds."""
    figure = Figure(figsize=(7.2, 5.0), layout="constrained")
    panel = figure.add_subplot()
    for number, (name, dots) in enumerate(chart.curves.items()):
        ends = [dot for dot in dots if np.isfinite(dot.seconds)]
        errors = [max(dot.error, 1e-12) for dot in ends]
        panel.loglog([dot.seconds for dot in ends], errors, MARKS[number % len(MARKS)] + "-",
                     label=titled(name, chart),
                     linewidth=2.5 if name == chart.default else 1.2)  # fmt: skip
        for dot, error in zip(ends, errors, strict=True):
            label = dot.label.removeprefix("tolerance ")
            panel.annotate(label, (dot.seconds, error), (4, 4), textcoords="offset points",
                           fontsize=6, color="0.35")  # fmt: skip
    panel.set(title=chart.title, xlabel="seconds", ylabel="largest relative error")
    low, high = panel.get_xlim()
    wide = max(1.0, np.sqrt(10.0 * low / high))  # at least a decade, so that noise looks small
    panel.set_xlim(low / wide, high * wide)
    panel.grid(alpha=0.3, which="both")
    panel.legend(fontsize=8)
    common.draw(figure, path)


def main() -> None:
    """Draw and print the charts."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse charts, a few minutes")
    common.picture_options(parser, "docs/accuracy")
    parser.add_argument("--questions", nargs="+", choices=list(QUESTIONS), default=list(QUESTIONS))
    options = parser.parse_args()
    for name in options.questions:
        report(QUESTIONS[name](options.quick), options.pictures)


if __name__ == "__main__":
    main()
