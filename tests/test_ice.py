"""Continuum ice: conservation, closed forms, convergence; on any number of ranks."""

import functools
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

pytest.importorskip("dolfinx")
from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.fenics.compat import MPI, ufl  # noqa: E402
from iceslide_fem.film.ice_heat import Column  # noqa: E402
from iceslide_fem.film.integrators import InterfaceState, advance  # noqa: E402
from iceslide_fem.film.law import FilmStage, Surface, implicit_stage  # noqa: E402
from iceslide_fem.film.loads import FilmLoads, FilmOnIce  # noqa: E402
from iceslide_fem.film.runge_kutta import INTEGRATORS  # noqa: E402
from iceslide_fem.interface import build  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads  # noqa: E402
from iceslide_fem.interface.ice_columns import GridColumnsUnderPoints  # noqa: E402
from iceslide_fem.interface.ice_continuum import Continuum  # noqa: E402
from iceslide_fem.interface.ice_modes import (
    StageSurface,  # noqa: E402
    SurfaceModes,  # noqa: E402
)
from iceslide_fem.interface.ice_surface import IceSurface  # noqa: E402
from iceslide_fem.interface.on_rubber import Attached, Rubbing  # noqa: E402
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid  # noqa: E402
from iceslide_fem.laws.film import FilmLaw  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.ice import patch_lines, tagged_ice  # noqa: E402
from iceslide_fem.reference import constant_flux_rise, flux_after_onset  # noqa: E402
from iceslide_fem.runtime.errors import NotConverged  # noqa: E402
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.materials import (
    ICE,
    ICE_DENSITY,
    ICE_DIFFUSIVITY,
    ICE_HEAT_CAPACITY,
    MELTING_TEMPERATURE,
    Layer,
)

pytestmark = [pytest.mark.fe, pytest.mark.mpi]

DURATION, T_0 = 1e-3, 269.15
INTERFACE_RESISTANCE, AGREEMENT = 1e-5, 1e-6  # of points and ice, and of both (K)
EVERYWHERE = MPI.COMM_WORLD
SDIRK2 = INTEGRATORS["sdirk2"]


def a_scene(model, refinement=1.0):
    return SimpleNamespace(
        name="ice",
        model=model,
        rubber=SimpleNamespace(
            length=1e-3,
            width=1e-3,
            height=1e-3,
            mesh=None,
            step=None,
            is_drawn=False,
            layers=(),
            heights=(),
            heat=False,
            outline=None,
            cuts=(),
            grooves=(),
            edge_radius=0.0,
            chamfer=0.0,
            draft_angle=0.0,
        ),
        load=SimpleNamespace(duration=DURATION),
        ice=SimpleNamespace(margin=0.0, motion="attached", solid=ICE),
        numerics=SimpleNamespace(refinement=refinement, tolerance=1e-3),
    )


def gauss_points(line):
    """Two Gauss points in each cell of the grid `line`, and their weights."""
    half, middle = np.diff(line) / 2, (line[1:] + line[:-1]) / 2
    points = middle[:, None] + half[:, None] * np.array([-1.0, 1.0]) / np.sqrt(3.0)
    return points.ravel(), np.repeat(half, 2)


def some_ice(model, refinement=1.0, interface_resistance=INTERFACE_RESISTANCE, agreement=AGREEMENT):
    """Ice below Gauss points of its own surface cells, shared out among the ranks."""
    lines = patch_lines(a_scene(model, refinement))
    points, area = gauss_points(lines[0])
    points = points[:, None]
    if model == "block":
        y, width = gauss_points(lines[1])
        points = np.array(np.meshgrid(points[:, 0], y)).reshape(2, -1).T
        area = np.outer(width, area).ravel()
    mine = slice(EVERYWHERE.rank, None, EVERYWHERE.size)
    points, area = points[mine], area[mine]
    ice = Continuum(lines, EVERYWHERE, Column(T_0, DURATION), interface_resistance, agreement)
    return ice.under(Contacts(ice.grid.place(points), area)), points, area


def given_flux(flux):
    """A film that gives `flux` (n,) as long as the surface does not melt."""

    class GivenFlux:
        def solve(self, surface: Surface, near=None) -> FilmStage:
            dry = surface.offset + surface.resistance * flux
            melting = dry > MELTING_TEMPERATURE
            ice_flux = np.where(melting, surface.melted_flux, flux)
            slope, zero = melting.astype(float), np.zeros_like(flux)
            rest = flux - ice_flux
            return FilmStage(
                zero, zero, flux, ice_flux, rest, dry, melting, melting, zero, slope, zero
            )

    return GivenFlux()


def total(values):
    return EVERYWHERE.allreduce(float(np.sum(values)), op=MPI.SUM)


def march(ice, flux, steps, duration=DURATION):
    """Implicit Euler steps that grow with time; the content and the last stage."""
    times = duration * np.linspace(0.0, 1.0, steps + 1) ** 2
    heat_state = ice.initial(flux.size)
    for dt in np.diff(times):
        heat_state, stage = ice.stage(heat_state, float(dt), given_flux(flux))
    return heat_state, stage


@pytest.mark.parametrize("model", ["slice", "block"])
def test_heat_that_leaves_the_points_is_the_heat_in_the_ice(model):
    ice, points, area = some_ice(model)
    flux = 1e5 * (1.0 + np.sin(3e3 * points[:, 0]))
    heat_state, _ = ice.stage(ice.initial(flux.size), 1e-4, given_flux(flux))
    given = 1e-4 * total(area * flux)
    assert ice.heat(heat_state) == pytest.approx(given, rel=1e-9)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_heat_is_conserved_while_part_of_the_surface_melts(model):
    ice, points, area = some_ice(model)
    flux = 6e5 * (1.0 + 0.8 * np.sin(3e3 * points[:, 0]))
    heat_state, given = ice.initial(flux.size), 0.0
    melting = []
    for _ in range(8):
        heat_state, stage = ice.stage(heat_state, 5e-5, given_flux(flux))
        given += 5e-5 * total(area * stage.ice_flux)
        melting.append(total(stage.melting) / total(np.ones_like(flux)))
    assert 0.2 < melting[-1] < 0.9
    assert ice.heat(heat_state) == pytest.approx(given, rel=1e-8)
    hottest = ice.surface_temperature(heat_state).max(initial=0.0)
    assert hottest < MELTING_TEMPERATURE + 1e-3
    assert total(stage.ice_flux > flux * (1 + 1e-9)) == 0


def test_under_a_uniform_flux_it_warms_as_its_column_does():
    ice, _, area = some_ice("block")
    column = Column(T_0, DURATION)
    flux = np.full(area.shape, 1e5)
    heat_state, _ = march(ice, flux, steps=400)
    alone, _ = march(column, np.full(1, 1e5), steps=400)
    rise = ice.surface_temperature(heat_state) - T_0
    expected = float(column.surface_temperature(alone)[0]) - T_0
    np.testing.assert_allclose(rise, expected, rtol=1e-9)
    np.testing.assert_allclose(rise, constant_flux_rise(1e5, DURATION), rtol=2e-3)
    kelvin = ice.profile(heat_state).kelvin
    np.testing.assert_allclose(
        kelvin - T_0, np.tile(column.rise(alone), kelvin.shape[1]), atol=1e-9
    )


def test_flux_after_melt_onset_follows_the_closed_form():
    ice, _, area = some_ice("slice", 2.0)
    q = 2.0 * 4.0 / constant_flux_rise(1.0, DURATION)  # melts at a quarter of the run
    flux = np.full(area.shape, q)
    _, stage = march(ice, flux, steps=800)
    expected = flux_after_onset(q, 0.25 * DURATION, DURATION)
    worst = np.abs(stage.ice_flux / expected - 1.0).max(initial=0.0)
    assert EVERYWHERE.allreduce(worst, op=MPI.MAX) < 4e-3


def test_a_decaying_wave_has_the_orders_of_mesh_and_integrator():
    """T - T_0 = cos(k x) exp(-alpha k^2 t) at all depths, with insulated sides."""
    errors = []
    for refinement, steps in ((1.0, 8), (2.0, 16), (4.0, 32)):
        ice, _, area = some_ice("slice", refinement)
        x, k = ice.grid.lines[0], 2.0 * np.pi / 1e-3
        wave = np.tile(np.cos(k * (x + 0.5e-3)), (ice.profile(ice.initial(0)).depths.size, 1))
        start = ice.restored({"rise": wave[:, ice.grid.own]})
        state = InterfaceState(np.zeros(area.size), np.zeros(area.size), start)
        cold = FilmLoads(*np.zeros((3, area.size)), np.ones(area.size))
        for _ in range(steps):
            dt = 5e-3 / steps
            state = advance(state, cold, cold, dt, ice, INTEGRATORS["sdirk3"]).state
        left = np.exp(-ICE_DIFFUSIVITY * k**2 * 5e-3)
        errors.append(np.abs((ice.profile(state.ice).kelvin - T_0) / left - wave).max())
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[0] < 0.02 and (slopes > 1.8).all(), (errors, slopes)


def test_content_of_the_whole_patch_is_capacity_times_rise():
    ice, _, _ = some_ice("slice")
    depths = ice.profile(ice.initial(0)).depths
    warm = ice.restored({"rise": np.ones((depths.size, ice.grid.own.size))})
    heat = ICE_DENSITY * ICE_HEAT_CAPACITY * 1e-3 * depths[-1]
    assert ice.heat(warm) == pytest.approx(heat, rel=1e-12)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_modes_diagonalise_the_matrices_that_dolfinx_assembles(model):
    """Capacity and conduction of quadratic elements whose values are linear along x and y, lumped
    there, from Kronecker sums as from the forms.
    """
    surface, comm = patch_lines(a_scene(model, 0.4)), MPI.COMM_SELF
    column = Column(T_0, DURATION, first_layer=0.3, ratio=2.5)
    ice = Continuum(surface, comm, column, INTERFACE_RESISTANCE, AGREEMENT)
    z = -column.depths[::-1]
    mesh = gmsh_model.distribute(
        tagged_ice([*surface, z[::2]], [Layer("ice", np.inf, ICE)]), comm
    ).mesh
    space = compat.scalar_space(mesh, 2)
    trial, test = ufl.TrialFunction(space), ufl.TestFunction(space)
    dim, lines = mesh.geometry.dim, [*surface, z]
    shape = tuple(line.size for line in lines)
    quadratic = np.ones((space.dofmap.index_map.size_global, 1))
    for line, x in zip(lines, space.tabulate_dof_coordinates().T, strict=False):
        hats = np.array([np.interp(x, line, one) for one in np.eye(line.size)]).T
        quadratic = (quadratic[:, :, None] * hats[:, None]).reshape(len(x), -1)

    def assembled(integrand, lumped_axes):
        """Matrix of the grid's nodes whose entries have moved along the lumped axes."""
        form = compat.form(integrand * ufl.dx)
        matrix = compat.assemble_matrix(compat.create_matrix(form), form)
        dense = csr_matrix(matrix.getValuesCSR()[::-1]).toarray()
        dense = (quadratic.T @ dense @ quadratic).reshape(*shape, *shape)
        for axis in lumped_axes:
            rows = dense.sum(axis=dim + axis, keepdims=True)
            dense = rows * np.expand_dims(
                np.eye(shape[axis]),
                [other for other in range(2 * dim) if other not in (axis, dim + axis)],
            )
        return dense.reshape(quadratic.shape[1], -1)

    lateral, solid = list(range(dim - 1)), column.solid
    capacity = solid.density * solid.heat_capacity * assembled(trial * test, lateral)
    conduction = solid.conductivity * sum(
        assembled(trial.dx(axis) * test.dx(axis), [other for other in lateral if other != axis])
        for axis in range(dim)
    )
    n = ice.grid.n_nodes
    along = ice.modes.values(np.eye(n).reshape(n, *ice.grid.shape)).reshape(n, n)
    vectors = np.kron(along, column.modes[::-1].T)
    unit, rates = vectors @ capacity @ vectors.T, vectors @ conduction @ vectors.T
    np.testing.assert_allclose(unit, np.eye(len(unit)), atol=1e-9)
    expected = np.moveaxis(ice.rates, 0, -1).ravel()
    np.testing.assert_allclose(rates, np.diag(expected), atol=1e-9 * expected.max())


class Counted:
    """The film of a given flux, and how often it was asked."""

    def __init__(self, flux):
        self.film, self.times = given_flux(flux), 0

    def solve(self, surface, near=None):
        self.times += 1
        return self.film.solve(surface)


@pytest.mark.parametrize("melts", [False, True])
def test_a_film_is_asked_no_more_than_its_ice_needs(melts):
    """Once where nothing depends on the temperature, twice where points melt and freeze."""
    ice, points, _ = some_ice("slice")
    flux = (6e5 if melts else 1e5) * (1.0 + 0.8 * np.sin(3e3 * points[:, 0]))
    film = Counted(flux)
    heat_state, stage = ice.stage(ice.initial(0), 1e-4, film)
    assert film.times == (2 if melts else 1)
    assert stage.melting.any() == melts
    below = ice.surface_temperature(heat_state)
    given = np.minimum(flux, (MELTING_TEMPERATURE - below) / ice.interface_resistance)
    np.testing.assert_allclose(stage.ice_flux, given, atol=1e-2 * flux.max())
    dry = below + ice.interface_resistance * flux
    np.testing.assert_allclose(stage.dry_temperature, dry, atol=1e-6)


class Steeper:
    """A film whose heat falls with the temperature three times as fast as it says."""

    def solve(self, surface, near=None):
        zero, slope = np.zeros_like(surface.offset), np.full_like(surface.offset, 0.1)
        flux = 3.0 * slope * (T_0 + 1.0 - surface.offset) / surface.resistance
        never = np.zeros(flux.shape, dtype=bool)
        return FilmStage(zero, zero, flux, flux, zero, zero, never, never, zero, slope, zero)


def test_half_changes_find_what_full_ones_step_over():
    ice, points, _ = some_ice("slice")
    heat_state, _ = ice.stage(ice.initial(0), 1e-4, Steeper())
    np.testing.assert_allclose(ice.surface_temperature(heat_state), T_0 + 1.0, atol=1e-2)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_points_that_do_not_rub_are_left_out_and_nothing_else_changes(model):
    """Against all points in every step, while contact leaves the middle of the patch."""
    ice, points, area = some_ice(model, 0.5)
    friction = FilmLaw(ConstantContact(4.0, 2e-5, 1e-6), None, 1e4)
    at = ice.grid.place(points)
    middle, inside = np.abs(points[:, 0]).max(initial=0.0), np.abs(points[:, 0])
    some, fewer = (np.where(inside < share * middle, 2e5, 0.0) for share in (0.7, 0.3))
    start, end = (
        ContactLoads(points, pressure, area, np.full(len(area), 3.0), 0.0)
        for pressure in (some, fewer)
    )
    lifted = (start.pressure == 0.0) & (end.pressure == 0.0)
    assert 0.1 < total(lifted) / total(np.ones(len(area))) < 0.9
    states, records = [], []
    for kind in (Attached, Rubbing):
        carrier = kind(friction, ice, at)
        state = carrier.start(1e-7, len(area))
        for loads in (start, end, end):
            state = (record := carrier.advance(state, start, loads, 2e-4, SDIRK2)).state
        states.append(state)
        records.append(record)
    whole, part = records
    assert part.area.size == np.sum(~lifted) and total(part.step.last.melting) > 0.0
    np.testing.assert_array_equal(part.state.log_height[lifted], np.log(1e-7))
    for one, other in zip(*states, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6 * np.abs(one).max(initial=0.0))
    for heat in ("ice_heat", "latent_heat", "squeezed"):
        expected, found = (total(record.area * getattr(record.step, heat)) for record in records)
        assert found == pytest.approx(expected, rel=1e-6) and found > 0.0
    np.testing.assert_array_equal(whole.step.last.melting, part.of_all(part.step.last.melting))


def uneven_film(points, dt):
    """Films whose friction is uneven, on ice some of which they melt."""
    n = len(points)
    viscous = 0.02 * (1.0 + 0.8 * np.sin(3e3 * points[:, 0]))
    loads = FilmLoads(viscous, np.full(n, 3.0), np.full(n, 1e16), np.full(n, 1e-6))
    return FilmOnIce(implicit_stage, np.full(n, np.log(1e-7)), np.zeros(n), dt, loads)


def taken(modes, resistance, rise):
    """What conducting ice takes (W) where its surface is by `rise` (K) above the offset: the lines'
    matrices one for all nodes.
    """
    inverse = functools.reduce(np.kron, [line.inverse for line in modes.lines])
    return (inverse.T @ (inverse @ rise.ravel() / resistance.ravel())).reshape(rise.shape)


@pytest.mark.parametrize("conducts", [True, False])
@pytest.mark.parametrize("shape", [(7,), (6, 2), (6, 5)])
def test_what_is_balanced_is_what_ice_takes(shape, conducts):
    """Points of all ranks, on grids and ice made at random; some have two kinks nearby, and some
    ranks few points.
    """
    rng = np.random.default_rng(7)
    lines = [np.cumsum(rng.uniform(0.5, 1.5, n)) * 1e-4 for n in shape]
    grid = SurfaceGrid.shared(lines, EVERYWHERE)
    modes = SurfaceModes(lines) if conducts else None
    n, each = 90, slice(EVERYWHERE.rank * 17, EVERYWHERE.rank * 17 + 17)
    mine = slice(each.start, n) if EVERYWHERE.rank == EVERYWHERE.size - 1 else each
    where = np.column_stack([rng.uniform(line[0], line[-1], n) for line in lines])
    area = rng.uniform(0.5, 1.5, n) * 1e-9
    area[::7] = 0.0  # these do not touch
    at = grid.place(where[mine])
    surface = IceSurface(grid, ICE, modes).under(Contacts(at, area[mine]))
    resistance = rng.uniform(1.0, 2.0, shape) * 1e-5
    stage = StageSurface(rng.uniform(269.0, 272.0, shape), resistance)
    heat, fall, other, other_fall = rng.uniform(0.0, 3.0, (4, n)) * area * 1e5
    fluxes = np.column_stack([heat, fall, heat + 0.3 * other, 4.0 * other_fall])
    shared = surface.points.of_all(fluxes[mine])
    assert shared.shape == (n, 4)
    before = stage.offset + rng.uniform(0.0, 1.0, shape)
    inside = surface.inside(stage)
    found = surface.balanced(inside, shared, before, 1e-8)
    assert found.depends and not found.converged and 1 <= found.changes < 12
    rise = grid.interpolate((found.temperature - before).ravel(), at)
    one, two = (fluxes[mine, k] - fluxes[mine, k + 1] * rise for k in (0, 2))
    given = grid.scatter(np.minimum(one, two), at).reshape(shape)
    np.testing.assert_allclose(found.given, given, rtol=1e-9, atol=1e-9 * given.max())
    assert 0.0 < total((two < one)[area[mine] > 0.0]) < total(area[mine] > 0.0)
    warm = found.temperature - stage.offset
    per_area = grid.cell_area.reshape(shape) / resistance
    takes = taken(modes, resistance, warm) if conducts else per_area * warm
    np.testing.assert_allclose(takes, given, rtol=1e-4, atol=1e-6 * given.max())
    there = np.column_stack([one, fluxes[mine, 1], two, fluxes[mine, 3]])
    kinked = two < one  # the line that is lower where they are asked comes first
    there[kinked] = there[kinked][:, [2, 3, 0, 1]]
    shared = surface.points.of_all(there)
    again = surface.balanced(inside, shared, found.temperature, 1e-6)
    assert again.converged and again.changes == 0
    with pytest.raises(NotConverged):
        surface.balanced(inside, np.nan * shared, before, 1e-8)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-4, 2e-5, 1e-5, 1e-6])
def test_stages_settle_with_the_link_and_agreement_of_a_tolerance(tolerance):
    """Also where a stiff link lets rounding grow: the agreement does not ask for more."""
    ice, points, _ = some_ice(
        "slice", 0.5, build.INTERFACE_RESISTANCE * tolerance, build.agreement(tolerance)
    )
    heat_state = ice.initial(0)
    for _ in range(3):
        heat_state, stage = ice.stage(heat_state, 1e-4, uneven_film(points, 1e-4))
    assert stage.melting.any() and not stage.melting.all()


class Given:
    """A film that gives its ice `power` (W/m2), unless that melts it."""

    def __init__(self, power):
        self.power = power

    def solve(self, ice, near=None):
        melts = ice.melted_flux < self.power
        flux = np.minimum(self.power, ice.melted_flux)
        nothing = np.zeros_like(flux)
        return FilmStage(
            nothing, nothing, flux, flux, nothing, nothing, melts, melts, nothing, melts * 1.0, flux
        )


def test_points_that_melt_and_freeze_in_turn_settle():
    # Newton's method alone goes round in a circle: one point makes its neighbours melt no longer
    nodes = np.array([0.0, 1.03, 1.13])
    points = np.array([1.06, 0.979, 1.1, 1.05, 0.621])[:, None]
    area, power = [0.035, 15.9, 12.2, 11.7, 0.908], np.array([0.248, 0.38, 0.0799, 3.27, 0.166])
    grid = SurfaceGrid([nodes], np.arange(3), MPI.COMM_SELF)
    columns = GridColumnsUnderPoints(grid, MELTING_TEMPERATURE - 1.0, 1e-3)
    dt = 1e-4
    resistance = float(columns.resistance(dt)[0])
    ice = columns.under(Contacts(grid.place(points), np.array(area)))
    heat_state, stage = ice.stage(ice.initial(5), dt, Given(power / resistance))
    assert stage.melting.any() and not stage.melting.all()
    given = float(np.array(area) @ stage.ice_flux) * dt
    assert ice.heat(heat_state) @ grid.cell_area == pytest.approx(given, rel=1e-9)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_ice_for_a_longer_run_goes_on_below(model):
    lines = patch_lines(a_scene(model, 0.5))
    short, long = (
        Continuum(
            lines,
            EVERYWHERE,
            Column(T_0, np.array([DURATION, duration])),
            INTERFACE_RESISTANCE,
            AGREEMENT,
        )
        for duration in (DURATION, 4.0 * DURATION)
    )
    depths = [ice.profile(ice.initial(0)).depths for ice in (short, long)]
    n = depths[0].size
    rise = np.sin(np.arange(1.0, n * short.grid.n_nodes + 1.0)).reshape(n, -1)
    heat_state = short.restored({"rise": rise[:, short.grid.own]})
    before, after = (
        ice.profile(one).kelvin
        for ice, one in ((short, heat_state), (long, long.restored(short.saved(heat_state))))
    )
    np.testing.assert_allclose(before - T_0, rise, atol=1e-11)
    np.testing.assert_allclose(after[:n], before, rtol=1e-13)
    assert np.abs(after[n:] - T_0).max() < 1e-11 and len(after) > n
    np.testing.assert_allclose(depths[1][:n], depths[0], rtol=1e-12)
    assert depths[1][-1] > 1.9 * depths[0][-1]
