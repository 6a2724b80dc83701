"""Where do the methods fail? Maps of converged, with cut-backs, refused with a message, failed.

Each map varies two or three parameters and classifies every combination. Maps are drawn, their
counts, and the sentence of every refusal, printed in Markdown. The full form takes about an hour,
--quick a few minutes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import explicit_stage
from iceslide_fem.film.loads import film_loads
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.build import build_block
from iceslide_fem.rubber.contact import default_penalty
from iceslide_fem.rubber.equilibrium import Solution, TractionLaw
from iceslide_fem.rubber.press import press
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene import Scene, put, scene_from_dict
from iceslide_fem.scene.materials import (
    BAR,
    COMPOUNDS,
    MELTING_ENTHALPY,
    WATER_VISCOSITY,
    MooneyRivlin,
)
from scripts.studies import blocks, common, press_elements

CONVERGED, CUT_BACK, REFUSED, FAILED = "converged", "with cut-backs", "refused", "failed"
SMALL, MEDIUM, LARGE = "below 3 %", "below 10 %", "above 10 %"  # of a comparison
GREEN, YELLOW, ORANGE, RED = "#9AD3BC", "#F6E58D", "#F5B27A", "#D9534F"
COLORS = {
    CONVERGED: GREEN, CUT_BACK: YELLOW, REFUSED: ORANGE, FAILED: RED,
    SMALL: GREEN, MEDIUM: YELLOW, LARGE: ORANGE,
}  # fmt: skip
MARKS = {CUT_BACK: "c", REFUSED: "r", FAILED: "F"}
MU_SANE = 100.0  # friction above this is a failure even if it is called converged


class Cell(NamedTuple):
    """Classification of one combination, what is written into its cell, and a message."""

    kind: str
    text: str = ""
    message: str = ""


class Map(NamedTuple):
    """A map: axes with their labels and values, cells[y][x], and curves (name -> x, y index)."""

    name: str
    title: str
    x_label: str
    x: Sequence[Any] | Array
    y_label: str
    y: Sequence[Any] | Array
    cells: list[list[Cell]]
    curves: dict[str, Array] = {}


def classified(task: Callable[[], Cell]) -> Cell:
    """The cell of a task; a stop with its sentence is a refusal, any other error a failure."""
    try:
        with np.errstate(all="ignore"):
            return task()
    except SimulationStopped as reason:
        return Cell(REFUSED, message=str(reason))
    except Exception as reason:  # whatever it is, the map says that it happened
        return Cell(FAILED, message=f"{type(reason).__name__}: {reason}")


def classify(
    name: str,
    title: str,
    x: tuple[str, Sequence[Any] | Array],
    y: tuple[str, Sequence[Any] | Array],
    task: Callable[..., Cell],
) -> Map:
    """Classify `task(x, y)` at all combinations."""
    cells = [[classified(partial(task, a, b)) for a in x[1]] for b in y[1]]
    return Map(name, title, x[0], x[1], y[0], y[1], cells)


# --- the film law alone


def film_scene(**changes: Any) -> dict[str, Any]:
    """Conditions of a point of compound B at 1 bar, 3 m/s, -4 degC."""
    values = {"pressure": 1e5, "speed": 3.0, "temperature": 269.15, "k": 0.266, "D": 29e-6,
              "H_V": 2.86e-6, "initial_height": 70e-9, "duration": 7e-3}  # fmt: skip
    return values | changes


def film_point(
    integrator: str = "sdirk2",
    step: float | None = None,
    tolerance: float = 1e-3,
    shown: Callable[[Any], str] = lambda result: "",
    **changes: Any,
) -> Cell:
    """One point; fixed steps if `step` (s) is given."""
    conditions = Conditions.of(**film_scene(**changes))
    result = simulate(conditions, "column", tolerance, integrator, fixed_step=step)
    mu = np.array([result.mu_peak[0], result.mu_mean[0], result.mu_end[0]])
    if not (np.isfinite(mu).all() and (mu > 0.0).all()):
        return Cell(FAILED, message=f"mu = {mu}")
    return Cell(CONVERGED, shown(result))


def film_error(integrator: str, step: float, **changes: Any) -> Cell:
    """One point with fixed steps, and how far its mean mu is from that of an accurate run, in %.

    Explicit Euler runs without its guard; in brackets is what the guard refuses.
    """
    conditions = Conditions.of(**film_scene(**changes))
    exact = simulate(conditions, tolerance=1e-4).mu_mean[0]
    method = INTEGRATORS[integrator]
    if integrator == "explicit-euler":
        method = method._replace(stage=partial(explicit_stage, largest_change=np.inf))
    error = abs(simulate(conditions, integrator=method, fixed_step=step).mu_mean[0] / exact - 1.0)
    if not np.isfinite(error):
        return Cell(FAILED, message=f"relative error {error}")
    kind = SMALL if error < 0.03 else MEDIUM if error < 0.1 else LARGE
    text = f"{100.0 * error:.2g}"
    try:
        simulate(conditions, integrator=integrator, fixed_step=step)
    except SimulationStopped:
        text = f"({text})"
    return Cell(kind, text)


def explicit_limit(**changes: Any) -> float:
    """Smallest 2 / |d rate / d h| (s) on an accurate run: explicit Euler's linear limit.

    d rate / d h = K1/h^2 while it melts, and 3 K3 h^2 until the free volume is full.
    """
    conditions = Conditions.of(**film_scene(**changes))
    loads = conditions.loads()
    K1 = float(loads.viscous[0] * loads.speed[0]) / MELTING_ENTHALPY
    K3 = float(loads.squeeze_rate[0])
    limits = [2.0 / (3.0 * K3 * float(conditions.initial_height[0]) ** 2)]

    def observe(record: Any) -> None:
        h = float(np.exp(record.step.state.log_height[0]))
        rate = (K1 / h**2 if record.melting[0] else 0.0) + (
            0.0 if record.full[0] else 3 * K3 * h**2
        )
        limits.append(2.0 / rate if rate else np.inf)

    simulate(conditions, "column", 1e-3, observe=observe)
    return min(limits)


def film_steps(quick: bool) -> Iterable[Map]:
    """Time step against integrator."""
    count = 7 if quick else 13
    steps = np.logspace(-6, -3, count)
    methods = list(INTEGRATORS)

    def mean(result: Any) -> str:
        return f"{result.mu_mean[0]:.3f}"

    found = classify(
        "film_integrators", "Fixed steps of the film law, 1 bar, 3 m/s, 7 ms: mean mu in the cells",
        ("step (s)", steps), ("integrator", methods),
        lambda dt, method: film_point(method, dt, shown=mean),
    )  # fmt: skip
    yield found._replace(curves={"linear limit of explicit Euler": _at(steps, explicit_limit())})


def film_limits(quick: bool) -> Iterable[Map]:
    """Steps over explicit Euler's linear limit against initial height and speed."""
    relative = np.array([0.1, 0.5, 0.9, 1.1, 1.4, 1.6, 2.0, 3.0, 5.0, 10.0, 100.0, 1000.0])
    relative = relative[[0, 2, 4, 5, 7, 9, 11]] if quick else relative
    heights = [1e-9, 3e-9, 1e-8, 3e-8, 7e-8, 3e-7, 1e-6]
    speeds = [1e-3, 1e-2, 0.1, 1.0, 3.0, 10.0, 30.0]
    for method in ("explicit-euler", "sdirk2") if quick else INTEGRATORS:
        for name, label, key, values in (
            ("height", "h0 (m)", "initial_height", heights),
            ("speed", "speed (m/s)", "speed", speeds),
        ):
            limits = {value: explicit_limit(**{key: value}) for value in values}

            def point(ratio: float, value: float, key: str = key, limits: Any = limits,
                      method: str = method) -> Cell:  # fmt: skip
                dt = ratio * limits[value]
                duration = min(7e-3, 2000 * dt)
                changes = {key: value, "duration": duration}
                return film_error(method, min(dt, duration), **changes)

            found = classify(
                f"film_{method}_{name}",
                f"{method}: error of mean mu in %; in brackets what is refused",
                ("step / linear limit", relative), (label, values), point,
            )  # fmt: skip
            yield found._replace(curves={"linear limit": _at(relative, 1.0)})


def film_weather(quick: bool) -> Iterable[Map]:
    """Ice temperature against speed with adaptive steps: melts when, saturates when."""
    speeds = [1e-3, 1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0]
    celsius = [-40.0, -20.0, -10.0, -4.0, -1.0, -0.1]

    def when(result: Any) -> str:
        def time(at: float, sign: str) -> str:
            return f"{sign} {1e3 * at:.2g}" if np.isfinite(at) else ""

        parts = (time(result.melt_onset[0], "m"), time(result.saturation[0], "s"))
        return "\n".join(filter(None, parts)) or "dry"

    for pressure in (1.0, 5.0):
        k, D, H_V = (0.266, 29e-6, 2.86e-6) if pressure == 1.0 else (0.405, 46.5e-6, 0.56e-6)
        for h0 in (70e-9,) if quick else (70e-9, 1e-9):
            yield classify(
                f"film_weather_{pressure:g}bar_{1e9 * h0:g}nm",
                f"Point, {pressure:g} bar, h0 = {1e9 * h0:g} nm, 7 ms: m(elts), s(aturates) at ms",
                ("speed (m/s)", speeds), ("ice (degC)", celsius),
                lambda v, T, p=pressure, k=k, D=D, H=H_V, h=h0: film_point(
                    shown=when, speed=v, temperature=273.15 + T, pressure=p * BAR, k=k, D=D, H_V=H,
                    initial_height=h,
                ),
            )  # fmt: skip


def _at(values: Array, where: float) -> Array:
    """Fractional index of `where` on the logarithmic axis `values`."""
    return np.asarray(np.interp(np.log(where), np.log(values), np.arange(len(values))))


# --- blocks


@dataclass(eq=False)
class Counting(Block):
    """A block that counts equilibria not found."""

    failures: list[str]

    def balance(self, law: TractionLaw, load: float = 1.0, friction: float = np.inf) -> Solution:
        try:
            return super().balance(law, load, friction)
        except NotConverged as reason:
            self.failures.append(str(reason))
            raise


def a_scene(**changes: Any) -> Scene:
    """thesis_1bar as a coarse slice with columns; changes by dotted keys with __ for dots."""
    data: dict[str, Any] = {
        "name": "atlas",
        "model": "slice",
        "rubber": {"compound": "B"},
        "load": {"pressure": 1e5, "speed": 3.0, "duration": 4e-3},
        "numerics": {"tolerance": 1e-2},
    }
    for key, value in changes.items():
        put(data, key.replace("__", "."), value)
    return scene_from_dict(data)


def counting(scene: Scene) -> Counting:
    """The scene's block, counting."""
    return Counting(**common.fields_of(build_block(scene, MPI.COMM_SELF)), failures=[])


def pressed(scene: Scene, mu: float) -> Cell:
    """Press under a shear of `mu` times the pressure; the cell shows the contact's share."""
    block = counting(scene)
    press(block, lambda _: None, blocks.shear_of_pressure(mu))
    contact = block.contact
    touching = np.where(contact.pressure > 0.0, contact.area, 0.0)
    share = block.surface.total(np.ones_like(touching), touching) / block.area
    return Cell(CUT_BACK if block.failures else CONVERGED, f"{share:.2f}")


def slid(scene: Scene) -> Cell:
    """Press, bring to speed and slide; the cell shows the mean friction."""
    block = counting(scene)
    mu = blocks.slid(scene, block).mean
    if not 0.0 < mu < MU_SANE:
        return Cell(FAILED, message=f"mu = {mu}")
    return Cell(CUT_BACK if block.failures else CONVERGED, f"{mu:.3f}")


REFERENCE = press_elements.REFERENCE
MESHES = {"slice x 0.5": ("slice", 0.5), "slice": ("slice", 1.0), "block x 0.5": ("block", 0.5)}


def penalties(quick: bool) -> Iterable[Map]:
    """Penalty against shear ramp pressure on several meshes, and against the time step."""
    usual = default_penalty(COMPOUNDS["B"], 1e-3, 0.1)
    factors = [0.1, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 10.0, 100.0]
    if quick:
        factors = [0.1, 0.25, 0.5, 1.0, 2.0, 10.0]
    ramps = [0.002, 0.02, 0.05, 0.2] if quick else [0.0005, 0.002, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5]
    labels = [value(float(f"{factor * usual / 1e9:.2g}")) for factor in factors]
    for mesh, (model, refinement) in list(MESHES.items())[: 1 if quick else 3]:
        if model == "block":
            factors, ramps = [0.1, 0.25, 0.5, 1.0, 2.0, 10.0], [0.002, 0.05, 0.2]
            labels = [value(float(f"{factor * usual / 1e9:.2g}")) for factor in factors]
        for pressure in (1.0,) if quick or model == "block" else (1.0, 5.0):
            found = classify(
                f"penalty_ramp_{mesh.replace(' ', '')}_{pressure:g}bar",
                f"{mesh}, {pressure:g} bar, until {2 if model == 'block' else 4} ms: mean mu",
                ("penalty (MPa/mm)", factors), ("shear ramp pressure / p", ramps),
                lambda f, r, m=model, n=refinement, p=pressure: slid(
                    a_scene(model=m, load__pressure=p * BAR, numerics__penalty=f * usual,
                            load__duration=2e-3 if m == "block" else 4e-3,
                            load__speed=4.0 if m == "block" else 3.0,
                            numerics__refinement=n, numerics__shear_ramp_pressure=r * p * BAR)
                ),
            )  # fmt: skip
            yield found._replace(x=labels)
    steps = [1e-3, 3e-4, 1e-4, 3e-5] if quick else [4e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5]
    yield classify(
        "penalty_step", "Slice x 0.5, implicit Euler at fixed steps, 4 ms: mean mu",
        ("penalty (MPa/mm)", factors), ("step (s)", steps),
        lambda f, dt: slid(
            a_scene(numerics__penalty=f * usual, numerics__refinement=0.5, numerics__max_step=dt,
                    numerics__film_integrator="implicit-euler")
        ),
    )._replace(x=labels)  # fmt: skip


def friction(quick: bool) -> Iterable[Map]:
    """Friction level against pressure in the press: lift-off, chatter, fold-over."""
    levels = [0.05, 0.15, 0.3, 0.6, 1.0, 1.5] if quick else [0.05, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6,
                                                              0.8, 1.0, 1.25, 1.5]  # fmt: skip
    bars = [0.2, 1.0, 5.0, 10.0] if quick else [0.2, 0.5, 1.0, 2.0, 3.5, 5.0, 7.0, 10.0]
    for mesh, (model, refinement) in list(MESHES.items())[: 1 if quick else 3]:
        yield classify(
            f"friction_pressure_{mesh.replace(' ', '')}",
            f"{mesh}: press under a shear of mu p; contact over nominal area",
            ("mu", levels), ("pressure (bar)", bars),
            lambda mu, p, m=model, n=refinement: pressed(
                a_scene(model=m, load__pressure=p * BAR, numerics__refinement=n), mu
            ),
        )  # fmt: skip


def aspects(quick: bool) -> Iterable[Map]:
    """Height over length against friction: bending, buckling, loss of contact."""
    levels = [0.05, 0.3, 0.6, 1.0] if quick else [0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0]
    heights = [0.3, 1.0, 3.0] if quick else [0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0]
    for pressure in (1.0,) if quick else (0.5, 1.0, 3.0):
        yield classify(
            f"aspect_friction_{pressure:g}bar",
            f"Slice x 0.5, {pressure:g} bar: press under a shear of mu p; contact over nominal",
            ("mu", levels), ("height / length", heights),
            lambda mu, h, p=pressure: pressed(
                a_scene(rubber__height=h * 1e-3, load__pressure=p * BAR, numerics__refinement=0.5),
                mu,
            ),
        )  # fmt: skip


def weather(quick: bool) -> Iterable[Map]:
    """Ice temperature against speed for a slice, default settings."""
    speeds = [1e-3, 0.1, 3.0, 30.0] if quick else [1e-3, 1e-2, 0.1, 1.0, 3.0, 6.0, 10.0, 30.0]
    celsius = [-40.0, -4.0, -0.1] if quick else [-40.0, -20.0, -4.0, -1.0, -0.1]
    for motion in ("attached",) if quick else ("attached", "sliding"):
        yield classify(
            f"slice_weather_{motion}",
            f"Slice x 0.5, 1 bar, {motion} ice: mean mu",
            ("speed (m/s)", speeds), ("ice (degC)", celsius),
            lambda v, T, m=motion: slid(
                a_scene(load__speed=v, ice__temperature=273.15 + T, ice__motion=m,
                        load__duration=4e-3 if m == "attached" else min(4e-3, 2e-3 / v),
                        numerics__refinement=0.5)
            ),
        )  # fmt: skip


def inertia(quick: bool) -> Iterable[Map]:
    """Quasi-static against dynamic: a column of rubber in shear on the film law."""
    heights = [1.0, 10.0, 50.0] if quick else [1.0, 3.0, 5.0, 10.0, 20.0, 50.0]
    speeds = [1.0, 3.0, 10.0] if quick else [0.3, 1.0, 2.0, 3.0, 5.0, 10.0]
    for pressure in (1.0, 5.0):
        yield classify(
            f"inertia_{pressure:g}bar",
            f"Shear column, {pressure:g} bar, 7 ms: largest change of mu(t) by inertia",
            ("speed (m/s)", speeds), ("height (mm)", heights),
            lambda v, H, p=pressure: sheared_column(1e-3 * H, v, p * BAR),
        )  # fmt: skip


def sheared_column(height: float, speed: float, pressure: float) -> Cell:
    """mu(t) of a column of rubber with and without its mass, below a plate at constant speed.

    Linear elements of the shear modulus, lumped masses, Newmark's average acceleration; the film's
    shear is k eta / h times the slip speed, at the height before the step.
    """
    material, rho, n = COMPOUNDS["B"], 1100.0, 12
    G = material.shear_modulus
    scene = a_scene(load__pressure=pressure, load__speed=speed)
    k, D, H_V, _ = scene.contact_parameters(pressure)
    duration, wave = 7e-3, height * np.sqrt(rho / G)
    dt = duration / int(np.ceil(max(duration / (wave / n), 400)))
    cell = height / n
    stiffness = G / cell * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[0, 0] = G / cell  # node 0 is on the ice; the plate holds the node after the last
    mass = rho * cell * np.ones(n)
    mass[0] /= 2.0
    curves = []
    for inertial in (True, False):
        heat = Column(scene.ice.temperature, duration)
        state = InterfaceState(np.log([scene.film.initial_height]), np.zeros(1), heat.initial(1))
        M = np.diag(mass) * inertial
        c = float(k) * WATER_VISCOSITY / scene.film.initial_height
        u = np.linalg.solve(stiffness, -c * speed * np.eye(n)[0])
        velocity, acceleration = np.zeros(n), np.zeros(n)
        mu = [c * speed / pressure]
        while len(mu) <= round(duration / dt):
            c = float(k) * WATER_VISCOSITY / float(np.exp(state.log_height[0]))
            dashpot = np.zeros((n, n))
            dashpot[0, 0] = c
            push = -c * speed * np.eye(n)[0]
            if inertial:  # Newmark, beta = 1/4, gamma = 1/2
                guess = u + dt * velocity + dt**2 / 4.0 * acceleration
                guess_v = velocity + dt / 2.0 * acceleration
                matrix = M + dt / 2.0 * dashpot + dt**2 / 4.0 * stiffness
                acceleration = np.linalg.solve(matrix, push - dashpot @ guess_v - stiffness @ guess)
                u = guess + dt**2 / 4.0 * acceleration
                velocity = guess_v + dt / 2.0 * acceleration
            else:
                new = np.linalg.solve(stiffness + dashpot / dt, push + dashpot @ u / dt)
                velocity, u = (new - u) / dt, new
            slip = np.array([speed + velocity[0]])
            loads = film_loads(np.array([pressure]), slip, k, D, H_V)
            state = advance(state, loads, loads, dt, heat, INTEGRATORS["sdirk2"]).state
            mu.append(c * float(slip[0]) / pressure)
        curves.append(np.array(mu))
    change = float(np.max(np.abs(curves[0] / curves[1] - 1.0)))
    if not np.isfinite(change):
        return Cell(FAILED, message="not finite")
    kind = SMALL if change < 0.03 else MEDIUM if change < 0.1 else LARGE
    return Cell(kind, f"{change:.1%}")


def compressibility(quick: bool) -> Iterable[Map]:
    """Poisson's ratio against element in the frictionless press and under shear."""
    ratios = [0.45, 0.49, 0.499, 0.4995] if quick else [0.45, 0.48, 0.49, 0.495, 0.498, 0.499,
                                                         0.4995, 0.4999]  # fmt: skip
    E = COMPOUNDS["B"].youngs_modulus
    fine = 4 if quick else 8
    for pressure, mu, n in ((1.0, 0.0, fine), (5.0, 0.0, fine), (5.0, 0.15, 4)):
        exact: dict[float, float] = {}

        def point(nu: float, name: str, p: float = pressure, mu: float = mu, n: int = n,
                  exact: dict[float, float] = exact) -> Cell:  # fmt: skip
            G = E / (2.0 * (1.0 + nu))
            material = MooneyRivlin.from_nu(0.3 * G, 0.2 * G, nu)
            element = press_elements.ELEMENTS[name]
            grid = press_elements.half_cube(n)
            found = press_elements.pressed(element, grid, p * BAR, mu, material)
            if found.reached < 1.0:
                return Cell(
                    REFUSED, f"{found.reached:.0%}", f"stops at {found.reached:.0%} of the load"
                )
            if name == REFERENCE:
                exact[nu] = found.displacement
            error = found.displacement / exact[nu] - 1.0 if nu in exact else np.nan
            return Cell(
                CONVERGED, f"{error:+.1%}" if nu in exact else f"{1e6 * found.displacement:.0f} um"
            )

        names = [REFERENCE, *(x for x in press_elements.ELEMENTS if x != REFERENCE)]
        yield classify(
            f"nu_element_{pressure:g}bar_{mu:g}",
            f"n = {n}, {pressure:g} bar, {mu:g} p: plate against mixed",
            ("Poisson's ratio", ratios), ("element", names), point,
        )  # fmt: skip


# --- output

MAPS: dict[str, Callable[[bool], Iterable[Map]]] = {
    "film": film_steps,
    "film-limits": film_limits,
    "film-weather": film_weather,
    "friction": friction,
    "aspect": aspects,
    "penalty": penalties,
    "weather": weather,
    "nu": compressibility,
    "inertia": inertia,
}


def value(x: Any) -> str:
    """A value of an axis as one would write it."""
    return x if isinstance(x, str) else f"{x:.4g}"


def draw(found: Map, path: Path) -> None:
    """Draw the map."""
    columns, rows = len(found.x), len(found.y)
    figure = Figure(figsize=(2.6 + 0.72 * columns, 1.9 + 0.5 * rows), layout="constrained")
    panel = figure.add_subplot()
    for j, line in enumerate(found.cells):
        for i, cell in enumerate(line):
            color = COLORS[cell.kind]
            square = Rectangle((i - 0.5, j - 0.5), 1.0, 1.0, facecolor=color, edgecolor="white")
            panel.add_patch(square)
            panel.text(
                i, j, cell.text or MARKS.get(cell.kind, ""), ha="center", va="center", fontsize=7
            )
    for (name, at), style in zip(found.curves.items(), ("--", ":"), strict=False):
        panel.axvline(float(at), color="black", linestyle=style, linewidth=1.5, label=name)
    panel.set(xlim=(-0.5, columns - 0.5), ylim=(-0.5, rows - 0.5), title=found.title,
              xlabel=found.x_label, ylabel=found.y_label)  # fmt: skip
    panel.title.set_fontsize(10)
    panel.set_xticks(range(columns), [value(x) for x in found.x], fontsize=8)
    panel.set_yticks(range(rows), [value(y) for y in found.y], fontsize=8)
    kinds = {cell.kind for line in found.cells for cell in line}
    handles = [
        Patch(color=COLORS[kind], label=f"{kind} ({MARKS[kind]})" if kind in MARKS else kind)
        for kind in COLORS
        if kind in kinds
    ]
    figure.legend(handles=[*handles, *panel.get_legend_handles_labels()[0]],
                  loc="outside lower center", ncols=3, fontsize=7, frameon=False)  # fmt: skip
    common.draw(figure, path, 120)


def report(found: Map, seconds: float) -> None:
    """Print counts and messages of the map."""
    cells = [cell for line in found.cells for cell in line]
    counts = Counter(cell.kind for cell in cells)
    print(f"\n### {found.title}\n\n({found.name}, {seconds:.0f} s)\n")
    print(", ".join(f"{kind}: {counts[kind]}" for kind in COLORS if counts[kind]) + "\n")
    rows = []
    for y, line in zip(found.y, found.cells, strict=True):
        words = [
            " ".join(filter(None, [cell.text.replace("\n", " "), MARKS.get(cell.kind)]))
            for cell in line
        ]
        rows.append((value(y), *(word or "." for word in words)))
    common.table((f"{found.y_label} \\ {found.x_label}", *map(value, found.x)), rows)
    messages = Counter(cell.message for cell in cells if cell.message)
    if messages:
        print()
    for message, count in messages.most_common(8):
        print(f"- {count} x {message}")
    print(end="", flush=True)


def main() -> None:
    """Draw and print the maps."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse maps, a few minutes")
    common.picture_options(parser, "docs/stability")
    parser.add_argument("--maps", nargs="+", choices=list(MAPS), default=list(MAPS))
    options = parser.parse_args()
    for name in options.maps:
        started = monotonic()
        for found in MAPS[name](options.quick):
            report(found, monotonic() - started)
            draw(found, options.pictures / f"{found.name}.png")
            started = monotonic()


if __name__ == "__main__":
    main()
