"""Walls of sipes that meet: their energy, its derivatives, what they carry, on any ranks."""

import contextlib
import functools
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import along, left_by, ripple  # noqa: E402

from iceslide_fem.coupling.layouts import PointLayout  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.fenics.start import start_petsc  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.contact import Traction  # noqa: E402
from iceslide_fem.mechanics.press import press  # noqa: E402
from iceslide_fem.mechanics.self_contact_friction import slip  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.rubber import tagged_rubber  # noqa: E402
from iceslide_fem.runtime.errors import NotConverged  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from scripts.studies.press_elements import in_tetrahedra  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
WORLD, ALONE = MPI.COMM_WORLD, MPI.COMM_SELF
WIDTH, MIDDLE = 0.4e-3, 0.3e-3
START = start_petsc()


def siped(model, comm, sipe, *more, folder=None):
    """A block with a sipe; blocks can be cut into tetrahedra, by a file in `folder`."""
    solid = model.replace("tetrahedra", "block")
    changes = f"model={solid} rubber.length=6mm rubber.width=3mm rubber.height=4mm".split()
    changes += ["numerics.refinement=0.5", f"rubber.sipes=[{{{sipe}}}]"]
    if model == "tetrahedra":
        path = folder / "tetrahedra.msh"
        gmsh_model.save(in_tetrahedra(tagged_rubber(load_scene(CASE, changes))), path)
        changes = ["model=block", f"rubber.mesh={path}"]
    return build_block(load_scene(CASE, [*changes, *more]), comm)


@pytest.fixture(params=["slice", "block", "tetrahedra"])
def build(request, tmp_path):
    return functools.partial(siped, request.param, folder=tmp_path)


UPRIGHT = "position='0 mm', width='0.2 mm', depth='3 mm'"
SIPE = f"position={MIDDLE}, width={WIDTH}, depth='3 mm', angle='5 deg'"
RUBBING = "rubber.wall_friction=0.3"


def rub(block, way):
    """Let closed walls touch down as they are, then shift the lugs along each other by `way` (m)
    at the mouth; returns the nodes that move.
    """
    self_contact, u = block.rubber.self_contact, block.rubber.displacements
    self_contact.stick_points, _ = self_contact.followed(u)
    x = block.rubber.space.tabulate_dof_coordinates()[:, : u.shape[1]]
    right = x[:, 0] > MIDDLE + np.tan(np.radians(5.0)) * x[:, -1]
    u[right, 1:] += (way * (1.0 - x[:, -1] / 4e-3))[right, None]
    return right


def close(block):
    """Shear the lugs so that the sipe's walls go through each other at its mouth."""
    x = ripple(block.rubber)
    side = np.sign(x[:, 0] - MIDDLE - np.tan(np.radians(5.0)) * x[:, -1])
    block.rubber.displacements[:, 0] -= side * 0.3e-3 * (1.0 - x[:, -1] / 4e-3)
    return x


@pytest.mark.parametrize("way", [None, 3e-5], ids=["smooth", "rubbing"])
def test_forces_and_tangent_are_the_derivatives_of_the_energy(build, way):
    block = build(ALONE, SIPE, *([RUBBING] if way else []))
    x, u, self_contact = close(block), block.rubber.displacements, block.rubber.self_contact
    if way:  # where some of the points stick and others slip
        rub(block, way)
        tied = self_contact.sticking_at(
            self_contact.pressing_at(self_contact.deformed(u)), self_contact.deformed(u)
        )
        slips = slip(tied.springs.along, tied.bound, self_contact.penalty) > 0.0
        assert 0.2 < slips.mean() < 0.8
    way, step = np.sin(3e4 * x[:, ::-1] + 1.0), 1e-9
    forces = np.zeros_like(u)
    self_contact.add_forces(u, forces)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-9 * np.abs(forces).max())
    if self_contact.stick_points is None:
        change = (self_contact.energy(u + step * way) - self_contact.energy(u - step * way)) / (
            2 * step
        )
        assert np.sum(forces * way) == pytest.approx(change, rel=1e-6)
    matrix = block.rubber.create_matrix()
    matrix.assemble()
    self_contact.add_tangent(self_contact.stiffness(u), matrix)
    ends = [np.zeros_like(u), np.zeros_like(u)]
    for end, sign in zip(ends, (1.0, -1.0), strict=True):
        self_contact.add_forces(u + sign * step * way, end)
    slope = (ends[0] - ends[1]) / (2 * step)
    assert np.linalg.norm(along(matrix, way) - slope) < 1e-6 * np.linalg.norm(slope)


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [[], [RUBBING]], ids=["smooth", "rubbing"])
def test_any_number_of_ranks_finds_the_same_forces(build, friction):
    sums = []
    for comm in (WORLD, ALONE):
        block = build(comm, SIPE, *friction)
        close(block)
        rub(block, 2e-5)
        u, dofs = block.rubber.displacements, block.rubber.space.dofmap.index_map
        forces = np.zeros_like(u)
        block.rubber.self_contact.add_forces(u, forces)
        owned = forces[: dofs.size_local]
        moments = [owned.sum(), (owned**2).sum(), block.rubber.self_contact.energy(u) / comm.size]
        sums.append([comm.allreduce(float(moment), op=MPI.SUM) for moment in moments])
        sums[-1].append(block.smallest_opening())
        sums[-1].append(
            1e-3 * block.stick_points_after()[1]
        )  # of numbers that are compared, none is large
    assert sums[0] == pytest.approx(sums[1], rel=1e-9, abs=1e-9 * sums[1][1] ** 0.5)


def test_open_sipes_do_nothing():
    block = siped("slice", ALONE, SIPE)
    u = block.rubber.displacements
    assert block.smallest_opening() == pytest.approx(WIDTH * np.cos(np.radians(5.0)), rel=1e-3)
    forces = np.zeros_like(u)
    block.rubber.self_contact.add_forces(u, forces)
    assert not forces.any() and block.rubber.self_contact.energy(u) == 0.0
    matrix = block.rubber.create_matrix()
    matrix.assemble()
    block.rubber.self_contact.add_tangent(block.rubber.self_contact.stiffness(u), matrix)
    assert matrix.norm() == 0.0


class Mirror:
    """What a rigid, frictionless plane x = 0 does to the walls of a sipe in the middle."""

    stick_points = None

    def __init__(self, self_contact, penalty):
        self._own, self._penalty, self._weights = (
            self_contact.own_facets,
            penalty,
            self_contact.half_area,
        )
        self._none = self_contact.stiffness(np.zeros((1 + self_contact.dofs.max(), 2)))

    def _pull(self, u):
        x = self._own.positions(u)[..., 0]
        before = self._own.nodes.mean(axis=1)[:, None, 0]
        return 2.0 * self._weights * self._penalty * np.where(x * before < 0.0, x, 0.0)

    def energy(self, u):
        x = self._own.positions(u)[..., 0]
        return float(0.5 * np.sum(self._pull(u) * x))

    def add_forces(self, u, vector):
        forces = np.zeros(self._own.nodes.shape)
        forces[..., 0] = np.einsum("fqa,fq->fa", self._own.shape, self._pull(u))
        np.add.at(vector, self._own.dofs, forces)

    def stiffness(self, u):
        self._u = u
        return self._none

    def add_tangent(self, stiffness, matrix):
        u = self._u
        x = self._own.positions(u)[..., 0]
        stiffness = np.divide(self._pull(u), x, out=np.zeros_like(x), where=x != 0.0)
        for dofs, shape, weights in zip(self._own.dofs, self._own.shape, stiffness, strict=True):
            block = np.einsum("qa,q,qb->ab", shape, weights, shape)
            matrix.setValues(2 * dofs, 2 * dofs, block, True)
        matrix.assemble()


def pinched(mirrored):
    """A block whose two lugs are drawn together, against each other or against a plane."""
    sipe = "{position='0 mm', width='0.1 mm', depth='3 mm'}"
    changes = "model=slice rubber.length=6mm rubber.height=4mm numerics.refinement=0.5".split()
    block = build_block(load_scene(CASE, [*changes, f"rubber.sipes=[{sipe}]"]), ALONE)
    self_contact = block.rubber.self_contact
    if mirrored:
        block.rubber.self_contact = Mirror(self_contact, 2.0 * self_contact.penalty)
    x = block.surface.positions(np.zeros_like(block.rubber.displacements))[..., 0]

    def inwards(pressure, displacement):
        strength = -0.4 * np.sign(x)
        none = np.zeros((*pressure.shape, 1, 1))
        return Traction((strength * pressure)[..., None], strength[..., None], none)

    press(block, lambda _: None, inwards)
    u = block.rubber.displacements
    return block, -self_contact.smallest_opening(u, np.inf), self_contact.pressure(u)[1]


def test_two_walls_press_like_one_on_its_mirror_plane():
    both, depth, pressure = pinched(mirrored=False)
    one, _, _ = pinched(mirrored=True)
    u, plane = both.rubber.displacements, one.rubber.displacements
    assert pressure.max() > 2e4
    # They sink in by the penalty's share alone.
    assert depth == pytest.approx(pressure.max() / both.rubber.self_contact.penalty)
    assert np.abs(u - plane).max() < 5e-3 * np.abs(plane).max()
    energies = [block.rubber.elastic_energy() for block in (both, one)]
    assert energies[0] == pytest.approx(energies[1], rel=5e-3)


@pytest.mark.parametrize("raised", [0.0, 0.13e-3])  # 0.4 of a facet: they do not match
def test_an_even_pressure_passes_from_wall_to_wall(build, raised):
    block = build(ALONE, UPRIGHT)
    self_contact, u = block.rubber.self_contact, block.rubber.displacements
    x = block.rubber.space.tabulate_dof_coordinates()[:, : u.shape[1]]
    overlap = 10e-6
    u[:, 0] = -np.sign(x[:, 0]) * (0.1e-3 + overlap / 2)
    u[x[:, 0] > 0.0, -1] = raised
    forces, even = np.zeros_like(u), np.zeros_like(u)
    self_contact.add_forces(u, forces)
    own = self_contact.own_facets
    area = 2.0 * self_contact.half_area
    consistent = np.zeros(own.nodes.shape)
    pressure = self_contact.penalty * overlap
    consistent[..., 0] = np.einsum("fqa,fq->fa", own.shape, area * pressure)
    consistent[..., 0] *= -np.sign(own.nodes.mean(axis=1)[:, :1])
    np.add.at(even, own.dofs, consistent)
    inner = np.abs(x[:, -1] - 1.5e-3) < 0.8e-3  # away from the ends of walls that do not match
    scale = np.abs(even[inner]).max()
    assert np.abs(forces[inner] - even[inner]).max() < (1e-9 if raised == 0.0 else 0.1) * scale
    for side in (x[:, 0] > 0.0, x[:, 0] < 0.0):
        total, wanted = forces[side & inner, 0].sum(), even[side & inner, 0].sum()
        assert total == pytest.approx(wanted, rel=1e-9 if raised == 0.0 else 1e-2)


def test_damped_changes_take_factors_of_where_they_start():
    """A load that bends lugs is found at once from most starts (seven of nine; with factors of
    elsewhere, which creep, from one or two): which ones hangs on rounding.
    """
    scene = load_scene(CASE.with_name("siped_tread.toml"), ["numerics.refinement=0.25"])
    block, found = build_block(scene, ALONE), 0
    u = block.rubber.displacements
    start = u.copy()
    for part in range(9):
        u[:] = start
        u[:, -1] -= (1.0 + 0.01 * part) * 1e-6
        block.equilibrium.forget()
        with contextlib.suppress(NotConverged):
            for share in (0.15, 0.75):
                force = share * block.force
                solution = block.equilibrium.solve(force, block.static, 2e-5 * force)
            found += solution.iterations < 40
    assert found >= 5


def test_walls_that_rub_keep_account(build):
    """An even pressure, drawn to and fro along the wall: sticks, slips at mu p, and warms."""
    block = build(ALONE, UPRIGHT, RUBBING)
    self_contact, u = block.rubber.self_contact, block.rubber.displacements
    x = block.rubber.space.tabulate_dof_coordinates()[:, : u.shape[1]]
    right, overlap = x[:, 0] > 0.0, 10e-6
    u[:, 0] = -np.sign(x[:, 0]) * (0.1e-3 + overlap / 2)
    self_contact.stick_points, heat = self_contact.followed(u)
    assert (
        heat == 0.0
        and (self_contact.stick_points.facet >= 0).all()
        and (self_contact.stick_points.bound > 0.0).all()
    )
    area = self_contact.half_area.sum()  # of one of the two walls
    limit = 0.3 * overlap  # of the springs' length
    slid, work, before, warm = 0.0, 0.0, self_contact.energy(u), 0.0
    last = np.zeros_like(u)
    self_contact.add_forces(u, last)
    for step in 1e-6 * np.repeat([1.0, -1.0, 1.0], [9, 9, 5]):
        moved = np.where(right, step, 0.0)
        u[:, -1] += moved
        forces = np.zeros_like(u)
        self_contact.add_forces(u, forces)
        slid = np.clip(slid + step, -limit, limit)
        pull = forces[right, -1].sum() / (self_contact.penalty * area)
        assert pull == pytest.approx(slid, abs=1e-2 * limit)  # some points leave the wall's end
        work += float(moved @ (forces[:, -1] + last[:, -1])) / 2.0
        stick_points, heat = self_contact.followed(u)
        self_contact.stick_points, last = stick_points, forces
        warm += heat
    assert warm > 0.0 and work == pytest.approx(self_contact.energy(u) - before + warm, rel=1e-2)
    assert self_contact.energy(u + [*(u.shape[1] - 1) * [0.0], 1.0]) == pytest.approx(
        self_contact.energy(u)
    )


@pytest.mark.mpi
def test_a_grip_is_given_back_on_any_number_of_ranks(build):
    found = []
    for comm in (WORLD, ALONE):
        block = build(comm, SIPE, RUBBING)
        close(block)
        rub(block, 2e-5)
        self_contact, u = block.rubber.self_contact, block.rubber.displacements
        layout = PointLayout(self_contact.points, len(self_contact.points), comm)
        kept, trial = self_contact.stick_points, self_contact.followed(u)[0]
        assert self_contact.stick_points is kept  # a trial leaves no trace
        found.append(
            [comm.allgather(layout.kept(self_contact.saved(trial))), layout, self_contact, trial]
        )
    (kept, *_), (_, layout, self_contact, trial) = found
    again = self_contact.restored(layout.own(kept))  # by one rank what all have saved
    np.testing.assert_array_equal(again.facet, trial.facet)
    np.testing.assert_allclose(again.place, trial.place, atol=1e-9)
    np.testing.assert_allclose(again.bound, trial.bound, rtol=1e-9)
    assert (trial.facet >= 0).any() and (trial.facet < 0).any()


@pytest.mark.mpi
def test_changes_by_kept_factors_take_walls_as_they_touch_now(build):
    """Factors without walls solve the equations of walls that touch as closely as is asked."""
    block = build(WORLD, SIPE)
    self_contact, u = block.rubber.self_contact, block.rubber.displacements
    x = block.rubber.space.tabulate_dof_coordinates()[:, : u.shape[1]]
    side = np.sign(x[:, 0] - MIDDLE - np.tan(np.radians(5.0)) * x[:, -1])
    u[:, 0] = -side * 0.3e-3 * np.maximum(1.0 - x[:, -1] / 3e-3, 0.0)
    u[:, -1] = -1e-6
    assert block.smallest_opening() < -1e-5
    penalty, self_contact.penalty = self_contact.penalty, 0.0
    equations = block.equilibrium.under(block.force, block.static)
    equations.residual()
    equations.linearise()
    self_contact.penalty = penalty
    equations.residual()
    assert left_by(equations.change(), equations) < 0.05


def test_another_block_restores_stick_points_that_are_far_along_the_walls(build):
    """As a restart does, whose first search was between the walls as they were drawn."""
    block, other = (build(ALONE, SIPE, RUBBING) for _ in range(2))
    close(block)
    rub(block, 1.2e-3)
    walls = block.rubber.self_contact
    stick_points, _ = walls.followed(block.rubber.displacements)
    found = other.rubber.self_contact.restored(walls.saved(stick_points))
    gripped = stick_points.facet >= 0
    assert gripped.any()
    np.testing.assert_array_equal(found.facet >= 0, gripped)
    at, expected = (
        one.saved(sticks)["anchor"]
        for one, sticks in ((other.rubber.self_contact, found), (walls, stick_points))
    )
    size = np.linalg.norm(at - expected, axis=0)
    np.testing.assert_allclose(size[gripped.ravel()], 0.0, atol=1e-9)
