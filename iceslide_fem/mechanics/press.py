"""From the undeformed block to the sliding block: press it, and bring it to speed.

In `press` the plate's force grows from zero under static friction. In `start_sliding` the film's
shear at its initial height replaces static friction while the speed grows. Both are continuations
along a path parameter from 0 to 1 with a secant predictor; a step is halved if Newton fails. If the
press finds no larger load, the plate is lowered instead: beyond a limit load the block yields,
until it carries the whole load again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact import Traction, blend
from iceslide_fem.mechanics.loaded_block import TractionLaw
from iceslide_fem.mechanics.newton import QUICK, Solution
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped
from iceslide_fem.scene.materials import BAR

# The first load, as a strain, and the first path parameter towards the sliding speed. Smaller
# values need more solves; larger ones fail or need many tangents where sharp edges fold.
FIRST_STRAIN = 0.05
FIRST_RAMP = 0.4
SMALLEST_PATH_STEP = 1e-3
EASY_ITERATIONS = 6
# A lowered plate: step over the height; end at this fraction of the largest load, at this depth, or
# after this number of trials.
FIRST_LOWERING, LARGEST_LOWERING, SMALLEST_LOWERING = 2e-3, 2e-2, 2e-5
FALLEN, DEEPEST, LOWERINGS = 0.98, 0.5, 40


class PathPoint(NamedTuple):
    """An equilibrium on the path to sliding: phase, fraction of the load and of the speed."""

    phase: str
    load: float
    speed: float
    law: TractionLaw
    solution: Solution


# Called before each solve on the path with its point; it may raise.
Before = Callable[[str], None]
# Called if a path ends before 1, with place and reason; it raises, or reaches 1 itself.
Lost = Callable[[str, NotConverged], None]


def press(
    block: Block,
    observe: Callable[[PathPoint], None],
    law: TractionLaw | None = None,
    before: Before = lambda where: None,
) -> None:
    """Press the block on the ice up to the nominal force, under static friction or a `law`.

    Raises SimulationStopped with the largest load found if there is no equilibrium, and the errors
    of `before`.
    """
    law = law or block.static
    scene, u = block.scene, block.rubber.displacements
    strain = scene.load.pressures.first / scene.softest.youngs_modulus
    first = min(1.0, FIRST_STRAIN / strain)
    # Contact must carry the first load; otherwise the plate could move freely.
    u[:, -1] -= first * scene.load.pressures.first / block.equilibrium.penalty

    def found(solution: Solution) -> Solution:
        observe(PathPoint("press", solution.force / block.force, 0.0, law, solution))
        return solution

    def where(load: float) -> str:
        return f"pressing it at {load * strain:.0%} of E"

    def lost(place: str, reason: NotConverged) -> None:
        limit = block.limit_met()
        largest, mu, falls = _lower(block, law, found, lambda: before(place))
        if largest >= 1.0:
            return
        pressure = largest * scene.load.pressures.first / BAR
        further = "it carries less" if falls else "no equilibrium is found"
        raise SimulationStopped(
            f"the block finds no equilibrium when {place} ({reason}); {limit}; the largest load "
            f"found is {pressure:.3g} bar at mu = {mu:.2g}, and {further} under a plate that is "
            "lowered on"
        ) from reason

    def solve(load: float) -> Solution:
        return found(block.balance(law, load, patience=QUICK))

    _follow(block, solve, first, where, before, lost)


def start_sliding(
    block: Block,
    observe: Callable[[PathPoint], None],
    before: Before = lambda where: None,
) -> None:
    """Bring the pressed block to speed: the film at h0 replaces static friction.

    Raises SimulationStopped if there is no equilibrium, and the errors of `before`.
    """
    scene = block.scene
    sheared = block.law.at_start(scene.initial_height, block.surface.n_points)

    carried = block.static

    def solve(path: float) -> Solution:
        nonlocal carried
        fraction = path**2 * (3.0 - 2.0 * path)
        speed = np.full(block.surface.weights.shape, fraction * scene.load.speeds.first)
        film = block.sliding(sheared, lambda _: (speed, 0.0))

        def law(pressure: Array, displacement: Array) -> Traction:
            slipping = film(pressure, displacement)
            return blend(block.static(pressure, displacement), slipping, fraction)

        friction = block.friction_force(sheared)
        solution = block.balance(law, friction=friction, patience=QUICK)
        observe(PathPoint("ramp", 1.0, fraction, law, solution))
        carried = law
        return solution

    def where(path: float) -> str:
        return f"bringing it to {path**2 * (3.0 - 2.0 * path):.0%} of the sliding speed"

    def lost(place: str, reason: NotConverged) -> None:
        raise SimulationStopped(
            f"the block finds no equilibrium when {place} ({reason}); {block.limit_met()}; it "
            f"carries its load of {scene.load.pressures.first / BAR:.3g} bar up to mu = "
            f"{_friction_coefficient(block, carried):.2g}"
        ) from reason

    _follow(block, solve, FIRST_RAMP, where, before, lost)


def _follow(
    block: Block,
    solve: Callable[[float], Solution],
    first: float,
    where: Callable[[float], str],
    before: Before,
    lost: Lost,
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
                return lost(where(path), reason)
            continue
        block.set_stick_points(block.stick_points_after()[0])
        # The start is a guess far from the first point: no secant through it.
        last = (done, start) if done > 0.0 else None
        done = path
        if solution.iterations <= EASY_ITERATIONS:
            step *= 1.5


def _lower(
    block: Block,
    law: TractionLaw,
    found: Callable[[Solution], Solution],
    before: Callable[[], None],
) -> tuple[float, float, bool]:
    """Lower the plate from the present equilibrium until it carries the whole load, or much less.

    Returns the largest fraction of the load, mu there, and whether the load falls beyond it. At the
    whole load the block is in equilibrium.
    """
    values, height = block.rubber.u.x.array, block.height
    step, depth = FIRST_LOWERING * height, block.equilibrium.plate_displacement()
    largest = block.normal_force(block.contact) / (block.scale * block.force)
    mu, fraction = _friction_coefficient(block, law), largest
    last: tuple[float, Array] | None = None
    for _ in range(LOWERINGS):
        if fraction < FALLEN * largest or depth > DEEPEST * height:
            break
        before()
        start = values.copy()
        if last is not None:
            values[:] += (start - last[1]) * step / last[0]
        else:
            block.equilibrium.lower_plate(step)
        try:
            fraction = found(block.balance_under_held_plate(law)).force / block.force
            if fraction >= 1.0:
                found(block.balance(law))
                block.set_stick_points(block.stick_points_after()[0])
                return 1.0, mu, False
        except NotConverged:
            values[:] = start
            block.equilibrium.forget()
            step *= 0.5
            if step < SMALLEST_LOWERING * height:
                break
            continue
        block.set_stick_points(block.stick_points_after()[0])
        last, depth = (step, start), depth + step
        if fraction > largest:
            largest, mu = fraction, _friction_coefficient(block, law)
        step = min(1.5 * step, LARGEST_LOWERING * height)
    return largest, mu, fraction < largest


def _friction_coefficient(block: Block, law: TractionLaw) -> float:
    """Friction over normal force of the present displacements. Collective."""
    force = block.normal_force(block.contact)
    return block.drag(law) / force if force else 0.0
