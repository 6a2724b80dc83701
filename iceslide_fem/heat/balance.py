"""Films and the bodies that conduct their heat, in one implicit stage: a semismooth Newton method.

With the rises w, the capacity C (diagonal), the conduction K, the power g drawn by a held base, and
P that reads the surface at the points,

    (C / dt + K) w = C w_0 / dt - g + P^T a q(T_0 + P w),

where q are the fluxes (W/m2) that the films give, a their areas. Films melt what would get warmer
than T_m: q falls with the temperature, steeply where they melt, and the equations are the gradient
of a convex function. Each iteration evaluates the films at the present temperatures, takes the
slopes of what they give, solves one linear system, and goes as far along its solution as the convex
function falls (M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2003) 865: it is the
primal-dual active set method where the films only switch between two lines).

Points are joined to the surface through a thin `interface_resistance` (K m2/W), so that the flux of
one that melts is a function of its temperature, and unique.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.film.law import Film, FilmStage
from iceslide_fem.heat.bodies import Bodies
from iceslide_fem.heat.contact import Answer, Contact
from iceslide_fem.heat.linear import LinearSolver
from iceslide_fem.heat.readings import Readings
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.errors import NotConverged

MOST_ITERATIONS = 40
MOST_PLACES = 16
FALLEN = 0.5  # of the slope along a change: then it goes far enough
# Of the agreement: how nearly the surface is balanced, so that any number of ranks finds the same,
# and how closely a linear system is solved, as films answer by 1 / interface_resistance times as
# much.
CONVERGED, CLOSE = 1e-2, 1e-5
SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN
NOT_FOUND = "the melting part of the ice's surface is not found"


class Evaluation(NamedTuple):
    """What films answer at given temperatures, the imbalance of each unknown (W) with it."""

    answer: Answer
    imbalance: Array


class Begin(NamedTuple):
    """What is the same in all of a stage: heat state and rise (K) at its start, capacity over its
    length (W/K), conduction and its diagonal (W/K), the power (W) of sources and of a held base.
    """

    heat_state: Array
    rise: Array
    capacity: Array
    conduction: PETSc.Mat
    diagonal: Array
    power: Array


class Meeting(NamedTuple):
    """How films meet the bodies: what their points read, and the matrix of a system.

    conduction: that of the bodies (W/K) with entries for what the films couple, None where they
    couple nothing that conduction does not; tangent: what each iteration writes anew.
    """

    reads: Readings
    conduction: PETSc.Mat | None
    tangent: PETSc.Mat

    def among(self, points: Index | None) -> Meeting:
        """The same of films at some of the points alone."""
        return self if points is None else self._replace(reads=self.reads.among(points))


class Balance:
    """Bodies with films between or below them: `contact` says what those give."""

    _contact: Contact
    _meeting: Meeting

    def __init__(self, bodies: Bodies, temperature: float, agreement: float) -> None:
        """All bodies are at `temperature` (K) at first. agreement: how far (K) the surface may be
        from what takes what the films give.
        """
        self._bodies, self._T_0, self._agreement = bodies, temperature, agreement
        self._solver = LinearSolver(bodies.comm, CLOSE * agreement)
        self._heating = np.zeros_like(bodies.capacity)
        self._tangent_of_one = bodies.conduction.duplicate()
        self._own, self._other = bodies.conduction.createVecs()  # written anew in each product

    def meeting(self, reads: Readings, joins: bool = False) -> Meeting:
        """How films meet the bodies at points with these readings, and whether they join them:
        those above one body couple nothing that it does not. Collective.
        """
        if not joins:
            return Meeting(reads, None, self._tangent_of_one)
        wide = reads.widened(self._bodies.conduction)
        return Meeting(reads, wide, wide.duplicate())

    def under(self, meeting: Meeting, contact: Contact) -> Balance:
        """The same bodies as a `contact` meets them."""
        below = copy(self)
        below._contact, below._meeting = contact, meeting
        return below

    def heated(self, power: Array) -> Balance:
        """The same bodies with a source of heat within, W, (n_own,) (`load` of the elements)."""
        inside = copy(self)
        inside._heating = power
        return inside

    def temperature(self, heat_state: Array) -> Array:
        """At all that is read, K. Collective."""
        return self._T_0 + self._meeting.reads.of(self._bodies.rise(heat_state))

    def stage(self, start: Array, dt: float, film: Film) -> tuple[Array, FilmStage]:
        """Heat state at the end of a stage of `dt` (s) from `start`, and the film's. Collective.

        Raises NotConverged.
        """
        begin = self._begin(start, dt)
        rise = begin.rise
        evaluation = self._evaluated(begin, film, rise, film.log_height)
        for _ in range(MOST_ITERATIONS):
            if self._converged(begin, evaluation):
                return self._kept(rise, evaluation.imbalance, dt), evaluation.answer.stage
            tangent = self._tangent(begin, rise, evaluation.answer.slopes)
            change = self._solver.solve(tangent, evaluation.imbalance)
            rise, evaluation = self._along(begin, film, rise, change, evaluation)
        raise NotConverged(NOT_FOUND)

    def _begin(self, start: Array, dt: float) -> Begin:
        """What is the same in all of a stage; conduction is that of its start."""
        bodies = self._bodies
        rise = bodies.rise(start)
        matrix, drawn = bodies.conducting(rise)
        matrix = self._meeting.conduction or matrix
        matrix.getDiagonal(self._own)
        diagonal = np.array(self._own.array)
        return Begin(start, rise, bodies.capacity / dt, matrix, diagonal, self._heating - drawn)

    def _along(
        self, begin: Begin, film: Film, rise: Array, change: Array, before: Evaluation
    ) -> tuple[Array, Evaluation]:
        """As far along a `change` as the convex function falls: where its slope is small.

        The slope falls from that at the start. Where all of the change goes too far, the places
        between which it passes 0 are drawn together, by secants and by halves in turn.
        """
        low, first = 0.0, self._dot(change, before.imbalance)
        step_length, high, above, below = 1.0, np.inf, first, 0.0
        for attempt in range(MOST_PLACES):
            there = rise + step_length * change
            evaluation = self._evaluated(begin, film, there, before.answer.stage.log_height)
            slope = self._dot(change, evaluation.imbalance)
            if slope >= -FALLEN * first and (step_length == 1.0 or slope <= FALLEN * first):
                break
            if slope < 0.0:
                high, below = step_length, slope
            else:
                low, above = step_length, slope
            part = above / (above - below) if attempt % 2 == 0 else 0.5
            step_length = low + (high - low) * part
        return there, evaluation

    def _evaluated(self, begin: Begin, film: Film, rise: Array, near: Array) -> Evaluation:
        answer = self._contact.evaluate(film, self._T_0 + self._meeting.reads.of(rise), near)
        given = self._meeting.reads.given(answer.given) + begin.power
        kept = begin.capacity * (self._bodies.heat_state(rise) - begin.heat_state)
        return Evaluation(answer, given - kept - self._conducted(begin.conduction, rise))

    def _converged(self, begin: Begin, evaluation: Evaluation) -> bool:
        """Whether what is out of balance would warm no unknown by more than the agreement."""
        off = np.abs(evaluation.imbalance / (begin.capacity + begin.diagonal)).max(initial=0.0)
        most = self._bodies.comm.allreduce(off, op=MPI.MAX)
        if np.isnan(most):
            raise NotConverged(NOT_FOUND)
        return bool(most <= CONVERGED * self._agreement)

    def _kept(self, rise: Array, imbalance: Array, dt: float) -> Array:
        """The heat state with all heat: what the solver has left warms a body evenly."""
        warmer = [
            one.warmed(left, dt)
            for one, left in zip(self._bodies.equations, self._bodies.parts(imbalance), strict=True)
        ]
        return self._bodies.heat_state(rise) + np.concatenate(warmer)

    def _tangent(self, begin: Begin, rise: Array, slopes: Array) -> PETSc.Mat:
        """Capacity and conduction at a rise, and the falls of what the films give."""
        tangent = begin.conduction.copy(self._meeting.tangent, SAME)
        self._own.array[:] = begin.capacity * self._bodies.steepness(rise) + begin.diagonal
        tangent.setDiagonal(self._own)
        self._meeting.reads.couple(tangent, slopes)
        return tangent

    def _conducted(self, conduction: PETSc.Mat, rise: Array) -> Array:
        self._own.array[:] = rise
        conduction.mult(self._own, self._other)
        return np.asarray(self._other.array)

    def _dot(self, one: Array, other: Array) -> float:
        return self._bodies.total(float(one @ other))
