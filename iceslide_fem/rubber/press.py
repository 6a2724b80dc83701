"""From the undeformed block to the one that slides: press it, and bring it to speed.

In `press` the plate's force grows from nothing under static friction; in `start_sliding` static
friction gives way to the film's shear at its initial height while the speed grows. Both are
continuations along a path parameter from 0 to 1 with a secant predictor, whose steps are halved
where Newton fails.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import NotConverged, SimulationStopped
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.contact import Traction, blend
from iceslide_fem.rubber.equilibrium import Solution, TractionLaw

FIRST_STRAIN = 0.02
FIRST_RAMP = 0.25
SMALLEST_PATH_STEP = 1e-3
EASY_ITERATIONS = 6


class PathPoint(NamedTuple):
    """An equilibrium on the way to sliding: phase, share of the load and of the speed."""

    phase: str
    load: float
    speed: float
    law: TractionLaw
    solution: Solution


# What is told, before each solve on the way, where it stands; it may raise.
Before = Callable[[str], None]


def press(
    block: Block,
    observe: Callable[[PathPoint], None],
    law: TractionLaw | None = None,
    before: Before = lambda where: None,
) -> None:
    """Press the block on the ice under static friction or another `law`, up to the nominal force.

    Raises SimulationStopped where no equilibrium is found, and what `before` raises.
    """
    law = law or block.static
    scene, u = block.scene, block.rubber.displacements
    strain = scene.load.pressures.first / scene.mooney_rivlin.youngs_modulus
    first = min(1.0, FIRST_STRAIN / strain)
    # Contact must carry the first load, or the plate is free to move.
    u[:, -1] -= first * scene.load.pressures.first / block.equilibrium.penalty

    def solve(load: float) -> Solution:
        solution = block.balance(law, load)
        observe(PathPoint("press", load, 0.0, law, solution))
        return solution

    _follow(block, solve, first, lambda load: f"pressing it at {load * strain:.0%} of E", before)


def start_sliding(
    block: Block,
    observe: Callable[[PathPoint], None],
    before: Before = lambda where: None,
) -> None:
    """Bring the pressed block to its speed: static friction gives way to the film at h0.

    Raises SimulationStopped where no equilibrium is found, and what `before` raises.
    """
    scene = block.scene
    sheared = block.friction.at_start(scene.initial_height, block.surface.n_points)

    def solve(path: float) -> Solution:
        share = path**2 * (3.0 - 2.0 * path)
        speed = np.full(block.surface.weights.shape, share * scene.load.speeds.first)
        film = block.sliding(sheared, lambda _: (speed, 0.0))

        def law(pressure: Array, displacement: Array) -> Traction:
            slipping = film(pressure, displacement)
            return blend(block.static(pressure, displacement), slipping, share)

        solution = block.balance(law, friction=block.friction_force(sheared))
        observe(PathPoint("ramp", 1.0, share, law, solution))
        return solution

    def where(path: float) -> str:
        return f"bringing it to {path**2 * (3.0 - 2.0 * path):.0%} of the sliding speed"

    _follow(block, solve, FIRST_RAMP, where, before)


def _follow(
    block: Block,
    solve: Callable[[float], Solution],
    first: float,
    where: Callable[[float], str],
    before: Before,
) -> None:
    """Solve at path parameters from `first` to 1."""
    values = block.rubber.u.x.array
    done, step = 0.0, first
    last: tuple[float, Array] | None = None
    while done < 1.0:
        path = min(1.0, done + step)
        before(where(path))
        start = values.copy()
        if last is not None:
            values[:] += (start - last[1]) * (path - done) / (done - last[0])
        try:
            solution = solve(path)
        except NotConverged as reason:
            values[:] = start
            block.stop_at_faults(where(path))
            block.equilibrium.forget()
            step *= 0.5
            if step < SMALLEST_PATH_STEP * first:
                raise SimulationStopped(
                    f"the block finds no equilibrium when {where(path)} ({reason}); "
                    f"{block.limit_met()}"
                ) from reason
            continue
        # A first point is far from the start, which was a guess: no secant through it.
        last = (done, start) if done > 0.0 else None
        done = path
        if solution.iterations <= EASY_ITERATIONS:
            step *= 1.5
