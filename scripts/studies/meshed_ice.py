"""Ice on a mesh against continuum ice and columns, itself on a finer mesh, and steel below it.

The thesis's scene at 1 bar, as a slice at a tolerance of 1e-3 and as a block at 1e-2: mu(t) with
ice.heat = "mesh", "continuum" and "column", and on meshed ice (slice) with all meshes twice as
fine, the rubber's, too, and with the ice's alone. Then slices of 1 mm of ice on 10 mm of steel that
is held at -10 degC, the ice at that temperature, too, or at -4 degC at first. With --fine only
slices on meshes of both that are finer and finer, the finest first.
Differences are relative to the first row of each table: of mu(t), the largest, and of its mean.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Any
from unittest import mock

import numpy as np

from iceslide_fem.interface import build
from iceslide_fem.mesh import ice
from iceslide_fem.mesh.grid import Lines
from iceslide_fem.mesh.ice import patch_lines
from iceslide_fem.scene import Scene
from iceslide_fem.scene.thermal_layers import FIRST_LAYER, LAYER_RATIO, stacked_layers
from scripts.studies.blocks import Slide, slid
from scripts.studies.common import case, options, table

HEAD = ("ice", "steps", "unknowns of ice", "mean of mu", "mu(t)", "mean", "processor (s)")
HEATS = ("mesh", "continuum", "column")
SLICE = "model=slice", "numerics.tolerance=1e-3"
BLOCK = "model=block", "numerics.tolerance=1e-2"
SHORT = (  # and warm, so that it melts
    "load.duration=1ms", "ice.temperature=-1degC", "numerics.tolerance=1e-2",
    "numerics.refinement=0.5",
)  # fmt: skip
STEEL = (
    "{name='steel', thickness='10 mm', conductivity='50 W/m/K', density='7800 kg/m^3', "
    "heat_capacity='460 J/kg/K'}"
)
ON_STEEL = (
    "ice.depth=1mm", "ice.base=held", "ice.base_temperature=-10degC", f"ice.layers=[{STEEL}]",
)  # fmt: skip
ICE_ALONE = "mesh, ice alone twice as fine"
FINER = 4, 2, 1
MOMENTS = 400  # at which mu(t) is compared


@contextmanager
def finer_ice() -> Iterator[None]:
    """Mesh of the ice alone twice as fine, along the surface and downwards."""

    def halved(*arguments: Any) -> list[Lines]:
        lines = patch_lines(*arguments)
        return [np.sort(np.append(line, 0.5 * (line[1:] + line[:-1]))) for line in lines]

    thin = partial(
        stacked_layers, first_layer=0.5 * FIRST_LAYER, ratio=1.0 + 0.5 * (LAYER_RATIO - 1.0)
    )
    with (
        mock.patch.object(build, "patch_lines", halved),
        mock.patch.object(ice, "stacked_layers", thin),
    ):
        yield


def compared(title: str, scenes: Mapping[str, Scene]) -> None:
    """Print a table of slides of the scenes against that of the first one."""
    print(f"\n{title}\n")
    first: list[Slide] = []

    def row(name: str, scene: Scene) -> tuple[str, ...]:
        with finer_ice() if name == ICE_ALONE else nullcontext():
            found = slid(scene)
        first.append(found)
        times = np.linspace(0.0, scene.load.duration, MOMENTS)
        here, there = (np.interp(times, one.time, one.mu) for one in (found, first[0]))
        largest = float(np.abs(here / there - 1.0).max())
        unknowns = str(found.last.frame.ice.n_dofs)
        mean = found.mean / first[0].mean - 1.0
        return (
            name, str(found.steps), unknowns, f"{found.mean:.5f}", f"{largest:.2e}", f"{mean:+.1e}",
            f"{found.seconds:.1f}",
        )  # fmt: skip

    table(HEAD, (row(name, scene) for name, scene in scenes.items()))


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="short coarse slices, no block")
    parser.add_argument("--slices", action="store_true", help="no block")
    parser.add_argument("--fine", action="store_true", help="finer and finer meshes")
    asked = parser.parse_args()
    if asked.fine:
        scenes = {
            f"mesh, {n} times as fine": case(
                "thesis_1bar", *SLICE, "ice.heat=mesh", f"numerics.refinement={n}"
            )
            for n in FINER
        }
        compared("Slice, meshes of ice and rubber", scenes)
        return
    short = SHORT if asked.quick else ()
    slices = {heat: case("thesis_1bar", *SLICE, f"ice.heat={heat}", *short) for heat in HEATS}
    refinement = 2.0 * slices["mesh"].numerics.refinement
    finer = f"numerics.refinement={refinement}"
    slices["mesh, twice as fine"] = case("thesis_1bar", *SLICE, "ice.heat=mesh", *short, finer)
    slices[ICE_ALONE] = slices["mesh"]
    compared("Slice", slices)
    for degrees in (-10, -4):
        ground = *ON_STEEL, f"ice.temperature={degrees}degC"
        steel = {
            heat: case("thesis_1bar", *SLICE, *ground, f"ice.heat={heat}", *short)
            for heat in ("mesh", "column")
        }
        compared(f"Slice, 1 mm of ice at {degrees} degC on 10 mm of steel held at -10 degC", steel)
    if not (asked.quick or asked.slices):
        blocks = {heat: case("thesis_1bar", *BLOCK, f"ice.heat={heat}") for heat in HEATS}
        compared("Block", blocks | {ICE_ALONE: blocks["mesh"]})


if __name__ == "__main__":
    main()
