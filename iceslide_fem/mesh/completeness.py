"""Checks that the named parts of a mesh are complete: a lost name would silently change a run.

The plate is all of the top; the symmetry plane is all of y = 0. Contact has all facets on the ice.
If contact goes up a flat end of the block, it starts at the ice along the whole of that end and of
the opposite one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.mesh.soundness import Fault, planes
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh, among
from iceslide_fem.runtime.arrays import Array, Mask

STEEP = 0.5  # horizontal part of the unit normal from which a facet is a side, not the lower face
FLAT = 0.999  # of the horizontal direction of a normal along an axis: the flat end of a block


def gap(tagged: TaggedMesh, outer: IntArray, near: float) -> Fault | None:
    """The first facet of `outer` (n, corners) whose name is missing; None if there is none.

    `near` (m): distance below which a node is in a plane. The mesh stands on the ice, at 0.
    """
    names = _names(tagged, outer)
    corners = tagged.points[outer]
    heights = corners[:, :, -1]
    on_ice = (heights <= near).all(axis=1)
    on_top = (heights >= tagged.points[:, -1].max() - near).all(axis=1)
    return (
        _fault(
            on_top & (names != "plate"),
            'is part of the top and not tagged "plate", which must be all of it',
            corners,
        )
        or lost_symmetry(tagged, outer, near)
        or _fault(on_ice & (names == ""), 'lies on the ice and is not tagged "contact"', corners)
        or _fault(
            _lost_sides(corners, names, near),
            'begins at the ice and has no name, but another side is tagged "contact": tag the '
            "lower part of all of this side and of the opposite one",
            corners,
        )
    )


def lost_symmetry(tagged: TaggedMesh, outer: IntArray, near: float) -> Fault | None:
    """The first facet of `outer` (n, corners) at y = 0 without a name, where others have one."""
    if "symmetry" not in tagged.facets:
        return None
    corners = tagged.points[outer]
    lost = (abs(corners[:, :, 1]) <= near).all(axis=1) & (_names(tagged, outer) == "")
    return _fault(lost, 'is at y = 0 and not tagged "symmetry" like others', corners)


def only_lowest(tagged: TaggedMesh) -> bool:
    """Whether contact has only flat facets on the ice, so no side can touch it."""
    heights = tagged.points[tagged.facets["contact"], -1]
    return bool(heights.max() <= 1e-6 * np.ptp(tagged.points[:, -1]))


def _fault(lost: Mask, what: str, corners: Array) -> Fault | None:
    """A fault at the first of the `lost` facets; None if there are none."""
    count = int(lost.sum())
    if not count:
        return None
    like = f" ({count} such facets)" if count > 1 else ""
    return f"the facet there {what}{like}", corners[np.flatnonzero(lost)[0]].mean(axis=0)


def _names(tagged: TaggedMesh, outer: IntArray) -> NDArray[np.str_]:
    """Name of each outer facet, "" without a name."""
    names = np.full(len(outer), "", dtype="U16")
    for name, facets in tagged.facets.items():
        names[among(outer, facets)] = name
    return names


def _lost_sides(corners: Array, names: NDArray[np.str_], near: float) -> Mask:
    """Unnamed facets that start at the ice in flat ends of the block along x or y.

    Only ends are checked where contact covers more than half of one end's lower edge. Walls of
    sipes are not ends, because rubber stands on the ice beyond them.
    """
    dim = corners.shape[2]
    on_ice = corners[:, :, -1] <= near
    ice = np.unique(corners[on_ice][:, :-1], axis=0)
    normals = planes(corners)[1]
    across = np.linalg.norm(normals[:, :-1], axis=1)
    steep = across > STEEP * np.linalg.norm(normals, axis=1)
    # In a block a side stands on the ice with an edge; other facets may touch it with a corner.
    stands = steep & ~on_ice.all(axis=1) & (on_ice.sum(axis=1) >= dim - 1)
    lost = np.zeros(len(corners), dtype=bool)
    for axis in range(dim - 1):
        flat = abs(normals[:, axis]) > FLAT * across
        named, free = np.zeros(2), np.zeros(2)  # lengths of feet at both ends
        nameless = []
        for facet in np.flatnonzero(stands & flat & np.isin(names, ["", "contact", "walls"])):
            foot = corners[facet, on_ice[facet], :-1]
            sides = np.delete(foot, axis, axis=1)
            beyond = np.delete(ice, axis, axis=1)
            row = (beyond >= sides.min(axis=0) - near) & (beyond <= sides.max(axis=0) + near)
            row = row.all(axis=1)
            first, last = ice[row, axis].min(), ice[row, axis].max()
            ends = [first >= foot[:, axis].min() - near, last <= foot[:, axis].max() + near]
            length = np.ptp(sides, axis=0).sum() if dim == 3 else 1.0
            (named if names[facet] else free)[ends] += length
            if not names[facet] and any(ends):
                nameless.append(facet)
        if (named > free).any():
            lost[nameless] = True
    return lost
