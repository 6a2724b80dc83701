"""The grid of nodes on the ice's surface, held by every rank, and points placed on it.

Points read from the grid by (bi)linear interpolation, and give to the same nodes with the same
weights. The transfer is therefore conservative. Nodes are numbered with x outermost. Each node and
each point belongs to one rank; `SharedPoints` gathers those of all ranks where all are needed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.runtime.arrays import Array, Index

KNOWN = 4
_Contact = TypeVar("_Contact")
_Found = TypeVar("_Found")


class Recent(Generic[_Contact, _Found]):
    """Cache of `found(contact)` for the last few contacts; a contact is one object per rank."""

    def __init__(
        self, found: Callable[[_Contact], _Found], comm: MPI.Comm, known: int = KNOWN
    ) -> None:
        """found: computes the data, may be collective; known: number of contacts kept."""
        self._find, self._comm = found, comm
        self._known: deque[tuple[_Contact, _Found]] = deque(maxlen=known)

    def of(self, contact: _Contact) -> _Found:
        """Data of the `contact`, from the cache if all ranks have it there. Collective."""
        places = [number for number, (one, _) in enumerate(self._known) if one is contact]
        here = places[0] if places else -1
        if self._comm.size > 1:
            ends = np.array([here, -here])
            self._comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MIN)
            here = here if ends[0] == -ends[1] else -1
        if here >= 0:
            return self._known[here][1]
        found = self._find(contact)
        self._known.append((contact, found))
        return found


@dataclass(frozen=True, eq=False)
class Placement:
    """Positions of points on a grid: nodes around each and their weights (sum 1), (n, corners)."""

    node: NDArray[np.int32]
    weight: Array


@lru_cache(maxsize=2)
def part_of(at: Placement, index: bytes) -> Placement:
    """Placement of the points with the numbers (int64) in `index`. Caches two results."""
    some = np.frombuffer(index, dtype=np.int64)
    return Placement(at.node[some], at.weight[some])


def own_points(n: int) -> Placement:
    """Placement of `n` points that are themselves the nodes."""
    return Placement(np.arange(n, dtype=np.int32)[:, None], np.ones((n, 1)))


class Contacts(NamedTuple):
    """Points that touch the ice within a step: their placement and area (n,), m2 (m in a slice).

    points: their numbers (int64) among the placed points; None: all.
    """

    at: Placement
    area: Array
    points: Index | None = None

    @property
    def placed(self) -> Placement:
        """Placement of these points only."""
        return self.at if self.points is None else part_of(self.at, self.points.tobytes())


class OwnNodes(NamedTuple):
    """This rank's nodes among the `total` nodes of a grid that every rank holds."""

    numbers: NDArray[np.integer[Any]]
    total: int


class Profile(NamedTuple):
    """Temperature of the ice below its surface.

    depths: from 0 downwards, (n,), m; kelvin: at them, (n, N), K; heat: above the initial
    temperature, (N,), J/m2. N counts all nodes of the `grid`, or without one this rank's points.
    """

    depths: Array
    kelvin: Array
    heat: Array
    grid: SurfaceGrid | None


class SurfaceGrid:
    """Tensor grid of the sorted coordinates `lines` (x, or x and y; m).

    own: nodes of this rank; cell_area: area of the cell of each node, m2 (m in a slice), all nodes;
    n_nodes: number of all nodes.
    """

    def __init__(self, lines: Sequence[Array], own: NDArray[np.int64], comm: MPI.Comm) -> None:
        self.lines, self.own, self.comm = list(lines), own, comm
        self.shape = tuple(line.size for line in lines)
        self.n_nodes = int(np.prod(self.shape))
        own_nodes = own.astype(np.int32)[:, None]
        self._own_nodes = Placement(own_nodes, np.ones((own.size, 1)))
        self._widths = [np.diff(line) for line in lines]
        area = np.ones(1)
        for width in self._widths:
            half = width / 2.0
            around = np.append(half, 0.0) + np.insert(half, 0, 0.0)
            area = np.multiply.outer(area, around).ravel()
        self.cell_area = area

    @classmethod
    def shared(cls, lines: Sequence[Array], comm: MPI.Comm) -> SurfaceGrid:
        """The grid with its nodes split evenly over the ranks, in order."""
        nodes = np.arange(math.prod(line.size for line in lines))
        return cls(lines, np.array_split(nodes, comm.size)[comm.rank], comm)

    @property
    def nodes(self) -> OwnNodes:
        """This rank's nodes."""
        return OwnNodes(self.own, self.n_nodes)

    def place(self, points: Array) -> Placement:
        """Placement of points (n, len(lines)), m; points outside are moved to the grid's edge."""
        node, weight = np.zeros((len(points), 1), dtype=np.int32), np.ones((len(points), 1))
        for x, line, widths in zip(points.T, self.lines, self._widths, strict=True):
            x = np.minimum(np.maximum(x, line[0]), line[-1])
            cell = np.searchsorted(line[1:-1], x).astype(np.int32)
            fraction = (x - line[cell]) / widths[cell]
            node = node * line.size + cell[:, None]
            corners = len(x), 2 * node.shape[1]
            node = np.stack([node, node + 1], axis=-1).reshape(corners)
            first = weight * (1.0 - fraction)[:, None]
            last = weight * fraction[:, None]
            weight = np.stack([first, last], axis=-1).reshape(corners)
        return Placement(node, weight)

    def own_nodes(self) -> Placement:
        """Placement of points that are this rank's nodes themselves."""
        return self._own_nodes

    def allgather(self, own_values: Array) -> Array:
        """Values (..., nodes) from those of each rank's own nodes (..., own). Collective."""
        grid = np.zeros((*own_values.shape[:-1], self.n_nodes))
        grid[..., self.own] = own_values
        self.comm.Allreduce(MPI.IN_PLACE, grid, op=MPI.SUM)
        return grid

    def interpolate(self, grid: Array, at: Placement) -> Array:
        """Values (n,) of a grid function (nodes,) at points."""
        return np.asarray(np.einsum("nc,nc->n", at.weight, grid[at.node]))

    def scatter(self, amounts: Array, at: Placement) -> Array:
        """Nodal sums of the amounts from points of all ranks, (nodes,) or (kinds, nodes).
        Collective.

        `amounts`, (n,) or (kinds, n), are extensive: heat, area, force.
        """
        node, kinds = at.node.ravel(), np.atleast_2d(amounts)
        parts = ((at.weight * kind[:, None]).ravel() for kind in kinds)
        sums = [np.bincount(node, one, self.n_nodes) for one in parts]
        # NumPy returns integers for no points; MPI needs the same type on all ranks.
        grid = np.array(sums, dtype=float).reshape(*amounts.shape[:-1], self.n_nodes)
        self.comm.Allreduce(MPI.IN_PLACE, grid, op=MPI.SUM)
        return grid


class SharedPoints:
    """Points that read from and give to nodes of the surface's grid with the same weights."""

    def __init__(self, at: Placement, shape: tuple[int, ...], comm: MPI.Comm) -> None:
        """at: placement of this rank's points; shape: of the grid. Collective.

        reads: interpolation matrix (N, nodes) of the points of all ranks; gives: its transpose,
        which adds nodal loads.
        """
        self._comm, self._n, own = comm, int(np.prod(shape)), len(at.node)
        self._counts, self._own = comm.allgather(own), own
        self._some: Index | slice = slice(None)
        node, weight = self._gathered(at.node), self._gathered(at.weight)
        starts = node.shape[1] * np.arange(len(node) + 1)
        self.reads = csr_matrix((weight.ravel(), node.ravel(), starts), shape=(len(node), self._n))
        self.gives = self.reads.T.tocsr()
        # largest difference of the node numbers in one cell
        self._width = 1 if len(shape) == 1 else shape[1] + 1
        self._couples = self._coupling(node, weight)

    def among(self, points: Index | None) -> SharedPoints:
        """The same with some of this rank's points, by number; the other points give nothing."""
        if points is None:
            return self
        some = copy(self)
        some._some = points
        return some

    def of_all(self, own: Array) -> Array:
        """Rows (N, ...) of the points of all ranks, from those (n, ...) of this one. Collective."""
        rows = np.zeros((self._own, *own.shape[1:]))
        rows[self._some] = own
        return self._gathered(rows)

    def coupling(self, slopes: Array) -> Array:
        """P^T S P of slopes (N,) in the lower bands (width + 1, nodes) that LAPACK takes."""
        return np.asarray(self._couples @ slopes).reshape(self._width + 1, self._n)

    def _coupling(self, node: NDArray[np.int32], weight: Array) -> csr_matrix:
        """Matrix from slopes of the points to the entries of the nodes' band matrix."""
        apart = node[:, :, None] - node[:, None, :]
        lower = np.nonzero(apart >= 0)
        entry = apart[lower] * self._n + node[lower[0], lower[2]]
        product = weight[lower[0], lower[1]] * weight[lower[0], lower[2]]
        shape = (self._width + 1) * self._n, len(node)
        return csr_matrix((product, (entry, lower[0])), shape=shape)

    def _gathered(self, own: NDArray[Any]) -> NDArray[Any]:
        own = np.ascontiguousarray(own)
        if self._comm.size == 1:
            return own
        rows = np.empty((sum(self._counts), *own.shape[1:]), dtype=own.dtype)
        each = rows[:1].size
        self._comm.Allgatherv(own, [rows, [count * each for count in self._counts]])
        return rows
