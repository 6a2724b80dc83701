"""Output of stops: figures for a summary, and histories as a table."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from io import StringIO

from iceslide_fem.preprocess.wheel.stop import Stop

# Fields of a history, with units.
COLUMNS = "time_s speed_m_s wheel_speed_rad_s slip mu torque_N_m distance_m".split()


def stop_figures(stops: Mapping[str, Stop]) -> dict[str, dict[str, float]]:
    """Figures of every stop in SI units, as in their names."""
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
        }
        for name, stop in stops.items()
    }


def history_table(stops: Mapping[str, Stop]) -> str:
    """CSV with a row for every time of every stop; the control is the first column."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["control", *COLUMNS])
    for name, stop in stops.items():
        for row in zip(*stop.history, strict=True):
            writer.writerow([name, *(f"{value:.9g}" for value in row)])
    return text.getvalue()
