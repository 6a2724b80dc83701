"""The brush model: bristles stick to the ice, are stretched through the patch, and slide.

A sticking bristle at the distance xi behind the leading edge has the stress c sigma xi (c in Pa/m,
sigma of `rolling.Rolling.stretch`). It breaks away where this exceeds the static friction stress,
and then slides under the sliding stress of the law. It sticks again where the sliding stress rises
faster than the stretch stress. (E. Fiala, VDI-Z. 96 (1954) 973; H. B. Pacejka, *Tire and Vehicle
Dynamics*, chapter 3.)

A bristle has no mass, and a sliding bristle has the sliding speed w of the wheel. In series with a
melting film a massless bristle would have no solution.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array, Mask


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


def tractions(rise: Array, contact: Mask, static: Ends, sliding: Ends) -> Traction:
    """Friction stress of bristles that enter at the first column.

    rise: stress increase c sigma dx of a sticking bristle over a pixel, Pa, (n,), infinite for a
    locked wheel; static, sliding: largest static and sliding friction stress, Pa.
    """
    lines, columns = contact.shape
    stress, slides = np.zeros((lines, columns)), np.zeros((lines, columns))
    now, sticks = np.zeros(lines), np.ones(lines, dtype=bool)
    for i in range(columns):
        low, high = (
            np.where(sticks, *pair) for pair in zip(_at(static, i), _at(sliding, i), strict=True)
        )
        end = now + rise
        holds = (end <= high) & (~sticks | (now <= low))
        with np.errstate(invalid="ignore", divide="ignore"):
            reached = np.where(sticks, (low - now) / (rise - (high - low)), 0.0)
        part = np.where(holds, 1.0, np.clip(np.nan_to_num(reached), 0.0, 1.0))
        broken = np.where(holds, end, low + part * (high - low))
        stuck = np.where(part > 0.0, 0.5 * (now + broken), 0.0)
        first, last = _at(sliding, i)
        slid = first + (last - first) * 0.5 * (1.0 + part)
        touching = contact[:, i]
        stress[:, i] = np.where(touching, part * stuck + (1.0 - part) * slid, 0.0)
        slides[:, i] = np.where(touching, 1.0 - part, 0.0)
        now = np.where(touching, np.where(holds, end, last), np.where(sticks, end, now))
        sticks = np.where(touching, holds, sticks)
    return Traction(stress, slides)


def _at(ends: Ends, column: int) -> tuple[Array, Array]:
    return ends.first[:, column], ends.last[:, column]
