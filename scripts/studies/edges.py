"""Round edges: how well meshes agree, seconds, and the published comparison.

For each radius: peak, mean and end of mu of `thesis_1bar` as a slice on the default mesh and on one
twice as fine, their differences, and processor seconds. --published adds the four published cases
with sharp and with round edges, --block makes the first table in 3-D; --quick leaves out the fine
mesh. Draws edges.png, with --block the mesh of a block instead (edges_mesh.png). How far blocks
can be pressed is the study `envelope`.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.workflow.planning.mesh_picture import draw_mesh
from scripts.studies import common
from scripts.studies.blocks import Slide, slid

RADII = {"slice": (0.0, 25.0, 50.0, 100.0), "block": (0.0, 50.0, 100.0)}  # um
MESHES = {"slice": (1.0, 2.0), "block": (1.0, 1.5)}
PUBLISHED = ("thesis_1bar", "thesis_5bar", "paper_1bar", "paper_5bar")


def slide(name: str, radius: float, refinement: float, model: str = "slice") -> Slide:
    """A published case as a slice or a block with an edge radius in um, at a tolerance of 1e-2."""
    changes = [f"model={model}", "numerics.tolerance=1e-2", f"numerics.refinement={refinement}"]
    return slid(common.case(name, *changes, f"rubber.edge_radius={radius} um"))


def numbers(run: Slide) -> tuple[float, float, float]:
    """Peak, mean and end of mu."""
    return float(run.mu.max()), run.mean, float(run.mu[-1])


def accuracy(meshes: tuple[float, ...], model: str = "slice") -> dict[float, list[Slide]]:
    """Print what meshes make of thesis_1bar by radius; returns the slides."""
    found: dict[float, list[Slide]] = {}
    names = ("peak", "mean", "end")

    def rows() -> Iterable[list[object]]:
        for radius in RADII[model]:
            found[radius] = [slide("thesis_1bar", radius, mesh, model) for mesh in meshes]
            one, *others = (np.array(numbers(run)) for run in found[radius])
            apart = [f"{change:+.2%}" for other in others for change in one / other - 1.0]
            seconds = [f"{run.seconds:.1f} s" for run in found[radius]]
            yield [f"{radius:g} um", *(f"{value:.4f}" for value in one), *apart, *seconds]

    head = [*names, *(f"{name} against x {mesh:g}" for mesh in meshes[1:] for name in names)]
    common.table(["radius", *head, *(f"mesh x {mesh:g}" for mesh in meshes)], rows())
    return found


def published(radius: float) -> None:
    """Print the published cases with sharp edges and with round ones."""

    def rows() -> Iterable[list[object]]:
        for name in PUBLISHED:
            sharp, rounded = (np.array(numbers(slide(name, r, 1.0))) for r in (0.0, radius))
            values = [f"{a:.4f} / {b:.4f}" for a, b in zip(sharp, rounded, strict=True)]
            yield [name, *values, *(f"{change:+.1%}" for change in rounded / sharp - 1.0)]

    names = ("peak", "mean", "end")
    head = [f"{name}, sharp / {radius:g} um" for name in names]
    common.table(["case", *head, *(f"change of {name}" for name in names)], rows())


def chart(slides: dict[float, list[Slide]]) -> Figure:
    """Difference of the meshes and seconds over the radius."""
    radii = list(slides)
    figure = Figure(figsize=(7.2, 3.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    if all(len(runs) > 1 for runs in slides.values()):
        for place, name in enumerate(("peak", "mean", "end")):
            errors = [
                100 * abs(numbers(slides[r][0])[place] / numbers(slides[r][1])[place] - 1.0)
                for r in radii
            ]
            left.plot(radii, errors, "o-", label=f"{name} of μ")
        left.legend(fontsize=7)
    left.set(xlabel="edge radius (µm)", ylabel="difference of two meshes (%)")
    for number, mesh in enumerate(MESHES["slice"][: len(slides[radii[0]])]):
        right.plot(
            radii, [slides[r][number].seconds for r in radii], "o-", label=f"mesh × {mesh:g}"
        )
    right.set(xlabel="edge radius (µm)", ylabel="processor seconds", ylim=(0, None))
    right.legend(fontsize=7)
    return figure


def main() -> None:
    """Run the study."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="slides on the default mesh only")
    parser.add_argument("--block", action="store_true", help="in 3-D alone: five minutes")
    parser.add_argument("--published", type=float, metavar="UM", help="radius to compare")
    common.picture_options(parser)
    asked = parser.parse_args()
    start_petsc()
    model = "block" if asked.block else "slice"
    slides = accuracy(MESHES[model][: 1 if asked.quick else None], model)
    if asked.block:
        largest = common.case("thesis_1bar", "model=block", f"rubber.edge_radius={max(slides)} um")
        draw_mesh(largest, asked.pictures / "edges_mesh.png")
    else:
        common.draw(chart(slides), asked.pictures / "edges.png")
    if asked.published is not None:
        published(asked.published)


if __name__ == "__main__":
    main()
