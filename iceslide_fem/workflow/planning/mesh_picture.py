"""A picture of the meshes of rubber and ice: cells of a slice, or the surface of a block.

A block's rubber is seen from below, its ice from above. Layers of ice are thin, so another panel
shows the leading edge of the contact; for a block in the plane of the smallest y.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import tagged_rubber
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among, facets_of, outer_facets
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene

COLOURS = {"contact": "#d55e00", "walls": "#009e73", "plate": "#0072b2", "symmetry": "#bbbbbb"}
COLOURS |= {"base": "#cc79a7"}
FREE = "#eeeeee"
ICE = "#c6e5f5"
LAYERS = ("#ead6a8", "#bfdcb4", "#e3c3dc", "#d8b9a0", "#b6bfe0", "#9ec7c2")  # below the ice, cyclic
SHOWN_LAYERS = 40.0  # size of the panel of the edge, in thicknesses of the topmost cells


def draw_mesh(scene: Scene, path: Path) -> None:
    """Draw the mesh of the rubber, and of meshed ice, to `path`.

    Colours are those of parts and regions; lengths are in mm. Raises SceneError if the scene has no
    rubber, or it can't be meshed.
    """
    if scene.model == "point":
        raise SceneError('--picture draws the mesh of a slice or a block; model = "point" has none')
    meshes = [tagged_rubber(scene)]
    if scene.ice.heat == "mesh":
        meshes.append(ice_body(scene))
    meshes = [tagged._replace(points=1e3 * tagged.points) for tagged in meshes]
    figure = Figure(layout="constrained")
    (_draw_slice if scene.model == "slice" else _draw_block)(figure, *meshes)
    _add_legend(figure, meshes)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120)


def _draw_slice(figure: Figure, rubber: TaggedMesh, ice: TaggedMesh | None = None) -> None:
    figure.set_size_inches(8.0 if ice is None else 11.0, 6.0)
    if ice is None:
        _draw_section(figure.add_subplot(), rubber)
        return
    whole, edge = figure.subplots(1, 2)
    _draw_section(whole, rubber, ice)
    _draw_edge(edge, rubber, ice)


def _draw_block(figure: Figure, rubber: TaggedMesh, ice: TaggedMesh | None = None) -> None:
    figure.set_size_inches(8.0 if ice is None else 15.0, 6.0)
    if ice is None:
        _draw_outside(figure.add_subplot(projection="3d"), rubber, -25.0)
        return
    bodies = [(rubber, -25.0, "rubber, from below", 3), (ice, 25.0, "ice, from above", 1)]
    for place, (tagged, elevation, what, ticks) in enumerate(bodies, start=1):
        axes = figure.add_subplot(1, 3, place, projection="3d")
        _draw_outside(axes, tagged, elevation)
        axes.set_title(what)
        for axis in (axes.xaxis, axes.yaxis):  # few ticks for a deep body
            axis.set_major_locator(MaxNLocator(ticks))
    _draw_edge(figure.add_subplot(1, 3, 3), _side(rubber), _side(ice))


def _draw_section(axes: Any, *meshes: TaggedMesh) -> None:
    """Cells and named facets of meshes in a plane."""
    for tagged in meshes:
        for name, colour in _region_colours(tagged).items():
            corners = tagged.points[tagged.cells[tagged.named_cells[name]]]
            look: dict[str, Any] = {"facecolor": colour, "edgecolor": "black", "linewidth": 0.4}
            axes.add_collection(PolyCollection(list(corners), **look))
    for tagged in meshes:
        for name, facets in tagged.facets.items():
            if name in COLOURS:
                lines = list(tagged.points[facets])
                axes.add_collection(LineCollection(lines, colors=COLOURS[name], linewidths=2.0))
    axes.autoscale()
    axes.set(aspect="equal", xlabel="x (mm), sliding to the right", ylabel="z (mm)")


def _draw_edge(axes: Any, rubber: TaggedMesh, ice: TaggedMesh) -> None:
    """The leading edge of the contact, enlarged to show the topmost cells of the ice."""
    _draw_section(axes, rubber, ice)
    heights = ice.points[ice.cells, -1]
    topmost = heights[heights.max(axis=1) >= 0.0]
    shown = SHOWN_LAYERS * np.median(np.ptp(topmost, axis=1))
    bottom = rubber.points[rubber.points[:, -1] <= 1e-6 * np.ptp(rubber.points[:, -1])]
    edge = bottom[:, 0].max()
    axes.set(xlim=(edge - 0.6 * shown, edge + 0.4 * shown), ylim=(-0.75 * shown, 0.25 * shown))
    where = {"ha": "right", "va": "top", "transform": axes.transAxes}
    axes.text(0.98, 0.98, "leading edge of\nthe contact", **where)


def _side(tagged: TaggedMesh) -> TaggedMesh:
    """Faces of a block's cells in the plane of its smallest y, as cells of a mesh in x and z."""
    facets = facets_of(tagged)
    owner = np.repeat(np.arange(len(tagged.cells)), len(facets) // len(tagged.cells))
    y = tagged.points[:, 1]
    there = np.flatnonzero((y[facets] <= y.min() + 1e-6 * np.ptp(y)).all(axis=1))
    regions = {
        name: np.flatnonzero(np.isin(owner[there], cells))
        for name, cells in tagged.named_cells.items()
    }
    return TaggedMesh(
        tagged.points[:, [0, 2]], "quadrilateral", facets[there], {}, tagged.body, regions
    )


def _draw_outside(axes: Any, tagged: TaggedMesh, elevation: float) -> None:
    """The outer facets of a block, in the colours of their parts or regions."""
    parts = _outside(tagged)
    facets = np.concatenate([some for _, some in parts])
    colours = [colour for colour, some in parts for _ in some]
    # one collection: what is nearer is drawn over what is farther within one only
    look: dict[str, Any] = {"facecolors": colours, "edgecolor": "black", "linewidth": 0.3}
    axes.add_collection3d(Poly3DCollection(list(tagged.points[facets]), **look))
    low, high = tagged.points.min(axis=0), tagged.points.max(axis=0)
    for name, ends in zip("xyz", zip(low, high, strict=True), strict=True):
        axes.set(**{f"{name}lim": ends, f"{name}label": f"{name} (mm)"})
    axes.set_box_aspect(high - low)
    axes.view_init(elevation, -60.0)


def _outside(tagged: TaggedMesh) -> list[tuple[str, IntArray]]:
    """Colours, and the outer facets (n, corners) of each."""
    outer = outer_facets(tagged)
    if tagged.body == "ice":
        regions = {
            name: facets_of(tagged._replace(cells=tagged.cells[cells]))
            for name, cells in tagged.named_cells.items()
        }
        colours = _region_colours(tagged)
        return [(colours[name], outer[among(outer, regions[name])]) for name in regions]
    named = np.concatenate(list(tagged.facets.values()))
    parts = [(COLOURS[name], facets) for name, facets in tagged.facets.items()]
    return [(FREE, outer[~among(outer, named)]), *parts]


def _region_colours(tagged: TaggedMesh) -> dict[str, str]:
    """Colours of the regions of a mesh by name."""
    names = list(tagged.named_cells)
    if tagged.body != "ice":
        return dict.fromkeys(names, FREE)
    below = [name for name in names if name != "ice"]
    return {"ice": ICE} | dict(zip(below, itertools.cycle(LAYERS), strict=False))


def _add_legend(figure: Figure, meshes: list[TaggedMesh]) -> None:
    shown: dict[str, str] = {}
    for tagged in meshes:
        if len(meshes) > 1:
            shown |= _region_colours(tagged)
        if tagged.body != "ice" or tagged.points.shape[1] == 2:
            shown |= {name: COLOURS[name] for name in tagged.facets if name in COLOURS}
    patches = [
        Patch(facecolor=colour, edgecolor="black", linewidth=0.4, label=name)
        for name, colour in shown.items()
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))
