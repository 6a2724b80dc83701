"""The film's height at the end of an implicit stage: an equation of ln h, and its root.

`HeightEquation.residual` is the equation. `log_height_of` finds its root by Halley's method, and
where that does not converge by Newton's method within a bracket, at last by bisection.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.runtime.arrays import Array, Index, Mask

# The last change of ln h by Halley's method, unless a larger one will do: what is left is at most
# its cube (the residual is a sum of exponentials of at most 2 ln h).
CLOSE = 1e-4
_CHANGES = 4
# The last by Newton's method; what is left is of the order of its square.
_TOLERANCE = 1e-8
_ITERATIONS = 80
# Changes of ln h from which on it needs a safeguard.
_FAR = 0.1
_UNSETTLED = 8
# Where that does not settle: ever longer ways to a bracket, and halves of it.
_DOUBLINGS, _HALVINGS = 6, 60
# Changes of ln h up to which a root is the one that is meant: of a volume that is full, where its
# room is far below the height.
_ONE_ROOT, _NARROW = 1.0, 0.18


class LogEquation(Protocol):
    """An equation of y, the logarithm of a height, at every point; its left side rises with y."""

    @property
    def start(self) -> Array:
        """y at the start of the stage."""

    def residual(self, y: Array) -> Array:
        """The left side at y."""

    def take(self, index: Index) -> Self:
        """The equation at the points of `index`."""

    def terms(self, y: Array) -> Terms:
        """The terms at y."""

    def derivatives(self, y: Array, terms: Terms) -> tuple[Array, Array, Array]:
        """The residual and its first two derivatives, the first at least 0.1."""

    def change(self, y: Array, terms: Terms) -> Array:
        """Change of y by Halley's method."""


class HeightEquation(NamedTuple):
    """The equation of y = ln h in an implicit stage, at every point; arrays (n,).

        y - start + min(squeezing h^3, room) / h - max(heating / h - cooling, 0) / h = 0

    What is squeezed out is at most the `room` (m) in the free volume; heating (J/m) and cooling
    (J/m2) are over rho L. The left side falls to minus infinity with y and rises to infinity.
    """

    start: Array
    squeezing: Array
    room: Array
    heating: Array
    cooling: Array

    def residual(self, y: Array) -> Array:
        """The left side at ln h = y."""
        h = np.exp(y)
        squeezed = np.minimum(self.squeezing * h**3, self.room)
        melted = np.maximum(self.heating / h - self.cooling, 0.0)
        return np.asarray(y - self.start + (squeezed - melted) / h)

    def take(self, index: Index) -> HeightEquation:
        """The equation at the points of `index`."""
        return HeightEquation(*(part[index] for part in self))

    def terms(self, y: Array) -> Terms:
        """The terms at ln h = y."""
        inverse = np.exp(-y)
        filling, gain = self.room * inverse, self.heating * inverse
        squeeze_out = inverse * inverse
        np.divide(self.squeezing, squeeze_out, out=squeeze_out)
        return Terms(
            inverse, squeeze_out, filling, gain, squeeze_out >= filling, gain > self.cooling
        )

    def derivatives(self, y: Array, terms: Terms) -> tuple[Array, Array, Array]:
        """The residual and its first two derivatives, the first at least 0.1.

        Arrays are reused: this is the innermost part of every step at a point.
        """
        inverse, squeeze_out, filling, gain, full, melts = terms
        squeezed = np.minimum(squeeze_out, filling)
        melted = np.minimum(gain, self.cooling)
        np.subtract(gain, melted, out=melted)
        melted *= inverse
        residual = y - self.start
        residual += squeezed
        residual -= melted
        more = gain * melts
        more *= inverse
        melted += more
        # Squeeze-out goes with the power -1 or 2 of h, melting with -2 and -1.
        power = full * -3.0
        power += 2.0
        squeezed *= power
        curve = np.multiply(squeezed, power, out=power)
        curve -= melted
        more += more
        curve -= more
        slope = np.add(squeezed, melted, out=squeezed)
        slope += 1.0
        np.maximum(slope, 0.1, out=slope)
        return residual, slope, curve

    def change(self, y: Array, terms: Terms) -> Array:
        """Change of ln h by Halley's method, two thirds to twice that of Newton's."""
        newton, slope, curve = self.derivatives(y, terms)
        np.divide(1.0, slope, out=slope)
        newton *= slope
        slope *= 0.5
        curve *= slope
        curve *= newton
        np.maximum(curve, -0.5, out=curve)
        np.minimum(curve, 0.5, out=curve)
        curve -= 1.0
        return np.divide(newton, curve, out=newton)


class Terms(NamedTuple):
    """What the equation consists of at some height.

    inverse: 1/h (1/m); squeeze_out: squeezing h^2; filling: room / h; gain: heating / h (J/m3 over
    rho L); full, melts: where the free volume is full and the ice melts.
    """

    inverse: Array
    squeeze_out: Array
    filling: Array
    gain: Array
    full: Mask
    melts: Mask

    def take(self, index: Index) -> Terms:
        """The terms at the points of `index`."""
        parts: tuple[Any, ...] = self
        return Terms(*(part[index] for part in parts))


def log_height_of(
    equation: LogEquation, near: Array | None = None, close: float = CLOSE
) -> tuple[Array, Array]:
    """Root of the equation and 1/h there, NaN where it has not settled at all.

    Halley's method from ln h = `near`, by default the start, where its changes become no larger
    than `close` and the last meets no switch; what is left after it is at most of the order of its
    cube. Elsewhere `_bracketed`.
    """
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        y = equation.start if near is None else near
        terms = equation.terms(y)
        if near is None:
            y = y + equation.change(y, terms)
            terms = equation.terms(y)
        part, rest = equation, None
        for _ in range(_CHANGES):
            change = part.change(y, terms)
            y, before = y + change, terms
            terms = part.terms(y)
            np.abs(change, out=change)
            lost = ~(change <= close)
            lost |= terms.full ^ before.full
            lost |= terms.melts ^ before.melts
            lost |= terms.full & (terms.filling > _NARROW)
            np.subtract(y, part.start, out=change)
            lost |= np.abs(change, out=change) > _ONE_ROOT
            if rest is None:
                root, inverse = y, terms.inverse
            else:
                root[rest], inverse[rest] = y, terms.inverse
            some = lost.nonzero()[0]
            if not some.size:
                return root, inverse
            rest = some if rest is None else rest[some]
            part, terms, y = part.take(some), terms.take(some), y[some]
        root[rest] = y = _bracketed(part)
        inverse[rest] = np.exp(-y)
    return root, inverse


def _bracketed(equation: LogEquation) -> Array:
    """The root by Newton's method, kept in the bracket that the residual's signs give.

    That is where it is far from the root or not settled after a few iterations; where it creeps
    past two roots that are about to merge, `_bisected`.
    """
    y = equation.start.copy()
    low, high = np.full_like(y, -np.inf), np.full_like(y, np.inf)
    for iteration in range(_ITERATIONS):
        residual, slope, _ = equation.derivatives(y, equation.terms(y))
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
    creeps = np.flatnonzero(~(np.abs(change) <= _TOLERANCE))
    y[creeps] = _bisected(equation.take(creeps), low[creeps], high[creeps])
    return y


def _bisected(equation: LogEquation, low: Array, high: Array) -> Array:
    """A root between `low` and `high`, from where they are infinite sought further and further."""

    def above(y: Array) -> Mask:
        return np.asarray(equation.residual(y) >= 0.0)

    step = 1.0
    low, high = (np.where(np.isfinite(end), end, equation.start) for end in (low, high))
    for _ in range(_DOUBLINGS):
        low, high = np.where(above(low), low - step, low), np.where(above(high), high, high + step)
        step *= 2.0
    found = ~above(low) & above(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = np.where(above(middle), low, middle), np.where(above(middle), middle, high)
    return np.where(found, high, np.nan)
