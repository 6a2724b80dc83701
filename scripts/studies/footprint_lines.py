"""Lines of a footprint beside points: seconds of both integrators, and of lines on wet ice.

First the film map of lines of one pressure each, and of a Gaussian line, against the same lines as
points under the same pressures over time, in steps of a pixel at most, because a line has results
of every pixel: processor seconds and mean mu. Points end steps on melt onset and on saturation.
Then a wheel's Gaussian line of 120 mm on 10 um of water at -6 degC, whose water freezes by area or
stays liquid. --quick: short lines, and one slip ratio.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import numpy as np

from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.point_conditions import Loading
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap, as_map, gaussian_profile
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import curves
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import CONTACT_TABLES
from scripts.studies.common import ROOT, options, table

CONTACT = CONTACT_TABLES["B"]
SPEED, KELVIN, LENGTH, TOLERANCE = 3.0, 269.15, 0.18, 1e-2
LINES = (1, 540), (22, 540), (2048, 200)  # number and pixels
SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
WET = f"""name = "wet"
model = "slice"
[rubber]
compound = "B"
[load]
pressure = "2 bar"
speed = "1 m/s"
duration = "1 ms"
[ice]
temperature = "-6 degC"
water = "10 um"
[film]
voids = "carry"
contact = "{SURFACE}"
"""
Found = TypeVar("Found")


def seconds(call: Callable[[], Found], runs: int = 3) -> tuple[float, Found]:
    """Least processor time (s) of some runs, and their result."""
    times = []
    for _ in range(runs):
        begun = time.process_time()
        found = call()
        times.append(time.process_time() - begun)
    return min(times), found


def compared(name: str, footprint: PressureMap, pressure: Array, loading: Loading | None) -> Any:
    """Row of lines, and of points under the same pressures (Pa)."""
    ride, passing = Ride(SPEED, SPEED, KELVIN), footprint.dx / SPEED
    of_lines, found = seconds(lambda: film_map(footprint, ride, CONTACT, TOLERANCE))
    k, D, H_V, _ = CONTACT(pressure)
    points = Conditions.of(
        pressure=pressure, speed=SPEED, temperature=KELVIN, k=k, D=D, H_V=H_V,
        initial_height=70e-9, duration=footprint.pressure.shape[1] * passing,
    )  # fmt: skip
    longest = passing * (1.0 + 1e-9)
    of_points, result = seconds(
        lambda: simulate(points, tolerance=TOLERANCE, loading=loading, max_step=longest)
    )
    mu = "" if loading is not None else f"{result.mu_mean @ pressure / pressure.sum():.5f}"
    return (
        name, f"{of_lines:.3f}", f"{of_points:.3f}", f"{of_points / of_lines:.2f}",
        f"{found.mean_friction(footprint):.5f}", mu,
    )  # fmt: skip


def integrators(quick: bool) -> Iterator[Any]:
    """Rows of the first table."""
    for lines, pixels in LINES[: 1 if quick else None]:
        pressure = np.linspace(1e5, 5e5, lines) if lines > 1 else np.array([2e5])
        footprint = PressureMap(np.tile(pressure, (pixels, 1)).T.copy(), LENGTH / pixels, 1e-3)
        yield compared(f"{lines} of {pixels} pixels", footprint, pressure, None)
    pixels = 54 if quick else 540
    _, profile = gaussian_profile(LENGTH, 4e5, pixels)
    footprint, passing = as_map(profile, LENGTH / pixels), LENGTH / pixels / SPEED
    at = np.arange(pixels + 1.0)
    ends = np.interp(at, np.arange(pixels) + 0.5, profile[::-1])
    rows = np.stack([passing * at, ends]).T.tolist()
    load = {"pressure": rows, "speed": SPEED, "duration": passing * pixels}
    tables = {"name": "line", "model": "point", "rubber": {"compound": "B"}, "load": load}
    course = scene_from_dict(tables).load.pressures
    yield compared("Gaussian line", footprint, profile[:1], Loading(course, None, CONTACT))


def wet_lines(quick: bool) -> Iterator[Any]:
    """Rows of the second table."""
    given = {"gaussian": "120mm,2bar,30mm", "speed": "20km/h", "stiffness": "7e7Pa/m"}
    if quick:
        given["slip"] = "0.1"
    with TemporaryDirectory() as folder:
        for refreeze in ("area", "nothing"):
            path = Path(folder) / f"{refreeze}.toml"
            path.write_text(f'{WET}refreeze = "{refreeze}"\n')
            case = WheelCase.of(given | {"scene": str(path)})
            footprint = read_source(case).pressure_map
            stiffness = stiffness_of(case, footprint)
            taken, (curve,) = seconds(lambda: curves(case, footprint, stiffness), 1)  # noqa: B023
            yield refreeze, f"{taken:.1f}", f"{max(one.mu for one in curve.points):.4f}"


def main() -> None:
    """Print both tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="short lines, and one slip ratio")
    chosen: argparse.Namespace = parser.parse_args()
    head = "lines", "line, s", "points, s", "points / lines", "mu of lines", "mu of points"
    table(head, integrators(chosen.quick))
    print()
    table(("water", "a wheel's line, s", "largest mu"), wet_lines(chosen.quick))


if __name__ == "__main__":
    main()
