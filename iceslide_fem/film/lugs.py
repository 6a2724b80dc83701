"""Lugs between edges, sipes and grooves of a block, and the outflow of water below them.

The outflow below a plane rectangular lug with sides a >= b is a Poiseuille flow between parallel
faces. The mean pressure p squeezes the height h by

    dh/dt = -p h^3 / (eta B^2),   B^2 = 3 beta b^2,   beta = 1/3 - 0.21 b/a (1 - b^4 / (12 a^4))

The pressure has the shape of Prandtl's stress function of a twisted bar with the torsion constant
beta a b^3 (S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd ed. 1970, chapter 10; the fit
within 0.5 %). A long lug has B = b.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.rubber import Rubber

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
