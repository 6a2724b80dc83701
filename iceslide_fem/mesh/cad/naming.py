"""Names of outer facets by geometry: contact, plate, walls, symmetry."""

from __future__ import annotations

import numpy as np

from iceslide_fem.mesh.profile import CONTACT_HEIGHT
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, cells_of
from iceslide_fem.runtime.arrays import Array, Mask

NEAR = 1e-6  # of the height
SAMPLES = 40  # facets of a face from which rays start
STEEP = 0.8  # largest |n_z| of a wall
SEEN = 0.5  # part of a wall's samples that see another face
CHUNK = 200


def named(
    body: TaggedMesh, facets: IntArray, owner: IntArray, gap: float, symmetric: bool
) -> dict[str, IntArray]:
    """Parts of the outer `facets` (n, corners) of a `body` whose lowest points are at 0.

    owner: number of the CAD face (or edge) of each facet; gap: distance (as points) over which
    walls face each other. The plate is the flat top. Walls are faces that see another one across a
    gap. Contact is whatever looks down at the ice, or stands in the lower half of the height.
    """
    corners, height = body.points[facets], float(body.points[:, -1].max())
    z, near = corners[..., -1], NEAR * height
    top = (z > height - near).all(axis=1)
    plane = symmetric & (np.abs(corners[..., 1]) <= near).all(axis=1)
    wall = _walls(body, facets, owner, gap) & ~top & ~plane
    lowest, upright = (z <= near).all(axis=1), np.ptp(z, axis=1) > near
    low = (z.mean(axis=1) < CONTACT_HEIGHT * height) & upright
    found = {"contact": (lowest | low) & ~top & ~plane & ~wall, "plate": top}
    if symmetric:
        found["symmetry"] = plane
    if wall.any():
        found["walls"] = wall
    return {name: facets[mask] for name, mask in found.items()}


def _walls(body: TaggedMesh, facets: IntArray, owner: IntArray, gap: float) -> Mask:
    """Facets of faces most of which see another one within the `gap`."""
    points, normals = body.points, outward(body, facets)
    upright = np.abs(normals[:, -1]) < STEEP
    starts, of = [], []
    for face in np.unique(owner[upright]):
        some = np.flatnonzero(upright & (owner == face))
        chosen = some[np.linspace(0, some.size - 1, min(SAMPLES, some.size)).astype(int)]
        starts.append(np.unique(chosen))
        of.append(int(face))
    if not starts:
        return np.zeros(len(facets), dtype=bool)
    rays = np.concatenate(starts)
    middles = points[facets[rays]].mean(axis=1)
    seen = distances(middles, normals[rays], simplices(points[facets]), NEAR * gap) < gap
    wall, first = np.zeros(len(facets), dtype=bool), 0
    for face, some in zip(of, starts, strict=True):
        if seen[first : first + some.size].mean() > SEEN:
            wall |= (owner == face) & upright
        first += some.size
    return wall


def outward(body: TaggedMesh, facets: IntArray) -> Array:
    """Outward unit normals (n, d) of outer facets."""
    points, corners = body.points, body.points[facets]
    if points.shape[1] == 2:
        along = corners[:, 1] - corners[:, 0]
        normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
    else:
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    cells = body.cells[cells_of(body, facets)]
    inwards = points[cells].mean(axis=1) - corners.mean(axis=1)
    return np.asarray(-np.sign((inwards * normals).sum(axis=1))[:, None] * normals)


def simplices(corners: Array) -> Array:
    """Facets (n, corners, d) as segments or triangles (m, d, d)."""
    if corners.shape[1] == 4:
        return np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return corners


def distances(starts: Array, directions: Array, faces: Array, least: float) -> Array:
    """Distance (n,) along each ray to the first of the simplices (m, d, d); infinite without."""
    found = np.full(len(starts), np.inf)
    for first in range(0, len(starts), CHUNK):
        some = slice(first, first + CHUNK)
        sides = np.swapaxes(faces[:, 1:] - faces[:, :1], 1, 2)[None]  # (1, m, d, d-1)
        ray = np.broadcast_to(-directions[some, None, :, None], (*_shape(starts[some], faces), 1))
        matrix = np.concatenate([np.broadcast_to(sides, (*ray.shape[:3], sides.shape[3])), ray], 3)
        right = starts[some, None] - faces[None, :, 0]
        regular = np.abs(np.linalg.det(matrix)) > 1e-14 * np.abs(matrix).max() ** matrix.shape[-1]
        solved = np.full(right.shape, -1.0)
        solved[regular] = np.linalg.solve(matrix[regular], right[regular][..., None])[..., 0]
        inside = (solved[..., :-1] > -1e-9).all(axis=-1) & (
            solved[..., :-1].sum(axis=-1) < 1 + 1e-9
        )
        along = np.where(inside & (solved[..., -1] > least), solved[..., -1], np.inf)
        found[some] = along.min(axis=1)
    return found


def _shape(starts: Array, faces: Array) -> tuple[int, int, int]:
    return len(starts), len(faces), starts.shape[1]
