"""What a block carries: the largest pressure over friction, with sharp and with round edges.

A block of 1 mm of compound B is pressed towards 10 bar under a shear of mu times the local
pressure, and where it finds no more load its plate is lowered until it carries less. Such a path is
the same for every nominal pressure below, so one press gives the boundary of all of them. Prints
the largest pressure by mesh, edge radius and mu, and for those below 10 bar what the block gives
way by; draws envelope.png. --quick takes the slice alone, and half of the mu.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from matplotlib.figure import Figure

from iceslide_fem.errors import SimulationStopped
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.rubber.block import build_block
from iceslide_fem.rubber.press import PathPoint, press
from scripts.studies import common
from scripts.studies.blocks import shear_of_pressure

MESHES = {"slice": ("slice", 1.0), "slice x 2": ("slice", 2.0), "block x 0.5": ("block", 0.5)}
RADII = (100.0, 0.0)  # um
LEVELS = (0.2, 0.3, 0.45, 0.6, 0.8)
MOST = 10.0  # bar


class Limit(NamedTuple):
    """The largest pressure (bar) carried, and why no more."""

    pressure: float
    message: str


def limit(mesh: str, radius: float, mu: float) -> Limit:
    """How far the block can be pressed under a shear of `mu` times the local pressure."""
    model, refinement = MESHES[mesh]
    changes = [
        f"model={model}",
        f"numerics.refinement={refinement}",
        f"rubber.edge_radius={radius} um",
        f"load.pressure={MOST} bar",
        "numerics.tolerance=1e-2",
    ]
    block = build_block(common.case("thesis_1bar", *changes), MPI.COMM_SELF)
    largest, message = 0.0, ""

    def observe(point: PathPoint) -> None:
        nonlocal largest
        largest = max(largest, point.load)

    try:
        press(block, observe, shear_of_pressure(mu))
    except SimulationStopped as reason:
        message = str(reason)
    return Limit(MOST * largest, message)


def limits(
    meshes: Iterable[str], levels: tuple[float, ...]
) -> dict[tuple[str, float], list[Limit]]:
    """Print the limits of all meshes and radii; returns them in the order of `levels`."""
    found: dict[tuple[str, float], list[Limit]] = {}

    def rows() -> Iterable[list[object]]:
        for radius in RADII:
            for mesh in meshes:
                found[mesh, radius] = [limit(mesh, radius, mu) for mu in levels]
                cells = [f"{one.pressure:.2f}" for one in found[mesh, radius]]
                yield [mesh, f"{radius:g} um", *cells]

    common.table(["mesh", "edge", *(f"mu = {mu:g}" for mu in levels)], rows())
    print()
    for (mesh, radius), line in found.items():
        for mu, one in zip(levels, line, strict=True):
            if one.message:
                print(f"- {mesh}, {radius:g} um, mu = {mu:g}: {one.message}")
    return found


def chart(found: dict[tuple[str, float], list[Limit]], levels: tuple[float, ...]) -> Figure:
    """Largest pressure over mu, a panel for each edge radius."""
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels = figure.subplots(1, len(RADII), sharey=True)
    styles = {"slice": "C0o-", "slice x 2": "C1s--", "block x 0.5": "C2^:"}
    for panel, radius in zip(panels, RADII, strict=True):
        for (mesh, at), line in found.items():
            if at == radius:
                pressures = [one.pressure for one in line]
                panel.plot(levels, pressures, styles[mesh], label=mesh, markersize=4)
        title = f"edges of {radius:g} µm" if radius else "sharp edges"
        panel.set(xlabel="μ", ylim=(0, 1.05 * MOST), title=title)
        panel.title.set_fontsize(10)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8)
    panels[0].set_ylabel("largest pressure carried (bar)")
    return figure


def main() -> None:
    """Run the study."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="the slice alone, half of the mu")
    parser.add_argument("--meshes", nargs="+", choices=list(MESHES), help="of these alone")
    common.picture_options(parser, "docs/stability")
    asked = parser.parse_args()
    start_petsc()
    levels = LEVELS[::2] if asked.quick else LEVELS
    meshes = asked.meshes or (["slice"] if asked.quick else list(MESHES))
    common.draw(chart(limits(meshes, levels), levels), asked.pictures / "envelope.png")


if __name__ == "__main__":
    main()
