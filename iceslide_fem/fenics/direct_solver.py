"""The rubber's linear solver: PETSc's LU in a slice, symmetric MUMPS factors in a block.

Options with the solver's prefix choose another solver: `-rubber_pc_type gamg -rubber_ksp_type
fgmres`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics.compat import PETSc, solve_linear
from iceslide_fem.runtime.arrays import Array

# MUMPS estimates its memory before it knows pivots and distribution. This percentage is added to
# the estimate, and doubled until it suffices.
ROOM, MORE_ROOM, MOST_ROOM = 100, 200, 1600
NO_ROOM = (-8, -9)  # MUMPS errors: integer or real workspace too small
SPREAD = 10  # value of MUMPS's ICNTL(20): distributed right-hand sides


class SparseColumns(NamedTuple):
    """Sparse columns (CSC): entries first[k] to first[k + 1] of rows and values are column k.

    Rows are global numbers, int32.
    """

    first: NDArray[np.int32]
    rows: NDArray[np.int32]
    values: Array

    @classmethod
    def none(cls) -> SparseColumns:
        """No columns."""
        return cls(np.zeros(1, dtype=np.int32), np.zeros(0, dtype=np.int32), np.zeros(0))


def factorise(ksp: PETSc.KSP, dim: int) -> None:
    """Set up direct factors for `ksp`, which has its matrix, in `dim` dimensions. Collective."""
    pc = ksp.getPC()
    if dim == 3:
        pc.setType("cholesky")
        pc.setFactorSolverType("mumps")
        _give_room(pc, ROOM)
    elif ksp.comm.size > 1:  # a slice is small: every rank factorises all of it
        pc.setType("redundant")
    else:  # PETSc's factors take a third to a twentieth of MUMPS's time
        pc.setType("lu")
        pc.setFactorSolverType("petsc")
        if PETSc.Sys.hasExternalPackage("suitesparse"):  # a tenth fewer entries than PETSc's own
            pc.setFactorOrdering("amd")


def takes_symmetric(ksp: PETSc.KSP) -> bool:
    """Whether the factors are symmetric, so only half of the matrix is used."""
    return bool(ksp.getPC().getType() == "cholesky")


def takes_blocks(ksp: PETSc.KSP) -> bool:
    """Whether the factors are PETSc's, which can use blocks of the components of each node.

    Blocks halve the time of the factors, and reduce that of solves to three quarters. They do not
    support the option to shift pivots.
    """
    pc = ksp.getPC()
    shifts = PETSc.Options(ksp.getOptionsPrefix()).hasName("pc_factor_shift_type")
    return bool(pc.getType() == "lu" and pc.getFactorSolverType() == "petsc" and not shifts)


def takes_many(ksp: PETSc.KSP) -> bool:
    """Whether the factors are MUMPS's: several sparse loads take hardly longer than one."""
    pc = ksp.getPC()
    return bool(pc.getType() in ("lu", "cholesky") and pc.getFactorSolverType() == "mumps")


def solve(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> bool:
    """Solve, with more memory if MUMPS needs it; returns whether it succeeds. Collective."""
    solve_linear(ksp, right, solution)
    while ksp.getConvergedReason() < 0 and _more_room(ksp):
        solve_linear(ksp, right, solution)
    return bool(ksp.getConvergedReason() >= 0)


def solve_many(ksp: PETSc.KSP, loads: SparseColumns) -> Array:
    """Solutions (k, n) at this rank's unknowns for a few sparse `loads`. Collective.

    Loads are equal on all ranks. The factors are those of an earlier `solve`. The forward solve
    visits only the part that the loads reach.
    """
    count, first = len(loads.first) - 1, ksp.comm.rank == 0
    sizes, (_, unknowns) = ksp.getOperators()[0].getSizes()
    # the first rank has all loads, as rows
    shape = ((count if first else 0, count), (unknowns if first else 0, unknowns))
    rows = PETSc.Mat().createAIJ(shape, csr=loads if first else SparseColumns.none(), comm=ksp.comm)
    columns = PETSc.Mat().createTranspose(rows)
    solutions = PETSc.Mat().createDense((sizes, (PETSc.DECIDE, count)), comm=ksp.comm)
    solutions.setUp()
    ksp.getPC().getFactorMatrix().matSolve(columns, solutions)
    found = solutions.getDenseArray().T.copy()
    for matrix in (columns, rows, solutions):
        matrix.destroy()
    return np.asarray(found)


def _more_room(ksp: PETSc.KSP) -> bool:
    """Request more memory for the next factors; returns whether this may help."""
    if not takes_many(ksp):
        return False
    pc = ksp.getPC()
    factors = pc.getFactorMatrix()
    room = max(2 * factors.getMumpsIcntl(14), MORE_ROOM)
    if factors.getMumpsInfog(1) not in NO_ROOM or room > MOST_ROOM:
        return False
    matrix, _ = ksp.getOperators()
    pc.reset()  # PETSc keeps failed factors
    ksp.setOperators(matrix)
    _give_room(pc, room)
    return True


def _give_room(pc: PETSc.PC, room: int) -> None:
    pc.setFactorSetUpSolverType()
    factors = pc.getFactorMatrix()
    factors.setOptionsPrefix(pc.getOptionsPrefix())
    factors.setMumpsIcntl(14, room)
    factors.setMumpsIcntl(13, 1)  # root front on one rank: solves wait for a distributed one
    factors.setMumpsIcntl(20, SPREAD)
    # Stiffness matrices of one kind of element need no column permutation and no scaling, which
    # take 3 to 20 % of the time.
    factors.setMumpsIcntl(6, 0)
    factors.setMumpsIcntl(8, 0)
