"""The brush: bristles stick to the ice, are stretched on their way through the patch, and slide.

A bristle that sticks at the distance xi behind the leading edge bears the stress c sigma xi (c in
Pa/m, sigma of `rolling.Rolling.stretch`). It breaks away where that exceeds what static contact
bears, and then slides under the sliding stress of the law. It sticks again where the sliding stress
rises faster than the bristle is stretched. (E. Fiala, VDI-Z. 96 (1954) 973; H. B. Pacejka, *Tire
and Vehicle Dynamics*, chapter 3.)

A bristle has no mass and no speed of its own: what slides does so with the sliding speed w of the
wheel. In series with a film that melts a massless bristle has no motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array, Mask


class Ends(NamedTuple):
    """Values at both ends of every pixel, as the tread passes it, (n, nx): straight between."""

    first: Array
    last: Array


class Traction(NamedTuple):
    """Mean friction stress of every pixel (Pa), and the fraction of it that slides, (n, nx)."""

    stress: Array
    sliding: Array


def ends_of(values: Array, contact: Mask) -> Ends:
    """Values at the ends of pixels (n, nx) by straight lines through those of their neighbours in
    `contact`; not below 0, and 0 where there is none.
    """
    middle = 0.5 * (values[:, 1:] + values[:, :-1])
    joined = contact[:, 1:] & contact[:, :-1]
    first, last = values.copy(), values.copy()
    first[:, 1:] = np.where(joined, middle, values[:, 1:])
    last[:, :-1] = np.where(joined, middle, values[:, :-1])
    # At an edge of the contact the line goes on.
    no_first = np.concatenate([np.ones((len(values), 1), dtype=bool), ~joined], axis=1)
    no_last = np.concatenate([~joined, np.ones((len(values), 1), dtype=bool)], axis=1)
    first = np.where(no_first & ~no_last, 2.0 * values - last, first)
    last = np.where(no_last & ~no_first, 2.0 * values - first, last)
    return Ends(*(np.where(contact, np.maximum(end, 0.0), 0.0) for end in (first, last)))


def tractions(rise: Array, contact: Mask, static: Ends, sliding: Ends) -> Traction:
    """What bristles bear that enter at the first column.

    rise: c sigma dx, by which the stress of a bristle that sticks rises over a pixel (Pa, (n,)),
    infinite of a locked wheel; static, sliding: the most that contact bears at rest, and the
    friction of contact that slides (Pa).
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
