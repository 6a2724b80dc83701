"""One step of film, ice and block together: predict, film, equilibrium, correct, accept.

1. Predict: the block's motion is extrapolated over the step.
2. Film: film and heat advance under the predicted loads, in substeps (`subcycling`). The step is
   cut short where the friction force would leave a straight line over it.
3. Equilibrium: the block is solved under the new shear. Unless its pressure is about as predicted,
   film and heat are repeated from the old state under the new pressure. Both are repeated until the
   film changes by less than a fraction of the tolerance.
4. Correct: the motion at the end, its errors, and the difference of friction from its prediction.
5. Accept: the energy balance closes; water and ice window follow the block (`accept`).

Where friction hardly changes, equilibrium is not solved again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from iceslide_fem.coupling.accept import Acceptance, CorrectedStep
from iceslide_fem.coupling.drainage import Drainage
from iceslide_fem.coupling.energy import mechanics_of
from iceslide_fem.coupling.plate import Plate
from iceslide_fem.coupling.relaxing import Relaxing
from iceslide_fem.coupling.state import AcceptedStep, CoupledState
from iceslide_fem.coupling.step_error import StepError, StepRejected
from iceslide_fem.coupling.sticking import Shearing, Slipping, friction_of
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.coupling.subcycling import Subcycling
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import GROW, step_factor
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.mechanics.block import Block, SpeedLaw
from iceslide_fem.mechanics.newton import BRIEF, PATIENT
from iceslide_fem.mechanics.time_discretisation import Motion, MotionLaw, quiescent_motion
from iceslide_fem.runtime.errors import NotConverged

MANY_ITERATIONS = 10  # Newton iterations above which the next step is shorter
SHORTER = 0.8  # factor on the next step length in that case
# The predictor of the film uses the extrapolated velocity only after a smooth step. A step is
# smooth if the error of friction with the extrapolated velocity is below this fraction of the error
# with the velocity held. At a kink of the velocity the acceleration predicts nothing.
SMOOTH = 0.8


class FilmStep(NamedTuple):
    """Film and heat over a step.

    dt: step length, s; subcycles: the substeps; sheared: friction law at the end of each; forces:
    friction force at the start and after each, N; nonlinearity: distance of these from a line.
    """

    dt: float
    subcycles: Subcycles
    sheared: list[Sheared]
    forces: list[float]
    nonlinearity: float


class Balanced(NamedTuple):
    """Block and film in agreement at the end of a step.

    loads: of the points; shearing: their shear; film: over the step; iterations: Newton
    iterations; mismatch: change of the film by the first repetition, or its bound without one.
    """

    loads: ContactLoads
    shearing: Shearing
    film: FilmStep
    iterations: int
    mismatch: float


class CoupledStep:
    """Trial steps of `block` on its interface. A trial step does not modify the start state.

    adaptive: whether the step length is free (not fixed by the film integrator); friction: how the
    law becomes shear.
    """

    def __init__(
        self,
        block: Block,
        frame: FilmFrame,
        plate: Plate,
        motion_law: MotionLaw,
        relaxing: Relaxing,
        drainage: Drainage,
        error: StepError,
    ) -> None:
        self._block, self._frame, self._plate = block, frame, plate
        self._motion_law, self.friction, self._error = motion_law, friction_of(block), error
        integrator = INTEGRATORS[block.scene.numerics.film_integrator]
        self._subcycling = Subcycling(frame, error, integrator, plate.passing)
        self.adaptive = bool(integrator.estimate)
        # Under a law that is not viscous the shear may fall for long. The rubber then springs back
        # and makes heat. Skipped equilibria, and films that are not repeated, would miss that heat.
        self._relaxing = relaxing
        self._may_skip = motion_law.may_skip and block.law.viscous and relaxing.may_skip
        self._acceptance = Acceptance(block, frame, drainage, error, self.adaptive)

    def attempt(self, start: CoupledState, dt: float, film_dt: float) -> AcceptedStep:
        """A step of `dt` (s) from `start`; the first substep of film and heat is `film_dt` (s).

        The block is left at the displacements of the step's end. Raises StepRejected or
        NotConverged; the block's displacements are then undefined.
        """
        corrected = self._without_mechanics(start, dt, film_dt)
        if corrected is None:
            film = self._film(start, self._predict(start, dt), dt, film_dt)
            balanced = self._equilibrium(start, film)
            corrected = self._correct(start, balanced, film.forces[-1])
        return self._acceptance.of(start, corrected)

    def first_behind_kink(self, now: CoupledState) -> float:
        """The first step (s) after a kink of the plate's force or speed.

        In this time the kink changes friction by the tolerance, if film and rubber stay constant.
        """
        loads, (force, speed) = now.loads, self._plate.kinks(now.time)
        sheared = self._frame.sheared(now.interface, loads)
        _, by_pressure, by_speed = sheared(loads.pressure, loads.speed)
        rates = by_pressure * loads.pressure * force + by_speed * speed
        rate = self._block.total(rates, loads.area)
        return self._error.first_behind_kink(now.mechanics.friction_force, rate)

    def _without_mechanics(
        self, start: CoupledState, dt: float, film_dt: float
    ) -> CorrectedStep | None:
        """The step with equilibrium skipped; None if equilibrium has to be solved."""
        plate, end = self._plate, start.time + dt
        if not (start.quiescent and plate.force_holds(start.motion.time, end)):
            return None
        before = plate.with_still_rubber(start.loads, start.time)
        loads = plate.with_still_rubber(before, end)
        loads = replace(loads, offset=before.offset + plate.ice_passed(start.time, dt))
        subcycles = self._subcycling.advance(start.interface, before, loads, dt, film_dt)
        film = self._of_subcycles(start, dt, subcycles, Slipping())
        shear = film.sheared[-1](loads.pressure, loads.speed)[0]
        if not self._error.may_skip_mechanics(shear, start.solved_shear, start.loads.area):
            return None
        after = start._replace(
            time=end,
            motion=quiescent_motion(start.motion),
            loads=loads,
            interface=subcycles.state,
            mechanics=start.mechanics._replace(friction_force=film.forces[-1]),
        )
        return CorrectedStep(after, dt, subcycles, film.forces, GROW)

    def _predict(self, start: CoupledState, dt: float) -> tuple[ContactLoads, Shearing]:
        """Contact loads and shear after `dt` (s) under the extrapolated motion of the block."""
        plate, law, time = self._plate, self._motion_law, start.time + dt
        self._block.rubber.u.x.array[:], rate = law.begin(start.motion, time)
        offset = start.loads.offset + plate.ice_passed(start.time, dt)
        loads = plate.slipping(plate.slip(rate, time), offset)
        if start.motion.smooth:
            loads = plate.faster(loads, law.extrapolated_velocity(start.motion, time))
        return self.friction.predicted(start, loads)

    def _film(
        self, start: CoupledState, end: tuple[ContactLoads, Shearing], dt: float, film_dt: float
    ) -> FilmStep:
        """Film and heat over `dt` (s) under the loads and shear predicted at its `end`.

        The step ends earlier if friction leaves a straight line within it.
        """
        ends = start.loads, end[0]
        subcycles = self._subcycling.advance(start.interface, *ends, dt, film_dt)
        film = self._of_subcycles(start, dt, subcycles, end[1])
        parts, nonlinearity = self._error.straight_parts(film.forces, subcycles.ends)
        if parts < len(subcycles.ends) and self.adaptive:
            dt *= subcycles.ends[parts - 1]
            shorter = subcycles.first(parts)
            return FilmStep(
                dt, shorter, film.sheared[:parts], film.forces[: parts + 1], nonlinearity
            )
        return film._replace(nonlinearity=nonlinearity)

    def _equilibrium(self, start: CoupledState, film: FilmStep) -> Balanced:
        """Block and film, alternately, until they agree. Raises StepRejected, NotConverged."""
        block, plate, dt = self._block, self._plate, film.dt
        time = start.time + dt
        block.rubber.u.x.array[:], rate = self._motion_law.begin(start.motion, time)
        self._relaxing.begin(start, dt)
        speed, load = plate.slip(rate, time), plate.force(time)
        slip = block.scene.load.speeds.mean * dt if start.stuck else np.inf
        offset = start.loads.offset + plate.ice_passed(start.time, dt)
        iterations, mismatches = 0, list[float]()
        for _ in range(self._error.limits.passes):
            sheared = film.sheared[-1]
            friction = self.friction.law(start, dt, sheared)
            iterations += self._balance(sheared, friction, speed, load, slip)
            moved = plate.slipping(speed, offset)
            loads, shearing = self.friction.found(start, dt, sheared, moved)
            if self._may_skip:
                apart = self._error.of_loads(sheared, film.subcycles.loads[-1], loads)
                if apart <= self._error.limits.alike:
                    largest = max([apart, *mismatches[:1]])
                    return Balanced(loads, shearing, film, iterations, largest)
            ends = shearing.begin(start, loads, plate.slid(start.time, dt), dt), loads
            again = self._subcycling.repeat(start.interface, *ends, dt, film.subcycles)
            before, after = film.subcycles.substeps[-1], again.substeps[-1]
            mismatches.append(self._error.of_coupling(before, after))
            found = self._of_subcycles(start, dt, again, shearing)
            film = found._replace(nonlinearity=film.nonlinearity)
            if mismatches[-1] <= 1.0:
                return Balanced(loads, shearing, film, iterations, mismatches[0])
        raise StepRejected("block and film do not agree", 0.4)

    def _correct(self, start: CoupledState, balanced: Balanced, straight: float) -> CorrectedStep:
        """The state at the end, with its errors. Raises StepRejected.

        straight: friction force under the predicted loads, N.
        """
        block, law = self._block, self._motion_law
        loads, shearing, film, iterations, mismatch = balanced
        dt, time = film.dt, start.time + film.dt
        motion = law.end(start.motion, time, block.rubber.u.x.array.copy())
        sheared, area = film.sheared[-1], start.loads.area
        local = law.local_error(start.motion, motion)
        drift = self._error.of_motion(local, dt, area, self._elasticity(sheared, loads))
        if drift > 1.0:
            raise StepRejected("the block moves too fast", float(step_factor(drift, 2)))
        relaxation = self._relaxing.end(start, dt, film.subcycles.state)
        delay = self._error.of_stress(relaxation.error)
        if delay > 1.0 and self.adaptive:
            raise StepRejected("the rubber relaxes too fast", float(step_factor(delay, 2)))
        motion, velocity_error = self._velocity_error(
            start, motion, sheared, loads, shearing, film.forces, straight
        )
        if velocity_error > 1.0 and self.adaptive:  # first order at a kink of the velocity
            raise StepRejected(
                "the block's speed changes too fast", float(step_factor(velocity_error, 1))
            )
        shear = shearing.shear(sheared, loads)
        still = sheared(loads.pressure, self._plate.with_still_rubber(loads, time).speed)[0]
        quiescent = self._may_skip and self._error.may_skip_mechanics(
            still, start.solved_shear, area
        )
        stick_points, wall_heat = block.stick_points_after()
        after = CoupledState(
            time,
            motion,
            block.contact,
            loads,
            relaxation.interface,
            mechanics_of(block, shear, loads.area, law, motion, relaxation.relaxed),
            shear,
            quiescent,
            relaxation.relaxed,
            stick_points,
            start.stuck or shearing.some,
            ahead=start.ahead,
        )
        errors = mismatch, drift, film.nonlinearity, velocity_error, delay
        factor = float(step_factor(max(errors), 2))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, SHORTER)
        given, heats = (film.subcycles, film.forces), (wall_heat, relaxation.dissipation)
        stored = shearing.stored(block, loads.area)
        return CorrectedStep(after, dt, *given, factor, iterations, True, *heats, stored)

    def _velocity_error(
        self,
        start: CoupledState,
        end: Motion,
        sheared: Sheared,
        loads: ContactLoads,
        shearing: Shearing,
        forces: list[float],
        straight: float,
    ) -> tuple[Motion, float]:
        """The motion at the `end` with its smoothness, and the error of friction by the velocity.

        The error is that of the last of the `forces` (N) against its prediction. straight: friction
        force under the predicted loads, N.
        """
        law, force = self._motion_law, forces[-1]
        error = law.velocity_error(start.motion, end)
        changes = error, error + law.extrapolated_velocity(start.motion, end.time)
        slips = (self._plate.faster(loads, -change) for change in changes)
        extrapolated, held = (
            self._block.total(shearing.shear(sheared, slip), loads.area) for slip in slips
        )
        smooth = abs(force - extrapolated) < SMOOTH * abs(force - held)
        end = end._replace(smooth=smooth)
        velocity_error = self._error.of_velocity(force, extrapolated, (held, straight))
        if velocity_error > 1.0 and self._error.may_snap(end.time - start.time):
            velocity_error = 0.0
            if self._error.is_jump(force, extrapolated):
                end = law.behind_kink(start.motion, end)
        return end, velocity_error

    def _elasticity(self, sheared: Sheared, loads: ContactLoads) -> float:
        """Elasticity of friction in the slip speed, v/F dF/dv; 1 for a viscous law. Collective."""
        block = self._block
        if block.law.viscous:
            return 1.0
        shear, _, by_speed = sheared(loads.pressure, loads.speed)
        force = block.total(np.abs(shear), loads.area)
        rise = block.total(np.abs(by_speed * loads.speed), loads.area)
        return rise / force if force else 1.0

    def _of_subcycles(
        self, start: CoupledState, dt: float, subcycles: Subcycles, shearing: Shearing
    ) -> FilmStep:
        """The film step of `dt` (s) that the `subcycles` make, with its friction. Collective."""
        ends = list(zip(subcycles.substeps, subcycles.loads, strict=True))
        sheared = [shearing.read(self._frame, one, loads) for one, loads in ends]
        forces = [start.mechanics.friction_force]
        for law, loads, end in zip(sheared, subcycles.loads, subcycles.ends, strict=True):
            shear = shearing.shear(law, loads, end)
            forces.append(self._block.total(shear, loads.area))
        return FilmStep(dt, subcycles, sheared, forces, 0.0)

    def _balance(
        self, sheared: Sheared, friction: Sheared, speed: SpeedLaw, load: float, slip: float
    ) -> int:
        """Solve equilibrium under the `friction` by the law `sheared` and the plate's `load`.

        Returns the Newton iterations. slip: see `Block.balance`.

        At low pressure the shear fades in with a slope of several times mu. Newton's method may
        fail at a point that enters or leaves that range. Equilibrium is then solved with the fading
        held constant. The result is accepted if this hardly changes the shear.
        """
        block, values = self._block, self._block.rubber.u.x.array
        before, force = values.copy(), block.friction_force(sheared)
        law, patience = block.sliding(friction, speed), BRIEF if self.adaptive else PATIENT
        try:
            return block.balance(law, load, force, slip, patience).iterations
        except NotConverged:
            values[:] = before
            held = block.contact.pressure
            block.equilibrium.forget()
            law = block.held(friction, speed, held)
            iterations = block.balance(law, load, force, slip).iterations
            ones, now = np.ones_like(held), block.contact
            taken, due = (sheared(p, ones)[0] for p in (held, now.pressure))
            if not self._error.is_quiet(taken.ravel(), due.ravel(), now.area.ravel()):
                raise
            return iterations
