"""The coupled step: film and ice heat under a changing pressure, the block under a changing shear.

A step predicts the block's motion, advances film and ice heat under the predicted pressure,
finds the block's equilibrium under the new shear, and advances film and heat once more from the
old state under the pressure found. If that changes the film by more than a share of the tolerance,
block and film are solved again. Nothing of the old state is touched before the step is accepted.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.coupling.restart import nodes_of, places_of
from iceslide_fem.coupling.step_error import StepError
from iceslide_fem.errors import NotConverged, SimulationStopped
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.film.integrators import INTEGRATORS, InterfaceState
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.interface.build import carrier_of
from iceslide_fem.interface.carriers import Passage, Side
from iceslide_fem.materials import Array
from iceslide_fem.mesh.structured import window_cell
from iceslide_fem.rubber.block import Block, SpeedLaw
from iceslide_fem.rubber.contact import ContactState
from iceslide_fem.rubber.time_discretisation import (
    Dynamic,
    Motion,
    MotionLaw,
    QuasiStatic,
    Rate,
    at_rest,
    rested,
)

MAX_PASSES = 4
FIRST_STEP = 1e-5
LONGEST_STEP = 0.025  # of the duration, so that curves are smooth
SMALLEST_STEP = 1e-10  # of the duration
MANY_ITERATIONS = 10
MOVES = ("displacements", "velocity", "acceleration")  # of a Motion, at the nodes


class Moment(NamedTuple):
    """Everything that a step starts from: committed as a whole, or not at all.

    time (s); motion: of the block when it was last solved for; contact and solved_shear (of the
    points, Pa): of then; side: the rubber's points, (n,); interface: film and ice; calm: whether
    the last step changed the shear so little that the block may rest.
    """

    time: float
    motion: Motion
    contact: ContactState
    side: Side
    interface: InterfaceState
    solved_shear: Array
    calm: bool


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


def place_at_start(block: Block, state: dict[str, Any]) -> None:
    """Put the block where it was at t = 0 of the run that gave `state`.

    Raises SceneError if that was another mesh.
    """
    nodes = state["nodes"]
    own = nodes_of(block).own({"x": nodes["x"], "start": nodes["start"]})
    block.rubber.displacements[:] = own["start"].T


def _motion_law(block: Block) -> MotionLaw:
    return Dynamic(block.rubber) if block.scene.rubber.inertia else QuasiStatic()


class Sliding:
    """Sliding of a block that has reached its speed, from t = 0, step by step.

    `moment` is the last committed one; `motion_law` how the block moves.
    """

    def __init__(self, block: Block) -> None:
        """Prepare film, ice heat and step control at the block's present displacements."""
        scene = block.scene
        self.block = block
        self._integrator = INTEGRATORS[scene.numerics.film_integrator]
        self._duration = scene.load.duration
        n = block.surface.n_points
        self.carrier = carrier_of(block)
        self._error = StepError(block, self.carrier)
        state = self.carrier.start(scene.film.initial_height, n)
        side = self._side(np.full(n, scene.load.speed), 0.0)
        motion = at_rest(block.rubber.u.x.array)
        self.moment = Moment(
            0.0, motion, block.contact, side, state, self.shear(state, side), False
        )
        self.motion_law = _motion_law(block)
        self._start, self._places = motion.displacements, places_of(block, self.carrier)
        self._longest = scene.numerics.max_step or LONGEST_STEP * self._duration
        self._drift = scene.load.speed if scene.ice.motion == "sliding" else 0.0
        if self._drift > 0.0:  # no ice passes from cell to cell unseen
            self._longest = min(self._longest, window_cell(scene) / self._drift)
        self._adaptive = bool(self._integrator.estimate)
        self._dt = min(FIRST_STEP * self._duration if self._adaptive else np.inf, self._longest)

    def state(self) -> dict[str, Any]:
        """All that later steps depend on, of all ranks, in tables on rank 0. Collective."""
        moment, places, dim = self.moment, self._places, self.block.rubber.mesh.geometry.dim
        motion = moment.motion._asdict()
        nodes = {"start": self._start} | {name: motion[name] for name in MOVES}
        state = moment.interface
        points = {"speed": moment.side.speed, "shear": moment.solved_shear}
        films = {"log_height": state.log_height, "squeezed_height": state.squeezed_height}
        return {
            "time": moment.time,
            "solved": moment.motion[:2],
            "offset": moment.side.offset,
            "calm": moment.calm,
            "step": self._dt,
            "nodes": places.nodes.gather({k: v.reshape(-1, dim).T for k, v in nodes.items()}),
            "points": places.points.gather(points),
            "films": places.films.gather(films),
            "ice": places.ice.gather({"content": state.ice}),
            "rubber": places.rubber.gather({"content": state.rubber}),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go to the moment of `state`, which another run of the scene gave. Collective.

        This one has been made at that run's displacements at t = 0 (`place_at_start`). Raises
        SceneError if the state does not fit the meshes.
        """
        places = self._places
        nodes = {name: v.T.ravel() for name, v in places.nodes.own(state["nodes"]).items()}
        time, span = state["solved"]
        motion = Motion(time, span, **{name: nodes[name] for name in MOVES})
        self.block.rubber.u.x.array[:] = motion.displacements
        points, films = places.points.own(state["points"]), places.films.own(state["films"])
        content = places.ice.own(state["ice"])["content"]
        rubber = places.rubber.own(state["rubber"])["content"]
        self.moment = Moment(
            time=state["time"],
            motion=motion,
            contact=self.block.contact,
            side=self._side(points["speed"], state["offset"]),
            interface=self.moment.interface._replace(**films, ice=content, rubber=rubber),
            solved_shear=points["shear"],
            calm=state["calm"],
        )
        self._dt = state["step"]

    def shear(self, interface: InterfaceState, side: Side) -> Array:
        """Friction stress on the ice at the points, (n,), Pa. Collective."""
        height = self.carrier.film_height(interface, side)
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
                values[:] = self.moment.motion.displacements
                if isinstance(reason, NotConverged):
                    self.block.equilibrium.forget()
                self._dt = dt * (reason.factor if isinstance(reason, Refused) else 0.25)
                rejected += 1
                if self._dt < SMALLEST_STEP * self._duration or not self._adaptive:
                    raise SimulationStopped(self._farewell(reason)) from reason
                continue
            self.moment = trial.moment
            if last:
                self.moment = self.moment._replace(time=self._duration)
            if self._adaptive:
                self._dt = min(following, self._longest)
            return trial._replace(rejected=rejected)

    def _try(self, dt: float) -> tuple[Accepted, float]:
        """A trial step of `dt` and the length of the next. Raises Refused or NotConverged."""
        resting = self._rested(dt) if self.moment.calm else None
        return self._solved(dt) if resting is None else resting

    def _rested(self, dt: float) -> tuple[Accepted, float] | None:
        """A trial step with the block at rest on the plate; None if its shear changes too much."""
        start, before = self.moment, self._resting(self.moment.side)
        side = before._replace(offset=before.offset + self._drift * dt)
        passage = self._pass_over(side, dt, before)
        control = self._allowed(passage, 1.0)
        state = passage.step.state
        if not self._error.is_quiet(self.shear(state, side), start.solved_shear, start.side.area):
            return None
        moment = start._replace(
            time=start.time + dt, motion=rested(start.motion), side=side, interface=state
        )
        factor = float(self._factor(control))
        return Accepted(self._settled(moment), dt, passage, side, 0, False, 0), dt * factor

    def _solved(self, dt: float) -> tuple[Accepted, float]:
        """A trial step with the block in equilibrium under the shear at its end."""
        block, start, time = self.block, self.moment.motion, self.moment.time + dt
        values = block.rubber.u.x.array
        values[:], rate = self.motion_law.begin(start, time)
        speed = self._speed(rate)
        side = self._side_after(dt, speed)
        passage = self._pass_over(side, dt)
        self._allowed(passage, 1.0)
        iterations, mismatches = 0, []
        for _ in range(MAX_PASSES):
            height = self.carrier.film_height(passage.step.state, side)
            iterations += self._balance(height.reshape(block.surface.weights.shape), speed)
            side = self._side_after(dt, speed)
            corrected = self._pass_over(side, dt)
            mismatches.append(self._error.of_coupling(passage, corrected))
            passage = corrected
            if mismatches[-1] <= 1.0:
                break
        else:
            raise Refused("block and film do not agree", 0.4)
        control = self._allowed(passage, 2.0)

        motion = self.motion_law.end(start, time, values.copy())
        drift = self._error.of_motion(
            self.motion_law.local_error(start, motion), dt, self.moment.side.area
        )
        if drift > 1.0:
            raise Refused("the block moves too fast", float(step_factor(drift, 2)))

        state = passage.step.state
        shear, at_rest = self.shear(state, side), self.shear(state, self._resting(side))
        before, area = self.moment.solved_shear, self.moment.side.area
        calm = self.motion_law.may_rest and self._error.is_quiet(at_rest, before, area)
        moment = self._settled(Moment(time, motion, block.contact, side, state, shear, calm))
        factor = min(float(self._factor(control)), float(step_factor(mismatches[0], 2)))
        factor = min(factor, float(step_factor(drift, 2)))
        if iterations > MANY_ITERATIONS:
            factor = min(factor, 0.8)
        return Accepted(moment, dt, passage, side, iterations, True, 0), dt * factor

    def _balance(self, height: Array, speed: SpeedLaw) -> int:
        """Equilibrium under the film's shear; how many iterations it took.

        Where shear is faded in, it follows the pressure like a friction coefficient of several
        times mu, with which an equilibrium may end at a point that enters or leaves that range.
        Then the fading is held as it is, and may be so if that hardly changes the shear.
        """
        block, values = self.block, self.block.rubber.u.x.array
        before, held = values.copy(), block.contact.pressure
        try:
            return block.balance(block.film_shear(height, speed)).iterations
        except NotConverged:
            values[:] = before
            block.equilibrium.forget()
            iterations = block.balance(block.held_shear(height, speed, held)).iterations
            ones, now = np.ones_like(height), block.contact
            taken, due = (block.friction.shear(p, ones, height)[0] for p in (held, now.pressure))
            if not self._error.is_quiet(taken.ravel(), due.ravel(), now.area.ravel()):
                raise
            return iterations

    def _settled(self, moment: Moment) -> Moment:
        """The moment after the window of sliding ice has caught up with the block."""
        if not self._all(self.carrier.reaches(moment.side)):
            raise Refused("the block leaves its window of ice", 0.25)
        state, offset = self.carrier.settled(moment.interface, moment.side.offset)
        return moment._replace(interface=state, side=moment.side._replace(offset=offset))

    def _speed(self, rate: Rate) -> SpeedLaw:
        """Slip speed: the plate's and that of the rubber relative to it.

        Taken at the displacement that is solved for: a lagged one is unstable for steps below
        tau H / (v G), some ten microseconds.
        """
        surface, speed = self.block.surface, self.block.scene.load.speed
        dim = self.block.rubber.mesh.geometry.dim
        known = speed + surface.displacements(rate.intercept.reshape(-1, dim))[..., 0]
        return lambda displacement: (known + rate.slope * displacement, rate.slope)

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

    def _side_after(self, dt: float, speed: SpeedLaw) -> Side:
        """The rubber's points at the end of a step of `dt` to the present displacements."""
        present = self.block.surface.displacements(self.block.rubber.displacements)
        return self._side(
            speed(present[..., 0])[0].ravel(), self.moment.side.offset + self._drift * dt
        )

    def _resting(self, side: Side) -> Side:
        """The rubber's points if they do not move relative to the plate."""
        return side._replace(speed=np.full_like(side.speed, self.block.scene.load.speed))

    def _pass_over(self, side: Side, dt: float, before: Side | None = None) -> Passage:
        """Film and heat over the step to `side`, from `before` or the last moment's."""
        start, before = self.moment, before or self.moment.side
        return self.carrier.pass_over(start.interface, before, side, dt, self._integrator)

    def _allowed(self, passage: Passage, most: float) -> float:
        """Error of film and heat; raises Refused if it is above `most` of what is allowed."""
        control = self._error.of_film(passage, self.moment.interface)
        if control > most:
            raise Refused("film and heat change too fast", float(self._factor(control)))
        return control

    def _factor(self, control: float) -> Array:
        return step_factor(control, self._integrator.estimate_order)

    def _all(self, here: bool) -> bool:
        return bool(self.block.surface.comm.allreduce(here, op=MPI.LAND))

    def _farewell(self, reason: Exception) -> str:
        return (
            f"the run stops at t = {1e3 * self.moment.time:.4g} ms of "
            f"{1e3 * self._duration:.4g} ms: no step is accepted ({reason}); "
            f"{self.block.limit_met()}"
        )
