"""Layouts: how values of one kind are distributed over the ranks, independent of the partition.

Each rank saves the values that it owns, with their positions or global numbers. On restart a layout
picks this rank's values out of the parts that all ranks of the earlier run have saved. The parts
are read one at a time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple, Protocol

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.interface.surface_grid import OwnNodes
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SceneError

Arrays = dict[str, Array]
# Two points are equal within this distance, relative to the extent of the mesh.
SAME_PLACE = 1e-7


class Layout(Protocol):
    """The distribution of values of one kind over the ranks."""

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """What this rank saves of `values` (..., n): the values that it owns, and where they
        are.
        """

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values (..., n) from the `parts` that the ranks of an earlier run saved.

        Collective. Raises SceneError on all ranks if the parts do not fit this layout.
        """


class PointLayout:
    """Points identified by position: x (n, d), m. This rank owns the first `n_owned`.

    Point numbers depend on the partition; positions do not.
    """

    def __init__(self, x: Array, n_owned: int, comm: MPI.Comm) -> None:
        self._x, self._n_owned, self._comm = x, n_owned, comm
        self._size = _extent(x, comm)

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """Values at the points that this rank owns, and their positions `x`."""
        mine = {name: value[..., : self._n_owned] for name, value in values.items()}
        return mine | {"x": self._x[: self._n_owned].T}

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values, ghosts included. Collective: all ranks raise SceneError."""
        picked = self._picked(parts)
        if not self._comm.allreduce(bool(picked.there.all()), op=MPI.LAND):
            raise SceneError("the checkpoint does not fit the mesh of this run")
        return picked.values

    def _picked(self, parts: Iterable[Mapping[str, Array]]) -> Picked:
        """The saved values at this rank's points, 0 where no value was saved."""
        n, values = len(self._x), dict[str, Array]()
        there, tree, total = np.zeros(n, dtype=bool), cKDTree(self._x), 0
        for part in parts:
            saved = part["x"].T
            total += len(saved)
            distance, place = tree.query(saved)
            near = np.flatnonzero(distance <= SAME_PLACE * self._size)
            here = place[near]
            for name in part.keys() - {"x"}:
                some = part[name]
                mine = values.setdefault(name, np.zeros((*some.shape[:-1], n)))
                mine[..., here] = some[..., near]
            there[here] = True
        return Picked(values, there, total)


class Picked(NamedTuple):
    """Values at points, a mask of the points that have one, and the total number saved."""

    values: Arrays
    there: Mask
    total: int


class UnknownLayout(PointLayout):
    """Unknowns of meshed ice, identified by position.

    Ice that a shorter run did not have starts from 0, its initial state: stored heat counts from
    there.
    """

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values. Raises SceneError if the mesh differs. Collective."""
        picked = self._picked(parts)
        if self._comm.allreduce(int(picked.there.sum()), op=MPI.SUM) != picked.total:
            raise SceneError("the checkpoint does not fit the ice of this run")
        return picked.values


class GridLayout:
    """This rank's `nodes` of a grid that every rank knows."""

    def __init__(self, nodes: OwnNodes) -> None:
        self._nodes = nodes

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """Values at this rank's nodes, and their global numbers."""
        total = np.array(self._nodes.total)
        return {"numbers": np.asarray(self._nodes.numbers), "total": total, **values}

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """Values at this rank's nodes. Raises SceneError if the grid differs."""
        place = np.full(self._nodes.total, -1)
        place[self._nodes.numbers] = np.arange(len(self._nodes.numbers))
        values: Arrays = {}
        for part in parts:
            if int(part["total"]) != self._nodes.total:
                raise SceneError("the checkpoint does not fit the ice of this run")
            here = place[part["numbers"]]
            near = np.flatnonzero(here >= 0)
            for name in part.keys() - {"numbers", "total"}:
                shape = *part[name].shape[:-1], len(self._nodes.numbers)
                values.setdefault(name, np.zeros(shape))[..., here[near]] = part[name][..., near]
        return values


def _extent(x: Array, comm: MPI.Comm) -> float:
    """The largest extent (m) of all ranks' points. Collective."""
    ends = np.stack([-x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    return float(ends.sum(axis=0).max())
