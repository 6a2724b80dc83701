"""How far to go along a Newton step of the ice's temperature, so that the melting set settles."""

from __future__ import annotations

from collections.abc import Callable

ENOUGH = 0.1  # share of the first slope that may be left of it, uphill
MAX_TRIALS = 12


def search(slope_at: Callable[[float], float], first: float) -> float:
    """The share of a step with which the minimum along it is near enough: the last `slope_at` saw.

    The flux that a film gives falls with the temperature of the ice, so the equations of a stage
    are the gradient of a convex function: along Newton's step, which goes downhill with the slope
    `first` < 0, the slope only rises. Where a full step has gone well past the minimum (points
    that melted do so no longer, and the next step would undo it), the share is found at which the
    slope is about zero, by false position (Illinois).
    """
    share, slope = 1.0, slope_at(1.0)
    if slope <= -ENOUGH * first:
        return share
    (low, slope_low), (high, slope_high) = (0.0, first), (1.0, slope)
    for _ in range(MAX_TRIALS):
        share = low - slope_low * (high - low) / (slope_high - slope_low)
        slope = slope_at(share)
        if abs(slope) <= -ENOUGH * first:
            break
        if slope > 0.0:
            high, slope_high, slope_low = share, slope, 0.5 * slope_low
        else:
            low, slope_low, slope_high = share, slope, 0.5 * slope_high
    return share
