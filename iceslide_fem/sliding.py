"""The coupled step: film and ice heat under a changing pressure, the block under a changing shear.

A step predicts the block's motion, advances film and ice heat under the predicted pressure,
finds the block's equilibrium under the new shear, and advances film and heat once more from the
old state under the pressure found. If that changes the film by more than the tolerance, block and
film are solved again. Nothing of the old state is touched before the step is accepted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem._dolfinx import MPI
from iceslide_fem.block import Block, SpeedLaw
from iceslide_fem.carriers import Passage, Side
from iceslide_fem.contact import ContactState
from iceslide_fem.equilibrium import NotConverged
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.integrators import INTEGRATORS, InterfaceState, error_norms
from iceslide_fem.interface import carrier_of
from iceslide_fem.materials import MELTING_TEMPERATURE, Array
from iceslide_fem.meshing import window_cell
from iceslide_fem.timestep import step_factor

# Shares of the tolerance: the film's and heat's local error per step, the change of the film
# that one more pass over block and film would make, and the change of shear relative to the
# pressure below which the block is not solved again.
LOCAL_SHARE = 0.1
COUPLING_SHARE = 0.3
QUIET_SHARE = 0.1
MAX_PASSES = 4
FIRST_STEP = 1e-5
LONGEST_STEP = 0.025  # of the duration, so that curves are smooth
SMALLEST_STEP = 1e-10  # of the duration
LARGEST_GROWTH = 2.0
MANY_ITERATIONS = 10


class Moment(NamedTuple):
    """Everything that a step starts from: committed as a whole, or not at all.

    time (s); solved: when the block was last solved, s; displacements (all dofs of this rank, m)
    and shear (of the points, Pa) of then; contact; side: the rubber's points, (n,); interface:
    film and ice.
    """

    time: float
    solved: float
    displacements: Array
    contact: ContactState
    side: Side
    interface: InterfaceState
    shear: Array


class Accepted(NamedTuple):
    """An accepted step: the moment it leads to, and what happened on the way.

    passage: film and heat; side: the rubber's points at its end, before the window moved;
    iterations: Newton's; solved: whether the block was solved; rejected: steps refused before.
    """

    moment: Moment
    dt: float
    passage: Passage
    side: Side
    iterations: int
    solved: bool
    rejected: int


class Refused(ArithmeticError):
    """A trial step is not good enough: `factor` says how much shorter the next should be."""

    def __init__(self, reason: str, factor: float) -> None:
        super().__init__(reason)
        self.factor = factor


class Sliding:
    """Sliding of a block that has reached its speed, from t = 0, step by step.

    `moment` is the last committed one; `shear(moment)` the friction stress in it.
    """

    def __init__(self, block: Block) -> None:
        """Prepare film, ice heat and step control at the block's present displacements."""
        scene = block.scene
        self.block = block
        self._tolerance = scene.numerics.tolerance
        self._integrator = INTEGRATORS[scene.numerics.film_integrator]
        self._duration = scene.load.duration
        self._undercooling = MELTING_TEMPERATURE - scene.ice.temperature
        n = block.surface.n_points
        self.carrier = carrier_of(block)
        state = self.carrier.start(scene.film.initial_height, n)
        side = self._side(np.full(n, scene.load.speed), 0.0)
        displacements = block.rubber.u.x.array.copy()
        start = Moment(0.0, 0.0, displacements, block.contact, side, state, np.zeros(n))
        self.moment = start._replace(shear=self.shear(start))
        self._before: tuple[float, Array] | None = None
        self._longest = scene.numerics.max_step or LONGEST_STEP * self._duration
        self._drift = scene.load.speed if scene.ice.motion == "sliding" else 0.0
        if self._drift > 0.0:  # no ice passes from cell to cell unseen
            self._longest = min(self._longest, window_cell(scene) / self._drift)
        self._adaptive = bool(self._integrator.estimate)
        self._dt = min(FIRST_STEP * self._duration if self._adaptive else np.inf, self._longest)

    def shear(self, moment: Moment) -> Array:
        """Friction stress on the ice at the points, (n,), Pa. Collective."""
        height = self.carrier.film_height(moment.interface, moment.side)
        side = moment.side
        return self.block.friction.shear(side.pressure, side.speed, height)[0]

    def advance(self) -> Accepted:
        """Make the next step, shortened until it is accepted, and commit it.

        Raises SimulationStopped where no step, however short, is accepted.
        """
        rejected = 0
        values = self.block.rubber.u.x.array
        left = self._duration - self.moment.time
        while True:
            dt = min(self._dt, left)
            if left - dt < 1e-3 * dt:
                dt = left
            last = dt == left
            try:
                trial, following = self._try(dt)
            except (Refused, NotConverged) as reason:
                values[:] = self.moment.displacements
                if isinstance(reason, NotConverged):
                    self.block.equilibrium.forget()
                self._dt = dt * (reason.factor if isinstance(reason, Refused) else 0.25)
                rejected += 1
                if self._dt < SMALLEST_STEP * self._duration or not self._adaptive:
                    raise SimulationStopped(self._farewell(reason)) from reason
                continue
            if trial.solved:
                self._before = (self.moment.solved, self.moment.displacements)
            self.moment = trial.moment
            if last:
                self.moment = self.moment._replace(time=self._duration)
            # A step cut short by the end of the run says nothing about the next one.
            self._dt = min(following, self._longest)
            return trial._replace(rejected=rejected)

    def _try(self, dt: float) -> tuple[Accepted, float]:
        """A trial step of `dt` and the length of the next. Raises Refused or NotConverged."""
        block, start = self.block, self.moment
        values = block.rubber.u.x.array
        values[:] = self._predicted(dt)
        side = self._side_after(dt)
        passage = self._pass_over(side, dt)
        control = self._film_error(passage)
        if control > 1.0:
            raise Refused("film and heat change too fast", float(self._factor(control)))

        moment = self._moment(dt, side, passage)
        if self._is_quiet(self.shear(moment)):
            values[:] = start.displacements
            still = start.side._replace(offset=side.offset)
            moment = moment._replace(
                solved=start.solved,
                displacements=start.displacements,
                contact=start.contact,
                side=still,
            )
            factor = float(self._factor(control))
            return Accepted(self._settled(moment), dt, passage, still, 0, False, 0), dt * factor

        iterations, mismatches = 0, []
        for _ in range(MAX_PASSES):
            height = self.carrier.film_height(passage.step.state, side)
            law = block.film_shear(height.reshape(block.surface.weights.shape), self._speed(dt))
            iterations += block.balance(law).iterations
            side = self._side_after(dt)
            corrected = self._pass_over(side, dt)
            change = corrected.step.state.log_height - passage.step.state.log_height
            mismatch = self._mean(change, self._friction_weights(corrected))
            mismatches.append(mismatch / (COUPLING_SHARE * self._tolerance))
            passage = corrected
            if mismatches[-1] <= 1.0:
                break
        else:
            raise Refused("block and film do not agree", 0.4)
        control = self._film_error(passage)
        if control > 2.0:
            raise Refused("film and heat change too fast", float(self._factor(control)))

        moment = self._moment(dt, side, passage)
        moment = self._settled(moment._replace(shear=self.shear(moment)))
        factor = min(float(self._factor(control)), float(step_factor(mismatches[0], 2)))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, 0.8)
        factor = min(factor, LARGEST_GROWTH)
        return Accepted(moment, dt, passage, side, iterations, True, 0), dt * factor

    def _moment(self, dt: float, side: Side, passage: Passage) -> Moment:
        """The end of a step, with the block as it is now and the shear of the last solution."""
        block, time = self.block, self.moment.time + dt
        displacements = block.rubber.u.x.array.copy()
        state, shear = passage.step.state, self.moment.shear
        return Moment(time, time, displacements, block.contact, side, state, shear)

    def _settled(self, moment: Moment) -> Moment:
        """The moment after the window of sliding ice has caught up with the block."""
        state, offset = self.carrier.settled(moment.interface, moment.side.offset)
        return moment._replace(interface=state, side=moment.side._replace(offset=offset))

    def _predicted(self, dt: float) -> Array:
        """Displacements at the end of the step, on the line through the last two."""
        now = self.moment
        if self._before is None or now.solved <= self._before[0]:
            return now.displacements
        rate = (now.displacements - self._before[1]) / (now.solved - self._before[0])
        return np.asarray(now.displacements + (now.time + dt - now.solved) * rate)

    def _speed(self, dt: float) -> SpeedLaw:
        """Slip speed: the plate's and that of the rubber relative to it since the last solution.

        Taken at the displacement that is solved for: a lagged one is unstable for steps below
        tau H / (v G), some ten microseconds.
        """
        block, dim = self.block, self.block.rubber.mesh.geometry.dim
        start = block.surface.displacements(self.moment.displacements.reshape(-1, dim))[..., 0]
        speed, elapsed = block.scene.load.speed, self.moment.time + dt - self.moment.solved
        return lambda displacement: (speed + (displacement - start) / elapsed, 1.0 / elapsed)

    def _side(self, speed: Array, offset: float) -> Side:
        """The rubber's points at the block's present displacements."""
        surface, contact = self.block.surface, self.block.contact
        positions = surface.positions(self.block.rubber.displacements)[..., :-1]
        return Side(
            positions.reshape(surface.n_points, positions.shape[-1]),
            contact.pressure.ravel(),
            contact.area.ravel(),
            speed,
            offset,
        )

    def _side_after(self, dt: float) -> Side:
        """The rubber's points at the end of a step of `dt` to the present displacements."""
        present = self.block.surface.displacements(self.block.rubber.displacements)
        speed, _ = self._speed(dt)(present[..., 0])
        return self._side(speed.ravel(), self.moment.side.offset + self._drift * dt)

    def _pass_over(self, side: Side, dt: float) -> Passage:
        start = self.moment
        return self.carrier.pass_over(start.interface, start.side, side, dt, self._integrator)

    def _film_error(self, passage: Passage) -> float:
        """Local error of film and heat relative to what is allowed, weighted by friction."""
        step, ice = passage.step, self.carrier.ice
        if not self._adaptive:
            ok = self._all(bool(np.isfinite(step.state.log_height).all()))
            return 0.0 if ok else np.inf
        undercooling = np.full(passage.area.shape, self._undercooling)
        free_height = passage.loads.free_height
        error = error_norms(step, ice, self.moment.interface, free_height, undercooling)
        if not self._all(bool(np.isfinite(error).all())):
            return np.inf
        return self._mean(error, self._friction_weights(passage)) / (LOCAL_SHARE * self._tolerance)

    def _factor(self, control: float) -> Array:
        return step_factor(control, self._integrator.estimate_order)

    def _friction_weights(self, passage: Passage) -> Array:
        """Friction force (N) under each film at the end of the step."""
        return passage.area * passage.loads.viscous * np.exp(-passage.step.state.log_height)

    def _is_quiet(self, shear: Array) -> bool:
        """Whether shear has hardly changed since the block was last solved."""
        change = self._mean(shear - self.moment.shear, self.moment.side.area)
        return change <= QUIET_SHARE * self._tolerance * self.block.scene.load.pressure

    def _mean(self, values: Array, weights: Array) -> float:
        """Mean size of `values` over all ranks' points.

        With the friction force of each point as its weight, the mean of relative errors of the
        shear bounds that of mu.
        """
        own = np.array([float(weights @ np.abs(values)), float(weights.sum())])
        total = self.block.surface.comm.allreduce(own, op=MPI.SUM)
        return float(total[0] / total[1]) if total[1] > 0.0 else 0.0

    def _all(self, here: bool) -> bool:
        return bool(self.block.surface.comm.allreduce(here, op=MPI.LAND))

    def _farewell(self, reason: Exception) -> str:
        return (
            f"the run stops at t = {1e3 * self.moment.time:.4g} ms of "
            f"{1e3 * self._duration:.4g} ms: no step is accepted ({reason}); "
            f"{self.block.limit_met()}"
        )
