"""What a block carries: the largest pressure over friction, with sharp and with round edges.

A block of 1 mm of compound B is pressed towards 10 bar under a shear of mu times the local
pressure, and where it finds no more load its plate is lowered until it carries less. Such a path is
the same for every nominal pressure below, so one press gives the boundary of all of them. Prints
the largest pressure by mesh, edge radius and mu, and for those below 10 bar what the block gives
way by; draws envelope.png. --quick takes the slice alone, and half of the mu. Every limit is kept
in results/studies/envelope.jsonl as it comes, from where --go-on takes it.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

from matplotlib.figure import Figure

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.rubber.build import build_block
from iceslide_fem.rubber.press import PathPoint, press
from iceslide_fem.runtime.errors import SimulationStopped
from scripts.studies import common
from scripts.studies.blocks import shear_of_pressure

MESHES = {
    "slice": ("slice", 1.0),
    "slice x 2": ("slice", 2.0),
    "block x 0.5": ("block", 0.5),
    "block": ("block", 1.0),
}
RADII = (100.0, 0.0)  # um
LEVELS = (0.2, 0.3, 0.45, 0.6, 0.8)
MOST = 10.0  # bar
KEPT = common.RESULTS / "envelope.jsonl"


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


Place = tuple[str, float, float]  # mesh, radius (um), mu


def limits(wanted: Iterable[Place], found: dict[Place, Limit]) -> dict[Place, Limit]:
    """The limits `found` before, and those that are missing of what is `wanted`, which are kept."""
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    with open(KEPT, "a") as keep:
        for place in wanted:
            if place not in found:
                found[place] = limit(*place)
                print(json.dumps([*place, *found[place]]), file=keep, flush=True)
    return found


def kept() -> dict[Place, Limit]:
    """The limits of earlier calls."""
    lines = KEPT.read_text().splitlines() if KEPT.is_file() else []
    return {(mesh, radius, mu): Limit(*rest) for mesh, radius, mu, *rest in map(json.loads, lines)}


def report(found: dict[Place, Limit]) -> None:
    """Print a table of the limits, and why there is no more."""

    def rows() -> Iterable[list[object]]:
        for radius, mesh in product(RADII, MESHES):
            line = [found.get((mesh, radius, mu)) for mu in LEVELS]
            if any(line):
                yield [
                    mesh,
                    f"{radius:g} um",
                    *(f"{one.pressure:.2f}" if one else "" for one in line),
                ]

    common.table(["mesh", "edge", *(f"mu = {mu:g}" for mu in LEVELS)], rows())
    print()
    for (mesh, radius, mu), one in found.items():
        if one.message:
            print(f"- {mesh}, {radius:g} um, mu = {mu:g}: {one.message}")


def chart(found: dict[Place, Limit]) -> Figure:
    """Largest pressure over mu, a panel for each edge radius."""
    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    panels = figure.subplots(1, len(RADII), sharey=True)
    styles = {"slice": "C0o-", "slice x 2": "C1s--", "block x 0.5": "C2^:", "block": "C3v"}
    for panel, radius in zip(panels, RADII, strict=True):
        for mesh, style in styles.items():
            levels = [mu for mu in LEVELS if (mesh, radius, mu) in found]
            pressures = [found[mesh, radius, mu].pressure for mu in levels]
            if levels:
                panel.plot(levels, pressures, style, label=mesh, markersize=4)
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
    parser.add_argument("--radii", nargs="+", type=float, default=RADII, help="um, of these alone")
    parser.add_argument("--levels", nargs="+", type=float, help="values of mu")
    parser.add_argument("--go-on", action="store_true", help="keep what an earlier call has found")
    common.picture_options(parser, "docs/stability")
    asked = parser.parse_args()
    start_petsc()
    levels = asked.levels or (LEVELS[::2] if asked.quick else LEVELS)
    meshes = asked.meshes or (["slice"] if asked.quick else list(MESHES))
    wanted = product(meshes, asked.radii, levels)
    if not asked.go_on:
        KEPT.unlink(missing_ok=True)
    found = limits(wanted, kept())
    report(found)
    common.draw(chart(found), asked.pictures / "envelope.png")


if __name__ == "__main__":
    main()
