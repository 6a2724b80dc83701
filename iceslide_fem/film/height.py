"""The film height at the end of an implicit stage: an equation for ln h, and its root.

`HeightEquation.residual` is the equation. `log_height_of` finds its root by Halley's method. Where
that fails it uses Newton's method within a bracket, and finally bisection.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from iceslide_fem.runtime.arrays import Array, Index, Mask

# Tolerance of ln h in Halley's method, unless a larger one is given. The remaining error is at most
# its cube (the residual is a sum of exponentials of at most 2 ln h).
CLOSE = 1e-4
_CHANGES = 4
# Tolerance in Newton's method; the remaining error is of the order of its square.
_TOLERANCE = 1e-8
_ITERATIONS = 80
# Iterations after which Newton's method ends if no root is bracketed.
_LOST = 12
# Change of ln h above which Newton's method needs a safeguard.
_FAR = 0.1
_UNSETTLED = 8
# Bisection: doublings of the search distance to a bracket, and bisections of it.
_DOUBLINGS, _HALVINGS = 6, 60
# Largest distance of the root in ln h for full voids whose free room is far below the height.
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

    Squeeze-out is limited by the `room` (m) in the free volume. heating (J/m) and cooling (J/m2)
    are divided by rho L. The left side goes to minus infinity and to infinity with y.
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

        Arrays are reused, because this is the innermost loop of every step at a point.
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
        # Squeeze-out scales with the power -1 or 2 of h, melting with -2 and -1.
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
        """Change of ln h by Halley's method, limited to 2/3 to 2 times Newton's change."""
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
    """Terms of the equation at a given height.

    inverse: 1/h (1/m); squeeze_out: squeezing h^2; filling: room / h; gain: heating / h (J/m3 over
    rho L); full, melts: masks of full free volume and of melting ice.
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
    """Root of the equation and 1/h there; NaN where no method converges.

    Halley's method starts at ln h = `near`, by default at the start of the stage. It is accepted if
    its last change is at most `close` and crosses no switch. The remaining error is of the order of
    the cube of that change. Otherwise `_bracketed` finds the root.
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
    """The root by Newton's method, safeguarded by a bracket from the residual's signs.

    The bracket is used far from the root and after a few iterations. Near two merging roots
    Newton's method stagnates; `_bisected` finds the root there.
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
        if iteration >= _LOST and not (np.isfinite(low) & np.isfinite(high)).any():
            break
    creeps = np.flatnonzero(~(np.abs(change) <= _TOLERANCE))
    y[creeps] = _bisected(equation.take(creeps), low[creeps], high[creeps])
    return y


def _bisected(equation: LogEquation, low: Array, high: Array) -> Array:
    """A root between `low` and `high` by bisection; infinite bounds are searched outwards."""

    def above(y: Array) -> Mask:
        return np.asarray(equation.residual(y) >= 0.0)

    step = 1.0
    low, high = (np.where(np.isfinite(end), end, equation.start) for end in (low, high))
    for _ in range(_DOUBLINGS):
        low, high = np.where(above(low), low - step, low), np.where(above(high), high, high + step)
        step *= 2.0
    found = ~above(low) & above(high)
    if not found.any():
        return np.full_like(low, np.nan)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = np.where(above(middle), low, middle), np.where(above(middle), middle, high)
    return np.where(found, high, np.nan)
