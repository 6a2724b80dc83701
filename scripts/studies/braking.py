"""A wheel that brakes on ice: locked, by thresholds of the slip, and at the peak of its friction.

A slick of 120 mm under 2 bar on ice at -4 degC, by the film law of compound B. mu over speed and
slip is a table of the brush; a quarter car brakes from 50 to 5 km/h. Prints the peak of mu over
slip by speed; distances, times, decelerations and heat of the three stops; and what the distances
change by with finer tables.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from iceslide_fem.postprocess.report.png import figure_of
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.braking import compare_controls
from iceslide_fem.preprocess.wheel.charts import charts_of_stops
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.output import stop_columns
from iceslide_fem.preprocess.wheel.slip_table import KMH, SLIPS, SPEEDS, SlipTable, slip_table
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import draw, options, picture_options, table

FAST, SLOW = 50.0 / KMH, 5.0 / KMH  # m/s
LENGTH, PRESSURE, CELSIUS = 0.12, 2.0 * BAR, -4.0
STIFFNESS = 68.25e6  # Pa/m, of the tread
CELLS = 40
SIZES = (
    (SPEEDS // 2, SLIPS // 2 + 1),
    (SPEEDS, SLIPS),
    (2 * SPEEDS, 2 * SLIPS - 1),
)  # speeds and slip ratios of tables, the last one is finest


def wheel_table(speeds: int, slips: int) -> SlipTable:
    """mu of the slick at so many `speeds` and `slips`."""
    cell = LENGTH / CELLS
    footprint = PressureMap(np.full((1, CELLS), PRESSURE), cell, cell)
    contact = FilmContact(Ride(FAST, FAST, ZERO_CELSIUS + CELSIUS), CONTACT_TABLES["B"])
    rows = np.geomspace(SLOW, FAST, speeds)
    return slip_table(footprint, rows, np.linspace(0.0, 1.0, slips), Tread(STIFFNESS), contact)


def main() -> None:
    """Print the tables and draw the stops."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="the coarsest table alone")
    picture_options(parser)
    given = parser.parse_args()
    sizes = SIZES[:1] if given.quick else SIZES
    tables = {size: wheel_table(*size) for size in sizes}
    shown = tables[sizes[-1 if given.quick else 1]]
    speeds = np.linspace(shown.speeds[0], shown.speeds[-1], 4)
    peaks = [(v, *shown.peak(v), shown(v, 1.0)) for v in speeds]
    table(
        ["km/h", "S of the peak", "mu there", "mu of a locked wheel"],
        [[f"{KMH * v:.0f}", f"{S:.3g}", f"{mu:.4f}", f"{end:.4f}"] for v, S, mu, end in peaks],
    )
    print()
    first, last = float(shown.speeds[-1]), float(shown.speeds[0])
    stops = {size: compare_controls(each, first, last) for size, each in tables.items()}
    compared = stops[sizes[-1 if given.quick else 1]]
    table(
        [
            "control", "distance, m", "time, s", "deceleration, m/s2", "heat of the contact, kJ",
            "of the brake, kJ",
        ],
        [
            [
                name, f"{stop.distance:.1f}", f"{stop.time:.2f}", f"{stop.deceleration:.2f}",
                f"{1e-3 * stop.contact_work:.1f}", f"{1e-3 * stop.brake_work:.1f}",
            ]
            for name, stop in compared.items()
        ],
    )  # fmt: skip
    print()
    table(
        ["speeds x slip ratios", *(f"{name}, m" for name in compared)],
        [
            [f"{size[0]} x {size[1]}", *(f"{stop.distance:.2f}" for stop in found.values())]
            for size, found in stops.items()
        ],
    )
    figure = figure_of(charts_of_stops(pd.DataFrame(stop_columns(compared))))
    draw(figure, given.pictures / "braking.png")


if __name__ == "__main__":
    main()
