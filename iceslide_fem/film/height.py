"""The film's height at the end of an implicit stage: an equation of ln h, and its root."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.arrays import Array, Index, Mask

# The second change of ln h by Halley's method: what is left is of the order of its cube.
_CLOSE = 1e-4
# The last by Newton's method; what is left is of the order of its square.
_TOLERANCE = 1e-8
_ITERATIONS = 80
# Changes of ln h from which on neither needs a safeguard: the residual is a sum of exponentials
# of at most 2 ln h.
_FAR = 0.1
_UNSETTLED = 8
# Changes of ln h up to which a root of a volume that is not full is the one that is meant.
_ONE_ROOT = 1.0


class HeightEquation(NamedTuple):
    """The equation of ln h in an implicit stage, at every point.

    y - start + min(squeezing h^3, room) / h - melted / h = 0 with y = ln h and melted =
    max(heating / h - cooling, 0); heating and cooling in J/m2 over rho L. The residual falls to
    minus infinity with y and rises to infinity with it.
    """

    start: Array
    squeezing: Array
    room: Array
    heating: Array
    cooling: Array

    def at(self, y: Array) -> tuple[Array, Array, Array, Mask, Mask]:
        """Residual, two derivatives, and where the free volume is full and the ice melts."""
        inverse = np.exp(-y)
        filling, gain = self.room * inverse, self.heating * inverse
        thinning = self.squeezing / (inverse * inverse)
        full = thinning >= filling
        melts = gain > self.cooling
        melted = gain - np.minimum(gain, self.cooling)
        melted *= inverse
        gain *= inverse
        gain *= melts
        # Squeeze-out goes with the power -1 or 2 of h, melting with -2 and -1.
        squeezed = np.minimum(thinning, filling, out=thinning)
        power = 2.0 - 3.0 * full
        residual = y - self.start
        residual += squeezed
        residual -= melted
        squeezed *= power
        melted += gain
        slope = squeezed + melted
        slope += 1.0
        np.maximum(slope, 0.1, out=slope)
        curve = np.multiply(squeezed, power, out=squeezed)
        curve -= melted
        gain *= 2.0
        curve -= gain
        return residual, slope, curve, full, melts

    def take(self, index: Index) -> HeightEquation:
        """The equation at the points of `index`."""
        return HeightEquation(*(np.broadcast_to(part, self.start.shape)[index] for part in self))

    def switches(self, y: Array) -> tuple[Mask, Mask]:
        """Where the free volume is full and the ice melts."""
        inverse = np.exp(-y)
        full = self.squeezing >= self.room * inverse * inverse * inverse
        return full, self.heating * inverse > self.cooling


def log_height_of(equation: HeightEquation) -> Array:
    """Root of the equation, NaN where it has not settled at all.

    Halley's method where two changes do, or three, and the last is small and meets no switch; what
    is left after it is of the order of its cube. Elsewhere `_bracketed`.
    """
    start, y = equation.start, np.array(equation.start)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        near = np.abs(_change(equation, y)[0]) <= _FAR
        settled = near & _settles(equation, y)[0]
        if settled.all():
            return y
        rest = np.flatnonzero(~settled)
        part, again = equation.take(rest), y[rest]
        settled, full = _settles(part, again)
        # Where the free volume is full the root may be one of several.
        settled &= ~full & (np.abs(again - start[rest]) <= _ONE_ROOT)
    y[rest] = again
    if not settled.all():
        far = np.flatnonzero(~settled)
        y[rest[far]] = _bracketed(part.take(far))
    return y


def _settles(equation: HeightEquation, y: Array) -> tuple[Mask, Mask]:
    """Whether one more change of ln h, in place, is the last; where the free volume is full."""
    change, full, melts = _change(equation, y)
    full_now, melts_now = equation.switches(y)
    return (np.abs(change) <= _CLOSE) & (full == full_now) & (melts == melts_now), full


def _change(equation: HeightEquation, y: Array) -> tuple[Array, Mask, Mask]:
    """Change of ln h, in place, by Halley's method, two thirds to twice that of Newton's; the
    switches that it was made with."""
    change, slope, curve, full, melts = equation.at(y)
    curve *= change
    curve *= 0.5
    change *= slope
    slope *= slope
    curve -= slope
    slope *= -0.5
    np.minimum(curve, slope, out=curve)
    slope *= 3.0
    np.maximum(curve, slope, out=curve)
    change /= curve
    y += change
    return change, full, melts


def _bracketed(equation: HeightEquation) -> Array:
    """The root by Newton's method, kept in the bracket that the residual's signs give.

    That is where it is far from the root or not settled after a few iterations.
    """
    y = equation.start.copy()
    low, high = np.full_like(y, -np.inf), np.full_like(y, np.inf)
    for iteration in range(_ITERATIONS):
        residual, slope, *_ = equation.at(y)
        change = -residual / slope
        largest = np.abs(change).max(initial=0.0)
        if largest > _FAR or iteration >= _UNSETTLED:
            low = np.where(residual < 0.0, y, low)
            high = np.where(residual >= 0.0, y, high)
            change = np.clip(change, -2.0, 2.0)
            new = y + change
            outside = (new <= low) | (new >= high)
            outside &= np.isfinite(low) & np.isfinite(high) & (np.abs(change) > _TOLERANCE)
            if outside.any():
                new[outside] = 0.5 * (low[outside] + high[outside])
            y = new
        else:
            y += change
        if largest <= _TOLERANCE:
            return y
    return np.where(np.abs(change) <= _TOLERANCE, y, np.nan)
