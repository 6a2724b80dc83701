"""Where methods fail, what a block carries, and how large it can be.

`maps` vary two parameters and classify every combination: converged, with cut-backs, refused with a
sentence, failed. `envelope` presses a block of 1 mm of compound B towards 10 bar under a shear of
mu times the local pressure, and where it finds no more load its plate is lowered until it carries
less: such a path is the same for every nominal pressure below, so one press gives the boundary of
all of them. `sizes` slides the 3-D tread block for a moment, in processes of its own: seconds per
step and memory against unknowns, direct and iterative, on 1 and 2 ranks. What a step spends where
is sampled every millisecond of it: time belongs to the part of the innermost module that has one;
on 2 ranks it is that of the one that is busier with steps, with its waiting. All of it takes hours,
--quick minutes.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import signal
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from time import process_time
from types import FrameType
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from iceslide_fem import simulate as command
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.law import explicit_stage
from iceslide_fem.film.loads import film_loads
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.mechanics.block import Block, build_block
from iceslide_fem.mechanics.contact import default_penalty
from iceslide_fem.mechanics.loaded_block import Solution, TractionLaw
from iceslide_fem.mechanics.press import PathPoint, press
from iceslide_fem.mesh.size import unknowns
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
from scripts.studies import blocks, press_elements
from scripts.studies.common import (
    ROOT,
    case,
    draw,
    fault,
    fields_of,
    on_ranks,
    options,
    picture_options,
    table,
)

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


def film_error(step: float, **changes: Any) -> Cell:
    """One point by explicit Euler without its guard, at fixed steps (s): error of mean mu in %.

    In brackets is what the guard refuses.
    """
    conditions, integrator = Conditions.of(**film_scene(**changes)), "explicit-euler"
    exact = simulate(conditions, tolerance=1e-4).mu_mean[0]
    stage = partial(explicit_stage, largest_change=np.inf)
    method = INTEGRATORS[integrator]._replace(stage=stage)
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
    """Steps over explicit Euler's linear limit against initial height."""
    relative = np.array([0.1, 0.5, 0.9, 1.1, 1.4, 1.6, 2.0, 3.0, 5.0, 10.0, 100.0, 1000.0])
    relative = relative[[0, 2, 4, 5, 7, 9, 11]] if quick else relative
    heights = [1e-9, 3e-9, 1e-8, 3e-8, 7e-8, 3e-7, 1e-6]
    limits = {height: explicit_limit(initial_height=height) for height in heights}

    def point(ratio: float, height: float) -> Cell:
        step = ratio * limits[height]
        duration = min(7e-3, 2000 * step)
        return film_error(min(step, duration), initial_height=height, duration=duration)

    found = classify(
        "film_explicit-euler_height",
        "explicit-euler: error of mean mu in %; in brackets what is refused",
        ("step / linear limit", relative), ("h0 (m)", heights), point,
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
        yield classify(
            f"film_weather_{pressure:g}bar_70nm",
            f"Point, {pressure:g} bar, h0 = 70 nm, 7 ms: m(elts), s(aturates) at ms",
            ("speed (m/s)", speeds), ("ice (degC)", celsius),
            lambda v, T, p=pressure, k=k, D=D, H=H_V: film_point(
                shown=when, speed=v, temperature=273.15 + T, pressure=p * BAR, k=k, D=D, H_V=H
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

    def balance(self, law: TractionLaw, *settings: Any, **more: Any) -> Solution:
        try:
            return super().balance(law, *settings, **more)
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
    return Counting(**fields_of(build_block(scene, MPI.COMM_SELF)), failures=[])


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
    """Penalty against shear ramp pressure on several meshes."""
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
    yield classify(
        "aspect_friction_1bar",
        "Slice x 0.5, 1 bar: press under a shear of mu p; contact over nominal",
        ("mu", levels), ("height / length", heights),
        lambda mu, h: pressed(
            a_scene(rubber__height=h * 1e-3, numerics__refinement=0.5), mu
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
    yield classify(
        "inertia_1bar",
        "Shear column, 1 bar, 7 ms: largest change of mu(t) by inertia",
        ("speed (m/s)", speeds), ("height (mm)", heights),
        lambda v, H: sheared_column(1e-3 * H, v),
    )  # fmt: skip


def sheared_column(height: float, speed: float, pressure: float = BAR) -> Cell:
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
    """Poisson's ratio against element in the frictionless press by 1 bar."""
    ratios = [0.45, 0.49, 0.499, 0.4995] if quick else [0.45, 0.48, 0.49, 0.495, 0.498, 0.499,
                                                         0.4995, 0.4999]  # fmt: skip
    E, n = COMPOUNDS["B"].youngs_modulus, 4 if quick else 8
    exact: dict[float, float] = {}

    def point(nu: float, name: str) -> Cell:
        G = E / (2.0 * (1.0 + nu))
        material = MooneyRivlin.from_nu(0.3 * G, 0.2 * G, nu)
        element, grid = press_elements.ELEMENTS[name], press_elements.half_cube(n)
        found = press_elements.pressed(element, grid, BAR, 0.0, material)
        if found.reached < 1.0:
            said = f"{found.reached:.0%}"
            return Cell(REFUSED, said, f"stops at {said} of the load")
        if name == REFERENCE:
            exact[nu] = found.displacement
        if nu not in exact:
            return Cell(CONVERGED, f"{1e6 * found.displacement:.0f} um")
        return Cell(CONVERGED, f"{found.displacement / exact[nu] - 1.0:+.1%}")

    names = [REFERENCE, *(x for x in press_elements.ELEMENTS if x != REFERENCE)]
    yield classify(
        "nu_element_1bar_0", f"n = {n}, 1 bar, 0 p: plate against mixed",
        ("Poisson's ratio", ratios), ("element", names), point,
    )  # fmt: skip


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


def map_drawn(found: Map) -> Figure:
    """The map as a picture."""
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
    return figure


def print_map(found: Map) -> None:
    """Print counts and messages of the map."""
    cells = [cell for line in found.cells for cell in line]
    counts = Counter(cell.kind for cell in cells)
    print(f"\n### {found.title}\n\n({found.name})\n")
    print(", ".join(f"{kind}: {counts[kind]}" for kind in COLORS if counts[kind]) + "\n")
    rows = []
    for y, line in zip(found.y, found.cells, strict=True):
        words = [
            " ".join(filter(None, [cell.text.replace("\n", " "), MARKS.get(cell.kind)]))
            for cell in line
        ]
        rows.append((value(y), *(word or "." for word in words)))
    table((f"{found.y_label} \\ {found.x_label}", *map(value, found.x)), rows)
    messages = Counter(cell.message for cell in cells if cell.message)
    if messages:
        print()
    for message, count in messages.most_common(8):
        print(f"- {count} x {message}")


def maps(given: argparse.Namespace) -> None:
    """Draw and print the maps."""
    for name in given.maps:
        for found in MAPS[name](given.quick):
            print_map(found)
            draw(map_drawn(found), given.pictures / f"{found.name}.png", 120)


# --- what a block carries

OF_ENVELOPE = {**MESHES, "slice x 2": ("slice", 2.0), "block": ("block", 1.0)}
DRAWN = {"slice": "C0o-", "slice x 2": "C1s--", "block x 0.5": "C2^:", "block": "C3v"}
RADII = (100.0, 0.0)  # um
LEVELS = (0.2, 0.3, 0.45, 0.6, 0.8)
MOST = 10.0  # bar


def carried(mesh: str, radius: float, mu: float) -> tuple[float, str]:
    """The largest pressure (bar) under a shear of `mu` times the local one, and why no more."""
    model, refinement = OF_ENVELOPE[mesh]
    changes = (
        f"model={model}", f"numerics.refinement={refinement}", f"load.pressure={MOST} bar",
        f"rubber.edge_radius={radius} um", "numerics.tolerance=1e-2",
    )  # fmt: skip
    block = build_block(case("thesis_1bar", *changes), MPI.COMM_SELF)
    loads, message = [0.0], ""

    def observe(point: PathPoint) -> None:
        loads.append(point.load)

    try:
        press(block, observe, blocks.shear_of_pressure(mu))
    except SimulationStopped as reason:
        message = str(reason)
    return MOST * max(loads), message


def envelope(given: argparse.Namespace) -> None:
    """Print and draw the largest pressure over friction, with sharp and with round edges."""
    start_petsc()
    levels, meshes = (LEVELS[::2], ["slice"]) if given.quick else (LEVELS, [*DRAWN])
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels = dict(zip(RADII, figure.subplots(1, len(RADII), sharey=True), strict=True))
    said: list[str] = []

    def rows() -> Iterator[tuple[object, ...]]:
        for radius, mesh in product(RADII, meshes):
            found = [carried(mesh, radius, mu) for mu in levels]
            for mu, (_, message) in zip(levels, found, strict=True):
                said.extend([f"- {mesh}, {radius:g} um, mu = {mu:g}: {message}"] * bool(message))
            pressures = [pressure for pressure, _ in found]
            panels[radius].plot(levels, pressures, DRAWN[mesh], label=mesh, markersize=4)
            yield mesh, f"{radius:g} um", *(f"{pressure:.2f}" for pressure in pressures)

    table(("mesh", "edge", *(f"mu = {mu:g}" for mu in levels)), rows())
    print("", *said, sep="\n")
    for radius, panel in panels.items():
        title = f"edges of {radius:g} µm" if radius else "sharp edges"
        panel.set(xlabel="μ", ylabel="largest pressure carried (bar)", title=title)
        panel.set_ylim(0.0, 1.05 * MOST)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8)
    draw(figure, given.pictures / "envelope.png")


# --- how large a block can be

MECHANICS = ("contact", "assembly", "factors", "solves")
PARTS = (*MECHANICS, "heat", "transfer", "film", "output", "other")
INTERVAL = 1e-3  # s of processor time
# Folders and modules of the package, and the part that the time in them and below belongs to; the
# longest name that fits counts.
MODULES = {
    "mechanics": "contact",
    "mechanics.hyperelasticity": "assembly",
    "mechanics.tangent": "solves",
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
FACTORISE = ("mechanics.tangent", "factorise")  # whose solve is hardly more than new factors
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
    scene, comm = case("tread_block", *arguments.set), MPI.COMM_WORLD
    begun = process_time()
    with Sampler() as watch:
        summary = command.run(scene, Path(arguments.child).with_suffix(".run"), force=True)
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


SOLVERS = {
    "direct": "",
    "iterative": "-rubber_ksp_type fgmres -rubber_ksp_rtol 1e-3 -rubber_ksp_max_it 400 "
    "-rubber_ksp_gmres_restart 100 -rubber_pc_type gamg",
}
SIZES = (5e3, 1.2e4, 3e4, 6e4, 1.2e5, 2.5e5)
LONGEST = 1800  # s, of one run


class Size(NamedTuple):
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


def measured(
    solver: str, ranks: int, size: float, duration: str, limit: float = 1800.0
) -> Size | str:
    """The run, or why there is none: it fails, or takes longer than `limit` (s)."""
    # Fields would be written every few of these short steps, and are not what is asked.
    changes = [*changes_for(size), f"load.duration={duration}", "output.times=1"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.json"
        words = [sys.executable, "-m", "scripts.studies.limits", "--child", str(path)]
        words += [word for change in changes for word in ("--set", change)]
        environment = os.environ | {"PETSC_OPTIONS": SOLVERS[solver]}
        try:
            done = subprocess.run(
                on_ranks(words, ranks),
                cwd=ROOT,
                env=environment,
                capture_output=True,
                text=True,
                timeout=LONGEST,
            )
        except subprocess.TimeoutExpired:
            return f"takes longer than {LONGEST} s"
        if done.returncode:
            return fault(done.stderr)
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    steps = found["steps"]
    parts = {name: seconds / steps for name, seconds in found["parts"].items()}
    rubber = unknowns(case("tread_block", *changes)).rubber
    total = sum(parts.values())
    return Size(solver, ranks, rubber, steps, parts, total, found["memory"])


def sizes(given: argparse.Namespace) -> None:
    """Print and draw seconds and memory against unknowns."""
    wanted, ranks, solvers, duration = given.sizes, [1, 2], given.solvers, "2ms"
    if given.quick:
        wanted, ranks, solvers, duration = (2e3, 5e3), [1], ["direct"], "0.02ms"
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    panels = dict(zip(("seconds", "memory"), figure.subplots(1, 2), strict=True))

    def rows() -> Iterator[tuple[object, ...]]:
        for solver, count in product(solvers, ranks):
            found: list[Size] = []
            for size in wanted:
                run = measured(solver, count, size, duration)
                if isinstance(run, str):
                    yield solver, count, f"{size:.0f}", run, *("",) * (len(PARTS) + 2)
                    break
                found.append(run)
                shares = (run.parts.get(part, 0.0) / run.seconds for part in PARTS)
                yield (
                    solver, count, run.rubber, run.steps, f"{run.seconds:.3g}",
                    *(f"{share:.0%}" for share in shares), f"{run.memory:.0f}",
                )  # fmt: skip
            for value, panel in panels.items():
                panel.loglog(
                    [run.rubber for run in found], [getattr(run, value) for run in found],
                    "o-" if solver == "direct" else "s--", label=f"{solver}, on {count}",
                )  # fmt: skip

    table(
        ("solver", "ranks", "unknowns of the rubber", "steps", "s per step", *PARTS, "MB"), rows()
    )
    for name, panel in zip(("s per step", "MB per process"), panels.values(), strict=True):
        panel.set(xlabel="unknowns of the rubber", ylabel=name)
        panel.grid(which="both", alpha=0.3)
        panel.legend(fontsize=8)
    draw(figure, given.pictures / "limits.png")


QUESTIONS = {"maps": maps, "envelope": envelope, "sizes": sizes}


def main() -> None:
    """Print the tables and draw the pictures."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse maps and meshes, minutes")
    parser.add_argument("--questions", nargs="+", choices=list(QUESTIONS), default=list(QUESTIONS))
    parser.add_argument("--maps", nargs="+", choices=list(MAPS), default=list(MAPS))
    parser.add_argument("--sizes", type=float, nargs="+", default=SIZES, help="unknowns")
    parser.add_argument("--solvers", nargs="+", choices=list(SOLVERS), default=list(SOLVERS))
    parser.add_argument("--set", action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    picture_options(parser, "docs/stability")
    given = parser.parse_args()
    if given.child:
        child(given)
        return
    for name in given.questions:
        QUESTIONS[name](given)


if __name__ == "__main__":
    main()
