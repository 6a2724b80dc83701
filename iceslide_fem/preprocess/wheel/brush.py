"""The brush model: bristles stick to the ice, are stretched through the patch, and slide.

A sticking bristle at the distance xi behind the leading edge is stretched by d = sigma xi (sigma of
`Rolling.stretch`), and has the stress c d (c in Pa/m). It breaks away where this exceeds the static
friction stress, and then slides under the sliding stress of the law. It sticks again where the
sliding stress rises faster than the stretch stress. (E. Fiala, VDI-Z. 96 (1954) 973; H. B. Pacejka,
*Tire and Vehicle Dynamics*, chapter 3.)

A bristle of rubber that relaxes has the stress

    tau(t) = integral of c(t - s) d'(s) ds,   c(t) = c [1 - sum g_i (1 - exp(-t / tau_i))]

with the Prony series of the rubber, and t since the bristle came in. Each arm keeps its stress
from pixel to pixel. d is linear over a pixel, so tau is exact at its end (`Memory`), and in between
it is taken as linear. Where a bristle slides, tau is the sliding stress, and d follows from it.

A bristle has no mass, and a sliding bristle has the sliding speed w of the wheel. In series with a
melting film a massless bristle would have no solution.
"""

from __future__ import annotations

from math import cos, hypot, inf, sin
from typing import NamedTuple

import numpy as np

from iceslide_fem.relaxation.prony import Prony, mean_response
from iceslide_fem.runtime.arrays import Array, Mask

PHASES = 6  # within 0.4 % of the result with 48 (docs/explanation/wheel.md)
FINEST = 4.0  # least number of pixels per groove


class Pattern(NamedTuple):
    """Blocks along the wheel, `pitch` (m) from edge to edge, with a `groove` (m) between two.

    phases: representative positions of the pattern relative to the entering ice.
    """

    pitch: float
    groove: float
    phases: int = PHASES

    def over(self, pressure: Array, slid: float) -> Array:
        """Pressures (phases n, nx), Pa, on the ice from pressures (n, nx) of a smooth tread.

        slid: sliding distance of the tread over the ice per pixel, m. Blocks carry the same load on
        their fraction of the area.
        """
        columns = pressure.shape[1]
        way = (np.arange(columns) + 0.5) * slid
        phases = (np.arange(self.phases) + 0.5) / self.phases * self.pitch
        block = self.pitch - self.groove
        below = (way + phases[:, None]) % self.pitch < block  # (phases, nx)
        seen = below[:, None] * pressure * (self.pitch / block)
        return np.asarray(seen.reshape(-1, columns))

    def refinement(self, slid: float) -> int:
        """Number of parts into which a pixel is split to resolve the grooves."""
        return max(1, int(np.ceil(FINEST * slid / self.groove)))


class Rolling(NamedTuple):
    """A wheel whose centre moves with `speed` V (m/s), at a `slip_angle` alpha (rad) to its plane.

    Its circumference moves with V cos(alpha) (1 - S). The `slip` ratio S is 1 for a locked wheel, 0
    for free rolling, and negative for a driven wheel.
    """

    speed: float
    slip: float
    slip_angle: float = 0.0

    @property
    def forward(self) -> float:
        """Speed of the ice along the patch, m/s."""
        return self.speed * cos(self.slip_angle)

    @property
    def sliding(self) -> tuple[float, float]:
        """Sliding velocity of the tread over the ice along and across the wheel's plane, m/s."""
        return self.forward * self.slip, self.speed * sin(self.slip_angle)

    @property
    def sliding_speed(self) -> float:
        """Magnitude w of the sliding velocity, m/s."""
        return hypot(*self.sliding)

    @property
    def direction(self) -> tuple[float, float]:
        """Unit vector of the friction force against the motion, along and across; 0 at rest."""
        along, across = self.sliding
        size = self.sliding_speed
        return (along / size, across / size) if size else (0.0, 0.0)

    @property
    def passing(self) -> float:
        """Speed of the tread through the patch, m/s; 0 for a locked wheel."""
        return self.forward * (1.0 - self.slip)

    @property
    def stretch(self) -> float:
        """sigma: stretch of a sticking bristle per distance through the patch.

        It is w over the speed of the tread through the patch, infinite for a locked wheel; S / (1 -
        S) without a slip angle.
        """
        if self.passing > 0.0:
            return self.sliding_speed / self.passing
        return inf if self.slip > 0.0 else 0.0


class Memory(NamedTuple):
    """How arms of bristles in n lines relax over a pixel; without arms bristles are elastic.

    kept: part of the stress of every arm that is left; gained: its part of c times the stretch over
    the pixel, (arms, n). long_term: modulus over the instantaneous one.
    """

    kept: Array
    gained: Array
    long_term: float = 1.0

    @classmethod
    def over(cls, time: Array, arms: Prony) -> Memory:
        """The memory of rubber over the `time` (s) of a pixel, (n,); infinite for a locked wheel.

        An arm under a linear stretch: tau' = c g d' - tau / tau_i.
        """
        steps = time / np.array(arms.times)[:, None]
        fractions = np.array(arms.fractions)[:, None]
        return cls(np.exp(-steps), fractions * (1.0 - mean_response(steps)), arms.long_term)


ELASTIC = Memory(np.empty((0, 1)), np.empty((0, 1)))


class Ends(NamedTuple):
    """Values at both ends of every pixel in the direction of passage, (n, nx); linear between."""

    first: Array
    last: Array


class Traction(NamedTuple):
    """Mean friction stress of every pixel (Pa), and its sliding fraction, (n, nx)."""

    stress: Array
    sliding: Array


def ends_of(values: Array, contact: Mask) -> Ends:
    """Values at the ends of pixels (n, nx), interpolated from neighbours in `contact`.

    They are at least 0, and 0 without contact.
    """
    middle = 0.5 * (values[:, 1:] + values[:, :-1])
    joined = contact[:, 1:] & contact[:, :-1]
    first, last = values.copy(), values.copy()
    first[:, 1:] = np.where(joined, middle, values[:, 1:])
    last[:, :-1] = np.where(joined, middle, values[:, :-1])
    # extrapolated at an edge of the contact
    no_first = np.concatenate([np.ones((len(values), 1), dtype=bool), ~joined], axis=1)
    no_last = np.concatenate([~joined, np.ones((len(values), 1), dtype=bool)], axis=1)
    first = np.where(no_first & ~no_last, 2.0 * values - last, first)
    last = np.where(no_last & ~no_first, 2.0 * values - first, last)
    return Ends(*(np.where(contact, np.maximum(end, 0.0), 0.0) for end in (first, last)))


def tractions(
    rise: Array, contact: Mask, static: Ends, sliding: Ends, memory: Memory = ELASTIC
) -> Traction:
    """Friction stress of bristles that enter at the first column.

    rise: instantaneous stress c sigma dx of a sticking bristle's stretch over a pixel, Pa, (n,),
    infinite for a locked wheel; static, sliding: largest static and sliding friction stress, Pa.
    """
    lines, columns = contact.shape
    stress, slides = np.zeros((lines, columns)), np.zeros((lines, columns))
    now, sticks = np.zeros(lines), np.ones(lines, dtype=bool)
    arms = np.zeros((len(memory.kept), lines))
    stiffness = memory.long_term + memory.gained.sum(axis=0)
    for i in range(columns):
        low, high = (
            np.where(sticks, *pair) for pair in zip(_at(static, i), _at(sliding, i), strict=True)
        )
        lost = ((1.0 - memory.kept) * arms).sum(axis=0)
        more = stiffness * rise - lost
        end = now + more
        holds = (end <= high) & (~sticks | (now <= low))
        with np.errstate(invalid="ignore", divide="ignore"):
            reached = np.where(sticks, (low - now) / (more - (high - low)), 0.0)
        part = np.where(holds, 1.0, np.clip(np.nan_to_num(reached), 0.0, 1.0))
        broken = np.where(holds, end, low + part * (high - low))
        stuck = np.where(part > 0.0, 0.5 * (now + broken), 0.0)
        first, last = _at(sliding, i)
        slid = first + (last - first) * 0.5 * (1.0 + part)
        touching = contact[:, i]
        stress[:, i] = np.where(touching, part * stuck + (1.0 - part) * slid, 0.0)
        slides[:, i] = np.where(touching, 1.0 - part, 0.0)
        held = np.where(touching, holds, sticks)
        then = np.where(held, end, np.where(touching, last, now))
        with np.errstate(invalid="ignore"):  # of a locked wheel
            stretch = np.where(held, rise, (then - now + lost) / stiffness)
        arms = memory.kept * arms + memory.gained * np.nan_to_num(stretch)
        now, sticks = then, held
    return Traction(stress, slides)


def _at(ends: Ends, column: int) -> tuple[Array, Array]:
    return ends.first[:, column], ends.last[:, column]
