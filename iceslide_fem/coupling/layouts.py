"""How the values of one kind are laid out over the ranks, in terms that no partition changes.

Every rank keeps what is its own, with places or numbers. A layout picks this rank's values out of
what all ranks of an earlier run have kept, one of them after the other.
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
# Points are the same if they are this near, relative to the extent of all.
SAME_PLACE = 1e-7


class Layout(Protocol):
    """How the values of one kind are laid out over the ranks."""

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """What this rank keeps of its values (..., n): those that no other has, and where."""

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values (..., n) out of what the ranks of an earlier run have `kept`.

        Collective. Raises SceneError, on all ranks, where the two do not fit.
        """


class PointLayout:
    """Points known by where they lie: x (n, d), m, of which this rank owns the first `n_owned`.

    Partitions number points in their own ways, and coordinates do not depend on them.
    """

    def __init__(self, x: Array, n_owned: int, comm: MPI.Comm) -> None:
        self._x, self._n_owned, self._comm = x, n_owned, comm
        self._size = _extent(x, comm)

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """Values of this rank's own points, and their `x`."""
        mine = {name: value[..., : self._n_owned] for name, value in values.items()}
        return mine | {"x": self._x[: self._n_owned].T}

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values, ghosts included. Collective: all ranks raise SceneError."""
        picked = self._picked(parts)
        if not self._comm.allreduce(bool(picked.there.all()), op=MPI.LAND):
            raise SceneError("the checkpoint does not fit the mesh of this run")
        return picked.values

    def _picked(self, parts: Iterable[Mapping[str, Array]]) -> Picked:
        """What is at this rank's points, 0 where nothing is."""
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
    """Values at points, at which of them there is one, and how many were saved in all."""

    values: Arrays
    there: Mask
    total: int


class UnknownLayout(PointLayout):
    """Unknowns of ice on a mesh by where they lie: what a shorter run did not have is nothing yet.

    So much is that of the ice at first, which the content counts from.
    """

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """This rank's values. Raises SceneError where the mesh is another one. Collective."""
        picked = self._picked(parts)
        if self._comm.allreduce(int(picked.there.sum()), op=MPI.SUM) != picked.total:
            raise SceneError("the checkpoint does not fit the ice of this run")
        return picked.values


class GridLayout:
    """This rank's `nodes` of a grid that every rank knows."""

    def __init__(self, nodes: OwnNodes) -> None:
        self._nodes = nodes

    def kept(self, values: Mapping[str, Array]) -> Arrays:
        """Values at this rank's nodes, and their numbers."""
        total = np.array(self._nodes.total)
        return {"numbers": np.asarray(self._nodes.numbers), "total": total, **values}

    def own(self, parts: Iterable[Mapping[str, Array]]) -> Arrays:
        """Values at this rank's nodes. Raises SceneError if the grid is another one."""
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
