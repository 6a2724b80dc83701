"""Treads from CAD beside built-in ones: mean mu, and seconds with meshing.

Treads of `meshes/make_step.py`, 20 x 10 x 8 mm, of compound B at 1 bar, 3 m/s and -4 degC. No
built-in block is round at its ends alone, as the block `profile` is: the reference there is the
same CAD with cells smaller by FINER.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

from iceslide_fem.mesh.rubber import divisions
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.simulate import run
from scripts.studies.common import ROOT, options, table

SIZE = {"length": 20e-3, "width": 10e-3, "height": 8e-3}
PLACES = {"sipes4": (-6, -2, 2, 6), "profile": (-4, 4), "zigzag": (-4, 4)}
WAVE = {"wave": "zigzag", "amplitude": 0.5e-3, "wavelength": 4e-3}
SIPES = {
    name: [{"position": 1e-3 * x, "width": 0.4e-3, "depth": 6e-3} for x in places]
    for name, places in PLACES.items()
}
BUILT_IN: dict[str, dict[str, Any]] = {
    "plain": SIZE,
    "slick": {**SIZE, "edge_radius": 0.5e-3},
    "sipes4": {**SIZE, "sipes": SIPES["sipes4"]},
    "zigzag": {**SIZE, "sipes": [sipe | WAVE for sipe in SIPES["zigzag"]]},
    "profile": {**SIZE, "sipes": SIPES["profile"], "edge_radius": 0.5e-3},
}
MIDDLE_OF_WAVE = 1e-3  # m, where a zigzag is where a straight sipe is
FINER = 1.5
CELLS = {"slice": ("auto",), "block": ("auto", "tetrahedra")}


def scene(model: str, rubber: dict[str, Any], duration: float, refinement: float = 1.0) -> Scene:
    """A tread on ice."""
    return scene_from_dict(
        {
            "name": "cad", "model": model, "rubber": {"compound": "B", **rubber},
            "load": {"pressure": 1e5, "speed": 3.0, "duration": duration},
            "ice": {"temperature": "-4 degC", "motion": "attached"},
            "numerics": {"refinement": refinement},
        }
    )  # fmt: skip


def measured(of: Scene) -> tuple[float, float, int]:
    """Mean mu, seconds, and unknowns of the rubber."""
    begun = perf_counter()
    unknowns = int((2 if of.model == "slice" else 3) * divisions(of)["quadratic_nodes"])
    with tempfile.TemporaryDirectory() as folder:
        found = run(of, Path(folder) / "run")
    return float(found["mu_mean"]), perf_counter() - begun, unknowns


def rows(treads: Path, models: list[str], names: list[str], duration: float) -> Iterator[Any]:
    """Mean mu of the references, and its change by CAD."""
    for model in models:
        for name in names:
            file: dict[str, Any] = {"step": str(treads / f"{name}.step")}
            if model == "slice":
                file["step_plane"] = MIDDLE_OF_WAVE
            what, reference = "built in", scene(model, BUILT_IN[name], duration)
            if (model, name) == ("block", "profile"):
                what, reference = "finer", scene(model, file, duration, FINER)
            mu, seconds, unknowns = measured(reference)
            yield model, name, what, f"{mu:.5f}", "", unknowns, f"{seconds:.1f}"
            for cells in CELLS[model]:
                drawn = {**file, "step_cells": cells}
                found, taken, count = measured(scene(model, drawn, duration))
                change = f"{found / mu - 1.0:+.3%}"
                yield model, name, cells, f"{found:.5f}", change, count, f"{taken:.1f}"


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--models", nargs="+", choices=list(CELLS), default=list(CELLS))
    parser.add_argument("--treads", nargs="+", choices=list(BUILT_IN), default=list(BUILT_IN))
    parser.add_argument("--quick", action="store_true", help="plain slices, for a moment")
    parser.add_argument("--duration", type=float, default=3e-3, help="s (default 0.003)")
    given: argparse.Namespace = parser.parse_args()
    models, names, duration = given.models, given.treads, given.duration
    if given.quick:
        models, names, duration = ["slice"], ["plain"], 1e-4
    head = ("model", "tread", "cells", "mean mu", "change", "unknowns", "s")
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, str(ROOT / "meshes" / "make_step.py"), folder, *names]
        subprocess.run(words, check=True, capture_output=True)
        table(head, rows(Path(folder), models, names, duration))


if __name__ == "__main__":
    main()
