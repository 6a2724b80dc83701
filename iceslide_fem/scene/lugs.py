"""Lugs between the edges of a block, its sipes and its grooves: the way that water has to go.

Water below a plane rectangular lug of the sides a >= b flows out as Poiseuille's between its faces
does. Its mean pressure p then squeezes the height h by

    dh/dt = -p h^3 / (eta B^2),   B^2 = 3 beta b^2,   beta = 1/3 - 0.21 b/a (1 - b^4 / (12 a^4))

for the pressure has the shape of Prandtl's function of a twisted bar, whose torsion constant is
beta a b^3 (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, chapter 10; the
fit within 0.5 %). A long lug has B = b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.rubber import Rubber

CLOSING = 0.1  # of a sipe's volume


class Lugs(NamedTuple):
    """The lugs of a block along x.

    ends: (lugs, 2), m; width: of the widest rib between its edges and grooves, infinite in a
    slice, m; volumes: of the sipes between them, area of their cross sections (m2), infinite where
    they take whatever comes, (sipes,).
    """

    ends: Array
    width: float
    volumes: Array

    @property
    def longest(self) -> float:
        """B of the longest lug, m."""
        return float(self.outflow_lengths(np.ones(self.volumes.size)).max())

    def at(self, x: Array) -> NDArray[np.intp]:
        """Numbers of the lugs above places `x` (m) of the undeformed block, any shape."""
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
        """What of the `outflow` (lugs,) below each lug gets into each sipe, (sipes,), one unit.

        Along x half of it goes either way; a sipe lets by what it is not open for.
        """
        along = outflow / (1.0 + (self._lengths(openness) / self.width) ** 2)
        return _caught(along, openness) + _caught(along[::-1], openness[::-1])[::-1]

    def _lengths(self, openness: Array) -> Array:
        """Length (m) of each lug and of what is beyond sipes that are not open, (lugs,)."""
        length = self.ends[:, 1] - self.ends[:, 0]
        gaps = self.ends[1:, 0] - self.ends[:-1, 1]
        ahead = _beyond(length, gaps, openness)
        behind = _beyond(length[::-1], gaps[::-1], openness[::-1])[::-1]
        return np.asarray(length + ahead + behind)


def open_sipes(filled: Array) -> Array:
    """How open sipes are as outlets, 0 to 1, of which water fills a fraction, (sipes,).

    A sipe closes over the last `CLOSING` of its volume. This is a regularisation: a sipe that
    closed at once would open again in the next step.
    """
    return np.clip((1.0 - filled) / CLOSING, 0.0, 1.0)


def _beyond(length: Array, gaps: Array, openness: Array) -> Array:
    """Length (m) that adds to each lug ahead of it."""
    found = np.zeros_like(length)
    for i in range(gaps.size - 1, -1, -1):
        found[i] = (1.0 - openness[i]) * (gaps[i] + length[i + 1] + found[i + 1])
    return found


def _caught(along: Array, openness: Array) -> Array:
    """What each sipe takes of the half that flows ahead below every lug."""
    caught, flow = np.zeros_like(openness), 0.0
    for i, how_open in enumerate(openness):
        flow += 0.5 * along[i]
        caught[i] = how_open * flow
        flow -= caught[i]
    return caught


def lugs_of(rubber: Rubber, wide: bool = False) -> Lugs:
    """The lugs of a block without a mesh of its own; `wide`: as in a slice."""
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
