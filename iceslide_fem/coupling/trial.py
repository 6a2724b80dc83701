"""A trial step: film and ice heat under a changing pressure, the block under a changing shear.

It predicts the block's motion, advances film and ice heat under the predicted pressure (in
sub-steps of their own: `films`), ends where friction would leave a straight line, finds the block's
equilibrium under the new shear, and advances film and heat once more from the old state under the
pressure found. If that changes the film by more than a share of the tolerance, block and film are
solved again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.acceptance import Acceptance, Found
from iceslide_fem.coupling.energy import mechanics_of
from iceslide_fem.coupling.films import Films
from iceslide_fem.coupling.passage import Passage
from iceslide_fem.coupling.plate import Plate
from iceslide_fem.coupling.state import Accepted, CoupledState
from iceslide_fem.coupling.step_error import Refused, StepError
from iceslide_fem.errors import NotConverged
from iceslide_fem.film.integrators import INTEGRATORS
from iceslide_fem.film.step_control import GROW, step_factor
from iceslide_fem.interface.carriers import Carrier, ContactLoads
from iceslide_fem.laws.interface_law import Sheared
from iceslide_fem.rubber.block import Block, SpeedLaw
from iceslide_fem.rubber.time_discretisation import Motion, MotionLaw, rested

MANY_ITERATIONS = 10
# Film and heat reckon with the block's acceleration where friction at the end of the step before
# was nearer to that with the velocity so foreseen than to this share of what it was off with the
# velocity held. Where the velocity has corners the acceleration tells nothing of what comes.
SMOOTH_SHARE = 0.8


class Trials:
    """Trial steps of `block` on its interface, from any state: they change nothing of it.

    adaptive: whether somebody could choose a better step; under fixed steps nobody can.
    """

    def __init__(
        self,
        block: Block,
        carrier: Carrier,
        plate: Plate,
        motion_law: MotionLaw,
        error: StepError,
        passes: int,
    ) -> None:
        """`passes` over block and film at most."""
        self._block, self._carrier, self._plate = block, carrier, plate
        self._motion_law, self._error, self._passes = motion_law, error, passes
        integrator = INTEGRATORS[block.scene.numerics.film_integrator]
        self._films = Films(carrier, error, integrator, plate.passing)
        self.adaptive = bool(integrator.estimate)
        # Under a law that is not viscous the shear may fall for long: what springs back makes heat,
        # which a block that rests and is solved now and then would not give.
        self._may_rest = motion_law.may_rest and block.law.viscous
        self._acceptance = Acceptance(block, carrier, error, self.adaptive)

    def step(self, start: CoupledState, dt: float, film_step: float) -> Accepted:
        """A step of `dt` (s) from `start`, film and heat beginning with one of `film_step` (s).

        It leaves the block's displacements at its end. Raises Refused or NotConverged, with the
        displacements anywhere.
        """
        rests = start.steady and self._plate.force_holds(start.motion.time, start.time + dt)
        found = self._rested(start, dt, film_step) if rests else None
        return self._acceptance.of(start, found or self._solved(start, dt, film_step))

    def first_behind_corner(self, now: CoupledState) -> float:
        """How long (s) the block may go on unseen where the plate's force or speed has a corner:
        until friction, if film and rubber stayed as they are, would tell.
        """
        loads, (force, speed) = now.loads, self._plate.bends(now.time)
        sheared = self._carrier.sheared(now.interface, loads)
        _, by_pressure, by_speed = sheared(loads.pressure, loads.speed)
        rates = by_pressure * loads.pressure * force + by_speed * speed
        rate = self._block.total(rates, loads.area)
        return self._error.first_behind_corner(now.mechanics.friction_force, rate)

    def _rested(self, start: CoupledState, dt: float, film_step: float) -> Found | None:
        """With the block at rest on the plate; None if its shear changes too much."""
        plate = self._plate
        before = plate.resting(start.loads, start.time)
        loads = plate.resting(before, start.time + dt)
        loads = replace(loads, offset=before.offset + plate.way(start.time, dt))
        passage = self._films.passage(start.interface, before, loads, dt, film_step)
        shears = self._shears(passage, self._laws(passage))
        if not self._error.may_rest(shears[-1], start.solved_shear, start.loads.area):
            return None
        forces = self._forces(start, passage, shears)
        after = start._replace(
            time=start.time + dt,
            motion=rested(start.motion),
            loads=loads,
            interface=passage.state,
            mechanics=start.mechanics._replace(friction_force=forces[-1]),
        )
        return Found(after, dt, passage, forces, GROW)

    def _solved(self, start: CoupledState, dt: float, film_step: float) -> Found:
        """With the block in equilibrium under the shear at the step's end."""
        passage = self._foreseen(start, dt, film_step)
        laws = self._laws(passage)
        forces = self._forces(start, passage, self._shears(passage, laws))
        parts, bend = self._error.straight_parts(forces, passage.ends)
        if parts < len(passage.ends) and self.adaptive:
            dt *= passage.ends[parts - 1]
            passage, laws, forces = passage.first(parts), laws[:parts], forces[: parts + 1]

        block, plate, time = self._block, self._plate, start.time + dt
        values, law = block.rubber.u.x.array, self._motion_law
        values[:], rate = law.begin(start.motion, time)
        speed, load = plate.slip(rate, time), plate.force(time)
        interface, before = start.interface, start.loads
        offset = before.offset + plate.way(start.time, dt)
        straight = forces[-1]
        iterations, mismatches = 0, []
        for _ in range(self._passes):
            iterations += self._balance(laws[-1], speed, load)
            loads = plate.slipping(speed, offset)
            corrected = self._films.again(interface, before, loads, dt, passage)
            mismatches.append(self._error.of_coupling(passage.steps[-1], corrected.steps[-1]))
            passage, laws = corrected, self._laws(corrected)
            if mismatches[-1] <= 1.0:
                break
        else:
            raise Refused("block and film do not agree", 0.4)

        motion = law.end(start.motion, time, values.copy())
        local, elasticity = law.local_error(start.motion, motion), self._elasticity(laws[-1], loads)
        drift = self._error.of_motion(local, dt, before.area, elasticity)
        if drift > 1.0:
            raise Refused("the block moves too fast", float(step_factor(drift, 2)))

        shears, sheared = self._shears(passage, laws), laws[-1]
        forces = self._forces(start, passage, shears)
        at_rest = sheared(loads.pressure, plate.resting(loads, time).speed)[0]
        steady = self._may_rest and self._error.may_rest(at_rest, start.solved_shear, before.area)
        motion, swing = self._swung(start, motion, sheared, loads, forces[-1], straight)
        if swing > 1.0 and self.adaptive:  # at a corner of the velocity it is of first order
            raise Refused("the block's speed changes too fast", float(step_factor(swing, 1)))
        grip, wall_heat = block.grip_after()
        after = CoupledState(
            time,
            motion,
            block.contact,
            loads,
            passage.state,
            mechanics_of(block, shears[-1], loads.area, law, motion),
            shears[-1],
            steady,
            grip,
        )
        factor = float(step_factor(max(mismatches[0], drift, bend, swing), 2))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, 0.8)
        return Found(after, dt, passage, forces, factor, iterations, True, wall_heat)

    def _foreseen(self, start: CoupledState, dt: float, film_step: float) -> Passage:
        """Film and heat over `dt` (s) under the motion that is foreseen for the block."""
        plate, law, time = self._plate, self._motion_law, start.time + dt
        self._block.rubber.u.x.array[:], rate = law.begin(start.motion, time)
        offset = start.loads.offset + plate.way(start.time, dt)
        loads = plate.slipping(plate.slip(rate, time), offset)
        if start.motion.smooth:
            loads = plate.faster(loads, law.gained(start.motion, time))
        return self._films.passage(start.interface, start.loads, loads, dt, film_step)

    def _swung(
        self,
        start: CoupledState,
        end: Motion,
        sheared: Sheared,
        loads: ContactLoads,
        force: float,
        straight: float,
    ) -> tuple[Motion, float]:
        """How the block goes on from the `end` of a step, and how far its friction there, the
        `force` (N), is from what was foreseen; `straight`: before the block was solved for.
        """
        law = self._motion_law
        unforeseen = law.unforeseen(start.motion, end)
        changes = unforeseen, unforeseen + law.gained(start.motion, end.time)
        slips = (self._plate.faster(loads, -change) for change in changes)
        foreseen, held = (
            self._block.total(sheared(loads.pressure, slip.speed)[0], loads.area) for slip in slips
        )
        smooth = abs(force - foreseen) < SMOOTH_SHARE * abs(force - held)
        end = end._replace(smooth=smooth)
        swing = self._error.of_speed(force, foreseen, (held, straight))
        if swing > 1.0 and self._error.is_snap(end.time - start.time):
            swing = 0.0
            if self._error.is_jump(force, foreseen):
                end = law.turned(start.motion, end)
        return end, swing

    def _elasticity(self, sheared: Sheared, loads: ContactLoads) -> float:
        """Of friction with the slip speed, v / F dF/dv: 1 of a film. Collective."""
        block = self._block
        if block.law.viscous:
            return 1.0
        shear, _, by_speed = sheared(loads.pressure, loads.speed)
        force = block.total(np.abs(shear), loads.area)
        rise = block.total(np.abs(by_speed * loads.speed), loads.area)
        return rise / force if force else 1.0

    def _laws(self, passage: Passage) -> list[Sheared]:
        """Shear on the interface as it is after each step of `passage`. Collective."""
        steps = zip(passage.steps, passage.loads, strict=True)
        return [self._carrier.sheared(one.state, loads) for one, loads in steps]

    def _shears(self, passage: Passage, laws: list[Sheared]) -> list[Array]:
        """Friction stress at the points, Pa, after each step of `passage`, by the `laws` then."""
        ends = zip(laws, passage.loads, strict=True)
        return [law(loads.pressure, loads.speed)[0] for law, loads in ends]

    def _forces(self, start: CoupledState, passage: Passage, shears: list[Array]) -> list[float]:
        """Friction force of the block, N, at `start` and under each of the `shears` (Pa) after the
        steps of `passage`. Collective.
        """
        steps = zip(shears, passage.loads, strict=True)
        forces = [self._block.total(shear, loads.area) for shear, loads in steps]
        return [start.mechanics.friction_force, *forces]

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
