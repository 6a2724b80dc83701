"""The coupled step: film and ice heat under a changing pressure, the block under a changing shear.

A step predicts the block's motion, advances film and ice heat under the predicted pressure (in
sub-steps of their own: `films`), finds the block's equilibrium under the new shear, and advances
film and heat once more from the old state under the pressure found. If that changes the film by
more than a share of the tolerance, block and film are solved again. Nothing of the old state is
touched before the step is accepted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.coupling.energy import Mechanics, mechanics_of, step_energies
from iceslide_fem.coupling.films import MOST_STEPS, Films, Refused
from iceslide_fem.coupling.passage import Passage
from iceslide_fem.coupling.plate import Plate
from iceslide_fem.coupling.state import Accepted, CoupledState, Memory
from iceslide_fem.coupling.step_error import COUPLING, CouplingControl, StepError
from iceslide_fem.errors import NotConverged, SimulationStopped
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.friction import Sheared
from iceslide_fem.film.integrators import INTEGRATORS, InterfaceState
from iceslide_fem.film.step_control import GROW, step_factor
from iceslide_fem.interface.build import carrier_of
from iceslide_fem.interface.carriers import ContactLoads
from iceslide_fem.mesh.ice import cells_in_a_step, window_cell
from iceslide_fem.rubber.block import Block, SpeedLaw
from iceslide_fem.rubber.time_discretisation import (
    Dynamic,
    Motion,
    MotionLaw,
    QuasiStatic,
    at_rest,
    rested,
)

FIRST_STEP = 1e-5
LONGEST_STEP = 0.025  # of the duration, so that curves are smooth
SMALLEST_STEP = 1e-10  # of the duration
MANY_ITERATIONS = 10
MORE_STEPS = 0.9  # of the sub-steps that a step may have, in the next one
# What is told of a trial that is refused: its length (s), and why.
Refusal = Callable[[float, Exception], None]


def _motion_law(block: Block) -> MotionLaw:
    if not block.scene.rubber.inertia:
        return QuasiStatic()
    return Dynamic(block.rubber, plate=block.scene.load.speeds.slope)


class Sliding:
    """Sliding of a block that has reached its speed, from t = 0, step by step.

    `current` is the last committed state; `motion_law` how the block moves; `layers_for` (s): the
    run's duration by which the layers of what conducts heat have been chosen.
    """

    def __init__(
        self,
        block: Block,
        control: CouplingControl = COUPLING,
        layers_for: float | None = None,
    ) -> None:
        """Prepare film, heat and step control at the block's present displacements.

        `layers_for`: that of the run that this one goes on with; by default the scene's duration.
        """
        scene = block.scene
        self.block = block
        integrator = INTEGRATORS[scene.numerics.film_integrator]
        self._duration = scene.load.duration
        n = block.surface.n_points
        self.layers_for = layers_for or self._duration
        self.carrier = carrier_of(block, self.layers_for)
        self._error = StepError(block, control)
        self._longest = scene.numerics.max_step or LONGEST_STEP * self._duration
        passing = np.inf
        if scene.ice.motion == "sliding":  # no ice passes from cell to cell unseen
            passing = window_cell(scene) / scene.load.speeds.largest
            self._longest = min(self._longest, cells_in_a_step(scene) * passing)
        self._films = Films(self.carrier, self._error, integrator, passing)
        state = self.carrier.start(scene.initial_height, n)
        self._plate = Plate(block)
        loads = self._plate.first_loads()
        motion = at_rest(block.rubber.u.x.array)
        self.motion_law = _motion_law(block)
        # Under a law of the scene's own the shear may fall for long: what springs back makes heat,
        # which a block that rests and is solved now and then would not give.
        self._may_rest = self.motion_law.may_rest and not block.friction.may_fail
        shear = self.shear(state, loads)
        mechanics = mechanics_of(block, shear, loads.area, 0.0, self.motion_law.mass_moment(motion))
        strongest = mechanics.friction_force
        self.current = CoupledState(
            time=0.0,
            motion=motion,
            contact=block.contact,
            loads=loads,
            interface=state,
            mechanics=mechanics,
            solved_shear=shear,
            steady=False,
            grip=block.grip,
            strongest=strongest,
        )
        self._start = motion.displacements
        self._passes = control.passes
        # A plate that slows down lets rubber spring back, with what it has stored: swinging freely
        # it pushes with no more than the friction that sheared it.
        self._may_swing = scene.load.changes
        self._adaptive = bool(integrator.estimate)
        self._dt = min(FIRST_STEP * self._duration if self._adaptive else np.inf, self._longest)
        self._film_step = self._dt

    def memory(self) -> Memory:
        """All that later steps depend on, of this rank."""
        now = self.current
        return Memory(
            time=now.time,
            step=self._dt,
            film_step=self._film_step,
            start=self._start,
            motion=now.motion,
            speed=now.loads.speed,
            shear=now.solved_shear,
            offset=now.loads.offset,
            interface=now.interface,
            steady=now.steady,
            way=now.way,
            strongest=now.strongest,
            grip=now.grip,
        )

    def recall(self, memory: Memory) -> None:
        """Go to a moment of a run of this scene from the same start. Collective."""
        interface, motion = memory.interface, memory.motion
        self.block.rubber.u.x.array[:] = motion.displacements
        self.block.hold(memory.grip)
        loads = self._plate.loads(memory.speed, memory.offset)
        self.current = CoupledState(
            time=memory.time,
            motion=motion,
            contact=self.block.contact,
            loads=loads,
            interface=interface,
            mechanics=self._mechanics(self.shear(interface, loads), loads, motion),
            solved_shear=memory.shear,
            steady=memory.steady,
            grip=memory.grip,
            way=memory.way,
            strongest=memory.strongest,
        )
        self._dt, self._film_step = memory.step, memory.film_step

    def shear(self, interface: InterfaceState, loads: ContactLoads) -> Array:
        """Friction stress on the ice at the points, (n,), Pa. Collective."""
        return self.carrier.sheared(interface, loads)(loads.pressure, loads.speed)[0]

    @property
    def moment(self) -> str:
        """The present moment, in words."""
        return f"t = {1e3 * self.current.time:.4g} ms of {1e3 * self._duration:.4g} ms"

    @property
    def n_dofs(self) -> int:
        """Unknowns of rubber and meshed ice on all ranks."""
        return self.block.rubber.n_dofs + self.carrier.ice.n_dofs

    def steps(self, between_trials: Refusal = lambda dt, reason: None) -> Iterator[Accepted]:
        """All steps to the end of the slide (see `advance`), each committed when it is yielded."""
        while self.current.time < self._duration:
            yield self.advance(between_trials)

    def advance(self, between_trials: Refusal = lambda dt, reason: None) -> Accepted:
        """Make the next step, shortened until it is accepted, and commit it.

        `between_trials` is given the length and the fault of every trial that is refused, on all
        ranks, when everything is again as the last accepted step left it; it may raise. Raises
        SimulationStopped where no step, however short, is accepted.
        """
        rejected = 0
        values = self.block.rubber.u.x.array
        left = self._duration - self.current.time
        corner = self._plate.next_corner(self.current.time) - self.current.time
        while True:
            dt = min(self._dt, left, corner)
            for end in (left, corner):
                if abs(end - dt) < 1e-3 * dt:
                    dt = end
            last, cut = dt == left, dt == corner < self._dt
            try:
                trial, following = self._try(dt)
            except (Refused, NotConverged) as reason:
                values[:] = self.current.motion.displacements
                self.block.stop_at_faults(self.moment)
                if isinstance(reason, NotConverged):
                    self.block.equilibrium.forget()
                factor = reason.factor if isinstance(reason, Refused) else 0.25
                # what a first cut has not mended is a corner in the step: it falls slowly
                self._dt = dt * (min(factor, 0.5) if rejected else factor)
                rejected += 1
                if not self._dt >= SMALLEST_STEP * self._duration or not self._adaptive:
                    raise SimulationStopped(self._farewell(reason)) from reason
                between_trials(dt, reason)
                continue
            self.current = trial.state
            self.block.hold(trial.state.grip)
            if last:
                self.current = self.current._replace(time=self._duration)
            if self._adaptive:
                if rejected:  # what was too long is so in the next step, too
                    following = min(following, trial.dt)
                if cut and not rejected:  # a short step to a corner says nothing of the next
                    following = max(following, self._dt)
                self._dt = min(following, self._longest)
                self._film_step = trial.passage.following
            return trial._replace(rejected=rejected)

    def _try(self, dt: float) -> tuple[Accepted, float]:
        """A trial step of `dt` and the length of the next. Raises Refused or NotConverged."""
        now, solved = self.current, self.current.motion.time
        rests = now.steady and self._plate.force_holds(solved, now.time + dt)
        resting = self._rested(dt) if rests else None
        return self._solved(dt) if resting is None else resting

    def _rested(self, dt: float) -> tuple[Accepted, float] | None:
        """A trial step with the block at rest on the plate; None if its shear changes too much."""
        start, plate = self.current, self._plate
        before = plate.resting(start.loads, start.time)
        loads = plate.resting(before, start.time + dt)
        loads = replace(loads, offset=before.offset + plate.way(start.time, dt))
        passage = self._films.passage(start.interface, before, loads, dt, self._film_step)
        state, shears = passage.state, self._shears(passage)
        if not self._error.is_quiet(shears[-1], start.solved_shear, start.loads.area):
            return None
        force = self.block.total(shears[-1], loads.area)
        after = start._replace(
            time=start.time + dt,
            motion=rested(start.motion),
            loads=loads,
            interface=state,
            mechanics=start.mechanics._replace(friction_force=force),
        )
        return self._accepted(after, dt, passage, shears, 0, False, GROW)

    def _solved(self, dt: float) -> tuple[Accepted, float]:
        """A trial step with the block in equilibrium under the shear at its end."""
        block, start, time = self.block, self.current.motion, self.current.time + dt
        values = block.rubber.u.x.array
        values[:], rate = self.motion_law.begin(start, time)
        plate = self._plate
        speed, load = plate.slip(rate, time), plate.force(time)
        interface, before = self.current.interface, self.current.loads
        offset = before.offset + plate.way(self.current.time, dt)
        loads = plate.slipping(speed, offset)
        passage = self._films.passage(interface, before, loads, dt, self._film_step)
        forces = self._forces(passage, self._shears(passage))
        bend = self._error.of_curve(forces, passage.ends)
        if bend > 1.0 and self._adaptive:
            raise Refused("friction follows no straight line", float(step_factor(bend, 2)))
        iterations, mismatches = 0, []
        for _ in range(self._passes):
            sheared = self.carrier.sheared(passage.state, loads)
            iterations += self._balance(sheared, speed, load)
            loads = plate.slipping(speed, offset)
            corrected = self._films.again(interface, before, loads, dt, passage)
            mismatches.append(self._error.of_coupling(passage.steps[-1], corrected.steps[-1]))
            passage = corrected
            if mismatches[-1] <= 1.0:
                break
        else:
            raise Refused("block and film do not agree", 0.4)

        motion = self.motion_law.end(start, time, values.copy())
        drift = self._error.of_motion(
            self.motion_law.local_error(start, motion), dt, self.current.loads.area
        )
        if drift > 1.0:
            raise Refused("the block moves too fast", float(step_factor(drift, 2)))

        state, shears = passage.state, self._shears(passage)
        sheared, shear = self.carrier.sheared(state, loads), shears[-1]
        at_rest = sheared(loads.pressure, plate.resting(loads, time).speed)[0]
        solved, area = self.current.solved_shear, self.current.loads.area
        steady = self._may_rest and self._error.is_quiet(at_rest, solved, area)
        mechanics = self._mechanics(shear, loads, motion)
        curved = plate.faster(loads, -self.motion_law.unforeseen(start, motion))
        foreseen = block.total(sheared(loads.pressure, curved.speed)[0], loads.area)
        swing = self._error.of_speed(mechanics.friction_force, foreseen, forces[-1])
        if swing > 1.0 and self._error.is_snap(dt):
            swing = 0.0
            if self._error.is_jump(mechanics.friction_force, foreseen):
                motion = self.motion_law.turned(start, motion)
        if swing > 1.0 and self._adaptive:
            raise Refused("the block's speed changes too fast", float(step_factor(swing, 2)))
        grip, wall_heat = block.grip_after()
        after = CoupledState(
            time, motion, block.contact, loads, state, mechanics, shear, steady, grip
        )
        factor = float(step_factor(max(mismatches[0], drift, bend, swing), 2))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, 0.8)
        return self._accepted(after, dt, passage, shears, iterations, True, factor, wall_heat)

    def _accepted(
        self,
        after: CoupledState,
        dt: float,
        passage: Passage,
        shears: Sequence[Array],
        iterations: int,
        solved: bool,
        factor: float,
        wall_heat: float = 0.0,
    ) -> tuple[Accepted, float]:
        """The trial step with its energies; `shears` (Pa) are those after each step of `passage`,
        `factor` is that on the next one's length, `wall_heat` (J) of walls that have slipped.

        Raises Refused where its energies are not those of friction.
        """
        force, most = after.mechanics.friction_force, 0.0
        if self._may_swing:
            most = max(self.current.strongest, self._error.least_friction)
        if not (force > 0.0 or -force <= most):
            with_what = " with more than it was sheared by" if self._may_swing else ""
            raise Refused(f"rubber that springs back would push the block forward{with_what}", 0.25)
        after = after._replace(strongest=max(self.current.strongest, force))
        before = self.current.mechanics
        energies = step_energies(
            self.block,
            passage,
            self._forces(passage, shears),
            self.current.time,
            dt,
            before,
            after.mechanics,
            wall_heat,
        )
        unclosed = self._error.of_energy(energies, dt, after.mechanics.friction_force)
        shorter = float(step_factor(unclosed, 2))
        if unclosed > 1.0 and self._adaptive:  # else nobody could choose a better step
            raise Refused("the step's energy does not close: the block snaps", shorter)
        squeezed = self._squeezed(passage)
        shifted, lost = self._window_shifted(after)
        accepted = Accepted(
            shifted, dt, passage, energies, after.loads, iterations, solved, 0, squeezed, lost
        )
        # a step twice as long would take film and heat twice as many of their own
        most = MORE_STEPS * MOST_STEPS / len(passage.steps)
        return accepted, dt * min(factor, shorter, most)

    def _shears(self, passage: Passage) -> list[Array]:
        """Friction stress at the points, Pa, after each step of `passage`. Collective."""
        steps = zip(passage.steps, passage.loads, strict=True)
        return [self.shear(one.step.state, loads) for one, loads in steps]

    def _forces(self, passage: Passage, shears: Sequence[Array]) -> list[float]:
        """Friction force of the block, N, now and under each of the `shears` (Pa). Collective."""
        now = self.current.mechanics.friction_force
        steps = zip(shears, passage.loads, strict=True)
        return [now, *(self.block.total(shear, loads.area) for shear, loads in steps)]

    def _squeezed(self, passage: Passage) -> float:
        """Water that leaves the films of the whole block in `passage`, m3. Collective."""
        heights = [one.step.state.squeezed_height for one in passage.steps]
        heights.insert(0, self.current.interface.squeezed_height)
        gains = [after - before for before, after in pairwise(heights)]
        return self.block.total(np.concatenate(gains), passage.area)

    def _mechanics(self, shear: Array, loads: ContactLoads, motion: Motion) -> Mechanics:
        """What the block does and stores at its present displacements. Collective."""
        kinetic_energy = self.motion_law.kinetic_energy(motion)
        moment = self.motion_law.mass_moment(motion)
        return mechanics_of(self.block, shear, loads.area, kinetic_energy, moment)

    def _balance(self, sheared: Sheared, speed: SpeedLaw, load: float) -> int:
        """Equilibrium under the law's shear and `load` of the plate's force; its iterations.

        Where shear is faded in, it follows the pressure like a friction coefficient of several
        times mu, with which an equilibrium may end at a point that enters or leaves that range.
        Then the fading is held as it is, and may be so if that hardly changes the shear.
        """
        block, values = self.block, self.block.rubber.u.x.array
        before, held = values.copy(), block.contact.pressure
        friction = block.friction_force(sheared)
        try:
            return block.balance(block.sliding(sheared, speed), load, friction).iterations
        except NotConverged:
            values[:] = before
            block.equilibrium.forget()
            law = block.held(sheared, speed, held)
            iterations = block.balance(law, load, friction).iterations
            ones, now = np.ones_like(held), block.contact
            taken, due = (sheared(p, ones)[0] for p in (held, now.pressure))
            if not self._error.is_quiet(taken.ravel(), due.ravel(), now.area.ravel()):
                raise
            return iterations

    def _window_shifted(self, state: CoupledState) -> tuple[CoupledState, float]:
        """The state after water and the window of ice have followed the block; lost water, m3."""
        if not self._all(self.carrier.reaches(state.loads)):
            raise Refused("the block leaves its window of ice", 0.25)
        carrier, loads, start = self.carrier, state.loads, self.current
        moved, lost = carrier.water_moved(state.interface, start.loads, loads, start.way)
        way = start.way + (loads.offset - start.loads.offset)
        interface, offset, left = carrier.window_shifted(moved, loads.offset)
        loads = replace(loads, offset=offset)
        after = state._replace(interface=interface, loads=loads, way=way)
        return after, self.block.scale * (lost + left)

    def _all(self, here: bool) -> bool:
        return bool(self.block.surface.comm.allreduce(here, op=MPI.LAND))

    def _farewell(self, reason: Exception) -> str:
        if not self._adaptive:
            name = self.block.scene.numerics.film_integrator
            hint = (
                f'numerics.film_integrator = "{name}" takes fixed steps of {self._longest:.3g} s: '
                'give a shorter numerics.max_step, or "sdirk2", which chooses them'
            )
        else:
            force = self.block.normal_force(self.current.contact)
            mu = self.current.mechanics.friction_force / force if force else 0.0
            hint = f"mu is {mu:.2g}, and {self.block.limit_met()}"
        return f"the run stops at {self.moment}: no step is accepted ({reason}); {hint}"
