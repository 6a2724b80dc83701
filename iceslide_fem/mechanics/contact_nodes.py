"""Contact nodes in a global numbering, and their loads, held by all ranks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.direct_solver import SparseColumns
from iceslide_fem.mechanics.contact_surface import ContactSurface
from iceslide_fem.mechanics.self_contact import SelfContact
from iceslide_fem.runtime.arrays import Array

# Number of parts of a load that are solved at once; least norm of a part over the whole.
PARTS, WORTH = 6, 0.02
# Weight of the resultant in the norm of forces. The norm of a uniform residual falls with the
# number of nodes, but it moves the block most. A larger weight requires more factorisations than
# most runs need.
RESULTANT = 0.3


class ContactNodes:
    """Nodes of the contact `surface` in a global numbering, with loads held by all ranks.

    Loads are (n_loads,), N: all components of all nodes, then the plate. own: dofs of this rank
    among them.
    """

    def __init__(
        self,
        surface: ContactSurface,
        self_contact: SelfContact | None,
        vector: PETSc.Vec,
        fixed: NDArray[np.int32],
        lifted: Array,
    ) -> None:
        """self_contact: walls, whose nodes are included; vector: of nodal forces, overwritten;
        fixed, lifted: own dofs that are fixed, and those of the plate. Loads on fixed dofs are 0,
        except the plate's. Collective.
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
        """Sorted indices of loads that may be nonzero, equal on all ranks. Collective.

        They come from `loads` (k, n), from this rank's `facets`, and from the stiffness `between`
        walls. The plate's load is included.
        """
        acts = np.zeros(self.n_loads, dtype=np.int8)
        acts[self._numbers[facets]] = acts[-1] = 1
        if between is not None:
            acts[between.nonzero()[0]] = 1
        self._comm.Allreduce(MPI.IN_PLACE, acts, op=MPI.MAX)
        return np.flatnonzero(acts.astype(bool) | loads.any(axis=0))

    def summing(self, facets: NDArray[np.intp], acting: NDArray[np.intp]) -> csc_matrix:
        """Matrix from forces on this rank's `facets` (f a d) to `acting` loads without the
        plate's.
        """
        numbers = np.searchsorted(acting, self._numbers[facets].ravel())
        first = np.arange(numbers.size + 1)
        shape = (acting.size - 1, numbers.size)
        return csc_matrix((np.ones(numbers.size), numbers, first), shape=shape)

    def loads(self, own: Array, acting: NDArray[np.intp]) -> Array:
        """`acting` loads (a, k) summed over all ranks, from `own` (a - 1, k). Collective."""
        loads = np.empty((acting.size, own.shape[1]))
        loads[:-1], loads[-1] = own, 0.0
        self._comm.Allreduce(MPI.IN_PLACE, loads, op=MPI.SUM)
        loads[-1] = loads[:-1][self._lifted[acting[:-1]]].sum(axis=0)
        loads[:-1][self.fixed[acting[:-1]]] = 0.0
        return loads

    def resultant(self, acting: NDArray[np.intp]) -> Array:
        """Matrix (d, a) from `acting` loads (a) to their weighted resultant."""
        component = np.append(self._unknowns[acting[:-1]] % self._dim, -1)  # -1: the plate
        return RESULTANT * (component == np.arange(self._dim)[:, None])

    def everywhere(self, loads: Array, acting: NDArray[np.intp]) -> Array:
        """Full loads (k, n) from the `acting` ones (k, a)."""
        found = np.zeros((len(loads), self.n_loads))
        found[:, acting] = loads
        return found

    def between_walls(self, stiffness: csr_matrix) -> csr_matrix | None:
        """Matrix from changes of the `own` dofs to loads (n - 1), by a `stiffness` of the walls.

        stiffness: in the walls' unknowns, N/m, equal on all ranks. None if it is zero.
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
        """Parts (k, n) of a load, each of norm 1. Collective.

        They are the loads in x or z of the lines with the largest loads, and the rest. They are
        equal on all ranks to the last digit.
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
        """Norm of a load, equal on all ranks to the last digit. Collective."""
        return float(self._comm.bcast(float(np.linalg.norm(load)), root=0))

    def entries(self, loads: Array) -> SparseColumns:
        """Loads (k, n) as columns over all ranks' dofs, without the plate's."""
        column, place = np.nonzero(loads[:, :-1])
        first = np.searchsorted(column, np.arange(len(loads) + 1)).astype(np.int32)
        return SparseColumns(first, self._unknowns[place], loads[column, place])

    def on_own(self, load: Array) -> Array:
        """Loads on the `own` dofs."""
        return load[:-1][self._here]

    def at_facets(self, change: Array) -> Array:
        """A change of this rank's dofs (with ghosts) at the facets' nodes, (f, a d), m."""
        moved = change.reshape(-1, self._dim)[self._dofs]
        return np.asarray(moved.reshape(len(moved), moved.shape[1] * self._dim))


def _lines(
    nodes: Array, numbers: NDArray[np.int64], total: int, comm: MPI.Comm
) -> NDArray[np.intp]:
    """For each of `total` loads: number of its line across x and its direction. Collective.

    The direction is vertical or horizontal. nodes: of the facets (f, a, d), m; numbers: of their
    loads (f a d).
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
