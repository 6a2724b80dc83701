"""Rubber that slides on rough ice: contact and hysteresis by the theory of self-affine contact.

The ice's asperities deform the rubber at the frequencies q v cos(phi) of their waves. With the
ice's spectrum C, optionally that of the rubber, which rests in the rubber (`C_r`), and E of
incompressible rubber (B. N. J. Persson, J. Chem. Phys. 115 (2001) 3840):

    G(q) = pi/4 int_q0^q q^3 [C <|E|^2> + C_r E_inf^2] dq / ((1 - nu^2) p)^2          (1)
    P(q) = erf(1 / (2 sqrt(G)))                                                     (2)
    mu_h = pi int_q0^q1 q^3 C P S <cos(phi) Im E> dq / ((1 - nu^2) p)               (3)
    S    = gamma + (1 - gamma) P^2                                                  (4)

P is the fraction of the area in contact if only waves up to q are seen; <.> is the mean over the
direction phi of a wave to the sliding direction. gamma = 1 is the theory of 2001. With the arms E_i
and tau_i of a Prony series, y_i = q v tau_i a_T and A_i = 1 / sqrt(1 + y_i^2) the means are closed:

    <cos(phi) Im E> = sum E_i (1 - A_i) / y_i                                       (5)
    <|E|^2> = E_inf^2 + 2 sum (1 - A_i) E_i [E_inf + sum_j E_j tau_j / (tau_i + tau_j)]     (6)

Ice is rigid, and its asperities neither melt nor break.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erf

from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum

PANELS, NODES = 60, 8  # of the Gauss quadrature over ln q
GRADED = 3  # power by which panels get shorter towards q0, where P falls from 1
INCOMPRESSIBLE = 0.75  # 1 - nu^2


class Moduli(NamedTuple):
    """Young's moduli (Pa) of rubber: long-term, and arms with times (s, arrays) at a reference."""

    long_term: float
    arms: Array
    times: Array

    @classmethod
    def of(cls, instantaneous: float, relaxation: Relaxation | None) -> Moduli:
        """Those of rubber with an `instantaneous` modulus (Pa); None: it is elastic."""
        if relaxation is None:
            return cls(instantaneous, np.zeros(0), np.ones(0))
        prony = relaxation.prony
        arms = instantaneous * np.array(prony.fractions)
        return cls(instantaneous * prony.long_term, arms, np.array(prony.times))

    def means(self, frequency: Array) -> tuple[Array, Array]:
        """<cos(phi) Im E> (Pa) and <|E|^2> (Pa2) at q v a_T (rad/s), any shape, by (5) and (6)."""
        E, tau = self.arms, self.times
        y = frequency[..., None] * tau
        A = 1.0 / np.sqrt(1.0 + y**2)
        over = y * A**2 / (1.0 + A)  # (1 - A) / y, because 1 - A^2 = (y A)^2
        beside = self.long_term + (tau / (tau[:, None] + tau)) @ E
        square = self.long_term**2 + 2.0 * (y * over) @ (E * beside)
        return np.asarray(over @ E), np.asarray(square)


class Sliding(NamedTuple):
    """Rubber on rough ice under some conditions (n,), at wave numbers q (rad/m), (m,).

    contact: P(q), (n, m); friction: d mu_h / d ln q, (n, m); weights: of the quadrature over ln q,
    (m,); contact_fraction: P(q1), (n,).
    """

    q: Array
    contact: Array
    friction: Array
    weights: Array
    contact_fraction: Array

    @property
    def mu(self) -> Array:
        """mu_h by (3), (n,)."""
        return np.asarray(self.friction @ self.weights)


def sliding(
    ice: PowerSpectrum,
    rubber: Moduli,
    reduced_speed: ArrayLike,
    pressure: ArrayLike,
    gamma: float = 1.0,
    own: PowerSpectrum | None = None,
) -> Sliding:
    """Contact and hysteresis at v a_T (m/s) and pressures (Pa), which broadcast to (n,).

    gamma: of (4); own: roughness of the rubber, whose waves outside the ice's are left out.
    """
    v, p = np.broadcast_arrays(np.atleast_1d(reduced_speed), np.atleast_1d(pressure))
    lnq, half, weights, inside = _quadrature(ice.q)
    q = np.exp(lnq)
    loss, square = rubber.means(v.astype(float)[:, None, None] * q)
    scale = (INCOMPRESSIBLE * p.astype(float))[:, None, None]
    stored = ice(q) * square
    if own is not None:
        stored = stored + own.within(q) * rubber.long_term**2
    dG = 0.25 * np.pi * q**4 * stored / scale**2
    panels = half * (dG @ weights)
    before = np.cumsum(panels, axis=1) - panels
    G = before[..., None] + half[:, None] * (dG @ inside.T)
    P = erf(0.5 / np.sqrt(G))
    S = gamma + (1.0 - gamma) * P**2
    friction = np.pi * q**4 * ice(q) * P * S * loss / scale
    n = v.size
    last = erf(0.5 / np.sqrt(panels.sum(axis=1)))
    of_nodes = (half[:, None] * weights).ravel()
    return Sliding(q.ravel(), P.reshape(n, -1), friction.reshape(n, -1), of_nodes, last)


def waves_of(*spectra: PowerSpectrum) -> tuple[Array, Array]:
    """Wave numbers q (rad/m) of all spectra, and weights of the quadrature over ln q, (m,)."""
    rows = tuple(sorted({q for one in spectra for q in one.q}))
    nodes, half, weights, _ = _quadrature(rows)
    return np.exp(nodes).ravel(), (half[:, None] * weights).ravel()


@lru_cache(maxsize=8)
def _quadrature(rows: tuple[float, ...]) -> tuple[Array, Array, Array, Array]:
    """Nodes ln q (panels, nodes), half lengths of panels, Gauss weights, and the matrix of the
    integrals from a panel's start to its nodes.

    Panels are graded to the first of the `rows` (rad/m), and end on every row.
    """
    ends = np.log(rows)
    graded = ends[0] + np.linspace(0.0, 1.0, PANELS + 1) ** GRADED * (ends[-1] - ends[0])
    edges = np.unique(np.concatenate([graded, ends[1:-1]]))
    x, weights = np.polynomial.legendre.leggauss(NODES)
    values = np.polynomial.legendre.legvander(x, NODES - 1)
    integrals = np.stack(
        [
            np.polynomial.legendre.legval(x, np.polynomial.legendre.legint(unit, lbnd=-1))
            for unit in np.eye(NODES)
        ],
        axis=1,
    )
    half = 0.5 * np.diff(edges)
    nodes = edges[:-1, None] + half[:, None] * (1.0 + x)
    return nodes, half, weights, integrals @ np.linalg.inv(values)
