"""Nodes of the contact numbered over all ranks, and the loads on them, which all ranks know."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.direct_solver import SparseColumns
from iceslide_fem.rubber.contact_surface import ContactSurface
from iceslide_fem.rubber.self_contact import SelfContact
from iceslide_fem.runtime.arrays import Array

# Parts of a load that are answered at once; what one must have of the whole.
PARTS, WORTH = 6, 0.02
# What the resultant of forces counts beside each of them where their size is taken: what lacks
# evenly at all nodes counts less than where it lacks at one the more nodes there are, and moves the
# block most. More of it asks for more factors in slides that do not need them.
RESULTANT = 0.3


class ContactNodes:
    """Nodes of the contact `surface` numbered over all ranks, which all know the loads on them.

    Loads are (n_loads,), N: of all components of all nodes, and at the end of the plate. own: those
    dofs of this rank that are among them.
    """

    def __init__(
        self,
        surface: ContactSurface,
        self_contact: SelfContact | None,
        vector: PETSc.Vec,
        fixed: NDArray[np.int32],
        lifted: Array,
    ) -> None:
        """`self_contact` touch each other, too. `vector`: of nodal forces, overwritten; `fixed`
        and, of the plate, `lifted`: own dofs.

        Loads on fixed dofs are none but the plate's. Collective.
        """
        comm, dofs = surface.comm, surface.dofs[surface.firsts]
        dim, n_owned = surface.nodes.shape[-1], vector.getLocalSize()
        with vector.localForm() as local:
            local.set(0.0)
            local.array.reshape(-1, dim)[dofs] = 1.0
            if self_contact is not None:
                local.array.reshape(-1, dim)[self_contact.dofs] = 1.0
        compat.sum_ghosts(vector)
        self.own = np.flatnonzero(vector.array > 0.0)
        unknowns = comm.allgather(self.own + vector.getOwnershipRange()[0])
        self._unknowns = np.concatenate(unknowns).astype(np.int32)
        first, total = sum(map(len, unknowns[: comm.rank])), self._unknowns.size
        self._here = slice(first, first + self.own.size)
        vector.array[self.own] = np.arange(first, first + self.own.size)
        self._of_walls = np.zeros(0, dtype=np.int64)
        if self_contact is not None:
            at_walls, here = np.zeros(self_contact.unknowns.size), self_contact.own
            at_walls[here] = vector.array[
                self_contact.unknowns[here] - self_contact.unknowns_before
            ]
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
        self.fixed, self._lifted = everywhere > 0.0
        self._comm, self._dofs, self._dim = comm, dofs, dim
        self.n_loads = total + 1

    def acting(
        self, facets: NDArray[np.intp], between: csr_matrix | None, loads: Array
    ) -> NDArray[np.intp]:
        """Where there are `loads` (k, n), or some of this rank's `facets`, or what acts `between`
        walls, may make some; and the plate's. Increasing, the same on all ranks. Collective.
        """
        acts = np.zeros(self.n_loads, dtype=np.int8)
        acts[self._numbers[facets]] = acts[-1] = 1
        if between is not None:
            acts[between.nonzero()[0]] = 1
        self._comm.Allreduce(MPI.IN_PLACE, acts, op=MPI.MAX)
        return np.flatnonzero(acts.astype(bool) | loads.any(axis=0))

    def summing(self, facets: NDArray[np.intp], acting: NDArray[np.intp]) -> csc_matrix:
        """From forces on some of this rank's `facets` (f a d) to loads where they are `acting`, but
        for the plate's.
        """
        numbers = np.searchsorted(acting, self._numbers[facets].ravel())
        first = np.arange(numbers.size + 1)
        shape = (acting.size - 1, numbers.size)
        return csc_matrix((np.ones(numbers.size), numbers, first), shape=shape)

    def loads(self, own: Array, acting: NDArray[np.intp]) -> Array:
        """Loads (a, k) of all ranks where they are `acting`, of each rank's `own` (a - 1, k).

        Collective.
        """
        loads = np.empty((acting.size, own.shape[1]))
        loads[:-1], loads[-1] = own, 0.0
        self._comm.Allreduce(MPI.IN_PLACE, loads, op=MPI.SUM)
        loads[-1] = loads[:-1][self._lifted[acting[:-1]]].sum(axis=0)
        loads[:-1][self.fixed[acting[:-1]]] = 0.0
        return loads

    def resultant(self, acting: NDArray[np.intp]) -> Array:
        """From loads where they are `acting` (a) to their resultant, as it counts: (d, a)."""
        component = np.append(self._unknowns[acting[:-1]] % self._dim, -1)  # the plate's: none
        return RESULTANT * (component == np.arange(self._dim)[:, None])

    def everywhere(self, loads: Array, acting: NDArray[np.intp]) -> Array:
        """Loads (k, n) of those (k, a) that are `acting`."""
        found = np.zeros((len(loads), self.n_loads))
        found[:, acting] = loads
        return found

    def between_walls(self, stiffness: csr_matrix) -> csr_matrix | None:
        """The loads (n - 1) that changes of the `own` dofs make by a stiffness of the walls (N/m,
        by their unknowns, the same on all ranks); None if it is zero.
        """
        entries = stiffness.tocoo()
        if not entries.nnz:
            return None
        rows, columns = self._of_walls[entries.row], self._of_walls[entries.col]
        here = (self._here.start <= columns) & (columns < self._here.stop)
        shape = (self.fixed.shape[0], self.own.size)
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
