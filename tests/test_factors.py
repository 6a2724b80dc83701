"""MUMPS's factors in single precision by its own interface, against dense solves."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from iceslide_fem.errors import NotConverged  # noqa: E402
from iceslide_fem.fenics import direct_solver  # noqa: E402
from iceslide_fem.fenics.compat import MPI, SINGLE_BY_MUMPS, PETSc  # noqa: E402
from iceslide_fem.fenics.dissection import dissected  # noqa: E402
from iceslide_fem.fenics.halved_factors import HalvedFactors, separator  # noqa: E402
from iceslide_fem.fenics.mumps import SparseColumns, SpreadMatrix  # noqa: E402
from iceslide_fem.fenics.native import ints  # noqa: E402
from iceslide_fem.fenics.shared_factors import SharedFactors  # noqa: E402
from iceslide_fem.fenics.single_factors import SingleFactors  # noqa: E402

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


def spread(matrix, ranks=COMM.size):
    """The same in PETSc, its rows over the first so many ranks."""
    size = N // ranks + (N % ranks if COMM.rank == 0 else 0) if COMM.rank < ranks else 0
    found = PETSc.Mat().createAIJ(((size, N), (size, N)), nnz=N, comm=COMM)
    for row in range(*found.getOwnershipRange()):
        columns = np.flatnonzero(matrix[row]).astype(np.int32)
        found.setValues([row], columns, matrix[row, columns])
    found.assemble()
    return found


class Solver:
    """A PETSc solver of these factors."""

    def __init__(self, ranks):
        self.ranks = ranks
        here = spread(np.eye(N), ranks).getOwnershipRange()
        self.factors = SingleFactors(COMM, np.arange(*here, dtype=float)[:, None])
        self.ksp = PETSc.KSP().create(COMM)
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("python")
        self.ksp.getPC().setPythonContext(self.factors)

    def take(self, matrix):
        self.matrix = spread(matrix, self.ranks)
        self.ksp.setOperators(self.matrix)

    def solve(self, load):
        right, left = self.matrix.createVecs()
        right.array[:] = load[slice(*right.getOwnershipRange())]
        assert direct_solver.solve(self.ksp, right, left)
        return np.concatenate(COMM.allgather(left.array.copy()))


@pytest.fixture(params=["all", "all but the last"])
def solver(request):
    """With rows on these ranks."""
    return Solver(COMM.size if request.param == "all" else max(1, COMM.size - 1))


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


@pytest.mark.parametrize("places", [[2, 3], [50, 58], [0, 59]])
def test_sparse_loads_may_be_on_a_few_ranks_or_on_the_border_alone(solver, places):
    matrix = dense(3)
    solver.take(matrix)
    solver.solve(np.ones(N))
    rows = np.array([*places, N // 2], dtype=np.int32)[: 3 if places[0] == 0 else 2]
    first = np.array([0, 1, len(rows)], dtype=np.int32)
    sparse = SparseColumns(first, rows, np.arange(1.0, len(rows) + 1.0))
    loads = np.zeros((2, N))
    loads[np.minimum(np.arange(len(rows)), 1), rows] = sparse.values
    exact = np.linalg.solve(matrix, loads.T).T
    found = np.concatenate(COMM.allgather(solver.factors.solve_many(sparse)), axis=1)
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


@pytest.mark.skipif(COMM.size != 2, reason="halves are of two ranks")
@pytest.mark.parametrize("reach", [1, 3, 9])
def test_two_ranks_with_rows_halve_the_matrix_where_a_border_parts_it(solver, reach):
    solver.take(dense(reach))
    solver.solve(np.ones(N))
    halved = solver.ranks == 2
    assert isinstance(solver.factors._factors, HalvedFactors) == halved
    if halved:  # a band is parted by as many as it reaches
        assert solver.factors._factors._n_border == reach


@pytest.mark.skipif(COMM.size != 2, reason="halves are of two ranks")
def test_halves_without_pivots_of_their_own_are_left_for_good(solver):
    matrix, load = dense(3), np.random.default_rng(1).random(N)
    matrix[10, :] = matrix[:, 10] = matrix[20, :] = matrix[:, 20] = 0.0
    matrix[10, 30] = matrix[30, 10] = matrix[20, 31] = matrix[31, 20] = 1.0
    solver.take(matrix)
    exact = np.linalg.solve(matrix, load)
    for _ in range(2):
        np.testing.assert_allclose(solver.solve(load), exact, atol=1e-5 * np.abs(exact).max())
        assert isinstance(solver.factors._factors, SharedFactors)
        solver.matrix.scale(1.0)  # so that there will be factors once more


@pytest.mark.skipif(COMM.size != 2, reason="halves are of two ranks")
def test_a_singular_border_is_not_converged():
    matrix, load = dense(3), np.ones(N)
    matrix[27:33], matrix[:, 27:33] = 0.0, 0.0
    matrix[27, 30] = matrix[30, 27] = 1.0  # so that there is a border between
    for row in (28, 29, 31, 32):
        matrix[row, row] = 1.0
    solver = Solver(COMM.size)
    matrix[30, 30] = matrix[27, 27] = 1.0  # and its two rows are the same
    solver.take(matrix)
    with pytest.raises(NotConverged, match="the halves' border is singular"):
        solver.solve(load)


@pytest.mark.skipif(COMM.size != 2, reason="halves are of two ranks")
def test_a_border_of_the_fewest_unknowns_parts_any_graph():
    random = np.random.default_rng(5)
    for size, share in ((6, 0.2), (12, 0.05), (12, 0.2), (12, 0.6), (20, 0.1)):
        graph = random.random((size, size)) < share  # between the halves
        first, second = np.nonzero(graph)
        rows, columns = (first, second + size) if COMM.rank == 0 else (second + size, first)
        starts, points = np.array([0, size, 2 * size]), np.zeros((size, 3))
        places = rows.astype(np.int32), columns.astype(np.int32)
        border = separator(SpreadMatrix(COMM, starts, *places, points, 1))
        assert (np.isin(first, border) | np.isin(second + size, border)).all()
        assert len(border) == rank_of(graph)
        # and of two components at each node, of which one is coupled
        places = 2 * places[0], 2 * places[1] + 1
        both = separator(SpreadMatrix(COMM, 2 * starts, *places, points, 2))
        assert both.tolist() == [part for one in border for part in (2 * one, 2 * one + 1)]


def rank_of(graph):
    """The largest matching of a graph: the rank of a matrix with random entries there."""
    entries = np.random.default_rng(6).uniform(1.0, 2.0, graph.shape)
    return np.linalg.matrix_rank(np.where(graph, entries, 0.0))


def test_a_grid_that_is_dissected_takes_a_third_of_the_operations():
    size = 48
    points = np.stack(np.meshgrid(*[np.arange(size)] * 2, indexing="ij"), -1).reshape(-1, 2)
    apart = np.abs(points[:, None] - points[None]).max(axis=-1)
    first, second = np.nonzero(apart == 1)
    order = dissected(points.astype(float), first.astype(np.int32), second.astype(np.int32))
    assert sorted(order) == list(range(size**2))
    stiffness = np.where(apart == 1, -1.0, 0.0) + 9.0 * np.eye(size**2)

    def operations(order):
        factor = np.linalg.cholesky(stiffness[np.ix_(order, order)])
        return (np.count_nonzero(factor, axis=0) ** 2).sum()

    assert operations(order) < 0.35 * operations(np.arange(size**2))
    # the last ones are a line across, of which nothing passes
    cut = order[-size:]
    assert np.ptp(points[cut], axis=0).min() == 0


@pytest.mark.parametrize("n", [2, 40])
def test_points_that_no_cut_parts_stay_as_they_are(n):
    couples = np.indices((n, n)).reshape(2, -1).astype(np.int32)
    for points in (np.zeros((n, 3)), np.arange(3.0 * n).reshape(n, 3)):
        assert dissected(points, *couples).tolist() == list(range(n))


def test_integers_of_64_bits_go_into_c_as_those_of_32():
    given = np.array([0, 5, 2**31 - 1], dtype=np.int64)
    assert ints(given).dtype == np.int32 and (ints(given) == given).all()
    assert ints(given.astype(np.int32)) is not None
    with pytest.raises(OverflowError, match="2147483648 is no 32-bit integer"):
        ints(given + 1)
