"""The law beside measured friction, all of it second hand, with what was fitted and what predicted.

`bands`: published bands of mu (`dry_calibration`) by `iceslide calibrate`: stress and softening of
dry contact are fitted to every second band, and predict the others, and the other way round.
`stops`: mean friction of cars that brake on ice, from stopping distances of magazines, beside a
wheel under the dry stress that three of the bands gave; nothing is fitted to them. They are quoted
from a program that names its sources (github.com/tarvoraba01/Pidurdusmaa, 9a3825f), and so are the
temperatures of the ice. The wheel is a slick of 130 mm under 3 bar, and no tyre of those tests.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.inference.calibrate.fit import fit
from iceslide_fem.inference.calibrate.measured import Measured
from iceslide_fem.inference.calibrate.problem import Problem, fitted
from iceslide_fem.preprocess.wheel.command import WHEEL
from iceslide_fem.preprocess.work import run
from iceslide_fem.runs.many_points import Rows
from iceslide_fem.runtime.units import ZERO_CELSIUS
from scripts.studies.common import ROOT, case, options, table
from scripts.studies.dry_calibration import CALIBRATED, FOR_CALIBRATION, LENGTH, PREDICTED, Band

BOUNDS = {"film.dry_stress": "10kPa:10MPa", "film.dry_softening": "1K:100K"}
LONGEST = 100.0  # s, of a contact
FACTOR = 2.0
G = 9.80665  # m/s2
PATCH, WIDTH = 0.13, 3.25e-3  # m, of the slick and its cells


class Stops(NamedTuple):
    """Mean friction of stops of some tyres from `first` to `last` km/h at an ice temperature."""

    what: str
    first: float
    last: float
    celsius: float
    tyres: int
    least: float
    middle: float
    most: float


# Tekniikan Maailma 2025; Vi Bilagare 2010 (air temperatures); ADAC 2025 (assumed temperatures).
STOPS = (
    Stops("Nordic friction, TM 2025", 50, 0, -5.0, 7, 0.1838, 0.2053, 0.2156),
    Stops("Nordic friction, VB 2010", 30, 5, -2.5, 1, 0.1225, 0.1225, 0.1225),
    Stops("Central European, VB 2010", 30, 5, -2.5, 1, 0.0978, 0.0978, 0.0978),
    Stops("Nordic friction, VB 2010, air 0.5 to 1", 30, 5, -0.1, 1, 0.0726, 0.0726, 0.0726),
    Stops("Central European, VB 2010, air 0.5 to 1", 30, 5, -0.1, 1, 0.0577, 0.0577, 0.0577),
    Stops("Central European, ADAC 2025", 20, 0, -4.0, 31, 0.0746, 0.0931, 0.1035),
    Stops("all-season, ADAC 2025", 20, 0, -4.0, 16, 0.0841, 0.1021, 0.1108),
)


def middle_of(values: Sequence[float]) -> float:
    """The geometric middle of positive values, the mean of others."""
    ends = np.array([values[0], values[-1]])
    return float(np.sqrt(ends.prod()) if (ends > 0).all() else ends.mean())


def problem_of(bands: Sequence[Band]) -> Problem:
    """The middles of bands at the middles of their conditions."""
    speed = np.array([middle_of(one.speed) for one in bands])
    rows = Rows(
        1e5 * np.array([middle_of(one.bar) for one in bands]),
        speed,
        ZERO_CELSIUS + np.array([middle_of(one.celsius) for one in bands]),
        np.minimum(LENGTH / speed, LONGEST),
    )
    sigma = np.array([np.log(one.high / one.low) / 4.0 for one in bands])
    mu = np.array([one.middle for one in bands])
    measured = Measured(rows, mu, sigma, None, False, "bands", ("speed", "pressure", "temperature"))
    scene = case("cold_point")
    return Problem(scene, measured, fitted(scene, BOUNDS), "mu_mean")


def bands() -> Iterator[tuple[object, ...]]:
    """Each band: its middle, and mu of the fit that has not seen it."""
    every = [*FOR_CALIBRATION, *PREDICTED]
    met = 0
    for half in (0, 1):
        known, unknown = every[half::2], every[1 - half :: 2]
        problem = problem_of(known)
        found = fit(problem)
        z = found.best.z
        said = ", ".join(f"{key} = {value:.3g}" for key, value in problem.values(z).items())
        ends = [
            " to ".join("open" if np.isnan(end) else f"{np.exp(end):.3g}" for end in one[:2])
            for one in found.intervals
        ]
        print(f"fitted to {len(known)} bands: {said}; 95 %: {'; '.join(ends)}")
        predicted = np.exp(problem_of(unknown).computed(z)[0])
        for band, mu in zip(unknown, predicted, strict=True):
            ratio = mu / band.middle
            is_met = 1.0 / FACTOR <= ratio <= FACTOR
            met += is_met
            yield (
                band.conditions, f"{band.low:g} to {band.high:g}", f"{mu:.3f}", f"{ratio:.2f}",
                "met" if is_met else "missed",
            )  # fmt: skip
    print(f"{met} of {len(every)} predicted within a factor of {FACTOR:g}")


def stops(laws: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Each kind of stop, and those of the wheel, ideal and locked."""
    with tempfile.TemporaryDirectory() as folder:
        line = Path(folder) / "line.csv"
        cells = "".join(f"{WIDTH * (i + 0.5):.6g},3e5\n" for i in range(round(PATCH / WIDTH)))
        line.write_text("x_m,pressure_Pa\n" + cells)
        for one in STOPS:
            measured = f"{one.least:.3f} to {one.most:.3f}" if one.tyres > 1 else ""
            yield (
                one.what, one.tyres, f"{one.first:g} to {one.last:g}", f"{one.celsius:g}",
                f"{one.middle:.3f}", measured,
                *(f"{mu:.3f}" for law in laws for mu in wheel(line, one, law)),
            )  # fmt: skip


def wheel(line: Path, one: Stops, law: str) -> Iterator[float]:
    """Mean friction v dv / (g ds) of the wheel, at its peak and locked."""
    given = {
        "line": str(line), "speed": f"{one.first}km/h", "abs": True,
        "end_speed": f"{max(one.last, 1.0)}km/h", "temperature": f"{one.celsius}degC",
        "stiffness": "68.25MPa/m", "contact": str(ROOT / "cases" / "surfaces" / "compound_B.csv"),
    }  # fmt: skip
    if law == "dry":
        given |= {
            "dry_stress": f"{CALIBRATED.stress}Pa", "dry_softening": f"{CALIBRATED.softening}K",
            "initial_height": "0nm",
        }  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        found = run(WHEEL, given, Path(folder) / "wheel").figures["stops"]
    first, last = one.first / 3.6, max(one.last, 1.0) / 3.6
    for control in (next(name for name in found if "peak" in name or "ideal" in name), "locked"):
        yield (first**2 - last**2) / (2.0 * G * found[control]["distance_m"])


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--questions", nargs="+", choices=("bands", "stops"), default=["bands"])
    given: argparse.Namespace = parser.parse_args()
    if "bands" in given.questions:
        head = ("band", "published mu", "predicted", "over the middle", "within a factor of 2")
        table(head, list(bands()))
    if "stops" in given.questions:
        of_wheel = ("dry and film, at the peak", "locked", "film alone, at the peak", "locked")
        head_of_stops = ("tyres, test", "tyres", "km/h", "ice, °C", "measured mu", "from to")
        table((*head_of_stops, *of_wheel), stops(("dry", "film")))


if __name__ == "__main__":
    main()
