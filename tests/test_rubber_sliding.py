"""Heat in the rubber of a block: ledger, carriers against each other and the point, ranks."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from slides import slide, uniform  # noqa: E402
from test_passing import T_0, passing  # noqa: E402

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.point import Conditions, simulate  # noqa: E402
from iceslide_fem.film.rubber_heat import RubberColumns  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads  # noqa: E402
from iceslide_fem.interface.rubber_mesh import RubberOverGrid  # noqa: E402
from iceslide_fem.interface.surface_grid import SurfaceGrid  # noqa: E402
from iceslide_fem.scene.materials import rubber_solid  # noqa: E402

pytestmark = pytest.mark.fe


def warm(**changes):
    """A short block on fresh ice, with heat in the rubber."""
    return passing(
        **{"rubber__heat": True, "rubber__length": "2 mm", "load__duration": "0.6 ms"} | changes
    )


def test_points_over_nodes_take_the_heat_that_the_nodes_give():
    rng = np.random.default_rng(4)
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 21)], np.arange(21), MPI.COMM_SELF)
    rubber = RubberOverGrid(grid, T_0, 1e-3, rubber_solid(1100.0))
    positions, area = rng.uniform(0.2e-3, 0.8e-3, (100, 1)), rng.uniform(0.0, 1e-5, 100)
    pressure = 1e5 * (rng.uniform(size=100) > 0.3)
    resting = ContactLoads(positions, pressure, area, np.zeros(100), 0.0)
    rubber = rubber.above(resting, resting)
    at, area = grid.place(positions), resting.touching
    flux = rng.uniform(1e4, 9e4, 21) * (grid.scatter(area, at) > 0.0)
    heat_state = rubber.heated(rubber.initial(100), 1e-5, flux)
    kept = float(rubber.column.heat(heat_state) @ area)
    assert kept == pytest.approx(1e-5 * float(flux @ grid.cell_area), rel=1e-12)
    assert (rubber.column.heat(heat_state)[area == 0.0] == 0.0).all()


@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_uniform_pressure_gives_the_point_level(heat):
    scene = uniform(heat)
    rubber = scene.rubber.model_copy(update={"heat": True, "height": 8e-5})
    load = scene.load.model_copy(update={"duration": 3e-3})
    numerics = scene.numerics.model_copy(update={"tolerance": 3e-3})
    scene = scene.model_copy(update={"rubber": rubber, "load": load, "numerics": numerics})
    rows = slide(scene)
    conditions = Conditions.of(
        pressure=5e5,
        speed=4.0,
        temperature=T_0,
        k=0.405,
        D=46.5e-6,
        H_V=0.56e-6,
        initial_height=70e-9,
        duration=3e-3,
    )
    above = RubberColumns(T_0, 3e-3, rubber_solid(1100.0))
    times = rows["time_s"]
    point = simulate(conditions, "column", tolerance=1e-5, times=times, rubber=above)
    difference = np.abs(rows["mu"] / point.samples[:, 0] - 1.0)
    assert difference.max() < (1e-2 if heat == "continuum" else 3e-3)
    assert difference.mean() < 2e-3
    assert rows["melted_fraction"][-1] > 0.9
    assert np.abs(rows["energy_imbalance"][-1]) < 1e-3


@pytest.mark.parametrize("carrier", ["ice", "rubber"])
@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_energy_ledger_closes(heat, carrier):
    rows = slide(warm(ice__heat=heat, film__carrier=carrier, ice__temperature=272.65))
    assert np.abs(rows["energy_imbalance"][-1]) < 1e-3
    assert rows["rubber_heat_J"][-1] > 0.01 * rows["friction_work_J"][-1]
    assert rows["latent_heat_J"][-1] > 0.01 * rows["friction_work_J"][-1]


def test_both_carriers_share_the_heat_alike_below_a_film_that_stays():
    """Without squeeze-out and melting all films are h0: two couplings, one answer."""
    shares = []
    for carrier in ("ice", "rubber"):
        rows = slide(warm(film__carrier=carrier, film__D="10 mm", ice__temperature=250.0))
        shares.append(rows["rubber_heat_J"][1:] / rows["friction_work_J"][1:])
        assert rows["melted_fraction"][-1] == 0.0
    end, half = -1, len(shares[0]) // 2
    for at in (half, end):
        assert shares[0][at] == pytest.approx(shares[1][at], rel=0.01)
    # The ice is always fresh, so the rubber soon is as warm as it gets.
    assert 0.02 < shares[0][end] < shares[0][half] < 0.195


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("carrier", "heat", "duration"),
    [("ice", "column", 3e-4), ("rubber", "column", 2e-4), ("ice", "continuum", 1e-4)],
)
def test_the_same_friction_on_any_number_of_ranks(carrier, heat, duration):
    scene = warm(
        film__carrier=carrier, ice__heat=heat, load__duration=duration, ice__cell=4e-5,
        ice__temperature=272.15,
    )  # fmt: skip
    together, alone = slide(scene, MPI.COMM_WORLD), slide(scene, MPI.COMM_SELF)
    times = np.linspace(0.0, duration, 40)
    for name in ("mu", "rubber_heat_J"):
        curves = [np.interp(times, rows["time_s"], rows[name]) for rows in (together, alone)]
        np.testing.assert_allclose(*curves, rtol=1e-3)
