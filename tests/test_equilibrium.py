"""Equilibrium of the pressed block: forces, symmetry, linearisation, ranks and lanes."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from blocks import CELLS, SIZE, a_block, all_of, bend, left_by, options_of_rubber  # noqa: E402

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics import contact_nodes  # noqa: E402
from iceslide_fem.mechanics.contact import contact_state, sliding_friction, static_friction  # noqa: E402
from iceslide_fem.mechanics.contact_surface import contact_surface  # noqa: E402
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody  # noqa: E402
from iceslide_fem.mechanics.loaded_block import (
    Equilibrium,  # noqa: E402
)
from iceslide_fem.mechanics.newton import Newton  # noqa: E402
from iceslide_fem.runtime.errors import NotConverged, SceneError  # noqa: E402
from iceslide_fem.scene.materials import BAR, COMPOUNDS  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.mpi, pytest.mark.versions]

B = COMPOUNDS["B"]
PENALTY = 100 * B.youngs_modulus / SIZE
LAG = 3, 3  # iterations, see `Newton`
N = {"triangle": 5, "quadrilateral": 5, "tetrahedron": 3, "hexahedron": 3}

# Plate displacement (um) at 1 bar, sliding, on the meshes above; found with DOLFINx 0.5.2.
PRESSED = [("quadrilateral", 39.236819246), ("hexahedron", 49.507784247)]


def static(pressure, displacement):
    return static_friction(pressure, displacement, 0.1, 1e-6)


def sliding(pressure, displacement, mu=0.15):
    return sliding_friction(mu * pressure, np.full_like(pressure, mu), displacement.shape[-1])


def equilibrium_of(cells, comm=MPI.COMM_WORLD):
    rubber = HyperelasticBody(a_block(cells, N[cells], comm), all_of(B))
    surface = contact_surface(rubber.space, rubber.facets("contact"), 4)
    return Equilibrium(rubber, surface, PENALTY)


def optional(cells, options, comm=MPI.COMM_WORLD):
    """`equilibrium_of` with PETSc's options for the rubber."""
    with options_of_rubber(options):
        return equilibrium_of(cells, comm)


MULTIGRID = {"ksp_type": "fgmres", "ksp_rtol": 1e-6, "pc_type": "gamg"}


def press(system, law, pressure=BAR, accuracy=1e-9):
    """Press by `pressure` (Pa) in steps that Newton can take; returns the force (N or N/m)."""
    dim = system.rubber.mesh.geometry.dim
    force = pressure * SIZE ** (dim - 1)
    steps = max(1, round(pressure / (0.2 * BAR)))
    system.rubber.displacements[:, -1] -= pressure / steps / PENALTY
    for step in range(1, steps + 1):
        system.solve(force * step / steps, law, accuracy * force)
    return force


def forces_on_contact(system, law):
    """Resultant (d,) of the contact tractions on all ranks, and the covered area."""
    u, surface = system.rubber.displacements, system.surface
    state = contact_state(surface, u, PENALTY)
    shear = law(state.pressure, surface.displacements(u)[..., :-1]).value
    parts = [surface.total(shear[..., i], state.area) for i in range(shear.shape[-1])]
    touching = surface.total(state.pressure > 0.0, state.area)
    return np.array([*parts, surface.total(state.pressure, state.area)]), touching


@pytest.mark.parametrize("law", [static, sliding])
@pytest.mark.parametrize("cells", CELLS)
def test_contact_carries_the_plate(cells, law):
    system = equilibrium_of(cells)
    force = press(system, law)
    resultant, _ = forces_on_contact(system, law)
    assert resultant[-1] == pytest.approx(force, rel=1e-8)
    if law is sliding:
        assert resultant[0] == pytest.approx(-0.15 * force, rel=1e-8)


def test_friction_of_a_symmetric_block_cancels():
    system = equilibrium_of("hexahedron")
    force = press(system, static)
    resultant, _ = forces_on_contact(system, static)
    assert abs(resultant[0]) < 1e-8 * force
    assert resultant[1] < -1e-3 * force  # of half of the block: towards its middle
    held = system.rubber.symmetry
    assert not system.rubber.displacements[held, 1].any()


def test_plate_stays_parallel_to_the_ice_and_its_displacement_is_that_of_its_nodes():
    system = equilibrium_of("hexahedron")
    press(system, sliding)
    plate = system.rubber.displacements[system.rubber.plate]
    assert not plate[:, :2].any()
    np.testing.assert_allclose(plate[:, 2], -system.plate_displacement(), rtol=1e-12)
    assert 0.02 * SIZE < system.plate_displacement() < 0.08 * SIZE


def test_five_bar():
    system = equilibrium_of("quadrilateral")
    force = press(system, static, 5 * BAR)
    resultant, touching = forces_on_contact(system, static)
    assert resultant[-1] == pytest.approx(force, rel=1e-8)
    assert touching > 1.02 * SIZE  # the bulging sides rolled onto the ice
    assert 0.12 * SIZE < system.plate_displacement() < 0.18 * SIZE


def bent(system):
    """Bend the rubber of `system`, with plate and symmetry plane held; its plate's force, N."""
    rubber = system.rubber
    bend(rubber, 0.03)
    rubber.displacements[rubber.plate] = 0.0
    rubber.displacements[rubber.symmetry, 1] = 0.0
    return 0.5 * BAR * SIZE ** (rubber.mesh.geometry.dim - 1)


@pytest.mark.parametrize("cells", CELLS)
def test_newton_direction_solves_the_linearised_bordered_system(cells):
    """Factors that are not symmetric hold all of the contact, and leave rounding only."""
    system = optional(cells, {"pc_type": "lu"} if N[cells] == 3 else {})
    equations = system.under(bent(system), static)
    equations.residual()
    equations.linearise()
    assert left_by(equations.change(), equations) < 1e-5


@pytest.mark.parametrize("cells", CELLS)
def test_kept_factors_give_the_change_of_the_present_contact(cells):
    system = equilibrium_of(cells)
    force = press(system, sliding, 0.4 * BAR)
    before = system.under(force, sliding)
    before.residual()
    before.linearise()
    equations = system.under(force, static)
    equations.residual()
    assert left_by(equations.change(), equations) < 0.03


def test_loads_are_answered_line_by_line_at_once():
    system = equilibrium_of("hexahedron")
    system.rubber.displacements[:, -1] -= 0.1 * BAR / PENALTY
    equations = system.under(1.0, sliding)
    equations.residual()
    equations.linearise()
    bordered = system.tangent
    load = np.random.default_rng(1).random(bordered.nodes.n_loads)
    load[:-1][bordered.nodes.fixed] = 0.0
    parts = bordered.nodes.parts(load)
    assert len(parts) == contact_nodes.PARTS
    np.testing.assert_allclose(parts @ parts.T, np.eye(len(parts)), atol=1e-12)
    np.testing.assert_allclose((parts @ load) @ parts, load, atol=1e-12)
    on_plate = np.zeros_like(load)  # a load on the plate alone has no entry
    on_plate[-1] = 1.0
    loads = np.vstack([parts, on_plate])
    alone = []
    for one in loads:
        bordered.load_vector.array[:] = 0.0
        bordered.load_vector.array[bordered.nodes.own] = bordered.nodes.on_own(one)
        alone.append(bordered.solved(one[-1]))
    answers = bordered.response(loads)
    np.testing.assert_allclose(answers, alone, atol=1e-9 * np.abs(answers).max())
    size = np.abs(alone[:1]).max(initial=0.0)
    np.testing.assert_allclose(bordered.response(loads[:1]), alone[:1], atol=1e-9 * size)


@pytest.mark.parametrize(("cells", "n"), [("quadrilateral", 16), ("hexahedron", 4)])
def test_what_lacks_evenly_counts_however_many_nodes_share_it(cells, n):
    """Their forces alone would count less than this already here, and ever less."""
    rubber = HyperelasticBody(a_block(cells, n), all_of(B))
    surface = contact_surface(rubber.space, rubber.facets("contact"), 4)
    system = Equilibrium(rubber, surface, PENALTY)
    force = press(system, sliding)
    missing = 0.01 * 0.15 * force
    equations = system.under(force, lambda p, u: sliding(p, u, 1.01 * 0.15))
    size = equations.residual()
    squares = float((equations.parts()[0] ** 2).sum())
    nodal = np.sqrt(MPI.COMM_WORLD.allreduce(squares, op=MPI.SUM))
    assert nodal < contact_nodes.RESULTANT * missing < size < missing


@pytest.mark.parametrize(("options", "stale"), [(MULTIGRID, True), ({}, False)])
def test_factors_that_cost_less_than_a_change_takes_are_made_anew(options, stale):
    """A preconditioner costs one solve, and factors cost forty."""
    system = optional("quadrilateral", options)
    force = press(system, sliding)
    equations = system.under(force, sliding)
    equations.residual()
    equations.linearise()
    for law in (sliding, static):  # the factors' own contact, and another
        other = system.under(force, law)
        other.residual()
        other.change()
    assert system.tangent.stale == stale
    equations.linearise()
    assert not system.tangent.stale


def test_too_large_a_load_is_refused_and_the_caller_can_restore():
    system = equilibrium_of("quadrilateral")
    force = press(system, static)
    before, displacement = system.rubber.u.x.array.copy(), system.plate_displacement()
    with pytest.raises(NotConverged):
        system.solve(300 * force, static, 1e-9 * force)
    system.rubber.u.x.array[:] = before
    system.forget()
    solution = system.solve(force, static, 1e-8 * force)
    assert solution.iterations == 0
    assert system.plate_displacement() == displacement


def test_a_solver_that_petsc_does_not_know_is_one_sentence():
    sentence = "PETSc does not take the options -rubber_...: .*nonsense"
    with options_of_rubber({"pc_type": "nonsense"}), pytest.raises(SceneError, match=sentence):
        equilibrium_of("quadrilateral")


@pytest.mark.parametrize("cells", ["tetrahedron", "hexahedron"])
def test_factors_get_more_room_where_theirs_is_too_small(cells):
    enough, tight = equilibrium_of(cells), equilibrium_of(cells)
    press(enough, sliding)
    factors, less = tight.tangent.ksp.getPC().getFactorMatrix, -80  # than MUMPS's own estimate
    factors().setMumpsIcntl(14, less)
    press(tight, sliding)
    assert factors().getMumpsIcntl(14) > 100
    assert tight.plate_displacement() == pytest.approx(enough.plate_displacement(), rel=1e-9)


@pytest.mark.parametrize("cells", ["tetrahedron", "hexahedron"])
def test_symmetric_factors_give_newton_the_direction_of_all_of_the_tangent(cells):
    system = equilibrium_of(cells)
    force = press(system, sliding, 0.4 * BAR)
    equations = system.under(1.2 * force, sliding)
    equations.residual()
    equations.linearise()
    assert left_by(equations.change(), equations) < 1e-3


@pytest.mark.parametrize(
    "options",
    [{"pc_factor_mat_solver_type": "mumps"}, {"pc_factor_shift_type": "nonzero"}],
)
def test_the_slice_s_own_factors_take_blocks_unless_options_do_not(options):
    """Pivots cannot be shifted in blocks: PETSc gave up."""
    systems = [optional("quadrilateral", each, MPI.COMM_SELF) for each in (options, {})]
    for system in systems:
        press(system, sliding)
    kinds = [system.tangent.ksp.getOperators()[0].getType() for system in systems]
    assert kinds == ["seqaij", "seqbaij"]
    one, other = (system.plate_displacement() for system in systems)
    assert one == pytest.approx(other, rel=1e-9)


def test_multigrid_knows_the_rigid_motions_and_finds_the_same_equilibrium():
    direct, iterative = equilibrium_of("hexahedron"), optional("hexahedron", MULTIGRID)
    for system in (direct, iterative):
        press(system, sliding)
    ksp = iterative.tangent.ksp
    matrix, _ = ksp.getOperators()
    modes = matrix.getNearNullSpace().getVecs()
    assert ksp.getPC().getType() == "gamg"
    assert len(modes) == 6
    np.testing.assert_allclose([[a.dot(b) for a in modes] for b in modes], np.eye(6), atol=1e-12)
    assert iterative.plate_displacement() == pytest.approx(direct.plate_displacement(), rel=1e-6)


class Misled:
    """Equations of a block whose changes are made wrong by `change`, once or always."""

    def __init__(self, equations, change):
        self.equations, self.wrong = equations, change

    def __getattr__(self, name):
        return getattr(self.equations, name)

    def change(self):
        return self.wrong(self.equations.change())


@pytest.mark.parametrize("size", [0.0, np.nan, np.inf])
def test_a_tangent_without_a_direction_is_not_converged(size):
    system = equilibrium_of("quadrilateral")
    force = press(system, static)
    equations = Misled(system.under(1.1 * force, static), lambda change: np.full_like(change, size))
    with pytest.raises(NotConverged, match="singular"):
        Newton(equations, 1e-8 * force, LAG, kept=False).solve(1.1 * force)


def test_a_block_that_does_not_touch_the_ice_is_not_converged():
    system = equilibrium_of("quadrilateral")
    force = press(system, static)
    system.rubber.displacements[:] = [0.0, 1e-4]
    with pytest.raises(NotConverged):
        system.solve(force, static, 1e-8 * force)


def test_a_kept_tangent_that_tears_the_rubber_is_made_anew():
    system = equilibrium_of("quadrilateral")
    force = press(system, sliding)
    system.solve(force, static, 1e-8 * force)  # another shear, and its tangent is kept
    factors = iter([1e4])
    equations = Misled(system.under(force, sliding), lambda change: next(factors, 1.0) * change)
    solve = Newton(equations, 1e-8 * force, LAG, kept=True)
    solve.solve(force)
    assert solve.jacobians >= 1
    assert system.plate_displacement() * 1e6 == pytest.approx(PRESSED[0][1], rel=1e-6)


@pytest.mark.parametrize("cells, micrometres", PRESSED)
def test_plate_displacement_is_the_same_in_every_dolfinx_version(cells, micrometres):
    system = equilibrium_of(cells)
    press(system, sliding)
    assert system.plate_displacement() * 1e6 == pytest.approx(micrometres, rel=1e-7)


@pytest.mark.parametrize("cells", CELLS)
def test_ranks_do_not_change_the_result(cells):
    together, alone = equilibrium_of(cells), equilibrium_of(cells, MPI.COMM_SELF)
    for law in (static, sliding):
        press(together, law)
        press(alone, law)
        assert together.plate_displacement() == pytest.approx(alone.plate_displacement(), rel=1e-7)
        (one, area_one), (other, area_other) = (
            forces_on_contact(system, law) for system in (together, alone)
        )
        assert area_one == pytest.approx(area_other, rel=1e-6)
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-8 * abs(one).max())
        rubber = together.rubber
        found = dict(zip(keys(alone.rubber), alone.rubber.displacements, strict=True))
        expected = np.array([found[key] for key in keys(rubber)])
        size = together.plate_displacement()
        np.testing.assert_allclose(rubber.displacements, expected, atol=1e-6 * size)


def keys(rubber):
    """Undeformed positions of the nodes as integers, to find a node again."""
    X = rubber.space.tabulate_dof_coordinates()
    return [tuple(row) for row in np.round(X / SIZE * 1e6).astype(int)]


@pytest.mark.parametrize("shear", [0.27, 0.35, 0.4])
def test_a_point_may_rest_where_its_shear_is_faded_in(shear):
    """Full changes go from touching firmly to lifted and back; the equilibrium is in between."""
    system = equilibrium_of("quadrilateral")
    force, steepest, steps = press(system, lambda p, u: sliding(p, u, 0.1)), shear / 0.02, 10

    def faded(pressure, displacement, share):
        fading = np.clip(pressure / (0.02 * BAR), 0.0, 1.0)
        slope = np.where((fading > 0.0) & (fading < 1.0), steepest, 0.0)
        stress = share * shear * BAR * fading
        return sliding_friction(stress, share * slope, displacement.shape[-1])

    for step in range(1, steps + 1):
        law = lambda p, u, share=step / steps: faded(p, u, share)  # noqa: E731
        found = system.solve(force, law, 1e-7 * force)
        assert found.iterations <= 16  # 8 to 12 in single steps; without landing none is found
        assert found.residual <= 1e-7 * force
