"""k, D and H_V over the age of contact: asperities of viscoelastic rubber creep under pressure.

On smooth ice the rubber's asperities are loaded once. Growing contact equals elastic contact with p
/ E replaced by the hereditary integral of the creep compliance J (E. H. Lee, J. R. M. Radok, J.
Appl. Mech. 27 (1960) 438). k, D and H_V are therefore those of elastic rubber with the
instantaneous modulus E_0 under the equivalent pressure

    p_e(t) = E_0 integral of J(xi(t) - xi(s)) dp(s) = p + sum J_i c_i          (1)
    a_T lambda_i dc_i/dt = p - c_i,   c_i(0) = 0                               (2)

with the reduced time xi, d xi = dt / a_T(T), and J_i and lambda_i of `relaxation.prony.Creep`.

Under falling pressure the contact stays at the largest p_e since touchdown. This is an upper bound:
real contact shrinks with a delay (T. C. T. Ting, J. Appl. Mech. 33 (1966) 845). An opened contact
is reset. The history belongs to the points of the rubber; below a wheel nothing is held.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.relaxation.prony import Relaxation, delayed
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.columns import AREA
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contact_table import ConstantContact, ContactParameters, ContactTable

CONTACT_AREA = AREA.column


@dataclass(frozen=True)
class ContactAge:
    """Ageing contact: its `table` at the instantaneous modulus, and the rubber's creep.

    History variables of a point of the rubber: the largest p_e so far, and c_i of (2), Pa, (1 +
    arms, n). holds: whether the largest p_e is held; it is 0 if not.
    """

    table: ContactTable
    relaxation: Relaxation
    holds: bool = True

    @property
    def rows(self) -> int:
        """Number of history variables of a place."""
        return 1 + len(self.relaxation.prony.creep.times)

    @cached_property
    def _fractions(self) -> Array:
        return np.array(self.relaxation.prony.creep.fractions)

    @cached_property
    def _times(self) -> Array:
        return np.array(self.relaxation.prony.creep.times)[:, None]

    def fresh(self, n: int) -> Array:
        """History variables of `n` untouched places."""
        return np.zeros((self.rows, n))

    def after(self, history: Array, start: Array, end: Array, reduced: Array) -> Array:
        """History after a `reduced` time (s), (n,); exact for linearly changing pressures.

        start, end: pressures (Pa) at both ends.
        """
        creeping = delayed(history[1:], start, end, reduced / self._times)
        largest = np.maximum(history[0], end + self._fractions @ creeping)
        held = self.holds & (end > 0.0)
        return np.concatenate([np.where(held, largest, 0.0)[None], creeping])

    def so_far(self, history: Array) -> AgedContact:
        """The contact of places with this `history`."""
        return AgedContact(self.table, self._fractions @ history[1:], history[0])

    def under_constant(self, pressure: Array, time: Array, temperature: Array) -> ContactParameters:
        """k, D and H_V a `time` (s) after touching down under a constant pressure (Pa), (n,).

        p_e = p E_0 J(t / a_T) at the rubber's temperature (K).
        """
        return self.table(pressure * self.relaxation.compliance(time, temperature))


@dataclass(frozen=True)
class AgedContact:
    """k, D and H_V of places as functions of the present pressure.

    They are those of the `table` at p_e = p + `creep`, or at the `largest` p_e so far, Pa, (n,).
    """

    table: ContactTable
    creep: Array
    largest: Array

    def equivalent(self, pressure: ArrayLike) -> Array:
        """p_e (Pa) under `pressure` (Pa), n values of any shape; the pressure below 0."""
        p = np.asarray(pressure, dtype=float)
        creep, largest = self.creep.reshape(p.shape), self.largest.reshape(p.shape)
        return np.where(p > 0.0, np.maximum(largest, p + creep), p)

    def __call__(self, pressure: ArrayLike) -> ContactParameters:
        """Parameters at `pressure` (Pa); k is constant where the largest p_e is held."""
        found = self.table(self.equivalent(pressure))
        return found._replace(dk_dp=np.where(self._rises(pressure), found.dk_dp, 0.0))

    def softness(self, pressure: Array) -> Array:
        """p_e / p (n,): the growth of the compliance, 1 without pressure."""
        equivalent = self.equivalent(pressure)
        return np.divide(equivalent, pressure, out=np.ones_like(equivalent), where=pressure > 0.0)

    def contact_area(self, pressure: ArrayLike) -> tuple[Array, Array]:
        """k and its derivative with pressure, 1/Pa."""
        k, slope = self.table.contact_area(self.equivalent(pressure))
        return k, np.where(self._rises(pressure), slope, 0.0)

    def outside(self, pressure: ArrayLike) -> Mask:
        """Where the table does not cover p_e."""
        return self.table.outside(self.equivalent(pressure))

    def _rises(self, pressure: ArrayLike) -> Mask:
        p = np.asarray(pressure, dtype=float)
        return np.asarray(p + self.creep.reshape(p.shape) > self.largest.reshape(p.shape))


AnyContact = ContactTable | ConstantContact | AgedContact  # k, D and H_V over pressure


def contact_age(scene: Scene) -> ContactAge | None:
    """The ageing contact of a scene; None without ageing."""
    relaxation = scene.rubber.relaxation
    if not scene.film.contact_age or relaxation is None:
        return None
    return ContactAge(scene.contact_table, relaxation)
