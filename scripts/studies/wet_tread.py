"""Footprint and wheel on wet ice: friction over the water that the ice brings, and over the lug.

A line of 120 mm with 2 bar in its middle, at 20 km/h on ice of -1 degC, with k, D and H_V of the
generated surface of compound B. Prints the mean mu of the footprint of the locked wheel, the mean
height of the water below it and what of the load that bears, and the peak of mu over slip.
"""

from __future__ import annotations

from typing import Any

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import Curve, curves
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from scripts.studies.common import ROOT, options, table

GIVEN = {
    "gaussian": "120mm,2bar,30mm",
    "speed": "20km/h",
    "temperature": "-1degC",
    "contact": str(ROOT / "cases" / "surfaces" / "compound_B.csv"),
}
STIFFNESS = "7e7Pa/m"
# Water (um; None: voids that stop squeeze-out), lug (mm; None: the whole line).
ROWS: tuple[tuple[float | None, float | None], ...] = (
    (None, None), (0.0, None), (0.0, 6.0), (2.0, 6.0), (5.0, 6.0), (20.0, 6.0), (20.0, 4.0),
    (20.0, 2.0), (20.0, 20.0), (20.0, None),
)  # fmt: skip


def wet(water: float | None, lug: float | None) -> dict[str, str]:
    """Options of `ROWS`."""
    given = {"water": (water, "um"), "lug": (lug, "mm")}
    return {key: f"{value:g}{unit}" for key, (value, unit) in given.items() if value is not None}


def footprint(more: dict[str, str]) -> dict[str, Any]:
    """What the summary says of the film law below the locked wheel."""
    case = FootprintCase.of(GIVEN | more)
    figures: dict[str, Any] = summary(survey(case, read_footprint(case)))["film"]
    return figures


def wheel(more: dict[str, str], slips: str) -> Curve:
    """mu over slip."""
    case = WheelCase.of(GIVEN | {"slip": slips, "stiffness": STIFFNESS} | more)
    read = read_footprint(FootprintCase.of(GIVEN))
    (curve,) = curves(case, read.pressure_map, stiffness_of(case, read.pressure_map))
    return curve


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rows and slip ratios")
    given = parser.parse_args()
    rows = []
    for water, lug in ROWS[:: 4 if given.quick else 1]:
        film = footprint(wet(water, lug))
        curve = wheel(wet(water, lug), "0:1:6" if given.quick else "0:1:21")
        peak = curve.peak
        assert peak is not None
        carries = water is not None
        rows.append(
            (
                f"{water:g} µm" if carries else "voids stop",
                f"{1e3 * film['lug_m']:g} mm" if carries else "",
                f"{film['mu_mean']:.4f}",
                f"{1e6 * film['mean_water_height_m']:.2f} µm" if carries else "",
                f"{film['water_borne_share']:.0%}" if carries else "",
                f"{peak.mu:.4f}",
                f"{peak.slip:.2f}",
            )
        )
    table(("water", "lug", "locked: mu", "W, mean", "load on water", "peak", "at S"), rows)


if __name__ == "__main__":
    main()
