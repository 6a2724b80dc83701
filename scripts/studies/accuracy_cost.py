"""Error against seconds: film, ice, contact, coupling and cases; and what `iceslide info` expects.

A table for each of the --questions, and a chart where it is of one problem. Seconds are of the
processor, on one process, forms compiled before. `cases` runs cases beside a finer mesh with a
sixth of the tolerance, and prints differences in fractions of the mean of mu, because mu itself
begins at nothing where a plate does. `estimates` prints at its end the constants of
`iceslide_fem/workflow/planning/cost.py` that fit best, to enter there. --quick takes minutes.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import groupby, product
from pathlib import Path
from subprocess import DEVNULL, Popen
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import nnls

from iceslide_fem.coupling.step_error import LIMITS
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.point import simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.mechanics.contact import default_penalty
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.mechanics.loaded_block import Equilibrium
from iceslide_fem.mechanics.press import press
from iceslide_fem.postprocess.results import Run as Finished
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from iceslide_fem.scene.thermal_layers import FIRST_LAYER, HEATED_LAYERS, LAYER_RATIO
from iceslide_fem.workflow.planning import cost
from scripts.studies.blocks import Slide, slid
from scripts.studies.common import (
    ROOT,
    case,
    conditions,
    draw,
    fields_of,
    largest,
    options,
    picture_options,
    run_words,
    table,
    timed,
)

MS = 1e3
COARSE = ("model=slice", "ice.heat=column", "numerics.refinement=0.5")
INTEGRATOR = Scene.model_fields["numerics"].default.film_integrator


class Dot(NamedTuple):
    """One run: seconds, relative error, what it was, and more columns of the table."""

    seconds: float
    error: float
    label: str
    more: tuple[object, ...] = ()


Curves = Mapping[str, Iterable[Dot]]


class Chart(NamedTuple):
    """Dots of one problem by method, and the headings of `more`; name: of the picture."""

    name: str
    problem: str
    curves: Curves
    headings: tuple[str, ...] = ()


# --- the film law alone, at 50 equal points, so that overhead counts as it does in a block


def samples(bar: float, speed: float, duration: float, **given: Any) -> Array:
    """mu at 500 times of the first point."""
    times = np.linspace(0.0, duration, 500)
    points = conditions(np.full(50, bar), speed, duration)
    return simulate(points, times=times, **given).samples[:, 0]


def film(quick: bool) -> Iterator[Chart]:
    """Integrators at fixed and at adaptive steps."""
    counts = (50, 200, 800) if quick else (25, 50, 100, 200, 400, 800, 1600)
    tolerances = (1e-2, 1e-3) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
    for here in ((1.0, 3.0, 7e-3), (5.0, 4.0, 5e-3)):
        exact = samples(*here, tolerance=1e-6)

        def dots(label: str, values: Iterable[float], here: Any = here, exact: Array = exact,
                 **given: Callable[[float], Any]) -> Iterator[Dot]:  # fmt: skip
            for value in values:
                asked = {name: of(value) if callable(of) else of for name, of in given.items()}
                try:
                    mu, seconds = timed(partial(samples, *here, **asked))
                except SimulationStopped:
                    continue  # unstable
                yield Dot(seconds, largest(mu, exact), label.format(value))

        curves: dict[str, Iterable[Dot]] = {}
        for method, tableau in INTEGRATORS.items():
            step: Any = partial(np.divide, here[2])
            own: dict[str, Any] = {"integrator": method}
            curves[f"{method}, fixed"] = dots("{} steps", counts, fixed_step=step, **own)
            if tableau.estimate:
                curves[f"{method}, adaptive"] = dots("{:g}", tolerances, tolerance=float, **own)
        yield Chart(f"film_{here[0]:g}bar", "film of {:g} bar, {:g} m/s".format(*here), curves)


def ice(quick: bool) -> Iterator[Chart]:
    """First layer, ratio and depth of columns, the closed form, and ice below a slice."""
    here, usual = (1.0, 3.0, 7e-3), (FIRST_LAYER, LAYER_RATIO, HEATED_LAYERS)
    point = conditions(np.full(50, here[0]), *here[1:])

    def column(first_layer: float, ratio: float, depth: float) -> Column:
        return Column(point.temperature, point.duration, first_layer, ratio, depth)

    exact = samples(*here, ice=column(0.004, 1.15, 8.0), tolerance=1e-5)

    def on(layers: Column | str, label: str, unknowns: object = "") -> Dot:
        mu, seconds = timed(partial(samples, *here, ice=layers, tolerance=1e-4))
        return Dot(seconds, largest(mu, exact), label, (unknowns,))

    def varied(place: int, values: Sequence[float]) -> Iterator[Dot]:
        for value in values[1::2] if quick else values:
            given = [*usual]
            given[place] = value
            layers = column(*given)
            default = " (default)" * (value == usual[place])
            yield on(layers, f"{value:g}{default}", layers.rates.size)

    curves = {
        "column: first layer": varied(0, (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125)),
        "column: ratio": varied(1, (4.0, 2.5, 2.0, 1.7, 1.4, 1.2)),
        "column: depth": varied(2, (1.0, 2.0, 3.0, 4.0, 6.0)),
        "closed form": (on("half-space", kind) for kind in ("half-space",)),
    }
    yield Chart("ice_column", "1 bar, 3 m/s, tolerance 1e-4", curves, ("unknowns",))
    uniform = {
        "name": "uniform", "model": "slice",
        "rubber": {"C10": "200 MPa", "C01": "0 MPa", "nu": 0.0, "height": "0.05 mm"},
        "load": {"pressure": "5 bar", "speed": "4 m/s", "duration": "5 ms"},
        "film": {"k": 0.405, "D": 46.5e-6, "H_V": 0.56e-6},
    }  # fmt: skip

    def slides(kind: str, tolerance: float) -> Iterator[Dot]:
        for refinement in (0.5,) if quick else (0.5, 1.0, 2.0):
            numerics = {"penalty": 1e12, "refinement": refinement, "tolerance": tolerance}
            run = slid(scene_from_dict({**uniform, "ice": {"heat": kind}, "numerics": numerics}))
            mu = simulate(conditions(5.0, 4.0, 5e-3), times=run.time, tolerance=1e-6).samples[:, 0]
            yield Dot(run.seconds, largest(run.mu, mu), f"mesh x {refinement:g}", (run.steps,))

    ways = product(("column", "continuum"), (1e-2, 1e-3))
    curves = {f"{kind}, tolerance {t:g}": slides(kind, t) for kind, t in ways}
    yield Chart("ice_slice", "even pressure, 5 bar, 4 m/s", curves, ("steps",))


# --- whole slides


def slides_at(
    tolerances: Iterable[str], exact: Slide, way: Callable[[Scene], Slide], *of: str
) -> Iterator[Dot]:
    """Slides of the case and changes `of` against the `exact` one, after its first step."""
    for tolerance in tolerances:
        run = way(case(*of, f"numerics.tolerance={tolerance}"))
        even = np.linspace(run.time[1], run.time[-1], 2000)
        times = np.union1d(even, run.time[1:])
        reference = np.interp(times, exact.time, exact.mu)
        change = np.interp(times, run.time, run.mu) / reference - 1.0
        more = (f"{np.sqrt(np.mean(change**2)):.1e}", run.steps, run.rejected, run.iterations)
        yield Dot(run.seconds, float(np.abs(change).max()), f"tolerance {tolerance}", more)


OF_SLIDES = ("rms", "steps", "rejected", "Newton")


def scenes(quick: bool) -> Iterator[Chart]:
    """Is the error of the time steps below the tolerance asked?"""
    tolerances = ("1e-2", "1e-3") if quick else ("1e-2", "1e-3", "1e-4")
    wanted = (
        ("thesis_1bar", "column", "7ms"), ("thesis_5bar", "column", "5ms"),
        ("thesis_sliding_1bar", "column", "1ms"), ("thesis_1bar", "continuum", "7ms"),
    )  # fmt: skip
    for name, kind, duration in wanted[:1] if quick else wanted:
        of = (name, *COARSE, f"ice.heat={kind}", f"load.duration={'2ms' if quick else duration}")
        exact = slid(case(*of, f"numerics.tolerance={'2e-4' if quick else '2e-5'}"))
        curves = {
            method: slides_at(tolerances, exact, slid, *of, f"numerics.film_integrator={method}")
            for method in ("sdirk2", "sdirk3")
        }
        yield Chart(f"scene_{name}_{kind}", f"{name}, slice x 0.5, {kind}", curves, OF_SLIDES)


def full_newton(scene: Scene) -> Slide:
    """A slide with a new tangent in every iteration."""
    block = build_block(scene, MPI.COMM_SELF)
    solver = Equilibrium(block.rubber, block.surface, block.equilibrium.penalty, lag=0)
    return slid(scene, replace(block, equilibrium=solver))


def coupling(quick: bool) -> Iterator[Chart]:
    """How block and film are coupled, and how the block is solved."""

    def limited(**changes: Any) -> Callable[[Scene], Slide]:
        return partial(slid, limits=replace(LIMITS, **changes))

    of = ("thesis_1bar", *COARSE, f"load.duration={'2ms' if quick else '7ms'}")
    exact = slid(case(*of, f"numerics.tolerance={'2e-4' if quick else '2e-5'}"))
    ways: dict[str, Callable[[Scene], Slide]] = {
        "default": slid,
        "one pass per step": limited(agreement=np.inf),
        "film repeated in every step": limited(alike=0.0),
        "iterated to 1 % of the tolerance": limited(agreement=0.01, passes=12),
        "block in every step": limited(quiet=0.0),
        "block when shear moved by the tolerance": limited(quiet=1.0),
        "full Newton": full_newton,
    }
    tolerances = ("1e-2",) if quick else ("3e-2", "1e-2", "1e-3", "1e-4")
    curves = {name: slides_at(tolerances, exact, way, *of) for name, way in ways.items()}
    yield Chart("coupling", "thesis_1bar, slice x 0.5, columns", curves, OF_SLIDES)


# --- contact enforcement


@dataclass(frozen=True)
class Augmented(ContactSurface):
    """A contact surface whose gaps are lowered by multiplier over penalty: p = <l - eps z>."""

    shift: Array

    def heights(self, u: Array) -> Array:
        return super().heights(u) - self.shift


class Pressed(NamedTuple):
    """Plate displacement (m), pressure at the points (Pa), penetration (m), iterations, seconds."""

    plate: float
    pressure: Array
    depth: float
    iterations: int
    seconds: float


def enforced(scene: Scene, penalty: float, updates: int) -> Pressed:
    """The scene's block, pressed with a penalty (Pa/m) and so many updates of its multipliers."""
    started = process_time()
    block = build_block(scene, MPI.COMM_SELF)
    zero = np.zeros(block.surface.weights.shape)
    surface = Augmented(**fields_of(block.surface), shift=zero)
    solver = Equilibrium(block.rubber, surface, penalty)
    block = replace(block, surface=surface, equilibrium=solver)
    counts: list[int] = []
    press(block, lambda point: counts.append(point.solution.iterations))
    for _ in range(updates):
        surface.shift[:] = block.contact.pressure / penalty
        counts.append(block.balance(block.static).iterations)
    contact, plate = block.contact, block.equilibrium.plate_displacement()
    depth = float((-(contact.gap + surface.shift)).max())
    seconds = process_time() - started
    return Pressed(plate, contact.pressure.ravel(), depth, sum(counts), seconds)


def contact(quick: bool) -> Iterator[Chart]:
    """Penalty against augmented Lagrangian in the press of a slice."""
    scene = scene_from_dict(
        {"name": "press", "model": "slice", "rubber": {"compound": "B"},
         "load": {"pressure": BAR, "speed": 3.0, "duration": 1e-3},
         "numerics": {"tolerance": 1e-3, "refinement": 0.5 if quick else 1.0}}
    )  # fmt: skip
    unit = default_penalty(COMPOUNDS["B"], 1e-3, 0.1) / 100.0  # E/H
    exact = enforced(scene, 1e5 * unit, 8)

    def dots(updates: int, factors: Iterable[float]) -> Iterator[Dot]:
        for factor in factors:
            label = f"{factor:g} E/H"
            try:
                found = enforced(scene, factor * unit, updates)
            except (NotConverged, SimulationStopped) as reason:
                yield Dot(np.nan, np.nan, f"{label}: {reason}"[:60], ("", "", ""))
                continue
            rms = float(np.sqrt(np.mean((found.pressure - exact.pressure) ** 2)) / BAR)
            more = (f"{found.depth / exact.plate:.1e}", f"{rms:.1e}", found.iterations)
            yield Dot(found.seconds, abs(found.plate / exact.plate - 1.0), label, more)

    curves = {
        "penalty (default)": dots(0, (10.0, 100.0, 1e3, 1e4, 1e5)),
        "augmented Lagrangian, 1 update": dots(1, (10.0, 100.0, 1e3)),
        "augmented Lagrangian, 5 updates": dots(5, (10.0, 100.0, 1e3)),
    }
    headings = ("penetration / plate", "pressure, rms / p", "Newton")
    yield Chart("contact_1bar", "press by 1 bar", curves, headings)


def report(charts: Iterable[Chart], folder: Path) -> None:
    """Print charts as they come, one table if their columns agree; then draw them."""
    drawn: list[Chart] = []

    def rows(group: Iterable[Chart]) -> Iterator[tuple[object, ...]]:
        for chart in group:
            curves: dict[str, list[Dot]] = {}
            for name, dots in chart.curves.items():
                curves[name] = []
                for dot in dots:
                    curves[name].append(dot)
                    ended = np.isfinite(dot.seconds)
                    values = (f"{dot.error:.1e}", f"{dot.seconds:.3g}") if ended else ("", "")
                    yield (chart.problem, name, dot.label, *values, *dot.more)
            drawn.append(chart._replace(curves=curves))

    for headings, group in groupby(charts, key=lambda chart: chart.headings):
        table(("problem", "method", "with", "largest", "s", *headings), rows(group))
        print()
    for chart in drawn:
        figure = Figure(figsize=(7.2, 5.0), layout="constrained")
        errors_over_seconds(figure.add_subplot(), chart)
        draw(figure, folder / f"{chart.name}.png")


def errors_over_seconds(panel: Axes, chart: Chart) -> None:
    """Draw a chart; the curve of the program's default is thick."""
    for mark, (name, dots) in zip("os^vD*Px<>ph" * 2, chart.curves.items(), strict=False):
        ends = [(dot.seconds, max(dot.error, 1e-12), dot.label) for dot in dots if dot.error >= 0]
        if not ends:
            continue
        wide = name.startswith(("default", "penalty", f"{INTEGRATOR}, adaptive"))
        panel.loglog(*np.transpose([end[:2] for end in ends]), mark + "-", label=name,
                     linewidth=2.5 if wide else 1.2)  # fmt: skip
        for x, y, label in ends:
            panel.annotate(label.removeprefix("tolerance "), (x, y), (4, 4),
                           textcoords="offset points", fontsize=6, color="0.35")  # fmt: skip
    panel.set(title=chart.problem, xlabel="seconds", ylabel="largest relative error")
    low, high = panel.get_xlim()
    around = max(1.0, np.sqrt(10.0 * low / high))  # at least a decade, so that noise looks small
    panel.set_xlim(low / around, high * around)
    panel.grid(alpha=0.3, which="both")
    panel.legend(fontsize=8)


# --- whole runs


class Measured(NamedTuple):
    """A run of the command: what it left, processor seconds, and memory (bytes)."""

    run: Finished
    seconds: float
    memory: float


@cache
def measured(name: str, *changes: str) -> Measured:
    """A case run in a process of its own. Raises SystemExit if it fails."""
    with tempfile.TemporaryDirectory() as folder:
        words = run_words(ROOT / "cases" / f"{name}.toml", folder, *changes)
        with Popen(words, stdout=DEVNULL, stderr=DEVNULL, cwd=ROOT) as process:
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f"{' '.join(words)} ended with exit code {process.returncode}")
        run = read_run(Path(folder))
    return Measured(run, used.ru_utime + used.ru_stime, 1024.0 * used.ru_maxrss)


CASES = (
    "thesis_1bar", "thesis_5bar", "paper_1bar", "paper_5bar", "thesis_sliding_1bar",
    "thesis_sliding_5bar", "tread_block", "siped_tread", "load_step", "friction_tester",
    "braking_wheel",
)  # fmt: skip


def cases(given: argparse.Namespace) -> None:
    """Print what each case's mu(t) is off by, mesh and steps together, and draw it."""
    names, meshes, finer = given.cases, given.meshes, given.finer
    changes = [f"model={given.model}"]
    if given.quick:
        names, meshes, finer = names[:1], [0.5], 1.0
        changes.append("load.duration=0.1ms")
    figure = Figure(figsize=(11.0, 2.5 * -(-len(names) * len(meshes) // 3)), layout="constrained")
    panels = figure.subplots(-(-len(names) * len(meshes) // 3), 3, squeeze=False).ravel()
    for panel in panels:
        panel.set_axis_off()

    def rows() -> Iterator[tuple[object, ...]]:
        for panel, (name, mesh) in zip(panels, product(names, meshes), strict=False):
            own = case(name, *changes).numerics.refinement
            run, fine = (
                measured(
                    name, *changes, f"numerics.refinement={times * own}", f"numerics.tolerance={t}"
                ).run
                for times, t in ((mesh, 1e-2), (finer, 1e-2 / 6.0))
            )
            end = min(float(one.history["time_s"][-1]) for one in (run, fine))
            times = np.linspace(0.0, end, 2000)
            mu, exact = (
                np.interp(times, one.history["time_s"], one.history["mu"]) for one in (run, fine)
            )
            off = (mu - exact) / np.mean(exact)
            worst = int(np.abs(off).argmax())
            panel.set_axis_on()
            panel.plot(MS * times, exact, color="C1", linewidth=2.5, alpha=0.6, label="reference")
            panel.plot(MS * times, mu, color="C0", linewidth=0.9, label="run")
            panel.set(
                title=f"{name}, mesh {mesh:g}", xlabel="time, ms", ylabel="mu", ylim=(0.0, None)
            )
            panel.grid(alpha=0.3)
            here, there = run.summary, fine.summary
            yield (
                name, f"{mesh:g}", "0.01", here["dofs"], here["steps"], f"{here['wall_s']:.1f}",
                f"{abs(off[worst]):.2%}", f"{MS * times[worst]:.2f}",
                f"{np.sqrt(np.mean(off**2)):.2%}", f"{here['mu_mean'] / there['mu_mean'] - 1:+.2%}",
                there["dofs"], there["steps"], f"{there['wall_s']:.0f}",
            )  # fmt: skip

    head = ("case", "mesh", "tolerance", "unknowns", "steps", "s", "largest", "at, ms", "rms",
            "of mean mu", "reference: unknowns", "its steps", "its s")  # fmt: skip
    table(head, rows())
    panels[0].legend(fontsize="small")
    draw(figure, given.pictures / f"case_errors_{given.model}.png")


# --- what `iceslide info` expects: short and long, coarse and fine, attached and sliding

# The shape of docs/how-to/shapes.md
SHAPE = (
    "rubber.length=20mm rubber.width=20mm rubber.height=8mm rubber.sipes=4 "
    "rubber.sipe_width=0.4mm rubber.sipe_depth=6mm rubber.edge_radius=0.1mm rubber.draft_angle=5deg"
)
EXPECTED = (
    ("thesis_1bar", "model=point ice.heat=column"),
    ("thesis_5bar", "model=slice ice.heat=half-space numerics.tolerance=1e-2"),
    ("user_mesh", "numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice"),
    ("thesis_1bar", "model=slice ice.heat=column"),
    ("thesis_1bar", "model=slice numerics.refinement=3 numerics.tolerance=1e-2 load.duration=2ms"),
    ("thesis_1bar", "model=slice numerics.refinement=8 numerics.tolerance=1e-2 load.duration=20us"),
    ("thesis_1bar", "model=slice rubber.heat=true ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice rubber.height=0.5mm ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_sliding_1bar", "model=slice"),
    ("tread_block", "model=slice load.duration=2ms"),
    ("thesis_1bar", "numerics.refinement=0.5 ice.heat=column numerics.tolerance=1e-2"),
    ("thesis_1bar", "numerics.tolerance=1e-2 ice.heat=column"),
    ("thesis_1bar", "numerics.refinement=2 ice.heat=column load.duration=20us"),
    ("thesis_sliding_1bar", "model=block numerics.refinement=0.5 numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice numerics.tolerance=1e-2"),
    ("thesis_1bar", "numerics.tolerance=1e-2"),
    ("thesis_1bar", "model=slice ice.heat=mesh"),
    ("thesis_1bar", "model=slice ice.heat=mesh numerics.tolerance=1e-2"),
    ("thesis_1bar", "ice.heat=mesh numerics.tolerance=1e-2"),
    ("thesis_sliding_5bar", "model=slice ice.heat=mesh numerics.tolerance=1e-2"),
    # of docs/how-to and docs/tutorials
    ("siped_tread", "model=slice load.pressure=1bar load.speed=3 numerics.tolerance=1e-2 " + SHAPE),
    ("siped_tread", "model=slice numerics.tolerance=1e-2 " + SHAPE),
    ("thesis_1bar", "model=slice load.passes=10 load.period=1s film.between=freeze "
                    "numerics.tolerance=1e-2"),
    ("tread_block", "rubber.inertia=true"),
    ("thesis_1bar", "model=slice load.duration=2ms rubber.modulus_is=long-term rubber.D1=1e-9 "
                    f"numerics.tolerance=1e-2 rubber.dma={ROOT}/cases/rubber/synthetic_dma.csv"),
    ("siped_tread", "model=block"),
    *((scene.stem, "") for scene in sorted((ROOT / "cases").glob("*.toml"))),
)  # fmt: skip


class Run(NamedTuple):
    """A scene, what was expected, and the steps and seconds that it took."""

    scene: Scene
    expected: cost.Cost
    steps: int
    seconds: float


def estimates(given: argparse.Namespace) -> None:
    """Print what is expected of runs beside what they take, and the constants that fit best."""
    runs: list[Run] = []
    over: list[Array] = []

    def rows() -> Iterator[tuple[object, ...]]:
        for name, words in EXPECTED[:3] if given.quick else EXPECTED:
            found, scene = measured(name, *words.split()), case(name, *words.split())
            expected, steps = cost.estimate(scene), found.run.summary["steps"]
            runs.append(Run(scene, expected, steps, found.seconds))
            took = (steps, found.seconds, found.memory)
            hoped = (expected.steps, expected.time, expected.memory)
            over.append(np.divide(hoped, took))
            yield (
                name, words.replace(f"{ROOT}/", ""), expected.rubber_unknowns,
                expected.ice_unknowns, found.run.summary.get("newton_iterations", 0), steps,
                expected.steps, f"{found.seconds:.1f}", f"{expected.time:.1f}",
                f"{found.memory / 1e6:.0f}", f"{expected.memory / 1e6:.0f}",
            )  # fmt: skip

    head = ("scene", "changes", "unknowns, rubber", "ice", "Newton", "steps", "expected", "s",
            "expected", "MB", "expected")  # fmt: skip
    table(head, rows())
    for what, values in zip(("steps", "seconds", "memory"), np.array(over).T, strict=True):
        print(f"{what}, expected over measured: {spread(values)}")
    fit(runs)
    many = ("load.period=1s", f"load.passes={10 if given.quick else 1000}")
    scene = case("thesis_sliding_1bar", "model=point", "film.carrier=ice", *many)
    (_, entries), seconds = timed(lambda: point_history(scene), 1)
    print(f"POINT_SECONDS = {seconds / entries['steps']:.2g}")


def fit(runs: Sequence[Run]) -> None:
    """Print the constants that fit the seconds of these runs best, in relative terms.

    They are those of the start, and two of plane, of space, of continuum ice and of meshed ice.
    """
    parts = np.zeros((len(runs), 9))
    for row, run in zip(parts, runs, strict=True):
        row[0] = 1.0
        if run.scene.model == "point":
            continue
        _, rubber, ice = run.expected[:3]
        steps = (run.steps + cost.START_STEPS) * cost.work_of_cuts(run.scene)
        first, power = (
            (1, cost.work_power(2)) if run.scene.model == "slice" else (3, cost.work_power(3))
        )
        row[first : first + 2] = steps, steps * rubber**power
        if ice:
            of_ice = 7 if run.scene.ice.heat == "mesh" else 5
            row[of_ice : of_ice + 2] = steps, steps * ice
    seconds = np.array([run.seconds for run in runs])
    (start, *pairs), _ = nnls(parts / seconds[:, None], np.ones(len(runs)))
    print("\nconstants that fit best (0: not in these runs, or lost in another one):")
    print(f"START_SECONDS = {start:.2g}")
    names = ("PLANE", "SPACE", "ICE", "MESHED")
    for name, pair in zip(names, np.reshape(pairs, (4, 2)), strict=True):
        print(f"{name}_SECONDS = {pair[0]:.2g}, {pair[1]:.2g}")
    print(f"seconds by them, over measured: {spread(parts @ [start, *pairs] / seconds)}")


def spread(values: Array) -> str:
    """Smallest, median and largest."""
    return f"{values.min():.2f}, {np.median(values):.2f}, {values.max():.2f}"


CHARTS = {"film": film, "ice": ice, "contact": contact, "coupling": coupling, "scenes": scenes}
WHOLE = {"cases": cases, "estimates": estimates}


def main() -> None:
    """Print the tables and draw the charts."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse charts, a few minutes")
    parser.add_argument("--questions", nargs="+", choices=(*CHARTS, *WHOLE), default=[*CHARTS])
    parser.add_argument("--cases", nargs="+", default=CASES, help="those of the folder cases")
    parser.add_argument("--model", choices=("slice", "block"), default="slice", help="of cases")
    parser.add_argument("--meshes", nargs="+", type=float, default=[1.0], help="times as fine")
    parser.add_argument("--finer", type=float, default=2.0, help="the mesh to compare cases with")
    picture_options(parser, "docs/accuracy")
    given = parser.parse_args()
    for name in given.questions:
        if name in CHARTS:
            report(CHARTS[name](given.quick), given.pictures)
        else:
            WHOLE[name](given)


if __name__ == "__main__":
    main()
