"""A viscosity that follows the film's temperature, below a block."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from slides import slide, started, thesis, uniform  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.law import log_shearing  # noqa: E402
from iceslide_fem.film.point import Conditions, simulate  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.block_fields import BlockFields  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = pytest.mark.fe
ROWS = [[263.15, 2.64e-3], [268.15, 2.14e-3], [273.15, 1.79e-3]]
TABLE = f"water.viscosity={ROWS}"
LEVEL = "water.viscosity=[[263.15, 1.8e-3], [273.15, 1.8e-3]]"
COARSE = ("numerics.refinement=0.5", "numerics.tolerance=1e-2", "load.duration=0.2ms")
CARRIERS = {
    "attached": (),
    "rubber": ("ice.motion=sliding", "film.carrier=rubber"),
    "ice": ("ice.motion=sliding", "film.carrier=ice"),
    "heat": ("ice.motion=sliding", "film.carrier=ice", "rubber.heat=true"),
    "continuum": ("ice.motion=sliding", "ice.heat=continuum"),
}


@pytest.mark.parametrize("carrier", CARRIERS)
def test_films_have_the_viscosity_of_their_temperature(carrier):
    """At the end of a step, at each film; it goes on from a checkpoint, and energy closes."""
    scene = thesis(*COARSE, *CARRIERS[carrier], TABLE)
    sliding = started(scene)
    accepted = [step for step, _ in zip(sliding.steps(), range(12), strict=False)]
    state, step = sliding.current.interface, accepted[-1].subcycles.substeps[-1]
    state = step.step.state
    warm = step.ice.surface_temperature(state.ice)
    power = step.loads.viscous * step.loads.speed * np.exp(log_shearing(state))
    films = power, np.exp(state.log_height)
    film = step.rubber.film_temperature(warm, state.rubber, lambda: films)
    table = scene.water.table
    expected = np.log(table(film) / scene.viscosity)
    covered = step.area > 0.0
    # rubber that covers a cell in part warms its film by that part only
    nearly = 1e-3 if carrier == "heat" else 2e-4
    np.testing.assert_allclose(state.internal[0][covered], expected[covered], atol=nearly)
    assert state.internal[0].min() < -0.002  # it has become thinner
    missing = sum(one.energies.missing for one in accepted)
    # the block leaves its rest within these steps
    assert abs(missing) < 2e-3 * sum(one.energies.friction_work for one in accepted)
    row = slide_row(sliding, Ledger(sliding), accepted[-1])
    warmest = scene.viscosity * np.exp(sliding.current.interface.internal[0].min())
    assert warmest < row.film_viscosity_Pa_s < 0.999 * scene.viscosity
    saved = checkpoint_tables(sliding)
    sliding.advance()
    again = resumed(build_block(scene, MPI.COMM_SELF), saved)
    again.advance()
    here, there = (one.current.interface.internal for one in (sliding, again))
    np.testing.assert_allclose(there, here, atol=2e-6)


def test_fields_have_the_viscosity_of_the_films():
    """On the ice that carries them as at the points that touch, in Pa s."""
    scene = thesis(*COARSE, *CARRIERS["ice"], TABLE)
    sliding = started(scene)
    accepted = [step for step, _ in zip(sliding.steps(), range(12), strict=False)][-1]
    grids = BlockFields(sliding, ("interface", "trail")).grids(accepted)
    name = "film viscosity (Pa s)"
    expected = scene.viscosity * np.exp(sliding.current.interface.internal[0])
    trail = grids["trail"].point_data
    assert not [other for other in trail if "viscosity" in other and other != name]
    np.testing.assert_allclose(np.sort(trail[name]), np.sort(expected))
    mean = np.nanmean(grids["interface"].cell_data[name])
    assert expected.min() <= mean < 0.999 * scene.viscosity


def test_the_history_of_a_point_has_its_viscosity():
    scene = thesis(*COARSE, TABLE, "model=point", "load.duration=5ms")
    rows, _ = point_history(scene)
    temperature = np.array([row.surface_temperature_C for row in rows]) + 273.15
    found = [row.film_viscosity_Pa_s for row in rows]
    np.testing.assert_allclose(found, scene.water.table(temperature), rtol=1e-6)
    plain, _ = point_history(thesis(*COARSE, "model=point"))
    assert not hasattr(plain[0], "film_viscosity_Pa_s")


@pytest.mark.parametrize("carrier", ["attached", "ice"])
def test_a_level_table_is_the_constant(carrier):
    usual, level = (slide(thesis(*COARSE, *CARRIERS[carrier], *one)) for one in ((), (LEVEL,)))
    np.testing.assert_allclose(level["mu"], usual["mu"], rtol=1e-9)


def test_even_pressure_gives_the_point_level():
    tables = uniform("column").as_dict()
    tables["water"]["viscosity"] = ROWS
    tables["load"]["duration"] = 2e-3  # it melts from 0.8 ms on
    scene = scene_from_dict(tables)
    rows = slide(scene)
    k, D, H_V = 0.405, 46.5e-6, 0.56e-6
    conditions = Conditions.of(
        pressure=5e5, speed=4.0, temperature=269.15, k=k, D=D, H_V=H_V, initial_height=70e-9,
        duration=2e-3,
    )  # fmt: skip
    exact = simulate(conditions, water=scene.water.table, times=rows["time_s"], tolerance=1e-5)
    np.testing.assert_allclose(rows["mu"], exact.samples[:, 0], rtol=3e-3)


def test_points_are_sheared_with_the_power_that_the_nodes_take():
    """Power read at points equals that of the nodes to rounding, with a viscosity at each."""
    sliding = started(thesis(*COARSE, *CARRIERS["ice"], TABLE))
    carrier, loads = sliding.frame, sliding.current.loads
    rng = np.random.default_rng(1)
    state = sliding.current.interface
    state = state._replace(
        log_height=state.log_height + rng.uniform(-1.0, 1.0, state.log_height.size),
        internal=rng.uniform(-0.3, 0.0, state.internal.shape),
    )
    assert isinstance(loads, ContactLoads)
    shear = carrier.sheared(state, loads)(loads.pressure, loads.speed)[0]
    covered, nodal = carrier.on_nodes(loads)
    cell = carrier.ice.grid.cell_area[carrier.ice.grid.own]
    power = nodal.viscous * nodal.speed * np.exp(state.internal[0] - state.log_height) * cell
    assert power[covered].sum() == pytest.approx(float(loads.touching @ (shear * loads.speed)))
