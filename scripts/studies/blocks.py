"""What studies of slices and blocks share: slides without outputs, and a shear of one's own."""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.coupling.step_error import LIMITS, StepLimits
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import Block, build_block
from iceslide_fem.mechanics.contact import Traction, sliding_friction
from iceslide_fem.mechanics.loaded_block import TractionLaw
from iceslide_fem.mechanics.press import press, start_sliding
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene


class Slide(NamedTuple):
    """mu(t) of a slide from t = 0, s and 1, and its mean weighted by slip; what it took.

    steps and rejected: time steps; iterations: Newton's; seconds: of the processor; last: the
    committed state at the end.
    """

    time: Array
    mu: Array
    mean: float
    steps: int
    rejected: int
    iterations: int
    seconds: float
    last: Sliding


def at_speed(block: Block, limits: StepLimits = LIMITS) -> Sliding:
    """Press and bring to speed; the slide from there. Raises SimulationStopped."""
    press(block, lambda _: None)
    start_sliding(block, lambda _: None)
    return Sliding(block, limits)


def slid(
    scene: Scene,
    block: Block | None = None,
    limits: StepLimits = LIMITS,
    observe: Callable[[Sliding], None] = lambda run: None,
) -> Slide:
    """Press, bring to speed and slide on this process, without outputs.

    `block` is the scene's, made now if none is given; `limits` are those of its steps; `observe`
    sees t = 0 and every accepted step. Raises SimulationStopped where the run cannot
    go on.
    """
    started = process_time()
    block = block or build_block(scene, MPI.COMM_SELF)
    run = at_speed(block, limits)
    observe(run)
    time, mu, work, rejected, iterations = [0.0], [present_mu(run)], 0.0, 0, 0
    while run.current.time < scene.load.duration:
        accepted = run.advance()
        time.append(run.current.time)
        mu.append(present_mu(run))
        work += sum(float(one.area @ one.step.friction_work) for one in accepted.subcycles.substeps)
        rejected += accepted.rejected
        iterations += accepted.iterations
        observe(run)
    mean = work / (scene.load.speeds.mean * run.current.time * block.force)
    return Slide(
        np.array(time), np.array(mu), mean, len(time) - 1, rejected, iterations,
        process_time() - started, run,
    )  # fmt: skip


def present_mu(run: Sliding) -> float:
    """Friction force over contact force of the last committed state."""
    loads = run.current.loads
    shear = run.shear(run.current.interface, loads)
    return float(loads.area @ shear) / float(loads.area @ loads.pressure)


def shear_of_pressure(mu: float) -> TractionLaw:
    """A law that shears the contact by `mu` times its pressure."""

    def law(pressure: Array, displacement: Array) -> Traction:
        slope = np.full_like(pressure, mu)
        return sliding_friction(mu * pressure, slope, displacement.shape[-1])

    return law
