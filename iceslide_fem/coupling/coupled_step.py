"""One step of film, ice and block together: predict, film, equilibrium, correct, accept.

1. Predict: the block's motion is extrapolated over the step.
2. Film: film and heat advance under the predicted loads, in substeps (`subcycling`). The step ends
   early where friction would leave a straight line.
3. Equilibrium: the block is solved for under the new shear, then film and heat once more from the
   old state under the pressure found. This is repeated while it changes the film by more than a
   fraction of the tolerance.
4. Correct: the motion at the end, its errors, and how far friction is from the predicted one.
5. Accept: energies close, and water and ice follow the block (`accept`).

Where friction hardly changes the block is not solved for again.
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
from iceslide_fem.coupling.subcycles import Subcycles
from iceslide_fem.coupling.subcycling import Subcycling
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import GROW, step_factor
from iceslide_fem.interface.film_frame import ContactLoads, FilmFrame
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.rubber.block import Block, SpeedLaw
from iceslide_fem.rubber.time_discretisation import Motion, MotionLaw, quiescent_motion
from iceslide_fem.runtime.errors import NotConverged

MANY_ITERATIONS = 10  # of Newton's method, after which the next step is shorter
SHORTER = 0.8  # than this one, then
# The film reckons with the block's acceleration where friction at the end of the step before was
# nearer to that with the extrapolated velocity than to this fraction of what it was off with the
# velocity held. Where the velocity has kinks the acceleration tells nothing of what comes.
SMOOTH = 0.8


class FilmStep(NamedTuple):
    """Film and heat over a step: its length dt (s), the substeps, the shear on the interface after
    each, the friction forces (N) at the start and after each, and how far they leave a line.
    """

    dt: float
    subcycles: Subcycles
    sheared: list[Sheared]
    forces: list[float]
    nonlinearity: float


class Balanced(NamedTuple):
    """Block and film in agreement at the end of a step.

    loads: of the points; film: over the step; iterations: Newton's; mismatch: how much the first
    repetition has changed the film.
    """

    loads: ContactLoads
    film: FilmStep
    iterations: int
    mismatch: float


class CoupledStep:
    """Trial steps of `block` on its interface, from any state: they change nothing of it.

    adaptive: whether somebody could choose a better step; under fixed steps nobody can.
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
        self._motion_law, self._error = motion_law, error
        integrator = INTEGRATORS[block.scene.numerics.film_integrator]
        self._subcycling = Subcycling(frame, error, integrator, plate.passing)
        self.adaptive = bool(integrator.estimate)
        # Under a law that is not viscous the shear may fall for long. What springs back makes heat,
        # which a block that is solved for now and then would not give.
        self._relaxing = relaxing
        self._may_skip = motion_law.may_skip and block.law.viscous and relaxing.may_skip
        self._acceptance = Acceptance(block, frame, drainage, error, self.adaptive)

    def attempt(self, start: CoupledState, dt: float, film_dt: float) -> AcceptedStep:
        """A step of `dt` (s) from `start`, film and heat beginning with one of `film_dt` (s).

        It leaves the block's displacements at its end. Raises StepRejected or NotConverged, with
        the displacements anywhere.
        """
        corrected = self._without_mechanics(start, dt, film_dt)
        if corrected is None:
            predicted = self._predict(start, dt)
            film = self._film(start, predicted, dt, film_dt)
            balanced = self._equilibrium(start, film)
            corrected = self._correct(start, balanced, film.forces[-1])
        return self._acceptance.of(start, corrected)

    def first_behind_kink(self, now: CoupledState) -> float:
        """The first step (s) where the plate's force or speed has a kink: until friction would tell
        if film and rubber stayed as they are.
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
        """With the block as it is; None if it has to be solved for."""
        plate, end = self._plate, start.time + dt
        if not (start.quiescent and plate.force_holds(start.motion.time, end)):
            return None
        before = plate.with_still_rubber(start.loads, start.time)
        loads = plate.with_still_rubber(before, end)
        loads = replace(loads, offset=before.offset + plate.ice_passed(start.time, dt))
        subcycles = self._subcycling.advance(start.interface, before, loads, dt, film_dt)
        film = self._of_subcycles(start, dt, subcycles)
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

    def _predict(self, start: CoupledState, dt: float) -> ContactLoads:
        """Loads of the points after `dt` (s) by the block's motion, extrapolated."""
        plate, law, time = self._plate, self._motion_law, start.time + dt
        self._block.rubber.u.x.array[:], rate = law.begin(start.motion, time)
        offset = start.loads.offset + plate.ice_passed(start.time, dt)
        loads = plate.slipping(plate.slip(rate, time), offset)
        if start.motion.smooth:
            loads = plate.faster(loads, law.extrapolated_velocity(start.motion, time))
        return loads

    def _film(
        self, start: CoupledState, predicted: ContactLoads, dt: float, film_dt: float
    ) -> FilmStep:
        """Film and heat over `dt` (s) under the predicted loads, or over as many substeps as leave
        friction on a line.
        """
        ends = start.loads, predicted
        subcycles = self._subcycling.advance(start.interface, *ends, dt, film_dt)
        film = self._of_subcycles(start, dt, subcycles)
        parts, nonlinearity = self._error.straight_parts(film.forces, subcycles.ends)
        if parts < len(subcycles.ends) and self.adaptive:
            dt *= subcycles.ends[parts - 1]
            shorter = subcycles.first(parts)
            return FilmStep(
                dt, shorter, film.sheared[:parts], film.forces[: parts + 1], nonlinearity
            )
        return film._replace(nonlinearity=nonlinearity)

    def _equilibrium(self, start: CoupledState, film: FilmStep) -> Balanced:
        """Block and film in turn until they agree. Raises StepRejected, NotConverged."""
        block, plate, dt = self._block, self._plate, film.dt
        time = start.time + dt
        block.rubber.u.x.array[:], rate = self._motion_law.begin(start.motion, time)
        self._relaxing.begin(start, dt)
        speed, load = plate.slip(rate, time), plate.force(time)
        offset = start.loads.offset + plate.ice_passed(start.time, dt)
        iterations, mismatches = 0, []
        for _ in range(self._error.limits.passes):
            iterations += self._balance(film.sheared[-1], speed, load)
            loads = plate.slipping(speed, offset)
            ends = start.loads, loads
            again = self._subcycling.repeat(start.interface, *ends, dt, film.subcycles)
            before, after = film.subcycles.substeps[-1], again.substeps[-1]
            mismatches.append(self._error.of_coupling(before, after))
            film = self._of_subcycles(start, dt, again)._replace(nonlinearity=film.nonlinearity)
            if mismatches[-1] <= 1.0:
                return Balanced(loads, film, iterations, mismatches[0])
        raise StepRejected("block and film do not agree", 0.4)

    def _correct(self, start: CoupledState, balanced: Balanced, straight: float) -> CorrectedStep:
        """The state at the end, with its errors; `straight`: friction (N) before the block was
        solved for. Raises StepRejected.
        """
        block, law, (loads, film, iterations, mismatch) = self._block, self._motion_law, balanced
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
            start, motion, sheared, loads, film.forces, straight
        )
        if velocity_error > 1.0 and self.adaptive:  # at a kink of the velocity it is of first order
            raise StepRejected(
                "the block's speed changes too fast", float(step_factor(velocity_error, 1))
            )
        shear = sheared(loads.pressure, loads.speed)[0]
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
        )
        errors = mismatch, drift, film.nonlinearity, velocity_error, delay
        factor = float(step_factor(max(errors), 2))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, SHORTER)
        given, heats = (film.subcycles, film.forces), (wall_heat, relaxation.dissipation)
        return CorrectedStep(after, dt, *given, factor, iterations, True, *heats)

    def _velocity_error(
        self,
        start: CoupledState,
        end: Motion,
        sheared: Sheared,
        loads: ContactLoads,
        forces: list[float],
        straight: float,
    ) -> tuple[Motion, float]:
        """How the block goes on from the `end` of a step, and how far its friction there, the last
        of the `forces` (N), is from the predicted one; `straight`: before the block was solved for.
        """
        law, force = self._motion_law, forces[-1]
        error = law.velocity_error(start.motion, end)
        changes = error, error + law.extrapolated_velocity(start.motion, end.time)
        slips = (self._plate.faster(loads, -change) for change in changes)
        extrapolated, held = (
            self._block.total(sheared(loads.pressure, slip.speed)[0], loads.area) for slip in slips
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
        """Of friction with the slip speed, v / F dF/dv: 1 of a viscous law. Collective."""
        block = self._block
        if block.law.viscous:
            return 1.0
        shear, _, by_speed = sheared(loads.pressure, loads.speed)
        force = block.total(np.abs(shear), loads.area)
        rise = block.total(np.abs(by_speed * loads.speed), loads.area)
        return rise / force if force else 1.0

    def _of_subcycles(self, start: CoupledState, dt: float, subcycles: Subcycles) -> FilmStep:
        """Friction over `subcycles` of a step of `dt` (s). Collective."""
        ends = list(zip(subcycles.substeps, subcycles.loads, strict=True))
        sheared = [self._frame.sheared(one.state, loads) for one, loads in ends]
        forces = [start.mechanics.friction_force]
        for law, loads in zip(sheared, subcycles.loads, strict=True):
            shear = law(loads.pressure, loads.speed)[0]
            forces.append(self._block.total(shear, loads.area))
        return FilmStep(dt, subcycles, sheared, forces, 0.0)

    def _balance(self, sheared: Sheared, speed: SpeedLaw, load: float) -> int:
        """Equilibrium under the law's shear and `load` of the plate's force; its iterations.

        Where shear is faded in, it follows the pressure like a friction coefficient of several
        times mu, with which an equilibrium may end at a point that enters or leaves that range.
        Then the fading is held as it is, and may be so if that hardly changes the shear.
        """
        block, values = self._block, self._block.rubber.u.x.array
        before, friction = values.copy(), block.friction_force(sheared)
        try:
            return block.balance(block.sliding(sheared, speed), load, friction).iterations
        except NotConverged:
            values[:] = before
            held = block.contact.pressure
            block.equilibrium.forget()
            law = block.held(sheared, speed, held)
            iterations = block.balance(law, load, friction).iterations
            ones, now = np.ones_like(held), block.contact
            taken, due = (sheared(p, ones)[0] for p in (held, now.pressure))
            if not self._error.is_quiet(taken.ravel(), due.ravel(), now.area.ravel()):
                raise
            return iterations
