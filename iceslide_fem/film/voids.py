"""Water in the voids between rubber and ice, which bears a part of the pressure, and its outflow
below lugs, which lie between edges, sipes and grooves of a block.

The voids below rubber hold H_V(p_c) of water at the contact pressure p_c. With W (m) in them

    p = p_c + p_f,   0 <= p_f,   H_V(p - p_f) - W >= 0,   one of both 0        (1)

Full voids share the load: the water bears p_f and the asperities p_c. k, D and the squeeze-out are
those at p_c. Water under pressure flows out to the edges of a lug of the length B (m), as a film
between the plane faces of a long strip (O. Reynolds, Phil. Trans. R. Soc. 177 (1886) 157):

    dW/dt = ... - p_f W^3 / (eta B^2)                                          (2)

If ice brings more water than the voids hold, p_c is 0 until the water is squeezed out.

Outflow below a plane rectangular lug with sides a >= b is a Poiseuille flow between parallel
faces. The mean pressure p squeezes the height h by

    dh/dt = -p h^3 / (eta B^2),   B^2 = 3 beta b^2,   beta = 1/3 - 0.21 b/a (1 - b^4 / (12 a^4))

The pressure has the shape of Prandtl's stress function of a twisted bar with the torsion constant
beta a b^3 (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, chapter 10; the fit
within 0.5 %). A long lug has B = b.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array, Index, some_of
from iceslide_fem.scene.contact_table import ContactTable
from iceslide_fem.scene.rubber import Rubber

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from iceslide_fem.surfaces.combined_contact import Change

NO_CONTACT = 1e-12  # k at the limit of contact


@dataclass(frozen=True)
class Voids:
    """Voids of a contact `table`; lug: length B (m), scalar or (n,), infinite without outflow.

    rough: what rough ice changes at these places, None if the table has it or ice is smooth.

    Below the lowest pressure of the table k is proportional to pressure, D is constant, and H_V is
    extrapolated linearly in log-log. Above the highest pressure H_V is extrapolated likewise.
    """

    table: ContactTable
    lug: Array | float = np.inf
    rough: Change | None = None

    def take(self, index: Index) -> Voids:
        """The voids at `index`."""
        rough = self.rough and self.rough.take(index)
        return replace(self, lug=some_of(self.lug, index), rough=rough)

    @cached_property
    def _heights(self) -> tuple[Array, Array]:
        """ln H_V, decreasing, and ln p of the table, without rows of equal H_V."""
        height, pressure = np.log(self.table.H_V.values), np.log(self.table.pressure)
        kept = np.append(np.diff(height) < 0.0, True)
        return height[kept], pressure[kept]

    def carried(self, water: Array) -> Array:
        """Contact pressure (Pa) at which the voids hold exactly this `water` (m, (n,)).

        Infinite for zero or negative water, which stages of a too long step may have.
        """
        height, pressure = self._heights
        if self.rough is not None:
            water = water - self.rough.gap
        with np.errstate(divide="ignore"):
            log = np.log(np.maximum(water, 0.0))
        if height.size == 1:
            return np.where(log < height[0], np.inf, 0.0)
        with np.errstate(over="ignore"):
            found = np.exp(_straight(-log, -height, pressure))
        return np.where(water > 0.0, found, np.inf)

    def contact_pressure(self, pressure: Array, water: Array) -> Array:
        """p_c (Pa) of (1) under `pressure` (Pa) with `water` (m) in the voids, (n,)."""
        return np.minimum(np.maximum(pressure, 0.0), self.carried(water))

    def touching(self, pressure: Array) -> tuple[Array, Array]:
        """k and D (m) under contact pressures (Pa), (n,), as the table has them."""
        if self.rough is None:
            return self.table.k_and_D(pressure)
        k, D, *_ = self.table.changed(pressure, self.rough)
        return k, D

    def contact(self, pressure: Array) -> tuple[Array, Array]:
        """k and D (m) under contact pressures (Pa), (n,)."""
        k, D = self.touching(pressure)
        if self.rough is None:
            k = k * np.minimum(pressure / self.table.pressure[0], 1.0)
        return np.maximum(k, NO_CONTACT), D

    def held(self, pressure: Array) -> Array:
        """H_V (m) at contact pressures (Pa), (n,): inverse of `carried`."""
        height, log = self._heights
        more = 0.0 if self.rough is None else self.rough.gap
        if height.size == 1:
            return np.full_like(pressure, np.exp(height[0])) + more
        held = np.exp(_straight(np.log(np.maximum(pressure, 1e-300)), log, height))
        return np.asarray(held + more)

    def outflow(self, borne: Array, water: Array, viscosity: Array | float) -> Array:
        """p_f W^2 / (eta B^2), 1/s: outflow rate of the `water` W (m) by (2), (n,).

        borne: its pressure p_f, Pa.
        """
        return np.asarray(borne * water**2 / (viscosity * self.lug**2))


def _straight(at: Array, x: Array, y: Array) -> Array:
    """Piecewise linear interpolation, with linear extrapolation beyond rising x."""
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    slope = (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    with np.errstate(invalid="ignore"):
        return np.asarray(y[i] + slope * (at - x[i]))


CLOSING = 0.1  # last fraction of a sipe's volume over which it closes


class Lugs(NamedTuple):
    """The lugs of a block along x.

    ends: (lugs, 2), m; width: of the widest rib between edges and grooves, infinite in a slice, m;
    volumes: cross section areas of the sipes between them (m2), infinite for unlimited sipes,
    (sipes,).
    """

    ends: Array
    width: float
    volumes: Array

    @property
    def longest(self) -> float:
        """B of the longest lug, m."""
        return float(self.outflow_lengths(np.ones(self.volumes.size)).max())

    def at(self, x: Array) -> NDArray[np.intp]:
        """Numbers of the lugs above positions `x` (m) of the undeformed block, any shape."""
        middles = 0.5 * (self.ends[:-1, 1] + self.ends[1:, 0])
        return np.searchsorted(middles, x)

    def outflow_lengths(self, openness: Array) -> Array:
        """B (m) below each lug, (lugs,); see `open_sipes`."""
        length = self._lengths(openness)
        short, long = np.minimum(length, self.width), np.maximum(length, self.width)
        slender = short / long
        beta = 1.0 / 3.0 - 0.21 * slender * (1.0 - slender**4 / 12.0)
        return np.asarray(short * np.sqrt(3.0 * beta))

    def into_sipes(self, outflow: Array, openness: Array) -> Array:
        """Part of the `outflow` (lugs,) below the lugs that enters each sipe, (sipes,), same unit.

        Half of the outflow goes each way along x. A partly open sipe lets the rest pass.
        """
        along = outflow / (1.0 + (self._lengths(openness) / self.width) ** 2)
        return _caught(along, openness) + _caught(along[::-1], openness[::-1])[::-1]

    def _lengths(self, openness: Array) -> Array:
        """Length (m) of each lug plus lengths beyond closed sipes, (lugs,)."""
        length = self.ends[:, 1] - self.ends[:, 0]
        gaps = self.ends[1:, 0] - self.ends[:-1, 1]
        ahead = _beyond(length, gaps, openness)
        behind = _beyond(length[::-1], gaps[::-1], openness[::-1])[::-1]
        return np.asarray(length + ahead + behind)


def open_sipes(filled: Array) -> Array:
    """Openness of sipes as outlets, 0 to 1, from their filled fraction, (sipes,).

    A sipe closes over the last `CLOSING` of its volume. This is a regularisation: a sipe that
    closes suddenly would open again in the next step.
    """
    return np.clip((1.0 - filled) / CLOSING, 0.0, 1.0)


def _beyond(length: Array, gaps: Array, openness: Array) -> Array:
    """Additional length (m) ahead of each lug."""
    found = np.zeros_like(length)
    for i in range(gaps.size - 1, -1, -1):
        found[i] = (1.0 - openness[i]) * (gaps[i] + length[i + 1] + found[i + 1])
    return found


def _caught(along: Array, openness: Array) -> Array:
    """Part of the forward half of the outflow that each sipe takes."""
    caught, flow = np.zeros_like(openness), 0.0
    for i, how_open in enumerate(openness):
        flow += 0.5 * along[i]
        caught[i] = how_open * flow
        flow -= caught[i]
    return caught


class WetVoids(NamedTuple):
    """Voids that carry, the `lugs` that drain them, and the water on the ice ahead.

    brought: function from positions x (m) to the water height on the ice (m).
    """

    voids: Voids
    lugs: Lugs
    brought: Callable[[Array], Array]


def lugs_of(rubber: Rubber, wide: bool = False) -> Lugs:
    """The lugs of a built-in block; `wide`: of infinite width, as in a slice."""
    half = 0.5 * rubber.length
    walls = [sipe.walls for sipe in rubber.cuts]
    ends = np.array([-half, *(end for pair in walls for end in pair), half]).reshape(-1, 2)
    volumes = np.array([sipe.width * sipe.depth for sipe in rubber.cuts])
    if not rubber.stores_water:
        volumes = np.full_like(volumes, np.inf)
    return Lugs(ends, np.inf if wide else _widest_rib(rubber), volumes)


def _widest_rib(rubber: Rubber) -> float:
    """Width (m) of the widest rib between the edges of the block and its grooves."""
    half = 0.5 * rubber.width
    walls = [-half, half]
    for groove in rubber.grooves:
        for side in {groove.position, -groove.position}:
            walls += [side - 0.5 * groove.width, side + 0.5 * groove.width]
    walls.sort()
    return max(end - start for start, end in zip(walls[::2], walls[1::2], strict=True))
