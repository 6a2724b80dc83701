"""Events at a point: onset of melting, and saturation of the free volume.

An event occurs when its progress reaches 1. The progress is H_s / H_V for saturation, and w |w| for
melting, with w = (T_f - T_0) / (T_m - T_0). Under a constant flux w^2 is linear in time. w is
negative for films below T_0, under rubber colder than the ice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.film.driving import PointLoads
from iceslide_fem.film.integrators import Step
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.materials import Solid


class Events(NamedTuple):
    """Masks of steps that pass an event, the fraction of the step at the event, and masks of steps
    that end on melt onset and on saturation.
    """

    across: Index
    fraction: Array
    melting: Mask
    full: Mask


class Warmth(NamedTuple):
    """w |w| of films; cold: T_0 of the ice below them, span: T_m - T_0 (K)."""

    cold: Array
    span: Array

    def __call__(self, temperature: Array) -> Array:
        """w |w| of films of this temperature (K)."""
        band = temperature - self.cold
        band /= self.span
        band *= np.abs(band)
        return band

    def take(self, index: Index) -> Warmth:
        """The same for the films at `index`."""
        return Warmth(self.cold.take(index), self.span.take(index))


def events(
    step: Step, start: Array, filled: Array, loads: PointLoads, warmth: Warmth, band: float
) -> Events:
    """Events during `step`, by linear interpolation of the progress.

    start: w |w| at its start; filled: H_s / H_V at its start; loads: at its end. Voids that are
    already full do not become full again when H_V rises under falling pressure. A step ends on an
    event if it is within `band` of it (relative to T_m - T_0 and to H_V). A step that passes an
    event is cut to end half a `band` behind it.
    """
    warm = warmth(step.last.dry_temperature)
    overfilled = step.last.overfill / loads.free_height
    overfilled += 1.0
    past_onset, melting = _switches(start, warm, 2.0 * band)
    past_full, full = _switches(filled, overfilled, band)
    across = np.flatnonzero(past_onset | past_full)
    fraction = np.minimum(
        _crossing(start[across], warm[across], 2.0 * band),
        _crossing(filled[across], overfilled[across], band),
    )
    return Events(across, np.maximum(fraction, 0.01), melting, full)


def onset_below(flux: Array, undercooling: Array, solid: Solid) -> Array:
    """Time of melt onset (s) under a constant surface flux (W/m2) from t = 0.

    T_m - T_0 = 2 q sqrt(t / pi) / e, with the `undercooling` T_m - T_0 (K) and the effusivity e.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(0.25 * np.pi * (solid.effusivity * undercooling / flux) ** 2)


def until(
    step: Step, start: Array, end: Array, squeezed: Array, loads: PointLoads, band: float
) -> Array:
    """Expected time from the end of `step` to the next event (s); infinite without one.

    start, end: w |w| at its ends; squeezed: H_s (m) at its start; the others as for `events`. H_s
    is extrapolated with its last rate and the curvature of the step.
    """
    now, free = step.state.squeezed_height, loads.free_height
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        melts = (1.0 + band - end) * step.dt
        melts /= end - start
        rate = step.change.squeezed_height / step.stage_dt
        bend = squeezed - now
        bend /= step.dt
        bend += rate
        bend /= step.dt
        room = (1.0 + 0.5 * band) * free
        room -= now
        fills = 2.0 * room
        bend *= fills
        bend *= 2.0
        bend += rate * rate
        rate += np.sqrt(bend, out=bend)
        fills /= rate
    # An event behind, or without a root ahead, is not expected.
    none = melts <= 0.0
    none |= end >= 1.0 - 2.0 * band
    melts[none] = np.inf
    np.less_equal(fills, 0.0, out=none)
    none |= room <= 1.5 * band * free
    fills[none] = np.inf
    return np.fmin(np.fmin(melts, fills, out=fills), np.inf, out=fills)


def _switches(start: Array, end: Array, band: float) -> tuple[Mask, Mask]:
    """Masks of steps that pass an event, and of steps that end on it."""
    begins = end >= 1.0 - band
    begins &= start < 1.0 - band
    past = end > 1.0 + band
    past &= begins
    begins ^= past
    return past, begins


def _crossing(start: Array, end: Array, band: float) -> Array:
    """Fraction of the step that ends half a `band` behind an event; 1 if none is passed."""
    past = _switches(start, end, band)[0]
    fraction = np.ones_like(end)
    np.divide(1.0 + 0.5 * band - start, end - start, out=fraction, where=past)
    return fraction
