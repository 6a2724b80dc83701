"""The figures of a wheel: mu_slip.csv, stops.csv, and summary.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from iceslide_fem.film.doubts import WITHOUT_MELTING, doubts
from iceslide_fem.preprocess.footprint.reading import ReadFootprint
from iceslide_fem.preprocess.wheel.braking import Stop
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import Curve, SlipPoint
from iceslide_fem.preprocess.wheel.stops import Stops
from iceslide_fem.preprocess.wheel.tread import TreadStiffness
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS

# Columns of mu_slip.csv by fields of a point.
COLUMNS = {
    "slip": "slip",
    "mu": "mu",
    "mu_across": "mu_across",
    "trail": "trail_m",
    "sliding": "sliding_fraction",
    "melting": "melting_fraction",
    "saturated": "saturated_fraction",
    "film_height": "mean_film_m",
    "temperature": "mean_temperature_C",
}


# Columns of stops.csv, the fields of a history.
OF_STOPS = "time_s speed_m_s wheel_speed_rad_s slip mu torque_N_m distance_m".split()


def columns(found: Sequence[Curve], load: float) -> dict[str, Array]:
    """Columns of mu_slip.csv, names with units -> (members of the family * slip ratios,).

    Slip varies fastest. load: N, or N/m for a line; used for the aligning torque.
    """
    head = ("speed_m_s", "temperature_C", *COLUMNS.values(), "aligning_torque_N_m")
    rows = [
        (
            curve.speed,
            curve.temperature - ZERO_CELSIUS,
            *_row(point),
            point.mu_across * load * point.trail,
        )
        for curve in found
        for point in curve.points
    ]
    return dict(zip(head, np.array(rows).T, strict=True))


def _row(point: SlipPoint) -> list[float]:
    kelvin = {"temperature": point.temperature - ZERO_CELSIUS}
    return [(point._asdict() | kelvin)[name] for name in COLUMNS]


def stop_columns(stops: Mapping[str, Stop]) -> dict[str, Any]:
    """Columns of stops.csv: a row for every time of every stop; the control is the first one."""
    names = [name for name, stop in stops.items() for _ in stop.history.time]
    values = np.concatenate([np.array(stop.history) for stop in stops.values()], axis=1)
    return {"control": names, **dict(zip(OF_STOPS, values, strict=True))}


def stop_figures(stops: Stops) -> dict[str, dict[str, Any]]:
    """Figures of every stop in SI units, as in their names; of thresholds those of the first start.

    Measured decelerations are means over all phases.
    """
    return {
        name: {
            "from_speed_m_s": float(stop.history.speed[0]),
            "end_speed_m_s": float(stop.history.speed[-1]),
            "distance_m": stop.distance,
            "time_s": stop.time,
            "deceleration_m_s2": stop.deceleration,
            "contact_work_J": stop.contact_work,
            "brake_work_J": stop.brake_work,
            "kinetic_energy_J": stop.kinetic_energy,
            "measured_between_m_s": list(stops.measured),
            "measured_deceleration_m_s2": stops.deceleration(name),
            "measured_std_m_s2": float(stops.decelerations(name).std()),
            "phases": int(stops.decelerations(name).size),
        }
        for name, stop in stops.by_control.items()
    }


def summary(
    case: WheelCase, read: ReadFootprint, stiffness: TreadStiffness, found: Sequence[Curve]
) -> dict[str, Any]:
    """All figures, for summary.json; SI units as in the names."""
    footprint = read.pressure_map
    elastic = stiffness.relaxation is None and stiffness.carcass is None
    members = [
        _member(curve) | ({} if elastic else {"patch_stiffness_Pa_per_m": curve.stiffness})
        for curve in found
    ]
    return {
        "wheel": {
            "contact_length_m": footprint.contact_length,
            "load_N": footprint.load,
            "contact_area_m2": footprint.contact_area,
            "mean_pressure_Pa": footprint.mean_pressure,
            "pixels": list(footprint.pressure.shape[::-1]),
            "pixel_size_m": [footprint.dx, footprint.dy],
            "stiffness_Pa_per_m": stiffness.value,
            "stiffness_from": stiffness.source,
            "one_line": case.one_line,
            "passes": case.law.load.passes,
            **({"mass_kg": case.car(footprint.load).mass} if case.abs else {}),
        },
        "curves": members,
        "source": str(case.source),
        "warnings": [*read.notes, *case.scene_notes, *_warnings(case, found)],
    }


def _member(curve: Curve) -> dict[str, Any]:
    peak, locked = curve.peak, curve.locked
    ratio = peak.mu / locked.mu if peak is not None and locked is not None else None
    return {
        "speed_m_s": curve.speed,
        "temperature_C": curve.temperature - ZERO_CELSIUS,
        "peak_mu": None if peak is None else peak.mu,
        "slip_at_peak": None if peak is None else peak.slip,
        "locked_mu": None if locked is None else locked.mu,
        "peak_over_locked": ratio,
        "slope_at_0": curve.slope,
    }


def _warnings(case: WheelCase, found: Sequence[Curve]) -> list[str]:
    """Warnings on the use of the curves."""
    points = [point for curve in found for point in curve.points if point.sliding > 0.0]
    dry = case.rubs_without_melting
    result: list[str] = []
    films = [point.film_height for point in points if np.isfinite(point.film_height)]
    if films:
        lowest = min(films)
        strongest = max(abs(point.mu) for point in points)
        locked = [curve.locked.melting for curve in found if curve.locked is not None]
        melting = min(locked) if any(locked) else max(point.melting for point in points)
        result += doubts(lowest, strongest, melting, dry)
        if not dry and melting > 0.0:
            result += little_melting(found)
    for curve in found:
        peak, ends = curve.peak, [point.slip for point in curve.braking]
        if peak is not None and len(ends) > 1 and peak.slip == ends[0]:
            result.append(
                f"the hardest braking at {curve.name} is at the smallest slip ratio above 0, "
                f"{peak.slip:g}: the peak may lie below it; --slip 0:{4 * peak.slip:g}:21 shows it"
            )
    return result


def little_melting(found: Sequence[Curve]) -> list[str]:
    """Warning of slip ratios with little melting: of the curve with the largest of them."""
    curve = max(found, key=lambda curve: max(curve.without_melting, default=0.0))
    if not (slips := curve.without_melting):
        return []
    peak = curve.peak
    which = ""
    if peak is not None and peak.slip in slips:
        which = f", the peak of mu among them ({peak.melting:.0%} melts),"
    return [
        f"up to a slip ratio of {max(slips):g}{which} ice melts on less than half of the contact "
        f"at {curve.name}: {WITHOUT_MELTING}"
    ]
