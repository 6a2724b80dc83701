"""Blocks of two rubbers: springs in series, a base of steel beside a plate, and a stiffer base.

A block of 5 x 5 x 4 mm of compound B at 2 bar, 3 m/s and -4 degC; the base begins at 2 mm.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.mechanics.press import press
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.simulate import run
from scripts.studies.common import options, table

HIGH, LOW = 4e-3, 2e-3  # m
SPRINGS = 3e7, 12e7  # C10 of two rubbers, Pa; Poisson's ratio 0
BASES: dict[str, dict[str, Any] | None] = {
    "none": None,
    "the same rubber": {"compound": "B"},
    "C10, C01, K times 2": {"C10": 0.3324e6, "C01": 0.2136e6, "D1": 0.03685e-6},
    "C10, C01, K times 5": {"C10": 0.831e6, "C01": 0.534e6, "D1": 0.01474e-6},
    "steel": {"C10": 4e10, "C01": 0.0, "nu": 0.3},
}


def series() -> tuple[float, float]:
    """How far the plate sinks under 1 bar in a slice, and p sum h/E with the contact's, m."""
    rubber = {"C01": 0.0, "nu": 0.0, "length": LOW, "height": LOW}
    base = {"name": "base", "C10": SPRINGS[1], "C01": 0.0, "nu": 0.0, "above": 0.6 * LOW}
    scene = scene_from_dict(
        {
            "name": "series", "model": "slice",
            "rubber": {**rubber, "C10": SPRINGS[0], "layers": [base]},
            "load": {"pressure": 1e5, "speed": 3.0, "duration": 2e-4},
            "film": {"k": 0.3, "D": 29e-6, "H_V": 2.86e-6},
            "numerics": {"penalty": 1e13},
        }
    )  # fmt: skip
    block = build_block(scene, MPI.COMM_SELF)
    press(block, lambda point: None)
    sunk = -float(np.mean(block.rubber.displacements[block.rubber.plate, -1]))
    heights = 0.6 * LOW, 0.4 * LOW
    closed = sum(1e5 * h / (4.0 * C10) for h, C10 in zip(heights, SPRINGS, strict=True))
    return sunk, closed + 1e5 / 1e13


def rows(model: str, duration: float) -> Iterator[Any]:
    """Mean mu of blocks by their base; last a block as high as the rubber below it."""
    first = 0.0
    for name, base in [*BASES.items(), ("a plate at 2 mm", None)]:
        rubber: dict[str, Any] = {"compound": "B", "length": 5e-3, "width": 5e-3}
        rubber["height"] = LOW if name.startswith("a plate") else HIGH
        if base is not None:
            rubber["layers"] = [{"name": "base", "above": LOW, **base}]
        scene = scene_from_dict(
            {
                "name": "layers", "model": model, "rubber": rubber,
                "load": {"pressure": 2e5, "speed": 3.0, "duration": duration},
                "ice": {"temperature": "-4 degC", "motion": "attached"},
                "numerics": {"penalty": 1e12},
            }
        )  # fmt: skip
        begun = perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            found = run(scene, Path(folder) / "run")
        mu = float(found["mu_mean"])
        first = first or mu
        yield name, f"{mu:.5f}", f"{mu / first - 1.0:+.3%}", f"{perf_counter() - begun:.1f}"


def main() -> None:
    """Print both tables."""
    parser = options(__doc__)
    parser.add_argument("--model", choices=("slice", "block"), default="block")
    parser.add_argument("--quick", action="store_true", help="a slice, for a moment")
    given: argparse.Namespace = parser.parse_args()
    sunk, closed = series()
    head = ("springs in series", "um", "error")
    table(head, [("program", f"{1e6 * sunk:.4f}", f"{sunk / closed - 1.0:+.3%}")])
    model, duration = ("slice", 1e-4) if given.quick else (given.model, 3e-3)
    table(("base", "mean mu", "change", "s"), list(rows(model, duration)))


if __name__ == "__main__":
    main()
