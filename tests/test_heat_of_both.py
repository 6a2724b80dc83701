"""Heat on meshes of ice and rubber together, and ice whose properties follow its temperature."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from blocks import a_block  # noqa: E402
from slides import slide, started, thesis  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.fenics.compat import MPI, fem  # noqa: E402
from iceslide_fem.heat.elements import (  # noqa: E402
    LayeredElements,
    QuadraticElements,
    product,  # noqa: E402
)
from iceslide_fem.heat.equation import (  # noqa: E402
    HeatEquation,
    LinearSolver,
    of_regions,  # noqa: E402
)
from iceslide_fem.heat.tabulated import TabulatedHeat, integral  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.ice import tagged_ice  # noqa: E402
from iceslide_fem.mesh.ice_body import upright  # noqa: E402
from iceslide_fem.runtime.curve import Curve  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene.materials import ICE, Layer, rubber_solid  # noqa: E402

pytestmark = pytest.mark.fe
WORLD = MPI.COMM_WORLD
MESHES = "ice.heat=mesh", "rubber.heat=mesh"
CONDUCTIVITY = ((253.15, 2.42), (273.15, 2.22))  # W/(m K), rows as a scene has them
HEAT_CAPACITY = ((253.15, 1950.0), (263.15, 2040.0), (273.15, 2110.0))  # J/(kg K)


def total(equation, own):
    """Sum over the ranks."""
    return float(equation.comm.allreduce(float(own.sum()), op=MPI.SUM))


@pytest.mark.mpi
@pytest.mark.parametrize("cells", ["quadrilateral", "tetrahedron"])
def test_a_uniform_source_warms_a_body_of_any_cells_alike(cells):
    block, solid = a_block(cells, 3), rubber_solid(1100.0)
    equation = HeatEquation(
        block, QuadraticElements(block.mesh), of_regions(block, {"rubber": solid})
    )
    power = equation.elements.load(fem.Constant(block.mesh, 1e9))
    rise = equation.warmed(power, 1e-3)
    size = 1e-3**block.mesh.geometry.dim
    heat = solid.density * solid.heat_capacity
    assert (equation.capacity > 0.0).all()
    assert total(equation, equation.capacity) == pytest.approx(heat * size, rel=1e-12)
    np.testing.assert_allclose(rise, 1e9 * 1e-3 / heat, rtol=1e-12)


def test_a_held_plate_keeps_rubber_at_a_linear_temperature():
    block, solid = a_block("hexahedron", 3), rubber_solid(1100.0)
    elements = QuadraticElements(block.mesh)
    equation = HeatEquation(block, elements, of_regions(block, {"rubber": solid}), ("plate", 2.0))
    steady = 2.0 * equation.x[:, 2] / 1e-3  # of rubber that is held at 0 below
    flow = product(equation.conduction, np.where(equation.held, 0.0, steady)) + equation.drawn
    inside = ~equation.held & (equation.x[:, 2] > 1e-9)
    below = equation.x[:, 2] < 1e-9
    np.testing.assert_allclose(flow[inside], 0.0, atol=1e-12)
    assert flow[below].sum() == pytest.approx(-solid.conductivity * 2.0 / 1e-3 * 1e-6, rel=1e-9)


STAYS = ("load.duration=1.5ms", "ice.temperature=271.15K")
PASSES = (
    "load.duration=0.3ms", "ice.temperature=271.15K", "ice.motion=sliding", "film.carrier=rubber",
)  # fmt: skip


@pytest.mark.parametrize("motion", [STAYS, PASSES], ids=["attached", "passing"])
def test_both_ledgers_close_and_rubber_takes_what_columns_take(motion):
    run = *motion, "numerics.tolerance=1e-2"
    meshed = started(thesis(*MESHES, *run))
    ledger = Ledger(meshed)
    for accepted in meshed.steps():
        ledger.add(accepted)
    ice, heat_state, scale = meshed.frame.ice, meshed.current.interface.ice, meshed.block.scale
    energies = ledger
    if motion is STAYS:  # else some has left with the ice
        assert scale * ice.heat(heat_state) == pytest.approx(energies.ice_heat, rel=1e-9)
        assert energies.latent_heat > 0.0
    assert scale * ice.rubber_heat(heat_state) == pytest.approx(energies.rubber_heat, rel=1e-9)
    columns = slide(thesis("ice.heat=mesh", "rubber.heat=true", *run))
    assert energies.rubber_heat == pytest.approx(columns["rubber_heat_J"][-1], rel=0.06)
    assert energies.ice_heat == pytest.approx(columns["ice_heat_J"][-1], rel=0.01)


@pytest.mark.mpi
@pytest.mark.parametrize("motion", [STAYS, PASSES], ids=["attached", "passing"])
def test_the_same_friction_and_heat_of_both_on_any_number_of_ranks(motion):
    short = "load.duration=0.1ms", "numerics.tolerance=1e-2", "ice.temperature=-1degC"
    scene = thesis(*MESHES, *motion, *short)
    together, alone = slide(scene, WORLD), slide(scene, MPI.COMM_SELF)
    for name in ("mu", "rubber_heat_J", "ice_heat_J"):
        curves = [np.interp(0.9e-4, rows["time_s"], rows[name]) for rows in (together, alone)]
        assert curves[0] == pytest.approx(curves[1], rel=1e-4)


def test_a_plate_that_is_held_takes_heat_that_an_insulated_one_keeps():
    thin = "rubber.height=20um", "rubber.length=0.4mm", "load.duration=3ms"
    heats = []
    for plate in ("insulated", "held"):
        rows = slide(thesis(*MESHES, *thin, f"rubber.plate={plate}", "numerics.tolerance=1e-2"))
        heats.append(rows["rubber_heat_J"][-1])
    assert heats[1] > 1.02 * heats[0]


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["ice.heat=column"], 'rubber.heat = "mesh" and ice.heat = "column" contradict'),
        (["ice.heat=mesh", "ice.motion=sliding"], 'film.carrier = "ice" contradict'),
        (["ice.heat=mesh", "friction.law=coulomb", "friction.mu=0.2"], "friction.law"),
        (["ice.heat=mesh", f"ice.conductivity={[list(row) for row in CONDUCTIVITY]}"], "rows of"),
    ],
)
def test_what_the_rubbers_mesh_cannot_be_with_is_refused(changes, sentence):
    with pytest.raises(SceneError, match=sentence):
        thesis("rubber.heat=mesh", *changes)


# --- properties over temperature


def tabulated(lines, base=None):
    """Ice with the rows above, at 263.15 K at first."""
    stack = [Layer("ice", np.inf, ICE)]
    body = gmsh_model.distribute(upright(tagged_ice(lines, stack)), WORLD)
    rows = Curve.of(CONDUCTIVITY), Curve.of(HEAT_CAPACITY)
    solids = {"ice": ICE._replace(conductivity=2.32, heat_capacity=2040.0)}
    return TabulatedHeat(body, LayeredElements(body.mesh), solids, 263.15, rows, base)


def test_integrals_of_rows_are_exact():
    rows, kelvin = Curve.of(HEAT_CAPACITY), np.linspace(245.0, 280.0, 36)
    ends = [np.linspace(253.15, end, 100_001) for end in kelvin]
    found = [np.trapezoid(rows(x), x) if hasattr(np, "trapezoid") else np.trapz(rows(x), x)
             for x in ends]  # fmt: skip
    np.testing.assert_allclose(integral(rows, kelvin), found, atol=1e-6)


def test_a_content_is_the_enthalpy_of_its_rise():
    lines = [np.linspace(0.0, 1e-3, 4), np.linspace(-1e-3, 0.0, 7)]
    equation = tabulated(lines)
    rise = 12.0 * np.sin(3e3 * equation.x[:, 0]) - 3.0
    heat_state = equation.heat_state(rise)
    kelvin = 263.15 + rise
    enthalpy = [np.polyval([4.5, 2040.0, 0.0], x) if x < 0 else None for x in (kelvin - 263.15)]
    colder = np.array([one is not None for one in enthalpy]) & (kelvin > 253.15)
    expected = np.array([one for one, some in zip(enthalpy, colder, strict=True) if some])
    np.testing.assert_allclose(heat_state[colder] * 2040.0, expected, rtol=1e-12)
    np.testing.assert_allclose(equation.rise(heat_state), rise, atol=1e-10)


def test_a_steady_layer_whose_conductivity_falls_meets_its_integral():
    lines = [np.linspace(0.0, 1e-3, 3), np.linspace(-1e-3, 0.0, 9)]
    equation = tabulated(lines, base=("base", 0.0))
    flux, rise = 2e4, np.zeros(len(equation.x))
    top = np.abs(equation.x[:, 1]) < 1e-12
    weights = np.where((equation.x[:, 0] > 1e-9) & (equation.x[:, 0] < 1e-3 - 1e-9), 2.0, 1.0)
    load = np.where(top, flux * 1e-3 * weights / 4.0, 0.0)
    solver = LinearSolver(equation.comm, 1e-12)
    for _ in range(60):
        matrix, drawn = equation.conducting(rise)
        system, diagonal = matrix.copy(), matrix.getDiagonal()
        diagonal.array[equation.held] += 1.0
        system.setDiagonal(diagonal)
        rise = rise + solver.solve(system, load - drawn - product(matrix, rise))
    warm = float(rise[top].mean())
    # int lambda dT = lambda_0 T + 0.5 slope T^2 = q d
    assert 2.32 * warm - 0.5 * 0.01 * warm**2 == pytest.approx(flux * 1e-3, rel=2e-4)


def test_ice_keeps_all_heat_that_it_is_given_whatever_its_capacity():
    rows = [f"ice.{key}={[list(row) for row in table]}" for key, table in
            (("conductivity", CONDUCTIVITY), ("heat_capacity", HEAT_CAPACITY))]  # fmt: skip
    sliding = started(
        thesis("ice.heat=mesh", "load.duration=2.2ms", "numerics.tolerance=1e-2", *rows)
    )
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    found = sliding.block.scale * sliding.frame.ice.heat(sliding.current.interface.ice)
    assert ledger.latent_heat > 0.0
    assert found == pytest.approx(ledger.ice_heat, rel=1e-9)


def test_constant_rows_are_a_number():
    rows = 'ice.conductivity=[["-20 degC","2.25 W/m/K"],["0 degC","2.25 W/m/K"]]'
    short = "ice.heat=mesh", "load.duration=0.5ms", "numerics.tolerance=1e-2"
    one, other = slide(thesis(*short)), slide(thesis(*short, rows))
    np.testing.assert_allclose(one["mu"], other["mu"], rtol=1e-7)
