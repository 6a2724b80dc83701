#!/usr/bin/env python3
"""A synthetic footprint through the whole chain: picture, pressure, film.

    python cases/footprint/synthetic_tread.py [--pixels 540] [--out results/synthetic_tread]

Makes the picture of a tread whose pressure is known (JPEG, with a legend), reads it as
`iceslide footprint` does, and prints what was read beside the truth.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from iceslide_fem.preprocess.footprint.command import FOOTPRINT
from iceslide_fem.preprocess.footprint.synthetic import Tread, coloured_picture, save
from iceslide_fem.preprocess.work import run

HIGH = 4e5  # Pa, the upper end of the legend


def main() -> None:
    """Make the picture, survey it, print both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pixels", type=int, default=540, help="along the direction of travel")
    parser.add_argument("--out", type=Path, default=Path("results") / "synthetic_tread")
    arguments = parser.parse_args()
    tread = Tread()
    shape = (round(arguments.pixels * tread.width / tread.length), arguments.pixels)
    truth = tread.footprint(shape)
    picture, legend = coloured_picture(truth, HIGH, "jet")
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    figures = run(
        FOOTPRINT,
        {
            "image": save(picture, arguments.out.with_suffix(".jpg")),
            "length": tread.length,
            "width": tread.width,
            "max_pressure": HIGH,
            "legend": ",".join(map(str, legend)),
            "crop": f"0,0,{shape[1]},{shape[0]}",
        },
        arguments.out,
    ).figures
    for name, value in FOOTPRINT.words(figures).lines:
        print(f"{name:32} {value}")
    found = figures["footprint"]
    for key, true in truth.summary().items():
        if key.endswith(("area_m2", "mean_pressure_Pa", "load_N")):
            print(f"{key:32} {found[key]:.6g}, truth {true:.6g} ({found[key] / true - 1.0:+.2%})")
    print(f"written to {arguments.out}")


if __name__ == "__main__":
    main()
