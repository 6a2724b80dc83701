"""Heat balance of films and bodies in one implicit stage, by a semismooth Newton method.

With temperature rises w, capacity C (diagonal), conduction K, the power g drawn by a held base, and
the interpolation P from the unknowns to the points,

    (C / dt + K) w = C w_0 / dt - g + P^T a q(T_0 + P w),

where q are the fluxes (W/m2) from the films and a their areas. Ice melts at T_m, so q falls with
the temperature, steeply where it melts. Each iteration of `heat.newton` evaluates the films and
their slopes at the present temperatures and solves one linear system.

Points are coupled to the surface through a small `interface_resistance` (K m2/W). The flux of a
melting point is then a unique function of its temperature.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.film.rubber_heat import FilmBetween, HalfFilm, RubberSurface, parallel
from iceslide_fem.heat.bodies import Bodies
from iceslide_fem.heat.equation import LinearSolver
from iceslide_fem.heat.newton import NOT_FOUND, balanced
from iceslide_fem.heat.surface import Readings
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.errors import NotConverged
from iceslide_fem.scene.materials import Solid


class Answer(NamedTuple):
    """Films at given temperatures: the heat to each reading, W, (m,).

    slopes: fall of this heat with the temperature there, and with that of the other body, if there
    are two, W/K, (bodies, m).
    """

    stage: FilmStage
    given: Array
    slopes: Array


class Contact(Protocol):
    """Films between bodies, or above one."""

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat at the read temperatures (K); first guess of heights: ln h = `near`."""


class AboveIce(NamedTuple):
    """Films above ice of `solid`: one reading for each point; area: of the points, m2."""

    area: Array
    solid: Solid
    interface_resistance: float

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat to the ice."""
        resistances = np.full_like(temperature, self.interface_resistance)
        stage = film.solve(Surface.of(temperature, resistances, self.solid), near)
        slopes = (self.area * stage.ice_slope / self.interface_resistance)[None]
        return Answer(stage, self.area * stage.ice_flux, slopes)


class BetweenIceAndRubber(NamedTuple):
    """Films between ice of `solid` and rubber: readings of the ice, then of the rubber.

    The half of a film conducts to either body (`HalfFilm`); area: of the points, m2.
    """

    area: Array
    solid: Solid
    interface_resistance: float
    half_film: HalfFilm

    def evaluate(self, film: Film, temperature: Array, near: Array) -> Answer:
        """Heat to both bodies.

        G_i and G_r are the conductances to the bodies. A melting film is at T_m, so the slope for a
        body is its own G. A film that does not melt gives its whole power to both, so the slope is
        G_i G_r / (G_i + G_r).
        """
        below, above = np.split(temperature, 2)
        resistances, cover = np.full_like(below, self.interface_resistance), np.ones_like(below)
        ice = Surface.of(below, resistances, self.solid)
        rubber = RubberSurface(above, resistances, cover, self.half_film)
        stage = FilmBetween(film, rubber).solve(ice, near)
        to_ice, to_rubber, _ = parallel(ice, rubber, film.height(stage.log_height))
        through = to_ice * to_rubber / (to_ice + to_rubber)
        own = [np.where(stage.melting, one, through) for one in (to_ice, to_rubber)]
        across = [np.where(stage.melting, 0.0, -through)] * 2
        given = self.area * stage.ice_flux, self.area * stage.rubber_flux
        slopes = np.tile(self.area, 2) * np.array([np.concatenate(own), np.concatenate(across)])
        return Answer(stage, np.concatenate(given), slopes)


MOST_ITERATIONS = 40
FALLEN = 0.5  # largest slope at the end of a line search over the first one
# Fractions of the agreement: tolerance of the balance, so the result does not depend on the number
# of ranks; tolerance of a linear system, because the flux of a film changes by 1 /
# interface_resistance times a temperature error.
CONVERGED, CLOSE = 1e-2, 1e-5
SAME = PETSc.Mat.Structure.SAME_NONZERO_PATTERN


class Begin(NamedTuple):
    """Constants of a stage.

    They are heat state and rise (K) at its start, capacity over dt (W/K), conduction and its
    diagonal (W/K), and the power of sources and of a held base (W).
    """

    heat_state: Array
    rise: Array
    capacity: Array
    conduction: PETSc.Mat
    diagonal: Array
    power: Array


class Meeting(NamedTuple):
    """Coupling of films and bodies: the interpolation to the points, and the system matrix.

    conduction: matrix of the bodies (W/K) with extra entries for the films' coupling, None without
    extra entries; tangent: matrix overwritten in each iteration.
    """

    reads: Readings
    conduction: PETSc.Mat | None
    tangent: PETSc.Mat

    def among(self, points: Index | None) -> Meeting:
        """The same with films at some of the points only."""
        return self if points is None else self._replace(reads=self.reads.among(points))


@dataclass(frozen=True)
class FilmsOnBodies:
    """A guess of the rise (K) of a `balance`, with the answer of the films.

    imbalance: what the films give more than the bodies take, W, (n_own,).
    """

    balance: Balance
    begin: Begin
    film: Film
    rise: Array
    answer: Answer
    imbalance: Array

    @property
    def settled(self) -> bool:
        """Whether the imbalance warms no unknown by more than a part of the agreement."""
        begin = self.begin
        off = np.abs(self.imbalance / (begin.capacity + begin.diagonal)).max(initial=0.0)
        most = self.balance.bodies.comm.allreduce(off, op=MPI.MAX)
        if np.isnan(most):
            raise NotConverged(NOT_FOUND)
        return bool(most <= CONVERGED * self.balance.agreement)

    def change(self) -> Array:
        """The Newton step (K)."""
        return self.balance.step(self.begin, self.rise, self.answer.slopes, self.imbalance)

    def along(self, change: Array) -> tuple[float, Callable[[float], tuple[float, FilmsOnBodies]]]:
        """Slope along a `change` (K), and slope and guess after a fraction of it. Collective."""
        near = self.answer.stage.log_height

        def at(length: float) -> tuple[float, FilmsOnBodies]:
            there = self.balance.guess(self.begin, self.film, self.rise + length * change, near)
            return there.slope(change), there

        return self.slope(change), at

    def slope(self, change: Array) -> float:
        """Slope of the convex function along a `change` (K). Collective."""
        return -self.balance.bodies.total(float(change @ self.imbalance))


class Balance:
    """Heat balance of bodies and films; `contact` gives the heat of the films."""

    _contact: Contact
    _meeting: Meeting

    def __init__(self, bodies: Bodies, temperature: float, agreement: float) -> None:
        """temperature: initial, of all bodies, K; agreement: tolerance of surface
        temperatures, K.
        """
        self.bodies, self.agreement, self._T_0 = bodies, agreement, temperature
        self._solver = LinearSolver(bodies.comm, CLOSE * agreement)
        self._heating = np.zeros_like(bodies.capacity)
        self._tangent_of_one = bodies.conduction.duplicate()
        self._own, self._other = bodies.conduction.createVecs()  # overwritten in each product

    def meeting(self, reads: Readings, joins: bool = False) -> Meeting:
        """Coupling of films and bodies at points with these readings. Collective.

        joins: whether films couple two bodies; films above one body add no matrix entries.
        """
        if not joins:
            return Meeting(reads, None, self._tangent_of_one)
        wide = reads.widened(self.bodies.conduction)
        return Meeting(reads, wide, wide.duplicate())

    def under(self, meeting: Meeting, contact: Contact) -> Balance:
        """The balance of the same bodies with a `contact`."""
        below = copy(self)
        below._contact, below._meeting = contact, meeting
        return below

    def heated(self, power: Array) -> Balance:
        """The balance with a heat source in the bodies, W, (n_own,) (`load` of the elements)."""
        inside = copy(self)
        inside._heating = power
        return inside

    def temperature(self, heat_state: Array) -> Array:
        """Temperature at all readings, K. Collective."""
        return self._T_0 + self._meeting.reads.of(self.bodies.rise(heat_state))

    def stage(self, start: Array, dt: float, film: Film) -> tuple[Array, FilmStage]:
        """Heat state at the end of a stage of `dt` (s) from `start`, and its film. Collective.

        Raises NotConverged.
        """
        begin = self._begin(start, dt)
        first = self.guess(begin, film, begin.rise, film.log_height)
        found, _ = balanced(first, MOST_ITERATIONS, FALLEN)
        return self._kept(found.rise, found.imbalance, dt), found.answer.stage

    def _begin(self, start: Array, dt: float) -> Begin:
        """Constants of a stage, with the conduction at its start."""
        bodies = self.bodies
        rise = bodies.rise(start)
        matrix, drawn = bodies.conducting(rise)
        matrix = self._meeting.conduction or matrix
        matrix.getDiagonal(self._own)
        diagonal = np.array(self._own.array)
        return Begin(start, rise, bodies.capacity / dt, matrix, diagonal, self._heating - drawn)

    def guess(self, begin: Begin, film: Film, rise: Array, near: Array) -> FilmsOnBodies:
        """The films and the imbalance at a `rise` (K); near: first guess of ln h. Collective."""
        answer = self._contact.evaluate(film, self._T_0 + self._meeting.reads.of(rise), near)
        given = self._meeting.reads.given(answer.given) + begin.power
        taken = begin.capacity * (self.bodies.heat_state(rise) - begin.heat_state)
        imbalance = given - taken - self._conducted(begin.conduction, rise)
        return FilmsOnBodies(self, begin, film, rise, answer, imbalance)

    def _kept(self, rise: Array, imbalance: Array, dt: float) -> Array:
        """The heat state with the solver's residual spread evenly, so heat is conserved."""
        warmer = [
            one.warmed(left, dt)
            for one, left in zip(self.bodies.equations, self.bodies.parts(imbalance), strict=True)
        ]
        return self.bodies.heat_state(rise) + np.concatenate(warmer)

    def _conducted(self, conduction: PETSc.Mat, rise: Array) -> Array:
        self._own.array[:] = rise
        conduction.mult(self._own, self._other)
        return np.asarray(self._other.array)

    def step(self, begin: Begin, rise: Array, slopes: Array, imbalance: Array) -> Array:
        """Newton step (K) from a `rise` with these slopes of the films' heat. Collective.

        Raises NotConverged.
        """
        tangent = begin.conduction.copy(self._meeting.tangent, SAME)
        self._own.array[:] = begin.capacity * self.bodies.steepness(rise) + begin.diagonal
        tangent.setDiagonal(self._own)
        self._meeting.reads.couple(tangent, slopes)
        return self._solver.solve(tangent, imbalance)
