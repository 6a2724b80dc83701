"""A picture of the rubber's mesh: a slice's cells, or the outside of a block seen from below."""

from __future__ import annotations

from pathlib import Path

from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from iceslide_fem.errors import SceneError
from iceslide_fem.mesh.rubber import tagged_rubber
from iceslide_fem.mesh.soundness import outer_facets
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.results.png import write_png
from iceslide_fem.scene import Scene

COLOURS = {"contact": "#d55e00", "walls": "#009e73", "plate": "#0072b2", "symmetry": "#bbbbbb"}
FREE = "#eeeeee"


def draw_mesh(scene: Scene, path: Path) -> None:
    """Write a picture of the scene's rubber, coloured by its parts, lengths in mm, to `path`.

    Raises SceneError if the scene has no rubber or it can't be meshed.
    """
    if scene.model == "point":
        raise SceneError('--picture draws the mesh of a slice or a block; model = "point" has none')
    tagged = tagged_rubber(scene)
    tagged = tagged._replace(points=1e3 * tagged.points)
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    (_draw_slice if scene.model == "slice" else _draw_block)(figure, tagged)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(figure, path, 120)


def _draw_slice(figure: Figure, tagged: TaggedMesh) -> None:
    axes = figure.add_subplot()
    cells = PolyCollection(
        list(tagged.points[tagged.cells]), facecolor="white", edgecolor="black", linewidth=0.4
    )
    axes.add_collection(cells)
    for name, facets in tagged.facets.items():
        edges = LineCollection(
            list(tagged.points[facets]), colors=COLOURS[name], linewidths=2.0, label=name
        )
        axes.add_collection(edges)
    axes.autoscale()
    axes.set(aspect="equal", xlabel="x (mm), sliding to the right", ylabel="z (mm)")
    figure.legend(loc="outside upper center", ncols=len(tagged.facets))


def _draw_block(figure: Figure, tagged: TaggedMesh) -> None:
    axes = figure.add_subplot(projection="3d")
    drawn = [(FREE, outer_facets(tagged))]
    drawn += [(COLOURS[name], facets) for name, facets in tagged.facets.items()]
    named = {frozenset(facet) for _, facets in drawn[1:] for facet in facets.tolist()}
    for colour, facets in drawn:
        kept = facets
        if colour == FREE:
            kept = facets[[frozenset(facet) not in named for facet in facets.tolist()]]
        if len(kept):
            axes.add_collection3d(
                Poly3DCollection(
                    list(tagged.points[kept]), facecolor=colour, edgecolor="black", linewidth=0.3
                )
            )
    low, high = tagged.points.min(axis=0), tagged.points.max(axis=0)
    axes.set(
        xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]),
        xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)",
    )  # fmt: skip
    axes.set_box_aspect(high - low)
    axes.view_init(-25.0, -60.0)
