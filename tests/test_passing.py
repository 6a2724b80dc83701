"""Ice that passes under the block: band source, transit time, conservation, window, ranks."""

import copy
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from slides import CASES, refusal, slide, started  # noqa: E402
from test_ice import given_flux  # noqa: E402

from iceslide_fem.coupling.coupled_step import CoupledStep
from iceslide_fem.coupling.drainage import Undrained  # noqa: E402
from iceslide_fem.coupling.plate import Plate  # noqa: E402
from iceslide_fem.coupling.relaxing import Elastic  # noqa: E402
from iceslide_fem.coupling.step_error import StepError  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.ice_heat import Column  # noqa: E402
from iceslide_fem.film.point import Conditions, simulate  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads, Travel  # noqa: E402
from iceslide_fem.interface.ice_columns import GridColumns, GridColumnsUnderPoints  # noqa: E402
from iceslide_fem.interface.ice_continuum import Continuum  # noqa: E402
from iceslide_fem.interface.on_ice import OnIce  # noqa: E402
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid  # noqa: E402
from iceslide_fem.interface.window import reaches  # noqa: E402
from iceslide_fem.laws.film import FilmLaw  # noqa: E402
from iceslide_fem.mesh.ice import WINDOW_BESIDE, window_lines  # noqa: E402
from iceslide_fem.reference import band_source_rise  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.runtime.errors import NotConverged  # noqa: E402
from iceslide_fem.scene import load_scene, scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import CONTACT_TABLES  # noqa: E402

pytestmark = pytest.mark.fe
T_0 = 269.15


def passing(**changes):
    """A long, stiff, thin block without transverse strain: almost even pressure."""
    scene = {
        "name": "passing",
        "model": "slice",
        "rubber": {
            "C10": 166.2e6,
            "C01": 106.8e6,
            "D1": 0.0055e-6,
            "length": "20 mm",
            "height": "0.5 mm",
        },
        "load": {"pressure": "2 bar", "speed": "5 m/s", "duration": "6 ms"},
        "ice": {"motion": "sliding", "heat": "column"},
        "film": {"k": 0.32, "D": "36 um", "H_V": "0.5 um"},
        "numerics": {"tolerance": 1e-2},
    }
    for key, value in changes.items():
        table, name = key.split("__")
        scene[table][name] = value
    return scene_from_dict(scene)


def a_window(kind, length, speed, comm=MPI.COMM_SELF):
    scene = passing(rubber__length=length, load__duration=1.5 * length / speed)
    lines = window_lines(scene, [(-length / 2, length / 2)])
    if kind == "continuum":
        return Continuum(
            lines,
            comm,
            Column(T_0, 1.5 * length / speed),
            interface_resistance=1e-5,
            agreement=1e-6,
        )
    return GridColumns(SurfaceGrid.shared(lines, comm), T_0, 1.5 * length / speed)


@pytest.mark.parametrize("kind", ["column", "continuum"])
@pytest.mark.parametrize(("length", "speed"), [(1e-3, 3.0), (20e-3, 4.0)])
def test_band_source(kind, length, speed):
    """Peclet numbers of 2700 and 72,000: closed form at the trailing edge, nothing ahead."""
    ice, q = a_window(kind, length, speed), 1e5
    grid = ice.grid
    cell = float(grid.lines[0][1] - grid.lines[0][0])
    n = 1000
    points = ((np.arange(n) + 0.5) / n - 0.5)[:, None] * length
    heat_state, dt = ice.initial(n), cell / speed
    below_nodes = ice.under(Contacts(grid.own_nodes(), grid.cell_area[grid.own]))
    coldest = 0.0
    for _ in range(int(1.3 * length / cell)):
        middle = points + np.array([0.5 * cell])
        flux = grid.scatter(np.full(n, q * length / n), grid.place(middle)) / grid.cell_area
        heat_state, _ = below_nodes.stage(heat_state, dt, given_flux(flux[grid.own]))
        coldest = min(coldest, float(np.min(below_nodes.surface_temperature(heat_state) - T_0)))
        heat_state = ice.shifted(heat_state, 1, ice.initial(n))
    rise = grid.allgather(below_nodes.surface_temperature(heat_state) - T_0)
    below = grid.interpolate(rise, grid.place(points))
    expected = band_source_rise(q, length, speed)
    assert below.max() == pytest.approx(expected, rel=0.01)
    assert below.mean() == pytest.approx(2.0 / 3.0 * expected, rel=0.01)
    assert coldest > -1e-3 * expected
    ahead = grid.lines[0] > 0.5 * length + cell
    assert np.abs(rise[ahead]).max() < 1e-3 * expected


@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_transit_time_equivalence(heat):
    """A long block in steady sliding is the attached sample at t = x / v, melted and saturated."""
    scene = passing(
        ice__heat=heat, ice__cell="0.05 mm", rubber__height="0.1 mm", numerics__penalty=2e12
    )
    sliding, friction = started(scene), []
    while sliding.current.time < scene.load.duration:
        state = sliding.advance().state
        force = sliding.shear(state.interface, state.loads) @ state.loads.area
        friction.append((state.time, force / (state.loads.pressure @ state.loads.area)))
    side, state = sliding.current.loads, sliding.current.interface
    shear = sliding.shear(sliding.current.interface, sliding.current.loads)
    times = np.linspace(0.0, 4e-3, 401)
    conditions = Conditions.of(
        pressure=2e5,
        speed=5.0,
        temperature=T_0,
        k=0.32,
        D=36e-6,
        H_V=0.5e-6,
        initial_height=70e-9,
        duration=4e-3,
    )
    point = simulate(conditions, "column", tolerance=1e-5, times=times)
    mu = shear @ side.area / (side.pressure @ side.area)
    assert mu == pytest.approx(float(point.mu_mean[0]), rel=1e-3)
    assert np.isfinite(point.saturation[0]) and np.isfinite(point.melt_onset[0])
    height = sliding.frame.film_height(state, side)
    age = (side.positions[:, 0].max() - side.positions[:, 0]) / 5.0
    expected = 0.32 * 1.8e-3 * 5.0 / (2e5 * point.samples[:, 0])
    inside = (age > 0.1e-3) & (age < 3.9e-3) & (side.pressure > 0)
    error = np.abs(height / np.interp(age, times, expected) - 1.0)[inside]
    assert error.mean() < 0.001
    assert error.max() < 0.01
    # The point level says the same of the whole slide: the contact begins on fresh ice.
    alone = scene.model_copy(update={"model": "point"})
    rows, results = point_history(alone)
    time, mu = np.array(friction).T
    found = np.interp(time, [row.time_s for row in rows], [row.mu for row in rows])
    late = time > 0.1e-3
    np.testing.assert_allclose(mu[late], found[late], rtol=0.01)
    assert results["mu_end"] == pytest.approx(float(point.mu_mean[0]), rel=1e-3)


@pytest.mark.parametrize("carrier", ["ice", "rubber"])
@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_energy_ledger_closes_while_the_window_moves(heat, carrier):
    scene = passing(
        ice__heat=heat, film__carrier=carrier, rubber__length="2 mm", load__duration="1 ms"
    )
    rows = slide(scene)
    assert np.abs(rows["energy_imbalance"][-1]) < 1e-5
    assert rows["slip_m"][-1] == pytest.approx(5e-3)


def heat_in(ice, heat_state):
    """Heat above the initial temperature in columns, J/m."""
    return float(ice.heat(heat_state) @ ice.grid.cell_area[ice.grid.own])


def test_heat_given_is_the_heat_in_the_ice_trail_included():
    """Nothing leaves a window with a trail as long as the slide."""
    scene = passing(rubber__length="1 mm", load__duration="0.6 ms", ice__trail=4e-3)
    sliding = started(scene)
    given = 0.0
    while sliding.current.time < scene.load.duration:
        subcycles = sliding.advance().subcycles
        given += sum(float(one.step.ice_heat @ one.area) for one in subcycles.substeps)
    kept = heat_in(sliding.frame.ice, sliding.current.interface.ice)
    assert kept == pytest.approx(given, rel=1e-9)


@pytest.mark.parametrize("kind", ["column", "continuum"])
def test_a_flux_that_is_no_number_is_not_converged(kind):
    ice = a_window(kind, 1e-3, 3.0)
    if kind == "column":
        ice = GridColumnsUnderPoints(ice.grid, T_0, 1e-3)
    at = ice.grid.place(np.linspace(-3e-4, 3e-4, 50)[:, None])
    film = given_flux(np.full(50, np.nan))
    with pytest.raises(NotConverged):
        ice.under(Contacts(at, np.full(50, 1e-5))).stage(ice.initial(50), 1e-6, film)


def heat_states(thing):
    """All that `thing` holds, for a comparison; but for what follows from a stage's dt alone."""
    if isinstance(thing, dict):
        return {name: heat_states(value) for name, value in thing.items() if name != "_stage"}
    if isinstance(thing, (list, tuple)):
        return [heat_states(value) for value in thing]
    if not hasattr(thing, "__dict__"):
        return copy.deepcopy(thing) if isinstance(thing, (np.ndarray, float, int, str)) else None
    return heat_states(vars(thing)) if type(thing).__module__.startswith("iceslide_fem") else None


@pytest.mark.parametrize("heat", ["column", "continuum"])
@pytest.mark.parametrize(
    ("motion", "carrier"), [("attached", "ice"), ("sliding", "ice"), ("sliding", "rubber")]
)
def test_a_trial_step_leaves_no_trace_in_a_model(motion, carrier, heat):
    scene = passing(
        ice__motion=motion, ice__heat=heat, film__carrier=carrier, rubber__heat=True,
        rubber__length="1 mm", ice__cell="50 um", load__duration="0.3 ms",
    )  # fmt: skip
    sliding = started(scene)
    sliding.advance()
    before = heat_states(sliding.frame)
    block, carrier, law = sliding.block, sliding.frame, sliding.motion_law
    laws = law, Elastic(), Undrained(block)
    step = CoupledStep(block, carrier, Plate(block), *laws, StepError(block, 1e-3))
    step.attempt(sliding.current, 1e-6, 1e-6)
    np.testing.assert_equal(heat_states(sliding.frame), before)
    assert before["ice"]


@pytest.mark.parametrize(
    ("carrier", "temperature"), [("rubber", "-0.2 degC"), ("ice", "-0.5 degC")]
)
def test_ice_is_below_all_that_touches_when_the_block_springs_forward(carrier, temperature):
    """Friction falls as warm ice melts: the block straightens by more than ten cells."""
    sliding = started(springing(carrier, temperature))
    grid, farthest = sliding.frame.ice.grid, 0.0
    begin = touched(sliding).max()
    while sliding.current.time < 0.3e-3:
        sliding.advance()
        x = touched(sliding)
        farthest = max(farthest, x.max() - begin)
        assert grid.lines[0][0] <= x.min() and x.max() <= grid.lines[0][-1]
    assert farthest > 10e-6


def test_no_step_is_accepted_that_leaves_the_window_of_ice():
    sliding = started(springing("rubber", "-0.2 degC"))

    def farther(step):
        there = replace(step.after.loads, positions=step.after.loads.positions + 1.0)
        return step._replace(after=step.after._replace(loads=there))

    assert refusal(sliding, farther) == "the block leaves its window of ice"


@pytest.mark.parametrize(("y", "inside"), [(0.2e-3, True), (1.05e-3, False), (-0.05e-3, False)])
def test_a_point_that_bulges_out_of_the_window_sideways_is_seen(y, inside):
    lines = [np.linspace(0.0, 2e-3, 21), np.linspace(0.0, 1e-3, 5)]
    grid = SurfaceGrid(lines, np.arange(105), MPI.COMM_SELF)
    one = np.ones(2)
    points = ContactLoads(np.array([[0.5e-3, 0.5e-3], [1e-3, y]]), one, one, one, 0.5e-3)
    assert reaches(grid, points) == inside
    assert reaches(grid, replace(points, pressure=np.array([1.0, 0.0])))  # what does not touch may


@pytest.mark.parametrize("shape", [(5,), (5, 3)])
def test_a_rank_without_contact_has_its_points_on_the_grid(shape):
    """None: placing them raised ValueError on that rank alone."""
    lines = [np.linspace(0.0, 1e-3, n) for n in shape]
    grid = SurfaceGrid(lines, np.arange(np.prod(shape)), MPI.COMM_SELF)
    nowhere = grid.place(np.zeros((0, len(shape))))
    assert grid.interpolate(np.ones(grid.n_nodes), nowhere).shape == (0,)
    assert not grid.scatter(np.zeros((2, 0)), nowhere).any()


def test_the_window_is_wider_than_the_contact_at_its_start():
    """A cube at 5 bar bulges by 0.05 of its height sideways while it slides."""
    scene = load_scene(CASES / "thesis_sliding_1bar.toml", ["model=block"])
    (_, y), height = window_lines(scene, [(-1e-3, 1e-3), (0.0, 0.6e-3)]), scene.rubber.height
    assert y[0] == 0.0 and y[-1] == pytest.approx(0.6e-3 + WINDOW_BESIDE * height)
    assert np.diff(y).min() > 0.01 * height


def springing(carrier, temperature):
    """A soft cube on ice that melts at once."""
    return scene_from_dict(
        {
            "name": "springing",
            "model": "slice",
            "rubber": {"compound": "B"},
            "load": {"pressure": "1 bar", "speed": "8 m/s", "duration": "0.5 ms"},
            "ice": {"motion": "sliding", "temperature": temperature, "cell": "10 um"},
            "film": {"carrier": carrier},
            "numerics": {"tolerance": 1e-2, "refinement": 0.25},
        }
    )


def touched(sliding):
    """Where the points that touch lie on the window's grid."""
    side = sliding.current.loads
    return side.positions[side.pressure > 0.0, 0] + side.offset


def test_friction_power_is_the_same_on_both_sides():
    """Loads averaged on the nodes and heights read by the points: equal power to rounding."""
    rng = np.random.default_rng(1)
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 30)], np.arange(30), MPI.COMM_SELF)
    ice = GridColumns(grid, T_0, 1e-3)
    friction = FilmLaw(CONTACT_TABLES["B"], None, 1e4)
    carrier = OnIce(friction, ice, 70e-9)
    n = 200
    side = ContactLoads(
        rng.uniform(0, 1e-3, (n, 1)),
        rng.uniform(-1e5, 5e5, n).clip(0.0),
        rng.uniform(1e-6, 2e-6, n),
        rng.uniform(2.0, 4.0, n),
        0.0,
    )
    state = carrier.start(70e-9, n)
    state = state._replace(log_height=state.log_height + rng.uniform(-1, 1, 30))
    height = carrier.film_height(state, side)
    shear, _ = friction.shear(side.pressure, side.speed, height)
    of_points = float((shear * side.speed) @ side.area)
    _, loads = carrier.on_nodes(side)
    area = grid.cell_area
    of_nodes = float((loads.viscous * loads.speed * np.exp(-state.log_height)) @ area)
    assert of_nodes == pytest.approx(of_points, rel=1e-12)


def test_a_shift_moves_whole_cells_and_lets_fresh_ice_in():
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 11)], np.arange(11), MPI.COMM_SELF)
    ice = GridColumns(grid, T_0, 1e-3)
    carrier = OnIce(FilmLaw(CONTACT_TABLES["B"], None, 1e4), ice, 70e-9)
    state = carrier.start(50e-9, 0)
    state = state._replace(
        log_height=state.log_height + np.arange(11.0),
        squeezed_height=np.array([*range(8), 0.0, 0.0, 0.0]),
        ice=state.ice + np.arange(11.0),
    )
    moved, rest, water, _ = carrier.shift_window(state, Travel(2.25e-4, 2.25e-4))
    assert rest == pytest.approx(0.25e-4)
    assert water == pytest.approx((0.5 * 0.0 + 1.0 + 0.5 * 2.0) * 1e-4)  # half cells at the ends
    np.testing.assert_array_equal(moved.squeezed_height, [*range(2, 8), 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(moved.ice[3], [*range(2, 11), 0, 0])
    np.testing.assert_allclose(np.exp(moved.log_height[-2:]), 70e-9)
    assert carrier.shift_window(state, Travel(0.9e-4, 3.15e-4)) == (state, 0.9e-4, 0.0, 0.0)


def test_rubber_carrier_conserves_heat_with_points_that_share_strips():
    rng = np.random.default_rng(2)
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 21)], np.arange(21), MPI.COMM_SELF)
    ice = GridColumnsUnderPoints(grid, T_0, 1e-3)
    area = np.full(150, 0.8e-3 / 150)
    ice = ice.under(Contacts(grid.place(rng.uniform(0.1e-3, 0.9e-3, (150, 1))), area))
    flux = rng.uniform(2e5, 9e5, 150)
    heat_state, given, melted = ice.initial(150), 0.0, 0
    for _ in range(12):
        heat_state, stage = ice.stage(heat_state, 5e-5, given_flux(flux))
        given += 5e-5 * float(area @ stage.ice_flux)
        melted += int(stage.melting.sum())
    assert melted > 100
    assert heat_in(ice, heat_state) == pytest.approx(given, rel=1e-9)
    assert ice.surface_temperature(heat_state).max() < 273.15 + 1e-2


def test_the_cost_does_not_grow_with_the_distance():
    """Steps per millimetre and the size of everything carried along stay the same."""
    counts, sizes = [], []
    for duration in ("1 ms", "4 ms"):
        scene = passing(rubber__length="2 mm", load__duration=duration)
        sliding = started(scene)
        steps = 0
        while sliding.current.time < scene.load.duration:
            sliding.advance()
            steps += 1
        counts.append(steps)
        sizes.append(sliding.current.interface.log_height.size)
    assert 3.2 < counts[1] / counts[0] < 4.4  # longer ones where the block is steady
    assert sizes[0] == sizes[1]


@pytest.mark.mpi
@pytest.mark.parametrize("carrier", ["ice", "rubber"])
def test_the_same_friction_on_any_number_of_ranks(carrier):
    scene = passing(
        film__carrier=carrier, rubber__length="2 mm", load__duration="0.5 ms", ice__cell=4e-5
    )
    together, alone = slide(scene, MPI.COMM_WORLD), slide(scene, MPI.COMM_SELF)
    times = np.linspace(0.0, 0.5e-3, 40)
    curves = [np.interp(times, rows["time_s"], rows["mu"]) for rows in (together, alone)]
    np.testing.assert_allclose(*curves, rtol=1e-3)
