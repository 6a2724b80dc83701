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
from iceslide_fem.contact import ContactState
from iceslide_fem.equilibrium import NotConverged
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.film import FilmLoads
from iceslide_fem.heat import Column, HalfSpace, IceHeat
from iceslide_fem.ice import Continuum
from iceslide_fem.integrators import INTEGRATORS, InterfaceState, Step, advance, error_norms
from iceslide_fem.materials import MELTING_TEMPERATURE, Array
from iceslide_fem.meshing import ice_mesh
from iceslide_fem.timestep import step_factor

# Shares of the tolerance: the film's and heat's local error per step, the change of the film
# that one more pass over block and film would make, and the change of shear relative to the
# pressure below which the block is not solved again.
LOCAL_SHARE = 0.3
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

    time (s); displacements (all dofs of this rank, m); contact; speed: slip speed of the points
    (n,), m/s; interface: film and ice; shear: of the points when the block was last solved, Pa.
    """

    time: float
    displacements: Array
    contact: ContactState
    speed: Array
    interface: InterfaceState
    shear: Array


class Accepted(NamedTuple):
    """An accepted step: the moment it leads to, and what happened on the way.

    step: film and heat; area: what each point stood for, m2; iterations: Newton's; solved:
    whether the block was solved; rejected: steps refused before this one.
    """

    moment: Moment
    dt: float
    step: Step
    area: Array
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
        contact = block.contact
        self.ice = self._ice(contact)
        film = InterfaceState(
            np.full(n, np.log(scene.film.initial_height)), np.zeros(n), self.ice.initial(n)
        )
        speed = np.full(n, scene.load.speed)
        displacements = block.rubber.u.x.array.copy()
        start = Moment(0.0, displacements, contact, speed, film, np.zeros(n))
        self.moment = start._replace(shear=self.shear(start))
        self._before: tuple[float, Array] | None = None
        self._longest = scene.numerics.max_step or LONGEST_STEP * self._duration
        self._adaptive = bool(self._integrator.estimate)
        self._dt = min(FIRST_STEP * self._duration if self._adaptive else np.inf, self._longest)

    def shear(self, moment: Moment) -> Array:
        """Friction stress on the ice at the points, (n,), Pa."""
        height = np.exp(moment.interface.log_height)
        pressure = moment.contact.pressure.ravel()
        return self.block.friction.shear(pressure, moment.speed, height)[0]

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
                self._before = (self.moment.time, self.moment.displacements)
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
        contact, speed = block.contact, self._speed(dt)
        step, area = self._film(start, contact, speed, dt)
        control = self._film_error(step, start, contact, area)
        if control > 1.0:
            raise Refused("film and heat change too fast", float(self._factor(control)))

        shear = self._shear_of(step, contact, speed)
        if self._is_quiet(shear, area):
            values[:] = start.displacements
            contact, speed = start.contact, start.speed
            moment = Moment(
                start.time + dt, start.displacements, contact, speed, step.state, start.shear
            )
            factor = float(self._factor(control))
            return Accepted(moment, dt, step, area, 0, False, 0), dt * factor

        iterations, mismatches = 0, []
        for _ in range(MAX_PASSES):
            height = np.exp(step.state.log_height).reshape(block.surface.weights.shape)
            law = block.film_shear(height, self._speed_law(dt))
            iterations += block.balance(law).iterations
            contact, speed = block.contact, self._speed(dt)
            corrected, area = self._film(start, contact, speed, dt)
            change = corrected.state.log_height - step.state.log_height
            mismatch = self._mean(change, area * self._shear_of(corrected, contact, speed))
            mismatches.append(mismatch / (COUPLING_SHARE * self._tolerance))
            step = corrected
            if mismatches[-1] <= 1.0:
                break
        else:
            raise Refused("block and film do not agree", 0.4)
        control = self._film_error(step, start, contact, area)
        if control > 2.0:
            raise Refused("film and heat change too fast", float(self._factor(control)))

        moment = Moment(start.time + dt, values.copy(), contact, speed, step.state, start.shear)
        moment = moment._replace(shear=self.shear(moment))
        factor = min(float(self._factor(control)), float(step_factor(mismatches[0], 2)))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, 0.8)
        factor = min(factor, LARGEST_GROWTH)
        return Accepted(moment, dt, step, area, iterations, True, 0), dt * factor

    def _ice(self, contact: ContactState) -> IceHeat:
        scene, block = self.block.scene, self.block
        if scene.ice.heat == "column":
            return Column(scene.ice.temperature, scene.load.duration)
        if scene.ice.heat == "half-space":
            return HalfSpace(scene.ice.temperature, scene.load.duration)
        # Attached ice stays under the point of the rubber that it lies under at t = 0.
        positions = block.surface.positions(block.rubber.displacements)[..., :-1]
        points = positions.reshape(-1, positions.shape[-1])
        touching = points[contact.pressure.ravel() > 0.0]
        comm = block.surface.comm
        low, high = touching.min(axis=0, initial=np.inf), touching.max(axis=0, initial=-np.inf)
        comm.Allreduce(MPI.IN_PLACE, low, op=MPI.MIN)
        comm.Allreduce(MPI.IN_PLACE, high, op=MPI.MAX)
        if "symmetry" in block.rubber.block.tags:
            low[1] = 0.0
        mesh = ice_mesh(scene, comm, list(zip(low, high, strict=True)))
        return Continuum(mesh, scene.ice.temperature, points, contact.area.ravel())

    def _predicted(self, dt: float) -> Array:
        """Displacements at the end of the step, on the line through the last two."""
        now = self.moment
        if self._before is None or now.time <= self._before[0]:
            return now.displacements
        rate = (now.displacements - self._before[1]) / (now.time - self._before[0])
        return np.asarray(now.displacements + dt * rate)

    def _speed_law(self, dt: float) -> SpeedLaw:
        """Slip speed: the plate's and that of the rubber relative to it over the step.

        Taken at the displacement that is solved for: a lagged one is unstable for steps below
        tau H / (v G), some ten microseconds.
        """
        block, dim = self.block, self.block.rubber.mesh.geometry.dim
        start = block.surface.displacements(self.moment.displacements.reshape(-1, dim))[..., 0]
        speed = block.scene.load.speed
        return lambda displacement: (speed + (displacement - start) / dt, 1.0 / dt)

    def _speed(self, dt: float) -> Array:
        """Slip speed of the points (n,) at the block's present displacements, m/s."""
        present = self.block.surface.displacements(self.block.rubber.displacements)
        return self._speed_law(dt)(present[..., 0])[0].ravel()

    def _film(
        self, start: Moment, contact: ContactState, speed: Array, dt: float
    ) -> tuple[Step, Array]:
        friction = self.block.friction
        area = 0.5 * (start.contact.area + contact.area).ravel()
        if isinstance(self.ice, Continuum):
            self.ice.area = area
        loads = [
            friction.loads(pressure.ravel(), speed)
            for pressure in (start.contact.pressure, contact.pressure)
        ]
        step = advance(start.interface, loads[0], loads[1], dt, self.ice, self._integrator)
        return step, area

    def _film_error(self, step: Step, start: Moment, contact: ContactState, area: Array) -> float:
        """Local error of film and heat relative to what is allowed, over the contact area."""
        if not self._adaptive:
            ok = self._all(bool(np.isfinite(step.state.log_height).all()))
            return 0.0 if ok else np.inf
        loads: FilmLoads = self.block.friction.loads(contact.pressure.ravel(), start.speed)
        undercooling = np.full(area.shape, self._undercooling)
        error = error_norms(step, self.ice, start.interface, loads.free_height, undercooling)
        if not self._all(bool(np.isfinite(error).all())):
            return np.inf
        weights = area * self._shear_of(step, contact, start.speed)
        return self._mean(error, weights) / (LOCAL_SHARE * self._tolerance)

    def _factor(self, control: float) -> Array:
        return step_factor(control, self._integrator.estimate_order)

    def _shear_of(self, step: Step, contact: ContactState, speed: Array) -> Array:
        height = np.exp(step.state.log_height)
        return self.block.friction.shear(contact.pressure.ravel(), speed, height)[0]

    def _is_quiet(self, shear: Array, area: Array) -> bool:
        """Whether shear has hardly changed since the block was last solved."""
        change = self._mean(shear - self.moment.shear, area)
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
        contact = self.block.contact
        share = self.block.surface.total((contact.pressure > 0.0) * 1.0, contact.area)
        return (
            f"the run stops at t = {1e3 * self.moment.time:.4g} ms of "
            f"{1e3 * self._duration:.4g} ms: no step is accepted ({reason}); the block touches "
            f"the ice on {share / self.block.area:.0%} of its nominal area"
        )
