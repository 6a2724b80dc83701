"""Charts of a wheel: friction and what goes with it over slip, and stops over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from iceslide_fem.postprocess.report.page import Chart, Curve

# Of mu_slip.csv: anchor, title, description, label of y, column, factor.
OVER_SLIP = (
    ("mu", "Friction over slip", "Friction along the wheel.", "mu", "mu", 1.0),
    ("sliding", "What slides", "The rest sticks to the ice.", "% of the contact",
     "sliding_fraction", 100.0),
    ("melting", "Where ice melts", "Below what slides.", "% of the contact",
     "melting_fraction", 100.0),
    ("saturated", "Where free volume is full of water", "Below what slides.", "% of the contact",
     "saturated_fraction", 100.0),
    ("height", "Height of the film", "Mean where rubber slides.", "nm", "mean_film_m", 1e9),
    ("temperature", "Temperature of the ice's surface", "Mean where rubber slides.", "°C",
     "mean_temperature_C", 1.0),
)  # fmt: skip
ACROSS = (
    ("across", "Side force over slip", "Friction across the wheel.", "mu across", "mu_across", 1.0),
    ("trail", "Trail of the side force", "Behind the middle of the patch.", "mm", "trail_m", 1e3),
)
# Of stops.csv, the same.
OVER_TIME = (
    ("speed", "Speed of the car", "Down to the end of each stop.", "km/h", "speed_m_s", 3.6),
    ("slip", "Slip ratio", "1 is a locked wheel.", "S (1)", "slip", 1.0),
    ("mu-time", "Friction of the stop", "At the slip and speed of each moment.", "mu", "mu", 1.0),
    ("distance", "Distance", "From the first moment of braking.", "x (m)", "distance_m", 1.0),
)


def charts_of(slipping: pd.DataFrame, stops: pd.DataFrame | None) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures, of the tables mu_slip.csv and stops.csv."""
    members = {
        f"{3.6 * speed:.4g} km/h, {celsius:.4g} °C": rows
        for (speed, celsius), rows in slipping.groupby(["speed_m_s", "temperature_C"], sort=False)
    }
    turned = ACROSS if slipping["mu_across"].any() else ()
    below = "slip ratio (1: locked)"
    over_slip = [_chart(members, "slip", below, *each) for each in (*OVER_SLIP, *turned)]
    found = {"mu_slip": [_with_peaks(over_slip[0]), *filter(_has_values, over_slip[1:])]}
    if stops is not None:
        found["stops"] = charts_of_stops(stops)
    return found


def charts_of_stops(stops: pd.DataFrame) -> list[Chart]:
    """Stops over time, a curve for each control."""
    controls = dict(list(stops.groupby("control", sort=False)))
    return [_chart(controls, "time_s", "time (s)", *each) for each in OVER_TIME]


def _chart(
    groups: Mapping[str, pd.DataFrame], x: str, below: str,
    name: str, title: str, says: str, label: str, column: str, factor: float,
) -> Chart:  # fmt: skip
    """A column of every group of rows over the column `x`."""
    curves = [
        Curve(group, rows[x].to_numpy(), factor * rows[column].to_numpy(), look)
        for look, (group, rows) in enumerate(groups.items())
    ]
    return Chart(name, title, says, below, label, curves)


def _has_values(chart: Chart) -> bool:
    return any(np.isfinite(np.asarray(curve.y)).any() for curve in chart.curves)


def _with_peaks(chart: Chart) -> Chart:
    """The chart with a mark at the largest braking friction of each curve."""
    tops = []
    for curve in chart.curves:
        slip, mu = np.asarray(curve.x), np.asarray(curve.y)
        if (braking := np.flatnonzero(slip > 0.0)).size:
            top = braking[int(mu[braking].argmax())]
            tops.append((float(slip[top]), float(mu[top])))
    says = "; ".join(f"{mu:.4g} at a slip ratio of {slip:.4g}" for slip, mu in tops)
    slips, tips = np.transpose(tops) if tops else ((), ())
    peaks = [Curve("largest", slips, tips, 4, True)] if tops else []
    return chart._replace(curves=[*chart.curves, *peaks], says=f"Largest: {says}." if says else "")
