"""Slices over voids that carry and on wet ice, wherever films live."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from test_sliding import slide, started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.rubber.build import build_block  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.once]
WORLD = MPI.COMM_WORLD
FRAMES = {
    "attached": {"motion": "attached"},
    "on rubber": {"motion": "sliding"},
    "on ice": {"motion": "sliding"},
}


def scene(frame, water="0 um", voids="carry", duration=1e-3, **rubber):
    shape = {"compound": "B", "length": 8e-3, "width": 8e-3, "height": 4e-3}
    carrier = "rubber" if frame == "on rubber" else "ice"
    return scene_from_dict(
        {
            "name": "wet", "model": "slice", "rubber": shape | rubber,
            "load": {"pressure": 5e5, "speed": 6.0, "duration": duration},
            "ice": {"temperature": "-1 degC", "water": water, **FRAMES[frame]},
            "film": {"carrier": carrier, "voids": voids},
            "numerics": {"tolerance": 1e-2, "refinement": 0.5},
        }
    )  # fmt: skip


@pytest.mark.parametrize("water", ["0 um", "5 um"])
@pytest.mark.parametrize("frame", FRAMES)
def test_energies_close_and_water_carries(frame, water):
    sliding = started(scene(frame, water))
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    assert abs(ledger.imbalance) < 1e-3
    now = sliding.current
    mu = now.mechanics.friction_force / (sliding.block.force * sliding.block.scale)
    assert (0.02 < mu < 0.07) if water == "5 um" else (0.05 < mu < 0.2)


def test_voids_that_are_not_full_change_nothing():
    """Ice that passes a block of 8 mm does not fill them."""
    carry, stop = (slide(scene("on ice", voids=voids)) for voids in ("carry", "stop"))
    np.testing.assert_allclose(carry["mu"][-1], stop["mu"][-1], rtol=1e-3)


@pytest.mark.mpi
@pytest.mark.three
@pytest.mark.parametrize("frame", ["attached", "on ice"])
def test_the_same_on_any_number_of_ranks(frame):
    wet = scene(frame, "5 um", duration=0.3e-3)
    together, alone = slide(wet, WORLD), slide(wet, MPI.COMM_SELF)
    assert together["mu"][-1] == pytest.approx(alone["mu"][-1], rel=1e-5)


def test_a_restart_goes_on_with_the_same_water():
    wet = scene("on ice", "5 um", duration=0.3e-3)
    sliding = started(wet)
    for _ in range(20):
        sliding.advance()
    again = resumed(build_block(wet, WORLD), checkpoint_tables(sliding))
    for one in (sliding, again):
        for _ in one.steps():
            pass
    forces = [one.current.mechanics.friction_force for one in (sliding, again)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-4)


def test_sipes_that_meet_and_water_do_not_chatter():
    sipes = [{"position": x, "width": 3e-4, "depth": 2e-3} for x in (-2e-3, 2e-3)]
    rows = slide(scene("on rubber", "5 um", sipes=sipes))
    assert len(rows["time_s"]) < 1500 and abs(rows["energy_imbalance"][-1]) < 1e-3
