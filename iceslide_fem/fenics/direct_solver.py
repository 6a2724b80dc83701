"""Direct linear solvers of rubber and ice: PETSc's own factors in a slice, MUMPS's in a block."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.arrays import Array
from iceslide_fem.fenics.compat import PETSc

# MUMPS estimates the room for its factors before it knows the pivots and which rank takes what:
# so much is added to the estimate, in per cent, and doubled until it is enough.
ROOM, MORE_ROOM, MOST_ROOM = 100, 200, 1600
_NO_ROOM = (-8, -9)  # INFOG(1): too small a workspace of integers, of reals


class SparseColumns(NamedTuple):
    """Columns by their entries: those of column k are first[k] to first[k + 1] of rows (global
    numbers, int32) and values.
    """

    first: NDArray[np.int32]
    rows: NDArray[np.int32]
    values: Array

    @classmethod
    def none(cls) -> SparseColumns:
        """No columns."""
        return cls(np.zeros(1, dtype=np.int32), np.zeros(0, dtype=np.int32), np.zeros(0))


def factorise(ksp: PETSc.KSP, dimension: int) -> None:
    """Let `ksp`, which has its matrix, use direct factors."""
    pc = ksp.getPC()
    if dimension == 3:
        pc.setType("lu")
        pc.setFactorSolverType("mumps")
        _give_room(pc, ROOM)
    elif ksp.comm.size > 1:  # a slice is small: every rank factorises the whole of it
        pc.setType("redundant")
    else:  # and PETSc's own factors take a third to a twentieth of MUMPS's time
        pc.setType("lu")
        pc.setFactorSolverType("petsc")
        if PETSc.Sys.hasExternalPackage("suitesparse"):  # a tenth fewer entries than PETSc's own
            pc.setFactorOrdering("amd")


def takes_blocks(ksp: PETSc.KSP) -> bool:
    """Whether the factors are PETSc's own: with the components of each node in a block they take
    half the time, and solves with them three quarters. They cannot shift pivots, an option.
    """
    pc = ksp.getPC()
    shifts = PETSc.Options(ksp.getOptionsPrefix()).hasName("pc_factor_shift_type")
    return bool(pc.getType() == "lu" and pc.getFactorSolverType() == "petsc" and not shifts)


def solve(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> bool:
    """Solve, with more room for the factors where MUMPS needs it; whether that succeeded."""
    ksp.solve(right, solution)
    while ksp.getConvergedReason() < 0 and _more_room(ksp):
        ksp.solve(right, solution)
    return bool(ksp.getConvergedReason() >= 0)


def takes_many(ksp: PETSc.KSP) -> bool:
    """Whether the factors are MUMPS's: several sparse loads hardly take longer than one."""
    pc = ksp.getPC()
    return bool(pc.getType() == "lu" and pc.getFactorSolverType() == "mumps")


def solve_many(ksp: PETSc.KSP, rights: SparseColumns, solutions: PETSc.Mat) -> None:
    """Solve for a few sparse right sides with the factors, which a first `solve` has made.

    solutions: dense, overwritten. The first pass through the factors goes only where the right
    sides are. Collective.
    """
    unknowns, count = solutions.getSize()
    first = ksp.comm.rank == 0  # which MUMPS wants to have all of them, as rows
    sizes = ((count if first else 0, count), (unknowns if first else 0, unknowns))
    rows = PETSc.Mat().createAIJ(
        sizes, csr=rights if first else SparseColumns.none(), comm=ksp.comm
    )
    columns = PETSc.Mat().createTranspose(rows)
    ksp.getPC().getFactorMatrix().matSolve(columns, solutions)
    columns.destroy()
    rows.destroy()


def _more_room(ksp: PETSc.KSP) -> bool:
    """Make more room for the next factors; whether that may help."""
    if not takes_many(ksp):
        return False
    pc = ksp.getPC()
    factors = pc.getFactorMatrix()
    room = max(2 * factors.getMumpsIcntl(14), MORE_ROOM)
    if factors.getMumpsInfog(1) not in _NO_ROOM or room > MOST_ROOM:
        return False
    matrix, _ = ksp.getOperators()
    pc.reset()  # PETSc keeps factors that failed
    ksp.setOperators(matrix)
    _give_room(pc, room)
    return True


def _give_room(pc: PETSc.PC, room: int) -> None:
    pc.setFactorSetUpSolverType()
    factors = pc.getFactorMatrix()
    factors.setMumpsIcntl(14, room)
    factors.setMumpsIcntl(13, 1)  # the last front on one rank: shared out, solves wait for it
    # Stiffnesses of one kind of element need neither a permutation of columns nor scaling, which
    # take 3 to 20 % of the factors' time.
    factors.setMumpsIcntl(6, 0)
    factors.setMumpsIcntl(8, 0)
