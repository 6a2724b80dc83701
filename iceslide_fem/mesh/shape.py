"""Pure description of the built-in block: its extent and its cuts.

`BlockShape` is straight: slots and sides are vertical, so its mesh has straight grid lines except
at cut edges. `leaned` then maps its points to the real block, with inclined and wavy slots and
sides with draft.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene


class Wave(NamedTuple):
    """A slot's wave: amplitude and length (m), a zigzag or a sine, along y or along its depth."""

    amplitude: float
    length: float
    zigzag: bool
    across: bool

    def at(self, place: Array) -> Array:
        """Shift along x (m) at y, from a crest at 0, or at the height (m), from 0 at 0."""
        turns = np.asarray(place / self.length + (0.25 if self.across else 0.0))
        if not self.zigzag:
            return self.amplitude * np.sin(2.0 * math.pi * turns)
        return np.asarray(self.amplitude * (1.0 - 4.0 * np.abs((turns - 0.25) % 1.0 - 0.5)) * -1.0)

    def crests(self, low: float, high: float) -> Array:
        """Positions of the crests between two places, m."""
        first = 0.0 if self.across else 0.25
        ends = [(place / self.length - first) * 2.0 for place in (low, high)]
        numbers = np.arange(math.ceil(ends[0]), math.floor(ends[1]) + 1.0)
        return np.asarray(self.length * (first + 0.5 * numbers))


class Slot(NamedTuple):
    """A slot across the sliding direction: its range of x at the ice and its depth (m), tan of its
    lean, and its wave.
    """

    low: float
    high: float
    depth: float
    lean: float = 0.0
    wave: Wave | None = None


class Channel(NamedTuple):
    """A slot along the sliding direction: its range of y and its depth, m."""

    low: float
    high: float
    depth: float


SKIN = 2e-6  # m: penetration of heat into rubber in 35 us


class BlockShape(NamedTuple):
    """Ranges of x and (in 3-D) y that the rubber covers at the ice, and its height, in m.

    If `symmetric`, only the half y >= 0 is described. edge: radius of the lower edges of all lugs
    or, if `cut`, length of the chamfer, m; draft: tan of the inclination of the sides; skin:
    thickness of the lowest cells of a sharp-edged block whose mesh takes heat, else 0, m; layers:
    heights at which layers of other rubber begin, m.
    """

    ranges: list[tuple[float, float]]
    height: float
    symmetric: bool
    slots: tuple[Slot, ...] = ()
    channels: tuple[Channel, ...] = ()
    edge: float = 0.0
    cut: bool = False
    draft: float = 0.0
    skin: float = 0.0
    layers: tuple[float, ...] = ()

    @property
    def area(self) -> float:
        """Nominal contact area of the ranges, m2 (m in a slice)."""
        return math.prod(high - low for low, high in self.ranges)

    @property
    def straight(self) -> bool:
        """Whether no slot or side is inclined or wavy."""
        return not self.draft and not any(slot.lean or slot.wave for slot in self.slots)


def built_in_shape(scene: Scene) -> BlockShape:
    """The box of the scene, with its cuts."""
    rubber, slice_ = scene.rubber, scene.model == "slice"
    x, y = (-rubber.length / 2, rubber.length / 2), (0.0, rubber.width / 2)
    slots = []
    for sipe in rubber.cuts:
        half, wave = sipe.width / 2, None
        if sipe.wave != "none" and not (slice_ and sipe.along == "width"):
            across = sipe.along == "width"
            wave = Wave(sipe.amplitude, sipe.wavelength, sipe.wave == "zigzag", across)
        ends = (sipe.position - half, sipe.position + half)
        slots.append(Slot(*ends, sipe.depth, math.tan(sipe.angle), wave))
    channels = [
        Channel(max(groove.position - groove.width / 2, 0.0), high, groove.depth)
        for groove in sorted(rubber.grooves, key=lambda groove: groove.position)
        if (high := groove.position + groove.width / 2) and not slice_
    ]
    return BlockShape(
        [x] if slice_ else [x, y],
        rubber.height,
        not slice_,
        tuple(slots),
        tuple(channels),
        rubber.edge_radius or rubber.chamfer,
        rubber.chamfer > 0.0,
        math.tan(rubber.draft_angle),
        _skin(scene),
        rubber.heights,
    )


def _skin(scene: Scene) -> float:
    """Thickness (m) of the lowest cells, independent of the duration."""
    refinement = max(scene.numerics.refinement, 1.0)
    return SKIN / refinement if scene.rubber.heat == "mesh" else 0.0


def leaned(block: BlockShape, points: Array) -> Array:
    """Map points (n, d), m, of the straight block to the real block.

    Each slot and side has a shift along x, with linear interpolation between them. The shift grows
    from the ice to the slot's end, and falls to 0 at the plate. Sides along x are also inclined.
    """
    points = points.copy()
    y = points[:, 1].copy() if points.shape[1] == 3 else np.zeros(len(points))
    knots, by = _shifts(block, y, points[:, -1])
    points[:, 0] = _between(points[:, 0], knots, knots + by)
    if points.shape[1] == 3:
        points[:, 1] = y * (1.0 + block.draft * points[:, -1] / block.ranges[1][1])
    return points


def straightened(block: BlockShape, points: Array) -> Array:
    """Map points (n, d), m, of the real block to the straight block: the inverse of `leaned`."""
    points = points.copy()
    if points.shape[1] == 3:
        points[:, 1] /= 1.0 + block.draft * points[:, -1] / block.ranges[1][1]
    y = points[:, 1] if points.shape[1] == 3 else np.zeros(len(points))
    knots, by = _shifts(block, y, points[:, -1])
    points[:, 0] = _between(points[:, 0], knots + by, knots)
    return points


def _shifts(block: BlockShape, y: Array, z: Array) -> tuple[Array, Array]:
    """Positions along x of sides and slots in the straight block (k, n), m, and their shifts, m."""
    low, high = block.ranges[0]
    at, shifts = [low], [-block.draft * z]
    for slot in block.slots:
        inside = np.minimum(z, slot.depth)
        shift = slot.lean * inside
        if slot.wave is not None:
            shift = shift + slot.wave.at(y if slot.wave.across else inside)
        shift = shift * np.minimum((block.height - z) / (block.height - slot.depth), 1.0)
        at += [slot.low, slot.high]
        shifts += [shift, shift]
    at.append(high)
    shifts.append(block.draft * z)
    return np.repeat(np.array(at)[:, None], len(z), axis=1), np.array(shifts)


def _between(x: Array, one: Array, other: Array) -> Array:
    """Piecewise linear map of x (n,) from the knots `one` (k, n) to the knots `other`."""
    number = np.arange(len(x))
    piece = np.sum(x >= one[1:-1], axis=0)
    (low, high), (first, last) = ((at[piece, number], at[piece + 1, number]) for at in (one, other))
    return np.asarray(first + (x - low) / (high - low) * (last - first))
