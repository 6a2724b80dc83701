"""What kept factors answer to loads on the contact, and what a changed contact makes of it.

With factors M of an earlier tangent and the difference D of the present contact to theirs, whose
loads w act on the nodes of the contact alone,

    (M + D) x = b,    x = M^-1 (b - w),    w = D x:    (1 + D M^-1) w = D M^-1 b.

M^-1 of a load is kept as long as the factors are. w is sought among the loads that have been met
already, so that (1 + D M^-1) w is as near as can be; then a solve is made for what is left, and so
on (GMRES with a recycled space: Parks et al., SIAM J. Sci. Comput. 28 (2006) 1651). Factors that
answer several loads in little more time than one are given what is left in parts: points touch and
lift along lines across the sliding direction, and what a line does alone serves for more than what
all do at once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from iceslide_fem.arrays import Array
from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.mumps import SparseColumns
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.walls import Walls

# So many solves for one change at most; and so many answers are kept before factors are made anew.
MOST_SOLVES, MOST_KEPT = 20, 200
# Images of kept loads that are, to this share of the largest, combinations of others are none.
DEPENDENT = 1e-6
# What a solve leaves is the next load, unless it has left more than this share of what was there.
ENOUGH = 0.8
# Parts of a load that are answered at once, and what that costs in solves for one; what a part must
# have of the whole.
PARTS, PARTS_COST, WORTH = 6, 1.5, 0.02

# The changes of this rank's dofs, ghosts included, (k, dofs), that answer loads (k, n) on the
# contact. Collective.
Answered = Callable[[Array], Array]


class ContactNodes:
    """Nodes of the contact `surface` numbered over all ranks, which all know the loads on them.

    Loads are (n_loads,), N: of all components of all nodes, and at the end of the plate. own: those
    dofs of this rank that are among them.
    """

    def __init__(
        self,
        surface: ContactSurface,
        walls: Walls | None,
        vector: PETSc.Vec,
        fixed: NDArray[np.int32],
        lifted: Array,
    ) -> None:
        """`walls` touch each other, too. `vector`: of nodal forces, overwritten; `fixed` and, of
        the plate, `lifted`: own dofs.

        Loads on fixed dofs are none but the plate's. Collective.
        """
        comm, dofs = surface.comm, surface.dofs[surface.firsts]
        dim, n_owned = surface.nodes.shape[-1], vector.getLocalSize()
        with vector.localForm() as local:
            local.set(0.0)
            local.array.reshape(-1, dim)[dofs] = 1.0
            if walls is not None:
                local.array.reshape(-1, dim)[walls.dofs] = 1.0
        compat.sum_ghosts(vector)
        self.own = np.flatnonzero(vector.array > 0.0)
        unknowns = comm.allgather(self.own + vector.getOwnershipRange()[0])
        self._unknowns = np.concatenate(unknowns).astype(np.int32)
        first, total = sum(map(len, unknowns[: comm.rank])), self._unknowns.size
        self._here = slice(first, first + self.own.size)
        vector.array[self.own] = np.arange(first, first + self.own.size)
        self._of_walls = np.zeros(0, dtype=np.int64)
        if walls is not None:
            at_walls, here = np.zeros(walls.unknowns.size), walls.own
            at_walls[here] = vector.array[walls.unknowns[here] - walls.unknowns_before]
            comm.Allreduce(MPI.IN_PLACE, at_walls, op=MPI.SUM)
            self._of_walls = at_walls.round().astype(np.int64)
        compat.update_ghosts(vector)
        with vector.localForm() as local:
            numbers = local.array.reshape(-1, dim)[dofs].round().astype(np.int64).ravel()
        self._lines = _lines(surface.nodes[surface.firsts], numbers, total, comm)
        self._numbers = numbers.reshape(len(dofs), dofs.shape[1] * dim)
        kinds = np.zeros((2, n_owned))
        kinds[0, fixed], kinds[1, lifted] = 1.0, 1.0
        everywhere = np.zeros((2, total))
        everywhere[:, self._here] = kinds[:, self.own]
        comm.Allreduce(MPI.IN_PLACE, everywhere, op=MPI.SUM)
        self._fixed, self._lifted = everywhere > 0.0
        self._comm, self._dofs, self._dim = comm, dofs, dim
        self.n_loads = total + 1

    def summing(self, facets: NDArray[np.intp]) -> csc_matrix:
        """From forces on some of this rank's `facets` (f a d) to loads (n - 1)."""
        numbers = self._numbers[facets].ravel()
        first = np.arange(numbers.size + 1)
        shape = (self._fixed.size, numbers.size)
        return csc_matrix((np.ones(numbers.size), numbers, first), shape=shape)

    def loads(self, own: Array) -> Array:
        """Loads (n, k) of all ranks, each of which has its `own` (n - 1, k). Collective."""
        loads = np.zeros((self._fixed.size + 1, own.shape[1]))
        loads[:-1] = own
        self._comm.Allreduce(MPI.IN_PLACE, loads, op=MPI.SUM)
        loads[-1] = loads[:-1][self._lifted].sum(axis=0)
        loads[:-1][self._fixed] = 0.0
        return loads

    def between_walls(self, stiffness: csr_matrix) -> csr_matrix | None:
        """The loads (n - 1) that changes of the `own` dofs make by a stiffness of the walls (N/m,
        by their unknowns, the same on all ranks); None if it is zero.
        """
        entries = stiffness.tocoo()
        if not entries.nnz:
            return None
        rows, columns = self._of_walls[entries.row], self._of_walls[entries.col]
        here = (self._here.start <= columns) & (columns < self._here.stop)
        shape = (self._fixed.shape[0], self.own.size)
        places = rows[here], columns[here] - self._here.start
        return csr_matrix((entries.data[here], places), shape=shape)

    def parts(self, load: Array) -> Array:
        """Parts (k, n) of a load, each of the length 1: what the lines that have most of it have,
        in x or z, and the rest. The same on all ranks to the last digit. Collective.
        """
        sizes = np.bincount(self._lines, load[:-1] ** 2)
        place = np.full(sizes.size, PARTS - 1)
        place[np.argsort(sizes)[::-1][: PARTS - 1]] = np.arange(min(PARTS - 1, sizes.size))
        parts = np.zeros((PARTS, load.size))
        parts[place[self._lines], np.arange(load.size - 1)] = load[:-1]
        parts[-1, -1] = load[-1]
        sizes = np.linalg.norm(parts, axis=1)
        worth = sizes > WORTH * sizes.max()
        return np.asarray(self._comm.bcast(parts[worth] / sizes[worth, None]))

    def norm(self, load: Array) -> float:
        """Of a load, the same on all ranks to the last digit. Collective."""
        return float(self._comm.bcast(float(np.linalg.norm(load)), root=0))

    def entries(self, loads: Array) -> SparseColumns:
        """Loads (k, n) as columns of all ranks' dofs, but for what is on the plate."""
        column, place = np.nonzero(loads[:, :-1])
        first = np.searchsorted(column, np.arange(len(loads) + 1)).astype(np.int32)
        return SparseColumns(first, self._unknowns[place], loads[column, place])

    def on_own(self, load: Array) -> Array:
        """Those on the `own` dofs."""
        return load[:-1][self._here]

    def at_facets(self, change: Array) -> Array:
        """A change of this rank's dofs, ghosts included, at the facets' nodes, (f, a d), m."""
        moved = change.reshape(-1, self._dim)[self._dofs]
        return np.asarray(moved.reshape(len(moved), moved.shape[1] * self._dim))


class Responses:
    """Answers of factors to loads on the `nodes` of the contact: kept until they are cleared.

    worn: whether the last change took more solves than those since the factors did on the average,
    the factors' own cost included: then new ones are worth their while.
    """

    def __init__(self, nodes: ContactNodes, cost: float, many: bool = False) -> None:
        """`cost` of new factors, in solves with them; whether they answer `many` loads at once."""
        self._nodes, self._cost, self._many = nodes, cost, many
        # Loads (k, n), N, the changes of this rank's dofs that answer them (k, dofs), m, and those
        # at the facets (k, f, a d), m: there is room for more than the `_met`.
        self._loads: Array = np.zeros((0, nodes.n_loads))
        self._answers: Array = np.zeros((0, 0))
        self._moved: Array = np.zeros((0, 0, 0))
        self.clear()
        self._differing: NDArray[np.intp] = np.zeros(0, dtype=np.intp)  # facets
        self._sum = nodes.summing(self._differing)  # of the forces on them
        self._difference: Array = np.zeros(0)
        self._between: csr_matrix | None = None

    def clear(self) -> None:
        """There are new factors."""
        self._met = 0
        self._spent, self._changes, self.worn = self._cost, 0, False

    def differ(self, difference: Array, walls: csr_matrix | None = None) -> None:
        """The contact of the factors less the present one, as a tangent (f, a d, a d), N/m, and the
        stiffness of the `walls` now less that of the factors.
        """
        self._between = None if walls is None else self._nodes.between_walls(walls)
        self._differing = np.flatnonzero(difference.any(axis=(1, 2)))
        self._difference = difference[self._differing]
        self._sum = self._nodes.summing(self._differing)

    def correction(self, answer: Array, limit: float, answered: Answered) -> Array:
        """What to subtract of the factors' `answer` to some load, leaving at most `limit` (N).

        `answered` solves with the factors. Collective.
        """
        moved = self._nodes.at_facets(answer)
        left = self._differing_loads(answer[None], moved[None])[:, 0]
        images = self._images(0)
        parts = _orthonormal(images)
        left, shares = _less(left, images, parts)
        longest, solves = np.inf, 1.0
        for _ in range(MOST_SOLVES):
            length = self._nodes.norm(left)
            if not length > limit:
                break
            if length >= ENOUGH * longest:
                loads = (images @ parts[:, -1:]).T
            else:
                loads = self._nodes.parts(left) if self._many else left[None] / length
            longest, first = length, self._met
            solves += 1.0 if len(loads) == 1 else PARTS_COST
            for load, found in zip(loads, answered(loads), strict=True):
                self._keep(load, found)
            more = self._images(first)
            if not np.isfinite(more).all():
                self._met = first
                break
            rest, shared = _less(more, images, parts)
            of_rest = _orthonormal(rest)
            if not of_rest.shape[1]:
                break
            images = np.column_stack([images, more])
            of_new = np.concatenate([-shared @ of_rest, of_rest])
            parts = np.column_stack([np.pad(parts, ((0, len(loads)), (0, 0))), of_new])
            left, more_shares = _less(left, images, parts)
            shares = np.pad(shares, (0, len(loads))) + more_shares
        self._spent, self._changes = self._spent + solves, self._changes + 1
        self.worn = solves * self._changes > self._spent or self._met > MOST_KEPT
        return np.asarray(shares @ self._answers[: shares.size]) if shares.size else 0.0 * answer

    def _keep(self, load: Array, answer: Array) -> None:
        """Keep a load and the change that answers it."""
        moved = self._nodes.at_facets(answer)
        if self._met == len(self._loads) or self._answers.shape[1:] != answer.shape:
            self._loads, self._answers, self._moved = (
                _with_room(kept, one, self._met)
                for kept, one in (
                    (self._loads, load),
                    (self._answers, answer),
                    (self._moved, moved),
                )
            )
        self._loads[self._met], self._answers[self._met] = load, answer
        self._moved[self._met] = moved
        self._met += 1

    def _images(self, first: int) -> Array:
        """(1 + D M^-1) w of the kept loads w from the `first` on, (n, k), N. Collective."""
        kept = slice(first, self._met)
        if first == self._met:
            return np.zeros((self._nodes.n_loads, 0))
        return self._differing_loads(self._answers[kept], self._moved[kept]) + self._loads[kept].T

    def _differing_loads(self, answers: Array, moved: Array) -> Array:
        """Loads D x (n, k), N, of changes x (k, dofs), at the facets (k, f, a d). Collective."""
        forces = self._difference @ moved[:, self._differing].transpose(1, 2, 0)
        own = self._sum @ forces.reshape(-1, len(moved))
        if self._between is not None:
            own += self._between @ answers[:, self._nodes.own].T
        return self._nodes.loads(own)


def _with_room(kept: Array, one: Array, count: int) -> Array:
    """The first `count` of what is `kept`, (n, ...), and as much room again for more like `one`."""
    more: Array = np.empty((max(2 * count, 32), *one.shape))
    if count:
        more[:count] = kept[:count]
    return more


def _less(columns: Array, images: Array, parts: Array) -> tuple[Array, Array]:
    """`columns` (n, ...) less what of them `images` (n, k) can be, whose `parts` (k, r) make them
    orthonormal, and the shares (k, ...) of the images in that. Done once more against rounding.
    """
    shares = np.zeros((images.shape[1], *columns.shape[1:]))
    for _ in range(2):
        found = parts @ (parts.T @ (images.T @ columns))
        columns, shares = columns - images @ found, shares + found
    return columns, shares


def _lines(
    nodes: Array, numbers: NDArray[np.int64], total: int, comm: MPI.Comm
) -> NDArray[np.intp]:
    """Number of the line across x and of the direction, vertical or not, that each of `total` loads
    belongs to: on the facets' `nodes` (f, a, d), m, those of the `numbers` (f a d). Collective.
    """
    dim = nodes.shape[-1]
    place = np.full((total, 2), -np.inf)
    place[numbers, 0] = np.repeat(nodes[..., 0], dim)
    place[numbers, 1] = np.tile(np.arange(dim) == dim - 1, nodes.size // dim)
    comm.Allreduce(MPI.IN_PLACE, place, op=MPI.MAX)
    x = place[:, 0]
    size = np.ptp(x[np.isfinite(x)]) if np.isfinite(x).any() else 0.0
    place[:, 0] = np.round(x / (size or 1.0), 6)
    return np.unique(place, axis=0, return_inverse=True)[1].reshape(-1)


def _orthonormal(columns: Array) -> Array:
    """Parts (k, r) of the `columns` (n, k) with which their combinations are orthonormal."""
    squares, vectors = np.linalg.eigh(columns.T @ columns)
    good = squares > DEPENDENT**2 * squares.max(initial=0.0)
    return np.asarray(vectors[:, good] / np.sqrt(squares[good]))
