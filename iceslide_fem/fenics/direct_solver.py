"""Direct linear solvers of rubber and ice: PETSc's own factors in a slice, MUMPS's in a block."""

from __future__ import annotations

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.fenics.compat import SINGLE_BY_MUMPS, SINGLE_BY_PETSC, PETSc, solve_linear
from iceslide_fem.fenics.mumps import MORE_ROOM, MOST_ROOM, NO_ROOM, ROOM, SparseColumns
from iceslide_fem.fenics.single_factors import SingleFactors

PRECISIONS = ("single", "double")


def factorise(ksp: PETSc.KSP, points: Array) -> None:
    """Let `ksp`, which has its matrix, use direct factors. `points`: (n, d) of this rank's nodes.

    Raises SceneError for an option that is none. Collective.
    """
    pc = ksp.getPC()
    if points.shape[1] == 3:
        _use_mumps(ksp, points)
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
    """Solve, with more room for the factors where MUMPS needs it; whether that succeeded.

    Raises NotConverged where single factors cannot.
    """
    solve_linear(ksp, right, solution)
    while ksp.getConvergedReason() < 0 and _more_room(ksp):
        solve_linear(ksp, right, solution)
    return bool(ksp.getConvergedReason() >= 0)


def takes_many(ksp: PETSc.KSP) -> bool:
    """Whether the factors are MUMPS's: several sparse loads hardly take longer than one."""
    return bool(_in_single(ksp) or _in_double(ksp))


def solve_many(ksp: PETSc.KSP, loads: SparseColumns) -> Array:
    """Solutions (k, n) of this rank's unknowns for a few sparse `loads`, the same on all ranks.

    The factors are those that a first `solve` has made: the first pass through them goes only where
    the loads are. Collective.
    """
    if single := _in_single(ksp):
        return single.solve_many(loads)
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


def _in_single(ksp: PETSc.KSP) -> SingleFactors | None:
    pc = ksp.getPC()
    context = pc.getPythonContext() if pc.getType() == "python" else None
    return context if isinstance(context, SingleFactors) else None


def _in_double(ksp: PETSc.KSP) -> bool:
    pc = ksp.getPC()
    return bool(pc.getType() == "lu" and pc.getFactorSolverType() == "mumps")


def _use_mumps(ksp: PETSc.KSP, points: Array) -> None:
    """In single precision, where it is to be had and the option -pc_precision does not say double.

    Such factors take half the memory, and half the time where that is what their reading takes.
    Raises SceneError for another precision.
    """
    pc, options = ksp.getPC(), PETSc.Options(ksp.getOptionsPrefix())
    precision = options.getString("pc_precision", PRECISIONS[0])
    if precision not in PRECISIONS:
        name = f"-{ksp.getOptionsPrefix()}pc_precision"
        raise SceneError(f"the option {name} is {precision}; it may be {' or '.join(PRECISIONS)}")
    single = precision == "single"
    if single and SINGLE_BY_MUMPS:
        pc.setType("python")
        pc.setPythonContext(SingleFactors(ksp.comm.tompi4py(), points))
        return
    if single and SINGLE_BY_PETSC:
        options["pc_precision"] = "single"
    pc.setType("lu")
    pc.setFactorSolverType("mumps")
    _give_room(pc, ROOM)


def _more_room(ksp: PETSc.KSP) -> bool:
    """Make more room for the next factors; whether that may help."""
    if not _in_double(ksp):
        return False
    pc = ksp.getPC()
    factors = pc.getFactorMatrix()
    room = max(2 * factors.getMumpsIcntl(14), MORE_ROOM)
    if factors.getMumpsInfog(1) not in NO_ROOM or room > MOST_ROOM:
        return False
    matrix, _ = ksp.getOperators()
    pc.reset()  # PETSc keeps factors that failed
    ksp.setOperators(matrix)
    _give_room(pc, room)
    return True


def _give_room(pc: PETSc.PC, room: int) -> None:
    pc.setFactorSetUpSolverType()
    factors = pc.getFactorMatrix()
    factors.setOptionsPrefix(pc.getOptionsPrefix())  # that of its precision among them
    factors.setMumpsIcntl(14, room)
    factors.setMumpsIcntl(13, 1)  # the last front on one rank: shared out, solves wait for it
    # Stiffnesses of one kind of element need neither a permutation of columns nor scaling, which
    # take 3 to 20 % of the factors' time.
    factors.setMumpsIcntl(6, 0)
    factors.setMumpsIcntl(8, 0)
