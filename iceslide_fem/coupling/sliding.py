"""Sliding of a block over time, in coupled steps (`coupled_step`).

Each step is shortened until its errors are accepted. A rejected step leaves the state unchanged.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from iceslide_fem.coupling.coupled_step import CoupledStep
from iceslide_fem.coupling.drainage import drainage_of
from iceslide_fem.coupling.energy import mechanics_of
from iceslide_fem.coupling.plate import Plate
from iceslide_fem.coupling.relaxing import relaxing
from iceslide_fem.coupling.state import AcceptedStep, CheckpointState, CoupledState
from iceslide_fem.coupling.step_error import LIMITS, StepError, StepLimits, StepRejected
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.interface.build import film_frame_of
from iceslide_fem.interface.film_frame import ContactLoads
from iceslide_fem.interface.resting import PassBegin, Rest
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.time_discretisation import (
    Dynamic,
    MotionLaw,
    QuasiStatic,
    motion_at_rest,
)
from iceslide_fem.mesh.ice import cells_in_a_step
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped

FIRST_STEP = 1e-5
LONGEST_STEP = 0.025  # of the duration, so that curves are smooth
SMALLEST_STEP = 1e-10  # of the duration
# Called for each rejected trial step with its length (s) and the reason.
Rejection = Callable[[float, Exception], None]


def _motion_law(block: Block) -> MotionLaw:
    if not block.scene.rubber.inertia:
        return QuasiStatic()
    return Dynamic(block.rubber, plate=block.scene.load.speeds.slope)


class Sliding:
    """Sliding of a block from t = 0, step by step, at the plate's prescribed speed.

    current: the last committed state; motion_law: quasi-static or dynamic; layers_for: duration (s)
    for which the depth of the heat-conducting layers was chosen.
    """

    def __init__(
        self,
        block: Block,
        limits: StepLimits = LIMITS,
        layers_for: float | None = None,
    ) -> None:
        """Prepare film, heat and step control at the block's present displacements.

        layers_for: that of the run to continue; by default the scene's duration.
        """
        scene = block.scene
        self.block = block
        self._duration, self.number = scene.load.duration, 1
        self.layers_for = layers_for or self._duration
        self.frame = film_frame_of(block, self.layers_for)
        self.motion_law = _motion_law(block)
        self._plate = plate = Plate(block)
        self._longest = scene.numerics.max_step or LONGEST_STEP * self._duration
        if plate.passing < np.inf:  # ice moves by few cells in a step
            self._longest = min(self._longest, cells_in_a_step(scene) * plate.passing)
        error = StepError(block, self._longest, limits)
        self._relaxing = relaxing(block, self.frame)
        self._drainage = drainage_of(block, self.frame)
        laws = self.motion_law, self._relaxing, self._drainage
        self._step = CoupledStep(block, self.frame, plate, *laws, error)
        self._dt = self._film_dt = self._first_step
        interface = self.frame.start(scene.initial_height, block.surface.n_points)
        self._start = block.rubber.u.x.array.copy()
        self.current = self._at_rest(0.0, interface)

    def _at_rest(
        self, time: float, interface: InterfaceState, ahead: InterfaceState | None = None
    ) -> CoupledState:
        """The state of a pass that begins at `time` (s), at present displacements. Collective."""
        block, loads = self.block, self._plate.first_loads()
        interface, stored, *_ = self._drainage.begun(interface, loads)
        motion = motion_at_rest(block.rubber.u.x.array)._replace(time=time)
        shear = self.shear(interface, loads)
        relaxed = self._relaxing.at_rest()
        mechanics = mechanics_of(block, shear, loads.area, self.motion_law, motion, relaxed)
        return CoupledState(
            time=time,
            motion=motion,
            contact=block.contact,
            loads=loads,
            interface=interface,
            mechanics=mechanics,
            solved_shear=shear,
            quiescent=False,
            relaxed=relaxed,
            stick_points=block.stick_points,
            largest_friction_force=mechanics.friction_force,
            stored=stored,
            ahead=ahead,
        )

    @property
    def pass_is_over(self) -> bool:
        """Whether the present pass has ended and another one follows."""
        return self._end <= self.current.time < self.block.scene.load.sliding_time

    @property
    def _end(self) -> float:
        """End of the present pass, s."""
        return self.number * self._duration

    @property
    def _first_step(self) -> float:
        """Length of the first step of a pass, s."""
        first = FIRST_STEP * self._duration if self._step.adaptive else np.inf
        return min(first, self._longest)

    def begin_pass(self) -> None:
        """Let the ice rest, and begin the next pass.

        The block is again in its state of t = 0; the ice keeps its state (`FilmFrame.rested`).
        Collective. Raises SimulationStopped if the block has no equilibrium there.
        """
        block, scene, frame = self.block, self.block.scene, self.frame
        block.rubber.u.x.array[:] = self._start
        block.equilibrium.forget()
        self._relaxing.begin_at_once()
        loads = self._plate.first_loads()
        rest = Rest(scene.load.rest, self._duration, scene.between)
        begins = PassBegin(rest, scene.initial_height, scene.ice.solid, block.surface.comm)
        speed = np.full(block.surface.weights.shape, scene.load.speeds.first)
        try:
            now = self.current
            interface, ahead = frame.rested(now.interface, now.loads, loads, begins)
            sheared = frame.sheared(interface, loads)
            law = block.sliding(sheared, lambda _: (speed, 0.0))
            block.balance(law, friction=block.friction_force(sheared))
        except NotConverged as reason:
            raise SimulationStopped(
                f"the run stops at the beginning of pass {self.number + 1}: the block finds no "
                f"equilibrium on the ice that pass {self.number} has left ({reason})"
            ) from reason
        self.current = self._at_rest(self._end, interface, ahead)
        self.number += 1
        self._dt = self._film_dt = self._first_step

    def checkpoint_state(self) -> CheckpointState:
        """This rank's part of all that later steps depend on."""
        now = self.current
        return CheckpointState(
            time=now.time,
            dt=self._dt,
            film_dt=self._film_dt,
            start=self._start,
            motion=now.motion,
            speed=now.loads.speed,
            shear=now.solved_shear,
            offset=now.loads.offset,
            interface=now.interface,
            quiescent=now.quiescent,
            sliding_distance=now.sliding_distance,
            largest_friction_force=now.largest_friction_force,
            stick_points=now.stick_points,
            stuck=now.stuck,
            relaxed=now.relaxed,
            stored=now.stored,
            ahead=now.ahead,
        )

    def restore(self, state: CheckpointState) -> None:
        """Set the state of another run of this scene with the same start. Collective."""
        interface, motion, relaxed = state.interface, state.motion, state.relaxed
        self.block.rubber.u.x.array[:] = motion.displacements
        self.block.set_stick_points(state.stick_points)
        loads = self._plate.loads(state.speed, state.offset)
        of_law = self.shear(interface, loads)
        shear = self._step.friction.present(loads, state.shear, of_law)
        self.current = CoupledState(
            time=state.time,
            motion=motion,
            contact=self.block.contact,
            loads=loads,
            interface=interface,
            mechanics=mechanics_of(self.block, shear, loads.area, self.motion_law, motion, relaxed),
            solved_shear=state.shear,
            quiescent=state.quiescent,
            relaxed=relaxed,
            stick_points=state.stick_points,
            stuck=state.stuck,
            sliding_distance=state.sliding_distance,
            largest_friction_force=state.largest_friction_force,
            stored=state.stored,
            ahead=state.ahead,
        )
        self._dt, self._film_dt = state.dt, state.film_dt

    def friction_stress(self) -> Array:
        """Present friction stress on the ice at the points, (n,), Pa. Collective."""
        now = self.current
        of_law = self.shear(now.interface, now.loads)
        return self._step.friction.present(now.loads, now.solved_shear, of_law)

    def shear(self, interface: InterfaceState, loads: ContactLoads) -> Array:
        """Friction stress (n,), Pa, where all points slip with the speeds of `loads`."""
        return self.frame.sheared(interface, loads)(loads.pressure, loads.speed)[0]

    @property
    def moment(self) -> str:
        """The present time, in words for messages."""
        load = self.block.scene.load
        moment = f"t = {1e3 * self.current.time:.4g} ms of {1e3 * load.sliding_time:.4g} ms"
        return moment if load.passes == 1 else f"{moment} of sliding, in pass {self.number}"

    @property
    def n_dofs(self) -> int:
        """Unknowns of rubber and meshed ice on all ranks."""
        return self.block.rubber.n_dofs + self.frame.ice.n_dofs

    def steps(self, between_trials: Rejection = lambda dt, reason: None) -> Iterator[AcceptedStep]:
        """All steps to the end of the pass (see `advance`). A yielded step is committed."""
        while self.current.time < self._end:
            yield self.advance(between_trials)

    def advance(self, between_trials: Rejection = lambda dt, reason: None) -> AcceptedStep:
        """Make the next step, shortened until it is accepted, and commit it.

        between_trials: called on all ranks after each rejected trial, with its length and its
        error. The state is then that of the last accepted step. It may raise. Raises
        SimulationStopped if no step, however short, is accepted.
        """
        rejected = 0
        values = self.block.rubber.u.x.array
        left = self._end - self.current.time
        corner = self._plate.next_corner(self.current.time) - self.current.time
        while True:
            dt = min(self._dt, left, corner)
            for end in (left, corner):
                if abs(end - dt) < 1e-3 * dt:
                    dt = end
            try:
                trial = self._step.attempt(self.current, dt, self._film_dt)
            except (StepRejected, NotConverged) as reason:
                values[:] = self.current.motion.displacements
                self.block.stop_at_faults(self.moment)
                if isinstance(reason, NotConverged):
                    self.block.equilibrium.forget()
                factor = reason.factor if isinstance(reason, StepRejected) else 0.25
                # a second rejection means a kink in the step: its error falls slowly with dt
                self._dt = dt * (min(factor, 0.5) if rejected else factor)
                rejected += 1
                if not self._dt >= SMALLEST_STEP * self._duration or not self._step.adaptive:
                    raise SimulationStopped(self._failure_message(reason)) from reason
                between_trials(dt, reason)
                continue
            last, cut = trial.dt == left, trial.dt == corner < self._dt
            self.current = trial.state
            self.block.set_stick_points(trial.state.stick_points)
            if last:
                self.current = self.current._replace(time=self._end)
            following = trial.next_dt
            if self._step.adaptive:
                if rejected or trial.dt < dt:  # the next step is no longer
                    following = min(following, trial.dt)
                if cut and not rejected:  # a step cut at a kink does not limit the next
                    following = max(following, self._dt)
                if trial.dt == corner:
                    following = min(following, self._step.first_behind_kink(self.current))
                self._dt = min(following, self._longest)
                self._film_dt = trial.subcycles.next_dt
            return trial._replace(rejected=rejected)

    def _failure_message(self, reason: Exception) -> str:
        if not self._step.adaptive:
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
