"""A megapixel footprint: seconds of every part, and the error at which they were reached.

The picture is a synthetic footprint of 1120 x 900 pixels, read through its legend. The film's
error is that of the mean shear of every pixel in contact against a run with a tolerance of 1e-5
on ice with layers a quarter as thick, on every 18th line (lines do not depend on each other).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from os import times
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.ice_heat import FIRST_LAYER, Column
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.jaeger import friction_flux, moving_source_rise
from iceslide_fem.preprocess.footprint.passing import FilmMap
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.synthetic import Tread, coloured_picture, save
from iceslide_fem.runtime.arrays import Mask
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import iceslide_words, options, silently, table

SHAPE = (900, 1120)
EVERY = 18
B = CONTACT_TABLES["B"]
HEAD = ("part", "s", "of the processor", "error of mu per pixel: mean", "99 % below", "largest",
        "of the mean mu")  # fmt: skip


def processor_seconds() -> float:
    """Of this process and of those it has waited for, s."""
    return sum(times()[:4])


class Clocked(NamedTuple):
    """What some work has found, and its seconds by the clock and of the processor."""

    result: Any
    wall: float
    processor: float


def clocked(work: Callable[[], Any]) -> Clocked:
    """Result of `work`, and its times."""
    wall, processor = perf_counter(), processor_seconds()
    result = work()
    return Clocked(result, perf_counter() - wall, processor_seconds() - processor)


def errors(film: FilmMap, exact: FilmMap, contact: Mask) -> tuple[str, ...]:
    """Of mu in the pixels of the `exact` map's lines: mean, 99 %, largest; of their mean mu."""
    shear = film.shear[::EVERY]
    error = np.abs(shear[contact] / exact.shear[contact] - 1.0)
    found = (error.mean(), np.percentile(error, 99), error.max())
    return *(f"{one:.1e}" for one in found), f"{shear.sum() / exact.shear.sum() - 1.0:+.1e}"


def main() -> None:
    """Print times and errors."""
    options(__doc__).parse_args()
    picture, legend = coloured_picture(Tread().footprint(SHAPE), 4.0 * BAR, "jet")
    with tempfile.TemporaryDirectory() as folder:
        path = save(picture, Path(folder) / "footprint.jpg")
        given = {
            "length": "0.18m",
            "width": "0.14m",
            "max_pressure": "4bar",
            "legend": ",".join(map(str, legend)),
            "crop": f"0,0,{SHAPE[1]},{SHAPE[0]}",
        }
        words = iceslide_words("footprint", str(path))
        for key, amount in given.items():
            words += [f"--{key.replace('_', '-')}", str(amount)]
        words += ["--out", str(Path(folder) / "out")]
        parts = {"the whole command, with pictures and files": clocked(lambda: silently(words))}
        case = FootprintCase.of({"image": path, **given})
        parts["reading the colours"] = clocked(lambda: read_footprint(case))
    footprint = parts["reading the colours"].result.pressure_map
    flux = friction_flux(case.static_friction, footprint.pressure, case.speed, case.slip)
    parts["moving source"] = clocked(lambda: moving_source_rise(flux, footprint.dx, case.speed))
    maps = {
        f"film law, tolerance {tolerance:g}": clocked(
            partial(film_map, footprint, case.ride(), B, tolerance)
        )
        for tolerance in (1e-2, 1e-3)
    }
    part = replace(footprint, pressure=footprint.pressure[::EVERY])
    fine_ice = partial(Column, first_layer=FIRST_LAYER / 4.0, ratio=1.3, depth=6.0)
    exact = film_map(part, case.ride(), B, 1e-5, fine_ice)
    print(
        f"{footprint.pressure.size:,} pixels, {footprint.contact.sum():,} of them in contact, "
        f"{1e3 * footprint.dx:.3f} mm; {case.speed:g} m/s, slip {case.slip:g}; "
        f"mean mu of the reference's lines: {exact.mean_friction(part):.5f}"
    )
    table(
        HEAD,
        (
            (name, f"{work.wall:.2f}", f"{work.processor:.2f}",
             *(errors(work.result, exact, part.contact) if name in maps else ("",) * 4))
            for name, work in (parts | maps).items()
        ),
    )  # fmt: skip


if __name__ == "__main__":
    main()
