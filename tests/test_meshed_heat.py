"""Heat on a mesh: closed forms, manufactured solutions, conservation, bounds, whole slides."""

from pathlib import Path

import meshio
import numpy as np
import pytest
from program import rows_of, run

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from slides import slide, started  # noqa: E402

from iceslide_fem.cli import main  # noqa: E402
from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl  # noqa: E402
from iceslide_fem.film.law import FilmStage  # noqa: E402
from iceslide_fem.film.runge_kutta import INTEGRATORS  # noqa: E402
from iceslide_fem.heat.elements import LayeredElements, QuadraticElements  # noqa: E402
from iceslide_fem.heat.equation import (  # noqa: E402
    HeatEquation,
    LinearSolver,  # noqa: E402
    of_regions,
)
from iceslide_fem.interface.ice_mesh import MeshedIce, Settings  # noqa: E402
from iceslide_fem.interface.passing_mesh import PassingMeshedIce  # noqa: E402
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.ice import tagged_ice  # noqa: E402
from iceslide_fem.mesh.ice_body import upright  # noqa: E402
from iceslide_fem.postprocess.results import field_files  # noqa: E402
from iceslide_fem.reference import (  # noqa: E402
    constant_flux_rise,
    held_layer_rise,
    layered_rise,
)
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.runtime.units import ZERO_CELSIUS  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.scene.materials import ICE, Layer, Solid  # noqa: E402
from iceslide_fem.scene.thermal_layers import stacked_layers  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]
CASES = Path(__file__).parent.parent / "cases"
WORLD = MPI.COMM_WORLD
T_0, DURATION, FLUX = 269.15, 7e-3, 1e5
LENGTH = 1e-3  # m, of bodies along each axis of their surface
STEEL = Solid(50.0, 7800.0, 460.0)
HALF_SPACE = (Layer("ice", np.inf, ICE),)


# --- the equation


def surface_of(dim, cells=3):
    """Lines of x (and y) on a surface of some cells."""
    return [np.linspace(0.0, LENGTH, cells + 1)] * (dim - 1)


def half_space(solid, duration):
    """Thickness of the elements of a half-space, downwards."""
    return stacked_layers([Layer("body", np.inf, solid)], duration).thickness


def downwards(thickness):
    """Lines of z between elements of that thickness from the surface on."""
    return -np.append(0.0, np.cumsum(thickness))[::-1]


def equation_of(lines, stack, elements=LayeredElements, base=None):
    """The heat equation of a `stack` on these grid lines, shared out among all ranks."""
    body = gmsh_model.distribute(upright(tagged_ice(lines, stack)), WORLD)
    solids = {layer.name: layer.solid for layer in stack}
    return HeatEquation(body, elements(body.mesh), of_regions(body, solids), base)


class GivenFlux:
    """A film that gives that flux (n,), W/m2, whatever the temperature."""

    dt = 0.0

    def __init__(self, flux):
        self.flux, self.log_height = flux, np.zeros_like(flux)

    def solve(self, ice, near=None):
        zero, never = np.zeros_like(self.flux), np.zeros(self.flux.shape, dtype=bool)
        return FilmStage(
            zero, zero, self.flux, self.flux, zero, ice.offset, never, never, zero, zero, zero
        )


def under_points(equation):
    """Ice below points in the middle of a grid of 6 (by 6) on its surface; whom they belong to is
    not whose ice they lie on.
    """
    middles = LENGTH * (np.arange(6) + 0.5) / 6
    across = np.meshgrid(*[middles] * (equation.x.shape[1] - 1))
    points = np.stack([axis.ravel() for axis in across], axis=1)
    area = np.full(len(points), LENGTH ** points.shape[1] / len(points))
    mine = slice(WORLD.size - 1 - WORLD.rank, None, WORLD.size)
    ice = MeshedIce(equation, Settings(ICE, T_0, interface_resistance=1e-9, agreement=1e-8))
    return ice.under(Contacts(ice.place(points[mine]), area[mine])), len(points[mine])


def march(ice, heat_state, times, flux, points, method="sdirk3"):
    """Content at the last of `times` by steps between them, under flux(t), W/m2."""
    integrator = INTEGRATORS[method]
    diagonal = integrator.diagonal
    for start, dt in zip(times, np.diff(times), strict=False):
        changes = []
        for row, node in zip(integrator.rows, integrator.nodes, strict=True):
            parts = zip(row, changes, strict=True)
            begin = heat_state + sum(weight / diagonal * change for weight, change in parts)
            film = GivenFlux(np.full(points, flux(start + node * dt)))
            new, _ = ice.stage(begin, diagonal * dt, film)
            changes.append(new - begin)
        heat_state = new
    return heat_state


def rises_under_flux(equation, times, steps=24):
    """Surface rise (K) of all points at the `times` (s) under a constant flux."""
    ice, points = under_points(equation)
    heat_state, since, rises = ice.initial(points), 0.0, []
    for until in times:
        graded = until * np.linspace(0.0, 1.0, steps + 1) ** 4
        passed = np.append(since, graded[graded > since])
        heat_state = march(ice, heat_state, passed, lambda time: FLUX, points)
        rises.append(np.concatenate(WORLD.allgather(ice.surface_temperature(heat_state) - T_0)))
        since = until
    return np.array(rises)


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_a_half_space_under_constant_flux(dim):
    times = np.array([0.7e-3, DURATION])
    lines = [*surface_of(dim), downwards(half_space(ICE, DURATION))]
    rises = rises_under_flux(equation_of(lines, HALF_SPACE), times)
    exact = constant_flux_rise(FLUX, times)[:, None]
    np.testing.assert_allclose(rises, np.broadcast_to(exact, rises.shape), rtol=3e-4)


@pytest.mark.mpi
def test_ice_on_a_half_space_of_steel_under_constant_flux():
    times, depth = np.array([0.7e-3, DURATION]), 30e-6
    stack = (Layer("ice", depth, ICE), Layer("steel", np.inf, STEEL))
    lines = [*surface_of(2), downwards(stacked_layers(stack, DURATION).thickness)]
    rises = rises_under_flux(equation_of(lines, stack), times)
    exact = layered_rise(FLUX, times, depth, STEEL)[:, None]
    assert exact[1, 0] < 0.9 * constant_flux_rise(FLUX, DURATION)  # steel is felt
    np.testing.assert_allclose(rises, np.broadcast_to(exact, rises.shape), rtol=3e-4)


@pytest.mark.mpi
@pytest.mark.parametrize("base", [0.0, -6.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_a_layer_on_a_held_base_comes_to_rest(dim, base):
    depth = 0.5e-3
    lines = [*surface_of(dim), np.linspace(-depth, 0.0, 6)]
    stack = (Layer("ice", depth, ICE),)
    ice, points = under_points(equation_of(lines, stack, base=("base", base)))
    heat_state = march(ice, ice.initial(points), [0.0, 1e4, 1e8], lambda t: FLUX / 10, points)
    rise = ice.surface_temperature(heat_state) - T_0 - base
    np.testing.assert_allclose(rise, held_layer_rise(FLUX / 10, depth), rtol=1e-6)


def test_ice_that_passes_below_a_band_of_heat():
    """dT_max = 2 q sqrt(L / (pi v)) / e at the trailing edge, at high Peclet numbers."""
    band, speed, cell = 1e-3, 3.0, 1e-5
    line = np.arange(-0.2e-3, 1.2e-3 + 0.5 * cell, cell)
    depths = half_space(ICE, line.size * cell / speed)
    body = gmsh_model.distribute(
        upright(tagged_ice([line, downwards(depths)], HALF_SPACE)), MPI.COMM_SELF
    )
    equation = HeatEquation(body, LayeredElements(body.mesh), of_regions(body, {"ice": ICE}))
    grid = SurfaceGrid.shared([line], MPI.COMM_SELF)
    ice = PassingMeshedIce(
        equation, grid, Settings(ICE, T_0, interface_resistance=1e-9, agreement=1e-8)
    )
    heated = (line > 0.0) & (line < band + 0.5 * cell)
    contacts = Contacts(grid.own_nodes(), grid.cell_area)
    heat_state, parts = ice.initial(0), 4
    for _ in range(line.size):
        for _ in range(parts):  # of the time in which a cell passes
            film = GivenFlux(FLUX * heated)
            heat_state, _ = ice.under(contacts).stage(heat_state, cell / speed / parts, film)
        heat_state = ice.shifted(heat_state, 1, ice.initial(0))
    rise = ice.profile(heat_state).kelvin[0] - T_0
    expected = 2.0 * FLUX * np.sqrt(band / (np.pi * speed)) / ICE.effusivity
    assert expected == pytest.approx(0.963, rel=1e-3)
    assert rise.max() == pytest.approx(expected, rel=0.01)
    assert rise[heated].mean() == pytest.approx(2.0 / 3.0 * expected, rel=0.015)
    np.testing.assert_allclose(rise[line > band + 5 * cell], 0.0, atol=1e-3)


def test_bodies_pressed_together_meet_at_the_temperature_that_effusivities_weigh():
    above, below = (half_space(one, DURATION) for one in (ICE, STEEL))
    depth = float(above.sum())
    stack = (Layer("ice", depth, ICE), Layer("steel", np.inf, STEEL))
    lines = [*surface_of(2), downwards(np.append(above[::-1], below))]
    equation = equation_of(lines, stack)
    ice, points = under_points(equation)
    z, warmer = equation.x[:, -1] + depth, 10.0
    meeting = np.abs(z) < 1e-9
    shared = warmer * STEEL.effusivity / (ICE.effusivity + STEEL.effusivity)
    heat_state = np.where(z < 0.0, warmer, 0.0)
    heat_state[meeting] = shared
    heat = ice.heat(heat_state)
    for since, until in ((0.0, 0.1 * DURATION), (0.1 * DURATION, DURATION)):
        times = since + (until - since) * np.linspace(0.0, 1.0, 25) ** 3
        heat_state = march(ice, heat_state, times, lambda t: 0.0, points)
        np.testing.assert_allclose(heat_state[meeting], shared, rtol=5e-4)
    assert ice.heat(heat_state) == pytest.approx(heat, rel=1e-12)


# --- manufactured solutions


def wave(x, across, deep, cos):
    """cos along every axis with that many half waves across and downwards."""
    value = cos(deep * np.pi * x[-1] / LENGTH)
    for axis in x[:-1]:
        value = value * cos(across * np.pi * axis / LENGTH)
    return value


def error_of_a_stage(lines, elements, across, deep, warp=0.0):
    """L2 error relative to the solution of one implicit stage of a wave that dies away."""
    tagged = upright(tagged_ice(lines, HALF_SPACE))
    bent = np.prod(np.sin(2.0 * np.pi * tagged.points / LENGTH), axis=1, keepdims=True)
    body = gmsh_model.distribute(tagged._replace(points=tagged.points + warp * bent), WORLD)
    equation = HeatEquation(body, elements(body.mesh), of_regions(body, {"ice": ICE}))
    dim = equation.x.shape[1]
    rate = ICE.diffusivity * (np.pi / LENGTH) ** 2 * ((dim - 1) * across**2 + deep**2)
    dt = 1.0 / rate
    start = (1.0 + dt * rate) * wave(equation.x.T, across, deep, np.cos)
    system = equation.conduction.copy()
    diagonal = system.createVecRight()
    diagonal.array[:] = equation.capacity / dt
    system.setDiagonal(system.getDiagonal() + diagonal)
    solver, found = LinearSolver(WORLD, 1e-14), np.zeros_like(start)
    for _ in range(4):  # each takes a part of what is off
        there = system.createVecLeft()
        there.array[:] = found
        off = equation.capacity / dt * start - (system * there).array
        found = found + solver.solve(system, off)
    x = ufl.SpatialCoordinate(body.mesh)
    exact = wave([x[i] for i in range(dim)], across, deep, ufl.cos)
    dx = ufl.Measure("dx", domain=body.mesh, metadata={"quadrature_degree": 8})
    off = equation.elements.values(found) - exact
    squares = [
        compat.assemble_scalar(compat.form(part**2 * dx), WORLD)
        for part in (off, fem.Constant(body.mesh, 1.0) * exact)
    ]
    return float(np.sqrt(squares[0] / squares[1]))


def slopes(errors):
    """By which power of the size of cells that are halved the errors fall."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def grid(dim, across, down):
    return [*surface_of(dim, across), np.linspace(-LENGTH, 0.0, down + 1)]


SIZES = {2: (4, 8, 16), 3: (3, 6, 12)}


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_layered_elements_are_of_second_order_along_the_surface(dim):
    errors = [error_of_a_stage(grid(dim, n, n), LayeredElements, 1, 1) for n in SIZES[dim]]
    np.testing.assert_allclose(slopes(errors), 2.0, atol=0.15)


@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_layered_elements_are_of_third_order_downwards(dim):
    errors = [error_of_a_stage(grid(dim, 2, n), LayeredElements, 0, 2) for n in (4, 8, 16)]
    assert (slopes(errors) > 2.85).all(), slopes(errors)


@pytest.mark.mpi
@pytest.mark.parametrize("warp", [0.0, 0.04e-3])
@pytest.mark.parametrize("dim", [2, 3])
def test_quadratic_elements_are_of_third_order(dim, warp):
    errors = [error_of_a_stage(grid(dim, n, n), QuadraticElements, 1, 1, warp) for n in SIZES[dim]]
    assert (slopes(errors) > 2.75).all(), slopes(errors)


@pytest.mark.parametrize(("method", "order"), [("sdirk2", 2), ("sdirk3", 3)])
def test_steps_have_the_order_of_their_integrator(method, order):
    lines = [*surface_of(2, 1), np.linspace(-0.1e-3, 0.0, 4)]
    equation = equation_of(lines, HALF_SPACE)
    ice, points = under_points(equation)

    def surface(steps, name):
        times = np.linspace(0.0, DURATION, steps + 1)
        heat_state = march(ice, ice.initial(points), times, pulse, points, name)
        return float(ice.surface_temperature(heat_state)[0])

    def pulse(time):
        return FLUX * np.sin(np.pi * time / (1.4 * DURATION)) ** 4

    exact = surface(320, "sdirk3")
    found = slopes([abs(surface(steps, method) - exact) for steps in (10, 20, 40)])
    assert found[-1] > order - 0.15, found


# --- whole slides

WARM = "ice.temperature=-1degC"
SHEAR = "load.speed=4m/s"
COARSE = "numerics.refinement=0.5", "numerics.tolerance=1e-2"
PASSING = (
    "model=slice",
    "film.carrier=ice",
    "rubber.length=4mm",
    "rubber.height=3mm",
    SHEAR,
    "load.duration=1.5ms",
)


def thesis(name, *changes, heat="mesh"):
    return load_scene(CASES / f"{name}.toml", [*changes, f"ice.heat={heat}"])


SLIDES = {
    "slice": ("thesis_1bar", "model=slice", "load.duration=2.2ms", "numerics.tolerance=1e-2"),
    "block": ("thesis_1bar", *COARSE, WARM, "load.duration=0.5ms"),
}


@pytest.mark.parametrize("model", SLIDES)
def test_heat_of_a_slide_is_in_the_ice_within_its_temperatures(model):
    """Also while some of its surface melts. The ledger counts the whole block."""
    scene = thesis(*SLIDES[model])
    sliding = started(scene)
    ledger, ice = Ledger(sliding), sliding.frame.ice
    whole = 2.0 if model == "block" else scene.rubber.width
    initial, melting = scene.ice.temperature, scene.ice.melting_temperature
    melts, points, nodes, coldest = False, -np.inf, -np.inf, np.inf
    for accepted in sliding.steps():
        ledger.add(accepted)
        state, loads = sliding.current.interface, sliding.current.loads
        assert whole * ice.heat(state.ice) == pytest.approx(ledger.ice_heat, rel=1e-9)
        melts |= any(one.step.last.melting.any() for one in accepted.subcycles.substeps)
        touching = sliding.frame.ice_temperature(state, loads)[loads.pressure > 0.0]
        points, nodes = max(points, touching.max()), max(nodes, initial + state.ice.max())
        coldest = min(coldest, initial + state.ice.min())
    assert melts
    assert melting - 1e-3 < points < melting + 1e-3
    # Nodes beyond the last point that melts go on with the slope of the surface below it.
    assert nodes < melting + 0.02
    # In steps far too short for the first layer quadratic elements cool what is below it a little.
    assert coldest > initial - 1e-4 * (melting - initial)


def differences(scenes, comm):
    """Largest relative difference of mu(t) in two slides, each on its communicator."""
    rows = [slide(scene, one) for scene, one in zip(scenes, comm, strict=True)]
    times = np.linspace(0.0, scenes[0].load.duration, 200)
    one, other = (np.interp(times, each["time_s"], each["mu"]) for each in rows)
    return np.abs(one / other - 1.0).max()


@pytest.mark.parametrize(
    ("case", "changes", "most"),
    [
        ("thesis_1bar", ("model=slice", "load.duration=3.5ms"), 2.5e-3),
        ("thesis_sliding_5bar", PASSING, 3e-3),
    ],
    ids=["attached", "passing"],
)
def test_friction_is_that_on_continuum_ice(case, changes, most):
    scenes = [thesis(case, *changes, heat=heat) for heat in ("mesh", "continuum")]
    assert differences(scenes, [MPI.COMM_SELF] * 2) < most


RANKS = {
    "attached": ("thesis_1bar", "model=slice", *COARSE, WARM, "load.duration=1ms"),
    "passing": (
        "thesis_sliding_5bar",
        *PASSING,
        *COARSE,
        WARM,
        "rubber.length=1mm",
        "rubber.height=1mm",
        "load.duration=0.2ms",
    ),
    "block": ("thesis_1bar", *COARSE, "numerics.refinement=0.35", WARM, "load.duration=0.05ms"),
}


@pytest.mark.mpi
@pytest.mark.parametrize("name", RANKS)
def test_friction_is_the_same_on_any_number_of_ranks(name):
    scene = thesis(*RANKS[name])
    # A block's equilibria differ more than its heat does: by 3e-4 above columns, too.
    most = 1e-3 if name == "block" else 1e-4
    assert differences([scene, scene], [WORLD, MPI.COMM_SELF]) < most


# --- what a run writes


def test_fields_and_probes_have_the_temperature_of_the_ice(tmp_path):
    place = (0.1e-3, 0.0, -5e-6)
    scene = thesis(*RANKS["attached"], f"output.probes.deep={list(place)}")
    run(scene, tmp_path)
    *_, (time, path) = field_files(tmp_path, "ice")
    assert time == scene.load.duration
    ice = meshio.read(path)
    x, z, _ = np.round(ice.points.T, 12)
    celsius = ice.point_data["temperature (degC)"]
    initial = scene.ice.temperature - ZERO_CELSIUS
    assert initial - 1e-5 <= celsius.min() and -0.01 < celsius.max() <= 1e-3
    lines = [np.unique(axis) for axis in (x, z)]
    assert z.max() == 0.0 and z.min() < -4.0 * np.sqrt(ICE.diffusivity * time)
    assert x.min() == pytest.approx(-0.5e-3, rel=0.06) == -x.max()
    assert len(ice.points) == lines[0].size * lines[1].size
    assert ice.cells_dict["quad"].size == 4 * (lines[0].size - 1) * (lines[1].size - 1)
    order = np.lexsort([z, x])
    values = celsius[order].reshape(lines[0].size, lines[1].size)
    *_, last = rows_of(tmp_path / "probes.csv")
    assert float(last["time_s"]) == time
    below = [np.interp(place[-1], lines[1], column) for column in values]
    expected = np.interp(place[0], lines[0], below)
    assert initial + 0.1 < expected < -0.05
    assert float(last["temperature_C"]) == pytest.approx(expected, abs=5e-3)


STEEL_LAYER = """
[[ice.layers]]
name = "steel"
conductivity = "50 W/m/K"
density = "7800 kg/m^3"
heat_capacity = "460 J/kg/K"
"""
ON_STEEL = """
name = "on_steel"
model = "slice"
[rubber]
compound = "B"
[load]
pressure = "1 bar"
speed = "3 m/s"
duration = "0.2 ms"
[ice]
heat = "mesh"
base = "held"
"""
FITTED = "{}[numerics]\ntolerance = 1e-2\nrefinement = 0.5\n"


def test_a_run_on_the_example_of_an_own_mesh(tmp_path):
    mesh = CASES.parent / "meshes" / "ice_on_steel.msh"
    text = ON_STEEL + f'mesh = "{mesh}"\n' + FITTED.format(STEEL_LAYER)
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(SystemExit, match="0"):
        main(["run", str(tmp_path / "scene.toml"), "--out", str(tmp_path / "out")])
    *_, (_, path) = field_files(tmp_path / "out", "ice")
    points = meshio.read(path).points
    given = meshio.read(mesh).points[:, :2]
    assert {*map(tuple, np.round(1e9 * given))} <= {*map(tuple, np.round(1e9 * points[:, :2]))}


def test_thin_ice_on_steel_that_is_held_colder(tmp_path):
    """Cold comes up from the base: heat is drawn, and the surface is less warm than without."""
    layer = STEEL_LAYER + 'thickness = "0.1 mm"\n'
    ground = 'depth = "20 um"\n'
    (tmp_path / "scene.toml").write_text(ON_STEEL + ground + FITTED.format(layer))
    scenes = [
        load_scene(tmp_path / "scene.toml", [f"ice.base_temperature={celsius}degC"])
        for celsius in (-4, -9)
    ]
    slides = [started(scene) for scene in scenes]
    surfaces = []
    for sliding in slides:
        for _ in sliding.steps():
            pass
        current = sliding.current
        surfaces.append(sliding.frame.ice_temperature(current.interface, current.loads).mean())
        equation, heat_state = sliding.frame.ice.equation, current.interface.ice
        assert heat_state.min() == pytest.approx(equation.base_rise, abs=1e-6)
        assert (heat_state[equation.held] == equation.base_rise).all() and equation.held.any()
    assert surfaces[1] < surfaces[0] - 0.1


def test_a_preconditioner_that_petsc_does_not_know_is_refused_before_anything_is_written(tmp_path):
    options = PETSc.Options()
    options["heat_pc_type"] = "nonsense"
    sentence = "PETSc does not take the options -heat_...: .*nonsense"
    try:
        with pytest.raises(SceneError, match=sentence):
            run(thesis("thesis_1bar", "model=slice"), tmp_path / "out")
    finally:
        del options["heat_pc_type"]
    assert not list((tmp_path / "out").glob("[!.]*"))
