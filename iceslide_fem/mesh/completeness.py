"""Whether the named parts of a mesh are whole: a facet that lost its name changes a run in silence.

The plate is all of the top, the symmetry plane all of y = 0. Contact has no hole: it holds all
facets that lie on the ice; where it goes up a side, it goes up all of it and of the opposite one;
and what has no name and is enclosed by contact rises above it, as the end of a sipe does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from iceslide_fem.mesh.soundness import Fault, planes
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh

Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]

STEEP = 0.5  # horizontal part of the unit normal from which a facet is a side, not the lower face
FACING = 0.9  # horizontal direction of a normal along an axis: a side across it,
SLANTED = 0.7  # or one that is rather across it than along it


def gap(tagged: TaggedMesh, outer: IntArray, near: float) -> Fault | None:
    """The first facet of `outer` (n, corners) whose name is missing; None if there is none.

    `near` (m): distance below which a node is in a plane. The mesh stands on the ice, at 0.
    """
    names = _names(tagged, outer)
    corners = tagged.points[outer]
    heights = corners[:, :, -1]
    free = names == ""
    on_ice = (heights <= near).all(axis=1)
    on_top = (heights >= tagged.points[:, -1].max() - near).all(axis=1)
    lost = on_top & (names != "plate")
    if lost.any():
        what = 'is part of the top and not tagged "plate", which must be all of it'
        return _fault(lost, what, corners)
    if (names == "symmetry").any():
        lost = (abs(corners[:, :, 1]) <= near).all(axis=1) & free
        if lost.any():
            return _fault(lost, 'is at y = 0 and not tagged "symmetry" like others', corners)
    lost = on_ice & free
    if lost.any():
        return _fault(lost, 'lies on the ice and is not tagged "contact"', corners)
    lost = _lost_sides(corners, names, near)
    if lost.any():
        what = (
            'begins at the ice and has no name, but another side is tagged "contact": tag the '
            "lower part of all of this side and of the opposite one"
        )
        return _fault(lost, what, corners)
    lost = _enclosed(outer, heights.mean(axis=1), names, near)
    if lost.any():
        what = 'has no name and is enclosed by facets tagged "contact" or "walls": a hole in them'
        return _fault(lost, what, corners)
    return None


def only_lowest(tagged: TaggedMesh) -> bool:
    """Whether contact is no more than flat facets on the ice, so that no side can touch it."""
    heights = tagged.points[tagged.facets["contact"], -1]
    return bool(heights.max() <= 1e-6 * np.ptp(tagged.points[:, -1]))


def _fault(lost: Mask, what: str, corners: Floats) -> Fault:
    count = int(lost.sum())
    like = f" ({count} such facets)" if count > 1 else ""
    return f"the facet there {what}{like}", corners[np.flatnonzero(lost)[0]].mean(axis=0)


def _names(tagged: TaggedMesh, outer: IntArray) -> NDArray[np.str_]:
    """Name of each outer facet, "" where it has none."""
    names = np.full(len(outer), "", dtype="U16")
    for name, facets in tagged.facets.items():
        both = np.sort(np.concatenate([facets, outer]), axis=1)
        _, number = np.unique(both, axis=0, return_inverse=True)
        number = number.ravel()
        names[np.isin(number[len(facets) :], number[: len(facets)])] = name
    return names


def _lost_sides(corners: Floats, names: NDArray[np.str_], near: float) -> Mask:
    """Nameless facets that begin at the ice, at either end of the block along x or y, where contact
    goes up at one end at least. Walls of sipes are at no end: rubber stands on the ice beyond them.
    """
    on_ice = corners[:, :, -1] <= near
    ice = np.unique(corners[on_ice][:, :-1], axis=0)
    normals = planes(corners)[1]
    across = np.linalg.norm(normals[:, :-1], axis=1)
    facing = abs(normals[:, :-1]) / np.where(across > 0.0, across, 1.0)[:, None]
    side = (across > STEEP * np.linalg.norm(normals, axis=1)) & ~on_ice.all(axis=1)
    # In a block a side stands on the ice with an edge; with a corner, others do, too.
    begins = side & (names == "") & (on_ice.sum(axis=1) >= corners.shape[2] - 1)
    lost = np.zeros(len(corners), dtype=bool)
    for axis, along in enumerate(facing.T):
        if not (side & (names == "contact") & (along > FACING)).any():
            continue
        for facet in np.flatnonzero(begins & (along > SLANTED)):
            foot = corners[facet, on_ice[facet], :-1]
            beside = np.ones(len(ice), dtype=bool)
            for other in range(foot.shape[1]):
                if other != axis:
                    beside &= ice[:, other] >= foot[:, other].min() - near
                    beside &= ice[:, other] <= foot[:, other].max() + near
            line = ice[beside, axis]
            lost[facet] = (
                line.max() <= foot[:, axis].max() + near or line.min() >= foot[:, axis].min() - near
            )
    return lost


def _enclosed(outer: IntArray, middles: Floats, names: NDArray[np.str_], near: float) -> Mask:
    """Nameless facets in areas that contact (or walls) encloses and that do not rise above it.

    Facets are neighbours by their nodes in a slice, by their edges in a block. What reaches the
    plate is not enclosed.
    """
    if outer.shape[1] == 2:
        ridges = outer.reshape(-1, 1)
    else:
        ridges = np.stack([outer, np.roll(outer, 1, axis=1)], axis=2).reshape(-1, 2)
    _, ridge = np.unique(np.sort(ridges, axis=1), axis=0, return_inverse=True)
    ridge, facet = ridge.ravel(), np.repeat(np.arange(len(outer)), outer.shape[1])
    free = names[facet] == ""
    size = len(outer) + int(ridge.max()) + 1
    links = coo_array(
        (np.ones(free.sum()), (facet[free], len(outer) + ridge[free])), shape=(size, size)
    )
    count, area = connected_components(links, directed=False)
    # Areas of nameless facets reach their rims; a facet with a name is beside those of its ridges.
    beside = area[len(outer) + ridge[~free]]
    bounds = facet[~free]
    rim = np.full(count, -np.inf)
    held = np.isin(names[bounds], ["contact", "walls"])
    np.maximum.at(rim, beside[held], middles[bounds[held]])
    top = np.full(count, -np.inf)
    np.maximum.at(top, area[: len(outer)], middles)
    to_plate = np.zeros(count, dtype=bool)
    to_plate[beside[names[bounds] == "plate"]] = True
    hole = ~to_plate & (top <= rim + near)
    return (names == "") & hole[area[: len(outer)]]
