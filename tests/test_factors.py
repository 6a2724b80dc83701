"""MUMPS's factors in single precision by its own interface, against dense solves."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from iceslide_fem.errors import NotConverged  # noqa: E402
from iceslide_fem.fenics.compat import MPI, SINGLE_BY_MUMPS, PETSc  # noqa: E402
from iceslide_fem.fenics.single_factors import SingleFactors, SparseColumns  # noqa: E402

pytestmark = [
    pytest.mark.fe,
    pytest.mark.mpi,
    pytest.mark.three,
    pytest.mark.skipif(not SINGLE_BY_MUMPS, reason="PETSc has them itself"),
]

N = 60
COMM = MPI.COMM_WORLD


def dense(reach, seed=0):
    """A matrix that is not symmetric, of a band this wide."""
    matrix = np.random.default_rng(seed).uniform(-1.0, 1.0, (N, N)) + 4.0 * np.eye(N)
    far = np.abs(np.subtract.outer(np.arange(N), np.arange(N))) > reach
    return np.where(far, 0.0, matrix)


def spread(matrix):
    """The same in PETSc, its rows over the ranks, the last of which has none."""
    ranks = max(1, COMM.size - 1)
    size = N // ranks + (N % ranks if COMM.rank == 0 else 0) if COMM.rank < ranks else 0
    found = PETSc.Mat().createAIJ(((size, N), (size, N)), nnz=N, comm=COMM)
    for row in range(*found.getOwnershipRange()):
        columns = np.flatnonzero(matrix[row]).astype(np.int32)
        found.setValues([row], columns, matrix[row, columns])
    found.assemble()
    return found


class Solver:
    """A PETSc solver of these factors."""

    def __init__(self):
        self.factors = SingleFactors(COMM)
        self.ksp = PETSc.KSP().create(COMM)
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("python")
        self.ksp.getPC().setPythonContext(self.factors)

    def take(self, matrix):
        self.matrix = spread(matrix)
        self.ksp.setOperators(self.matrix)

    def solve(self, load):
        right, left = self.matrix.createVecs()
        right.array[:] = load[slice(*right.getOwnershipRange())]
        self.ksp.solve(right, left)
        return np.concatenate(COMM.allgather(left.array.copy()))


@pytest.fixture
def solver():
    return Solver()


def test_a_load_is_answered_in_single_precision(solver):
    matrix, load = dense(3), np.random.default_rng(1).random(N)
    solver.take(matrix)
    exact = np.linalg.solve(matrix, load)
    error = np.abs(solver.solve(load) - exact).max() / np.abs(exact).max()
    assert 1e-10 < error < 1e-5


def test_factors_follow_the_matrix_its_values_and_its_pattern(solver):
    load = np.random.default_rng(1).random(N)
    for matrix in (dense(3), dense(3, seed=2), dense(9), dense(1)):
        solver.take(matrix)
        exact = np.linalg.solve(matrix, load)
        np.testing.assert_allclose(solver.solve(load), exact, atol=1e-5 * np.abs(exact).max())


def test_sparse_loads_are_answered_at_once_before_and_after_a_dense_one(solver):
    matrix = dense(3)
    loads = np.zeros((3, N))
    loads[0, [2, 50]], loads[2, 30] = (1.0, -2.0), 3.0  # and one without an entry
    column, rows = np.nonzero(loads)
    first = np.searchsorted(column, np.arange(4)).astype(np.int32)
    sparse = SparseColumns(first, rows.astype(np.int32), loads[column, rows])
    solver.take(matrix)
    exact = np.linalg.solve(matrix, loads.T).T
    for load in loads:
        solver.solve(load)
        parts = COMM.allgather(solver.factors.solve_many(sparse))
        found = np.concatenate(parts, axis=1)
        np.testing.assert_allclose(found, exact, atol=1e-5 * np.abs(exact).max())


def test_a_singular_matrix_is_not_converged_on_any_rank_and_the_next_one_is_solved(solver):
    singular, load = dense(3), np.ones(N)
    singular[:, 7] = 0.0
    solver.take(singular)
    with pytest.raises(NotConverged, match="MUMPS's error -10"):
        solver.solve(load)
    solver.take(dense(3))
    exact = np.linalg.solve(dense(3), load)
    np.testing.assert_allclose(solver.solve(load), exact, atol=1e-5 * np.abs(exact).max())
