"""Walls of sipes that meet: their energy, its derivatives, what they carry, on any ranks."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.fenics.start import start_petsc  # noqa: E402
from iceslide_fem.rubber.block import build_block  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
WORLD, ALONE = MPI.COMM_WORLD, MPI.COMM_SELF
WIDTH, MIDDLE = 0.4e-3, 0.3e-3
START = start_petsc()


def siped(model, comm, *more):
    sipe = f"{{position={MIDDLE}, width={WIDTH}, depth='3 mm', angle='5 deg'}}"
    changes = f"model={model} rubber.length=6mm rubber.width=3mm rubber.height=4mm".split()
    changes += ["numerics.refinement=0.5", f"rubber.sipes=[{sipe}]", *more]
    return build_block(load_scene(CASE, changes), comm)


def close(block):
    """Shear the lugs so that the sipe's walls go through each other at its mouth."""
    u, dim = block.rubber.displacements, block.rubber.mesh.geometry.dim
    x = block.rubber.space.tabulate_dof_coordinates()[:, :dim]
    side = np.sign(x[:, 0] - MIDDLE - np.tan(np.radians(5.0)) * x[:, -1])
    u[:] = 2e-6 * np.sin(1e4 * x + 3.0)
    u[:, 0] -= side * 0.3e-3 * (1.0 - x[:, -1] / 4e-3)
    return x


@pytest.mark.parametrize("model", ["slice", "block"])
def test_forces_and_tangent_are_the_derivatives_of_the_energy(model):
    block = siped(model, ALONE)
    x, u, walls = close(block), block.rubber.displacements, block.rubber.walls
    way, step = np.sin(3e4 * x[:, ::-1] + 1.0), 1e-9
    forces = np.zeros_like(u)
    walls.add_forces(u, forces)
    change = (walls.energy(u + step * way) - walls.energy(u - step * way)) / (2 * step)
    assert np.sum(forces * way) == pytest.approx(change, rel=1e-6)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9 * np.abs(forces).max())
    matrix = block.rubber.create_matrix()
    matrix.assemble()
    walls.add_tangent(u, matrix)
    by_tangent, direction = matrix.createVecLeft(), matrix.createVecRight()
    direction.array[:] = way.ravel()
    matrix.mult(direction, by_tangent)
    ends = [np.zeros_like(u), np.zeros_like(u)]
    for end, sign in zip(ends, (1.0, -1.0), strict=True):
        walls.add_forces(u + sign * step * way, end)
    slope = ((ends[0] - ends[1]) / (2 * step)).ravel()
    assert np.linalg.norm(by_tangent.array - slope) < 1e-6 * np.linalg.norm(slope)


@pytest.mark.mpi
@pytest.mark.three
@pytest.mark.parametrize("model", ["slice", "block"])
def test_any_number_of_ranks_finds_the_same_forces(model):
    sums = []
    for comm in (WORLD, ALONE):
        block = siped(model, comm)
        close(block)
        u, dofs = block.rubber.displacements, block.rubber.space.dofmap.index_map
        forces = np.zeros_like(u)
        block.rubber.walls.add_forces(u, forces)
        owned = forces[: dofs.size_local]
        moments = [owned.sum(), (owned**2).sum(), block.rubber.walls.energy(u) / comm.size]
        sums.append([comm.allreduce(float(moment), op=MPI.SUM) for moment in moments])
        sums[-1].append(block.smallest_opening())
    assert sums[0] == pytest.approx(sums[1], rel=1e-9, abs=1e-9 * sums[1][1] ** 0.5)


def test_open_sipes_do_nothing():
    block = siped("slice", ALONE)
    u = block.rubber.displacements
    assert block.smallest_opening() == pytest.approx(WIDTH * np.cos(np.radians(5.0)), rel=1e-3)
    forces = np.zeros_like(u)
    block.rubber.walls.add_forces(u, forces)
    assert not forces.any() and block.rubber.walls.energy(u) == 0.0
    matrix = block.rubber.create_matrix()
    matrix.assemble()
    block.rubber.walls.add_tangent(u, matrix)
    assert matrix.norm() == 0.0
