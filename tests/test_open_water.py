"""Water on ice that the rubber has left: it freezes by the ice's own heat, and only there."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.runge_kutta import INTEGRATORS  # noqa: E402
from iceslide_fem.interface.film_frame import ContactLoads  # noqa: E402
from iceslide_fem.interface.ice_columns import GridColumns  # noqa: E402
from iceslide_fem.interface.on_ice import OnIce  # noqa: E402
from iceslide_fem.interface.surface_grid import SurfaceGrid  # noqa: E402
from iceslide_fem.laws.film_of_scene import film_law  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import ICE, MELTING_ENTHALPY, MELTING_TEMPERATURE  # noqa: E402

pytestmark = pytest.mark.fe
COLD, TOUCHED, LATER = 268.15, 1e-3, 20e-3  # K, s


def scene(water, dry=True):
    dries = {"dry_stress": 2e5, "initial_height": 0.0}
    return scene_from_dict(
        {
            "name": "open", "model": "slice",
            "rubber": {"compound": "B", "length": 4e-3, "height": 2e-3, "inertia": dry},
            "load": {"pressure": 2e5, "speed": 5.0, "duration": 1.2e-3},
            "ice": {
                "motion": "sliding", "heat": "column", "cell": 2e-4, "water": water,
                "temperature": COLD, "trail": 2e-3,
            },
            "film": {"voids": "carry", **(dries if dry else {})},
            "numerics": {"tolerance": 1e-2, "refinement": 0.5},
        }
    )  # fmt: skip


def lifted(water, dry):
    """Nodes, some of which rubber at rest has covered for a while: which ones, and what froze, m.

    The last value is the state of the films.
    """
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 11)], np.arange(11), MPI.COMM_SELF)
    law = film_law(scene(water, dry))
    frame = OnIce(law, GridColumns(grid, COLD, np.array([1e-4, LATER])), law.first.height)
    points, area = np.linspace(0.0, 0.5e-3, 200)[:, None], np.full(200, 0.5e-3 / 200)
    down = ContactLoads(points, np.full(200, 2e5), area, np.zeros(200), 0.0)
    up = replace(down, pressure=np.zeros(200))
    first = state = frame.start(law.first.height, 200)
    before, ice_heat, latent, out = down, 0.0, 0.0, np.zeros(11)
    ends = np.geomspace(1e-6, TOUCHED, 40), TOUCHED + np.geomspace(1e-6, LATER - TOUCHED, 60)
    for now, dt in zip(
        np.concatenate(ends), np.diff(np.concatenate(ends), prepend=0.0), strict=True
    ):
        loads = down if now < TOUCHED * 1.0001 else up
        found = frame.advance(state, before, loads, float(dt), INTEGRATORS["implicit-euler"])
        ice_heat += float(found.area @ found.step.ice_heat)
        latent += float(found.area @ found.step.latent_heat)
        out += found.step.flowed_out
        state, before = found.state, loads
    frozen = law.film_height(first) - law.film_height(state)
    frozen = frozen + first.squeezed_height - state.squeezed_height - out
    assert latent == pytest.approx(-ice_heat, rel=1e-9)
    assert latent == pytest.approx(-MELTING_ENTHALPY * float(grid.cell_area @ frozen), rel=1e-4)
    return grid.lines[0] < 0.45e-3, frozen, state


@pytest.mark.parametrize("dry", [True, False])
def test_water_that_the_rubber_has_left_freezes_as_neumann_says(dry):
    """Ice held at T_m takes 2 e (T_m - T) sqrt(t / pi), below the rubber and behind it."""
    met, frozen, state = lifted(10e-6, dry)
    due = 2.0 * ICE.effusivity * (MELTING_TEMPERATURE - COLD) * np.sqrt(LATER / np.pi)
    np.testing.assert_allclose(MELTING_ENTHALPY * frozen[met], due, rtol=0.02)
    np.testing.assert_array_equal(state.squeezed_height[-3:], 10e-6)  # no rubber has met it


def test_water_that_is_frozen_gives_no_more_heat():
    met, frozen, state = lifted(1.5e-6, dry=True)
    np.testing.assert_allclose(frozen[met], 1.5e-6, rtol=1e-5)
    assert not state.squeezed_height[met].any()


def test_ledgers_close_with_water_that_freezes_behind_the_block():
    sliding = started(scene(2e-6))
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    row = slide_row(sliding, ledger, accepted)._asdict()
    kept = sum(row[f"water_{name}_m3"] for name in ("below", "left", "in_sipes", "pushed_out"))
    brought = row["water_brought_m3"]
    assert abs(row["water_squeezed_m3"] + brought - kept) < 1e-10 * brought
    assert abs(ledger.imbalance) < 1e-3
    frame, now = sliding.frame, sliding.current
    x, water = frame.ice.grid.lines[0], now.interface.squeezed_height
    below, behind = (np.interp(at, x, water) for at in (-1.5e-3, -3e-3))
    assert behind < 0.8 * below
