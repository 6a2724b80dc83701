"""Sides that rise to the plate lie on it; a plate that is lowered finds the largest load."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import along, ripple  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import MPI, PETSc  # noqa: E402
from iceslide_fem.fenics.start import start_petsc  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.press import press  # noqa: E402
from iceslide_fem.runtime.errors import SimulationStopped  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from scripts.studies.blocks import shear_of_pressure  # noqa: E402

pytestmark = pytest.mark.fe

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
WORLD, ALONE = MPI.COMM_WORLD, MPI.COMM_SELF
START = start_petsc()


def made(model, comm, *more):
    return build_block(
        load_scene(CASE, [f"model={model}", "numerics.refinement=0.75", *more]), comm
    )


def bulge(block):
    """Lower the plate, and let what is beside it rise above its plane."""
    x = ripple(block.rubber)
    block.rubber.displacements[block.rubber.plate, -1] = -1e-4
    return x


@pytest.mark.parametrize("model", ["slice", "block"])
def test_forces_and_tangent_are_the_derivatives_of_the_energy(model):
    block = made(model, ALONE)
    x, u, beside = bulge(block), block.rubber.displacements, block.rubber.beside
    way, step = np.sin(3e4 * x[:, ::-1] + 1.0), 1e-9
    lift = 0.7
    way[block.rubber.plate] = np.eye(way.shape[1])[-1] * lift
    ends = [np.zeros_like(u), np.zeros_like(u)]
    energies, reactions = [], []
    for end, sign in zip(ends, (1.0, -1.0), strict=True):
        moved = u + sign * step * way
        reactions.append(beside.add_forces(moved, end))
        energies.append(beside.energy(moved))
    forces = np.zeros_like(u)
    reaction = beside.add_forces(u, forces)
    assert reaction > 0.0
    assert forces[:, -1].sum() == pytest.approx(reaction, rel=1e-9)
    change = (energies[0] - energies[1]) / (2 * step)
    assert np.sum(forces * way) - lift * reaction == pytest.approx(change, rel=1e-5)
    matrix, column = block.rubber.create_matrix(), np.zeros_like(u)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    matrix.assemble()
    beside.add_tangent(u, matrix)
    own = beside.add_lift(u, column)
    by_tangent = along(matrix, way) + lift * column
    np.testing.assert_allclose(
        by_tangent, (ends[0] - ends[1]) / (2 * step), atol=1e-5 * np.abs(by_tangent).max()
    )
    by_plate = np.sum(column * way) + lift * own
    assert by_plate == pytest.approx(-(reactions[0] - reactions[1]) / (2 * step), rel=1e-5)


@pytest.mark.mpi
@pytest.mark.parametrize("model", ["slice", "block"])
def test_any_number_of_ranks_finds_the_same_forces(model):
    sums = []
    for comm in (WORLD, ALONE):
        block = made(model, comm)
        bulge(block)
        u, beside = block.rubber.displacements, block.rubber.beside
        vector = block.rubber.create_vector()
        with vector.localForm() as local:
            reaction = beside.add_forces(u, local.array.reshape(u.shape))
        compat.sum_ghosts(vector)
        sums.append([vector.norm(), reaction, beside.energy(u)])
        stiffness = block.rubber.lift_slope(vector)
        sums[-1] += [vector.norm(), stiffness]
    assert sums[0] == pytest.approx(sums[1], rel=1e-9)


def test_a_held_plate_carries_what_a_force_holds():
    block = made("slice", ALONE)
    press(block, lambda _: None)
    depth = block.equilibrium.plate_displacement()
    assert block.balance_under_held_plate(block.static).force == pytest.approx(block.force, 1e-4)
    block.equilibrium.lower_plate(2e-3 * block.height)
    assert block.balance_under_held_plate(block.static).force > 1.02 * block.force
    block.balance(block.static)
    assert block.equilibrium.plate_displacement() == pytest.approx(depth, rel=1e-4)


def test_the_largest_load_is_named():
    """Rubber that went past the corner at the plate stopped the default mesh at 3.7 bar."""
    block = made("slice", ALONE, "rubber.edge_radius=100um", "load.pressure=6bar")
    loads = []
    with pytest.raises(SimulationStopped) as stop:
        press(block, lambda point: loads.append(6.0 * point.load), shear_of_pressure(0.3))
    assert max(loads) == pytest.approx(4.8, rel=0.02)
    named = f"the largest load found is {max(loads):.3g} bar at mu = 0.3"
    assert named in str(stop.value) and "carries less" in str(stop.value)
