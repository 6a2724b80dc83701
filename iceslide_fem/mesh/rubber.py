"""Mesh of the rubber block: the built-in shape, an outline, a user's mesh, or CAD.

Coordinates are (x, z) in a slice and (x, y, z) in a block, in m; z is vertical and the ice
plane is z = 0. The rubber moves in +x, so its leading edge is x = +length/2. A symmetric block is
meshed as its half y >= 0. Cells are quadrilaterals or hexahedra.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iceslide_fem.mesh.box import box_lines
from iceslide_fem.mesh.cad.tread import on_faces, tread
from iceslide_fem.mesh.gmsh_model import DistributedMesh, distribute_made
from iceslide_fem.mesh.grid import with_sides
from iceslide_fem.mesh.layers import with_layers
from iceslide_fem.mesh.outline import outline_mesh
from iceslide_fem.mesh.profile import block_mesh, count, on_arcs
from iceslide_fem.mesh.shape import BlockShape, built_in_shape
from iceslide_fem.mesh.tagged import TaggedMesh, mesh_size
from iceslide_fem.mesh.user_mesh import load_user_mesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene

if TYPE_CHECKING:  # lines and sizes are also needed without MPI
    from iceslide_fem.fenics.compat import MPI


def rubber_mesh(scene: Scene, comm: MPI.Comm) -> DistributedMesh:
    """Mesh of the scene's rubber block, or the user's mesh in `rubber.mesh`.

    Facets are tagged contact, plate, symmetry, walls, and sides (the others). Collective. Raises
    SceneError if the user's mesh can't be used.
    """
    return distribute_made(lambda: with_sides(tagged_rubber(scene)), comm)


def block_size(scene: Scene) -> tuple[float, ...]:
    """Length, (in 3-D) width, and height of the rubber block or of a user's mesh, m."""
    block = block_shape(scene)
    lengths = [high - low for low, high in block.ranges]
    if block.symmetric:
        lengths[1] *= 2.0
    return (*lengths, block.height)


def divisions(scene: Scene) -> dict[str, float]:
    """Size of the rubber's mesh: cells; nodes of the quadratic elements; smallest and largest cell
    edge in m; of a box without cut edges also the cells nx, ny (block only), nz of its grid.
    """
    if _drawn(scene):
        return mesh_size(tagged_rubber(scene))
    block, refinement = block_shape(scene), scene.numerics.refinement
    size = count(block, refinement)
    if block.edge:
        return size
    lines = box_lines(block, refinement)
    names = ["nx", "nz"] if len(lines) == 2 else ["nx", "ny", "nz"]
    return {name: len(line) - 1 for name, line in zip(names, lines, strict=True)} | size


def block_shape(scene: Scene) -> BlockShape:
    """The shape of the rubber: the scene's box, or the extent of the user's drawing."""
    if not _drawn(scene):
        return built_in_shape(scene)
    tagged = tagged_rubber(scene)
    low, high = tagged.points.min(axis=0), tagged.points.max(axis=0)
    ranges = list(zip(low[:-1].tolist(), high[:-1].tolist(), strict=True))
    return BlockShape(ranges, float(high[-1]), "symmetry" in tagged.facets)


def nominal_area(scene: Scene) -> float | None:
    """Nominal area of the mesh, m2 (m in a slice): length times width at the ice, with cuts.

    None for a user's drawing, whose nominal area is that of the plate.
    """
    return None if _drawn(scene) else built_in_shape(scene).area


def rounded(scene: Scene, points: Array) -> Array:
    """Surface points (..., d), m, of cells moved to the round edges."""
    if scene.rubber.step is not None:
        return on_faces(scene.rubber, points.shape[-1], scene.numerics.refinement, points)
    return points if _drawn(scene) else on_arcs(built_in_shape(scene), points)


def tagged_rubber(scene: Scene) -> TaggedMesh:
    """The rubber on this rank. Raises SceneError if the shape or the user's mesh is unsuitable."""
    return with_layers(_shaped_rubber(scene), scene.rubber.layers)


def _shaped_rubber(scene: Scene) -> TaggedMesh:
    """The rubber without the layers that begin at a height."""
    rubber, refinement = scene.rubber, scene.numerics.refinement
    dim = 2 if scene.model == "slice" else 3
    if rubber.mesh is not None:
        names = [layer.name for layer in rubber.layers if layer.above is None]
        tags = rubber.mesh_tags.items()
        return load_user_mesh(rubber.mesh, dim, rubber.mesh_unit, tags, names)
    if rubber.step is not None:
        return tread(rubber, dim, refinement)
    if rubber.outline is not None and dim == 3:
        return outline_mesh(rubber.outline, rubber.height, refinement, rubber.heights)
    return block_mesh(built_in_shape(scene), refinement)


def _drawn(scene: Scene) -> bool:
    """Whether the user gives the shape, as a mesh or (not in a slice) as an outline."""
    outline = scene.rubber.outline is not None and scene.model != "slice"
    return scene.rubber.is_drawn or outline
