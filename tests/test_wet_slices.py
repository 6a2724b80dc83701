"""Slices over voids that carry and on wet ice, wherever films live."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import slide, started  # noqa: E402

from iceslide_fem.coupling.drainage import drainage_of  # noqa: E402
from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = pytest.mark.fe
WORLD = MPI.COMM_WORLD
SURFACE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
FRAMES = {
    "attached": {"motion": "attached"},
    "on rubber": {"motion": "sliding"},
    "on ice": {"motion": "sliding"},
}


def scene(frame, water="0 um", voids="carry", duration=1e-3, water_speed=0.5, **rubber):
    shape = {"compound": "B", "length": 8e-3, "width": 8e-3, "height": 4e-3}
    carrier = "rubber" if frame == "on rubber" else "ice"
    return scene_from_dict(
        {
            "name": "wet", "model": "slice", "rubber": shape | rubber,
            "load": {"pressure": 5e5, "speed": 6.0, "duration": duration},
            "ice": {"temperature": "-1 degC", "water": water, **FRAMES[frame]},
            "film": {"carrier": carrier, "voids": voids, "water_speed": water_speed},
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
    """Ice that passes a block of 8 mm does not fill them. The table begins at a low pressure."""
    dry = scene("on ice")
    carry, stop = (
        slide(
            dry.model_copy(
                update={
                    "film": dry.film.model_copy(update=changes),
                    "load": dry.load.model_copy(update={"pressure": 1e5}),
                }
            )
        )
        for changes in ({"contact": SURFACE}, {"contact": SURFACE, "voids": "stop"})
    )
    np.testing.assert_allclose(carry["mu"][-1], stop["mu"][-1], rtol=1e-3)


@pytest.mark.mpi
@pytest.mark.parametrize("frame", ["attached", "on ice"])
def test_the_same_on_any_number_of_ranks(frame):
    wet = scene(frame, "5 um", duration=0.3e-3)
    together, alone = slide(wet, WORLD), slide(wet, MPI.COMM_SELF)
    assert together["mu"][-1] == pytest.approx(alone["mu"][-1], rel=1e-5)


SMALL = [{"position": x, "width": 3e-4, "depth": 4e-4} for x in (-1.5e-3, 1.5e-3)]


def unaccounted(row):
    """What the ledger of the water misses, over what the ice has brought."""
    kept = ("below", "left", "in_sipes", "pushed_out")
    there = sum(row[f"water_{name}_m3"] for name in kept)
    return abs(row["water_squeezed_m3"] + row["water_brought_m3"] - there) / row["water_brought_m3"]


def ledger_of(wet):
    """The last row of a slide in all of whose rows the water's ledger closes."""
    sliding = started(wet)
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
        row = slide_row(sliding, ledger, accepted)._asdict()
        assert unaccounted(row) < 1e-11
    return row


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize("stores", [True, False])
def test_the_ledger_of_water_closes(stores, share):
    wet = scene("on ice", "20 um", duration=2e-3, sipes=SMALL, stores_water=stores)
    film = wet.film.model_copy(update={"water_speed": share})
    row = ledger_of(wet.model_copy(update={"film": film}))
    assert row["water_left_m3"] > 0.0 and row["water_pushed_out_m3"] > 0.0
    at_first = ledger_of(
        wet.model_copy(update={"load": wet.load.model_copy(update={"duration": 1e-9})})
    )
    ice_passed = 8e-3 * 20e-6 * 6.0 * 2e-3
    came = row["water_brought_m3"] - at_first["water_brought_m3"]
    assert came == pytest.approx(ice_passed, rel=0.02)  # within a cell


@pytest.mark.parametrize("heat", ["column", "continuum"])
@pytest.mark.parametrize("frame", ["attached", "on rubber"])
def test_it_closes_where_areas_of_points_change(frame, heat):
    wet = scene(frame, "20 um", sipes=SMALL, stores_water=True)
    row = ledger_of(wet.model_copy(update={"ice": wet.ice.model_copy(update={"heat": heat})}))
    contact = 8e-3 * 8e-3 * 20e-6
    assert row["water_brought_m3"] == pytest.approx(contact, rel=0.2)
    assert row["water_left_m3"] == 0.0 and 0.0 < row["water_in_sipes_m3"] < 1.1 * 1.92e-9


def test_sipes_that_are_full_drain_no_more():
    """Two sipes of 0.12 mm2 take 1.92e-9 m3 below 8 mm of width."""
    full, draining = (
        slide(scene("on ice", "20 um", "carry", 4e-3, 1.0, sipes=SMALL, stores_water=stores))
        for stores in (True, False)
    )
    stored = full["water_in_sipes_m3"]
    assert stored[-1] == pytest.approx(1.92e-9, rel=0.15) and (stored <= 1.92e-9 * 1.1).all()
    assert (np.diff(stored) > -0.02 * stored[-1]).all()
    early = full["time_s"] < 1e-4
    np.testing.assert_allclose(full["mu"][early], draining["mu"][: early.sum()], rtol=1e-2)
    assert full["mu"][-1] < 0.7 * draining["mu"][-1]
    assert full["water_borne_fraction"][-1] > draining["water_borne_fraction"][-1]
    assert len(full["time_s"]) < 1.5 * len(draining["time_s"])


def test_a_sipe_holds_what_its_walls_leave():
    """Stretched along x it is wider by that, compressed along z lower."""
    sliding = started(scene("on ice", "20 um", sipes=SMALL, stores_water=True))
    rubber, drainage = sliding.block.rubber, drainage_of(sliding.block, sliding.frame)
    before, step = sliding.current, sliding.advance()
    much = np.ones_like(step.state.interface.squeezed_height)
    x = rubber.space.tabulate_dof_coordinates()[:, :2]
    for stretch in ([0.1, 0.0], [0.0, -0.2]):
        rubber.u.x.array[:] = (x * stretch).ravel()
        full = drainage.after(before, step.state, step.subcycles, wiped=much).stored
        np.testing.assert_allclose(full, 1.2e-7 * (1.0 + sum(stretch)), rtol=1e-9)


def test_a_puddle_comes_and_goes():
    wet = scene("on ice", "0 um", duration=3e-3, water_speed=1.0)
    rows = ((4e-3, 0.0), (5e-3, 20e-6), (9e-3, 20e-6), (10e-3, 0.0))
    rows = slide(wet.model_copy(update={"ice": wet.ice.model_copy(update={"water": rows})}))
    mu, brought = rows["mu"], rows["water_brought_m3"]
    assert brought[-1] == pytest.approx(8e-3 * 5e-3 * 20e-6)  # width, length, height
    wettest = rows["water_height_m"].argmax()
    assert 4e-3 < rows["slip_m"][wettest] < 15e-3
    assert mu[wettest] < 0.5 * mu[0] and mu[-1] > 1.5 * mu[wettest]


@pytest.mark.mpi
def test_sipes_fill_the_same_on_any_number_of_ranks():
    wet = scene("on ice", "20 um", duration=0.5e-3, sipes=SMALL, stores_water=True)
    together, alone = slide(wet, WORLD), slide(wet, MPI.COMM_SELF)
    for name in ("mu", "water_in_sipes_m3", "water_pushed_out_m3"):
        assert together[name][-1] == pytest.approx(alone[name][-1], rel=1e-5)


@pytest.mark.parametrize("stores", [True, False])
def test_a_restart_goes_on_with_the_same_water(stores):
    sipes = {"sipes": SMALL, "stores_water": True} if stores else {}
    wet = scene("on ice", "5 um", duration=0.3e-3, **sipes)
    sliding = started(wet)
    for _ in range(20):
        sliding.advance()
    again = resumed(build_block(wet, WORLD), checkpoint_tables(sliding))
    for one in (sliding, again):
        for _ in one.steps():
            pass
    forces = [one.current.mechanics.friction_force for one in (sliding, again)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-3 if stores else 1e-4)
    stored = [one.current.stored for one in (sliding, again)]
    np.testing.assert_allclose(*stored, rtol=1e-4)
    assert len(stored[0]) == 2 * stores


def test_sipes_that_meet_and_water_do_not_chatter():
    sipes = [{"position": x, "width": 3e-4, "depth": 2e-3} for x in (-2e-3, 2e-3)]
    rows = slide(scene("on rubber", "5 um", sipes=sipes))
    assert len(rows["time_s"]) < 1500 and abs(rows["energy_imbalance"][-1]) < 1e-3
