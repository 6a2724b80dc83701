"""What sipes do: a tread block without, with four and with six, on ice at several temperatures.

Runs `cases/siped_tread` as slices and prints for each block and temperature peak, mean and end of
mu, the fraction of the nominal area that touches, the largest pressure, and how near the walls of
the sipes come to each other: where they meet, how many, and how hard. Draws mu(t), the pressure
along the block, and the deformed blocks with the places where walls press on each other. What was
computed is kept in a folder and taken from there the next time; --quick is one short, coarse pair.
With --model block the same in 3-D on a coarse mesh, beside slices of the same refinement: the
picture shows the plane of symmetry, and pressure is that in strips across the block.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from iceslide_fem.coupling.sliding import Sliding
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact_surface import contact_surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.scene.materials import BAR
from scripts.studies.blocks import slid
from scripts.studies.common import ROOT, case, draw, options, picture_options, table

SIPES: tuple[int, ...] = (0, 4, 6)
CELSIUS, SHOWN = (-2.0, -5.0, -10.0, -20.0), -5.0
COLOURS = {0: "#0072b2", 4: "#d55e00", 6: "#009e73"}
COARSE = "numerics.refinement=0.25"
BLOCK_CELSIUS = (-5.0, -2.0)
QUICK = ("load.duration=0.2ms", COARSE)
STRIP = 0.25e-3  # m, along a block in 3-D
MM = 1e3
OPEN = 0.15e-3  # m: facets further apart on the ice are of two lugs
ONE_SIPE = 1.5e-3  # m: pressing points further apart along x are of two sipes


class Slid(NamedTuple):
    """A block that has slid: times (s), mu, smallest opening of walls (m) and their largest
    pressure (Pa) over time; and at the end the contact's facets or strips (middles, lengths, m;
    pressures, Pa), corners of the deformed cells (n, 4, 2), m, in 3-D of their faces at y = 0, the
    points of walls that press (m, 2), m, and their pressures, Pa. cost: processor seconds. Without
    walls openings are infinite.
    """

    time: Array
    mu: Array
    opening: Array
    wall_pressure: Array
    place: Array
    length: Array
    pressure: Array
    cells: Array
    pressing: Array
    pressing_pressure: Array
    cost: Array


Made = dict[tuple[str, int, float], Slid]  # by model, number of sipes, temperature in degC


def slide(scene: Scene) -> Slid:
    """Press, bring to speed and slide. Raises SimulationStopped where that cannot go on."""
    opening: list[float] = []
    wall_pressure: list[float] = []

    def note(run: Sliding) -> None:
        opening.append(run.block.smallest_opening())
        wall_pressure.append(walls_that_press(run.block)[1].max(initial=0.0))

    made = slid(scene, observe=note)
    block = made.last.block
    return Slid(
        made.time, made.mu, np.array(opening), np.array(wall_pressure), *contact_of(block),
        cells_of(block), *walls_that_press(block), np.array([made.seconds]),
    )  # fmt: skip


def walls_that_press(block: Block) -> tuple[Array, Array]:
    """Points (n, 2), m, of walls that press, and the pressures there, Pa."""
    self_contact = block.rubber.self_contact
    if self_contact is None:
        return np.zeros((0, 2)), np.zeros(0)
    at, pressure = self_contact.pressure(block.rubber.displacements)
    return at[:, [0, -1]], pressure


def contact_of(block: Block) -> tuple[Array, Array, Array]:
    """Middles and lengths (m) on the ice of the facets that touch, and mean pressures (Pa); in 3-D
    of strips across the block, as long as what touches in them covers of its width.
    """
    contact, surface = block.contact, block.surface
    if block.scene.model == "block":
        return strips_of(block)
    area = contact.area * (contact.pressure > 0.0)
    force, length = (contact.pressure * area).sum(axis=1), area.sum(axis=1)
    middle = surface.positions(block.rubber.displacements)[..., 0].mean(axis=1)
    order = np.argsort(middle)
    order = order[length[order] > 0.0]
    return middle[order], length[order], force[order] / length[order]


def strips_of(block: Block) -> tuple[Array, Array, Array]:
    """What touches, in strips across a block in 3-D: as `contact_of`."""
    x = block.surface.positions(block.rubber.displacements)[..., 0]
    touches = block.contact.pressure > 0.0
    strip = np.floor(x[touches] / STRIP).astype(int)
    first = int(strip.min())
    area = np.bincount(strip - first, block.contact.area[touches])
    force = (block.contact.pressure * block.contact.area)[touches]
    forces = np.bincount(strip - first, force)
    here = np.flatnonzero(area)
    middle = np.asarray((first + here + 0.5) * STRIP)
    return middle, area[here] / (0.5 * block.scene.rubber.width), forces[here] / area[here]


def cells_of(block: Block) -> Array:
    """Corners (n, 4, 2), m, of the deformed quadrilaterals, one after the other; in 3-D of the
    cells' faces in the plane of symmetry.
    """
    rubber = block.rubber
    if block.scene.model == "block":
        corners = contact_surface(rubber.space, rubber.facets("symmetry"), 1).dofs
    else:
        corners = compat.cell_dofs(rubber.space)
    dim = rubber.mesh.geometry.dim
    at = rubber.space.tabulate_dof_coordinates()[:, :dim] + rubber.displacements
    return np.asarray(at[corners[:, [0, 1, 3, 2]]][..., [0, -1]])


def kept(scene: Scene, folder: Path, name: str) -> Slid | str:
    """The slide of this scene by this program: kept, or made now; why not, if it stops."""
    path = folder / f"{name}.npz"
    known = fingerprint(scene)
    if path.is_file():
        with np.load(path) as there:
            if str(there.get("fingerprint")) == known:
                return Slid(**{key: there[key] for key in Slid._fields})
    try:
        made = slide(scene)
    except SimulationStopped as reason:
        return str(reason)
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(path, fingerprint=known, **made._asdict())
    return made


def sipes_that_touch(made: Slid) -> int:
    """Number of sipes whose walls press on each other at the end."""
    x = np.sort(made.pressing[:, 0])
    return int(np.sum(np.diff(x) > ONE_SIPE)) + 1 if x.size else 0


def row(sipes: int, celsius: float, made: Slid | str, scene: Scene) -> list[str]:
    """A row of the table."""
    if isinstance(made, str):
        return [scene.model, f"{celsius:g}", str(sipes), made, *(len(HEAD) - 4) * [""]]
    step = np.diff(made.time)
    mean = float(np.sum(step * made.mu[1:]) / made.time[-1])
    area = made.length.sum() / scene.rubber.length
    self_contact = [f"{1e6 * made.opening.min():.3g}", f"{1e6 * made.opening[-1]:.3g}",
             f"{sipes_that_touch(made)}", f"{made.wall_pressure.max() / BAR:.2f}"]  # fmt: skip
    return [
        scene.model, f"{celsius:g}", str(sipes),
        f"{made.mu.max():.4f}", f"{MM * made.time[made.mu.argmax()]:.2f}", f"{mean:.4f}",
        f"{made.mu[-1]:.4f}", f"{area:.2f}", f"{made.pressure.max() / BAR:.1f}",
        *(self_contact if sipes else 4 * ["-"]), f"{made.cost[0]:.0f} s",
    ]  # fmt: skip


HEAD = (
    "model", "degC", "sipes", "peak of mu", "at (ms)", "mean", "end", "area", "largest p (bar)",
    "smallest opening (um)", "at the end (um)", "sipes that touch", "wall pressure (bar)",
    "processor",
)  # fmt: skip


def named(sipes: int) -> str:
    """A block in words."""
    return f"{sipes} sipes" if sipes else "no sipes"


def deformed(axes: Axes, sipes: int, made: Slid) -> None:
    """A block at the end, with the points where walls press."""
    axes.add_collection(
        PolyCollection(
            list(MM * made.cells), facecolor="#dddddd", edgecolor="#888888", linewidth=0.3
        )
    )
    axes.plot(*(MM * made.pressing.T), ".", color="#cc0000", ms=4)
    axes.axhline(0.0, color="#56b4e9", lw=1.5)
    low, high = (MM * made.cells).min(axis=(0, 1)), (MM * made.cells).max(axis=(0, 1))
    axes.set(xlim=(low[0] - 0.5, high[0] + 0.5), ylim=(-0.4, high[1] + 0.4), aspect="equal")
    touching = "; red: walls press on each other" if len(made.pressing) else ""
    axes.set_title(f"{named(sipes)}, at the end{touching}", fontsize=9)
    axes.set_ylabel("z (mm)")


def picture(made: Made, model: str, celsius: float) -> Figure:
    """The blocks on one ice, deformed, pressure along them, mu(t), and mu over temperature; beside
    blocks in 3-D thin lines for slices.
    """
    figure = Figure(figsize=(8.0, 12.0), layout="constrained")
    counts = sorted({sipes for one, sipes, ice in made if (one, ice) == (model, celsius)})
    rows = figure.add_gridspec(len(counts) + 2, 2, height_ratios=[*len(counts) * [1.2], 1.4, 1.6])
    for number, sipes in enumerate(counts):
        deformed(figure.add_subplot(rows[number, :]), sipes, made[model, sipes, celsius])
    along = figure.add_subplot(rows[-2, :])
    over_time, by_ice = (figure.add_subplot(rows[-1, n]) for n in range(2))
    for sipes in counts:
        one, name, colour = made[model, sipes, celsius], named(sipes), COLOURS[sipes]
        ends = np.stack([one.place - one.length / 2, one.place + one.length / 2])
        breaks = np.flatnonzero(ends[0, 1:] - ends[1, :-1] > OPEN) + 1  # no lines over open sipes
        x, p = (np.insert(v, breaks, np.nan) for v in (MM * one.place, one.pressure / BAR))
        along.plot(x, p, ".-", ms=3, lw=1, color=colour, label=name)
        over_time.plot(MM * one.time, one.mu, color=colour, label=name)
        flat = made.get(("slice", sipes, celsius))
        if model == "block" and flat is not None:
            over_time.plot(MM * flat.time, flat.mu, ":", lw=1, color=colour, label="in 2-D")
        ices = sorted(ice for kind, count, ice in made if (kind, count) == (model, sipes))
        curves = [made[model, sipes, ice].mu for ice in ices]
        by_ice.plot(ices, [mu.max() for mu in curves], "o-", ms=4, color=colour)
        by_ice.plot(ices, [mu[-1] for mu in curves], "s--", ms=4, color=colour)
    along.set(xlabel="x (mm); the block slides to the right", ylabel="contact pressure (bar)")
    along.set_title(f"at the end, on ice at {celsius:g} °C", fontsize=9)
    over_time.set(xlabel="time (ms)", ylabel="mu", ylim=(0, None))
    over_time.set_title(f"on ice at {celsius:g} °C", fontsize=9)
    by_ice.set(xlabel="temperature of the ice (°C)", ylabel="mu", ylim=(0, None), xticks=ices)
    by_ice.set_title("solid: peak; dashed: at the end", fontsize=9)
    for axes in (along, over_time, by_ice):
        axes.grid(alpha=0.3)
    along.legend(fontsize=7, frameon=False)
    over_time.legend(fontsize=7, frameon=False, ncols=3, loc="lower right")
    return figure


def compared(
    models: Sequence[str],
    sipes: Sequence[int],
    celsius: Sequence[float],
    folder: Path,
    *changes: str,
) -> Made:
    """All blocks on all ices; prints the table."""
    made: Made = {}

    def rows() -> Iterator[list[str]]:
        for ice, count, model in itertools.product(celsius, sipes, models):
            scene = case("siped_tread", f"rubber.sipes={count}", f"ice.temperature={ice}degC",
                         *changes, f"model={model}")  # fmt: skip
            flat = "" if model == "slice" else f"_{model}"
            found = kept(scene, folder, f"{count}_sipes_{ice:g}degC{flat}")
            if not isinstance(found, str):
                made[model, count, ice] = found
            yield row(count, ice, found, scene)

    table(HEAD, rows())
    return made


def main() -> None:
    """Run the study."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a short, coarse pair of runs")
    parser.add_argument("--model", choices=("slice", "block"), default="slice",
                        help="2-D, or 3-D beside 2-D")  # fmt: skip
    parser.add_argument("--runs", type=Path, default=ROOT / "results" / "siped_tread",
                        help="folder to keep what was computed")  # fmt: skip
    parser.add_argument("--celsius", type=float, nargs="+", metavar="DEGC",
                        help="temperatures of the ice")  # fmt: skip
    parser.add_argument("--sipes", type=int, nargs="+", default=SIPES, choices=SIPES,
                        help="numbers of sipes")  # fmt: skip
    parser.add_argument("--set", dest="changes", action="append", default=[], metavar="KEY=VALUE",
                        help="change of the case")  # fmt: skip
    picture_options(parser)
    asked = parser.parse_args()
    start_petsc()
    solid = asked.model == "block"
    models: tuple[str, ...] = ("slice",)
    folder, name = asked.runs, "siped_tread.png"
    sipes, celsius, changes = asked.sipes, asked.celsius or CELSIUS, asked.changes
    if solid:
        models, folder, name = ("block", "slice"), folder / "coarse", "siped_tread_block.png"
        celsius, changes = asked.celsius or BLOCK_CELSIUS, [COARSE, *changes]
    if asked.quick:
        sipes, celsius, changes = (0, 4), (SHOWN,), [*QUICK, *changes]
    made = compared(models, sipes, celsius, folder, *changes)
    shown = [ice for _, _, ice in made]
    if shown:
        ice = SHOWN if SHOWN in shown else shown[0]
        draw(picture(made, asked.model, ice), asked.pictures / name)


if __name__ == "__main__":
    main()
