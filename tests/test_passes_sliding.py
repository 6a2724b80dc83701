"""Slices that pass over the same sliding ice: against a point, ledgers, restart, ranks."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.interface.film_frame import Travel  # noqa: E402
from iceslide_fem.interface.ice_columns import GridColumns  # noqa: E402
from iceslide_fem.interface.on_ice import OnIce  # noqa: E402
from iceslide_fem.interface.surface_grid import SurfaceGrid  # noqa: E402
from iceslide_fem.laws.film import FilmLaw  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.runs.point import point_history  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import CONTACT_TABLES, Ground  # noqa: E402

pytestmark = pytest.mark.fe
DURATION, PERIOD, PASSES, SHORT = 6e-3, 20e-3, 3, 0.8e-3
MELTS = {"k": 0.32, "D": 36e-6, "H_V": 0.5e-6}


def scene(between, heat="column", model="slice", cell=2e-4):
    """A long, stiff, thin block under even pressure."""
    return scene_from_dict(
        {
            "name": "again", "model": model,
            "rubber": {
                "C10": 166.2e6, "C01": 106.8e6, "D1": 0.0055e-6, "length": 20e-3, "height": 1e-4,
            },
            "load": {
                "pressure": 2e5, "speed": 5.0, "duration": DURATION, "passes": PASSES,
                "period": PERIOD,
            },
            "ice": {"motion": "sliding", "heat": heat, "cell": cell},
            "film": {"between": between, **MELTS},
            "numerics": {"tolerance": 1e-2, "penalty": 2e12},
        }
    )  # fmt: skip


def wet(between, refreeze="area"):
    """Soft rubber with a sipe on wet ice."""
    return scene_from_dict(
        {
            "name": "wet", "model": "slice",
            "rubber": {
                "compound": "B", "length": 4e-3, "height": 2e-3, "sipes": 1, "sipe_width": 2e-4,
                "sipe_depth": 1e-3,
            },
            "load": {
                "pressure": 5e5, "speed": 6.0, "duration": SHORT, "passes": 2, "period": PERIOD,
            },
            "ice": {
                "motion": "sliding", "heat": "column", "cell": 1e-4, "water": 5e-6,
                "temperature": "-1 degC",
            },
            "film": {"between": between, "voids": "carry", "refreeze": refreeze},
            "numerics": {"tolerance": 1e-2, "refinement": 0.5},
        }
    )  # fmt: skip


def slid(sliding, ledger=None):
    """The rows of a pass."""
    ledger = ledger or Ledger(sliding)
    rows = [slide_row(sliding, ledger, None)]
    for accepted in sliding.steps():
        ledger.add(accepted)
        rows.append(slide_row(sliding, ledger, accepted))
    return rows


def begun(sliding, ledger):
    sliding.begin_pass()
    ledger.begin()


@pytest.mark.parametrize(
    ("between", "heat"),
    [("drain", "column"), ("drain", "continuum"), ("drain", "mesh"), ("freeze", "column")],
)
def test_every_pass_is_that_of_a_point(between, heat):
    """What one period has left of the heat and the water of a piece of ice, is under all of it."""
    sliding = started(scene(between, heat=heat))
    ledger = Ledger(sliding)
    point, _ = point_history(scene(between, model="point"))
    means = []
    for number in range(1, PASSES + 1):
        rows = slid(sliding, ledger)
        assert abs(ledger.imbalance) < 1e-3
        time, mu = np.array([(row.time_s - (number - 1) * DURATION, row.mu) for row in rows]).T
        due = [row for row in point if row.pass_ == number]
        times = np.array([row.time_s for row in due]) - (number - 1) * PERIOD
        due = np.interp(time, times, [row.mu for row in due])
        late = time > 0.1e-3
        np.testing.assert_allclose(mu[late], due[late], rtol=0.01)
        means.append(float(np.mean(due)))
        if sliding.pass_is_over:
            begun(sliding, ledger)
    assert means[1] < 0.9 * means[0]  # the ice is warm


@pytest.mark.parametrize(("between", "refreeze"), [("keep", "nothing"), ("freeze", "area")])
def test_water_that_comes_in_again_is_accounted_for(between, refreeze):
    """Half of the water that passes below the rubber stays on the ice, and comes in again."""
    sliding = started(wet(between, refreeze))
    ledger = Ledger(sliding)
    rows = [slid(sliding, ledger)]
    x = sliding.frame.ice.grid.lines[0]
    left = np.interp(-2.8e-3, x, sliding.current.interface.squeezed_height)  # behind the rubber
    begun(sliding, ledger)
    ahead = sliding.current.ahead
    if between == "keep":
        np.testing.assert_allclose(ahead.squeezed_height, left, rtol=0.1)
    rows.append(slid(sliding, ledger))
    for passed in rows:
        row = passed[-1]._asdict()
        kept = sum(row[f"water_{name}_m3"] for name in ("below", "left", "in_sipes", "pushed_out"))
        brought = row["water_brought_m3"]
        assert abs(row["water_squeezed_m3"] + brought - kept) < 1e-9 * brought
        assert abs(row["energy_imbalance"]) < 5e-3
    window = float(np.ptp(sliding.frame.ice.grid.lines[0])) + 6.0 * SHORT
    due = float(ahead.squeezed_height[0]) * window * sliding.block.scale
    assert rows[1][-1].water_brought_m3 == pytest.approx(due, rel=0.02)


def mu_of_the_end(sliding):
    return slid(sliding)[-1].mu


def test_a_run_goes_on_from_the_middle_of_a_pass():
    again_wet = wet("keep", "nothing")
    whole = started(again_wet)
    slid(whole)
    whole.begin_pass()
    for _, _ in zip(whole.steps(), range(20), strict=False):
        pass
    again = resumed(build_block(again_wet, MPI.COMM_SELF), checkpoint_tables(whole))
    assert again.number == 2
    for one, other in zip(again.current.ahead, whole.current.ahead, strict=True):
        if one.size:
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-6)
    assert mu_of_the_end(again) == pytest.approx(mu_of_the_end(whole), rel=1e-3)


@pytest.mark.mpi
@pytest.mark.parametrize("heat", ["column", "mesh"])
def test_the_same_on_any_number_of_ranks(heat):
    ends = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        sliding = started(scene("freeze", heat, cell=1e-3), comm)
        slid(sliding)
        sliding.begin_pass()
        ends.append(mu_of_the_end(sliding))
    assert ends[0] == pytest.approx(ends[1], rel=1e-4)


@pytest.mark.parametrize("motion", ["attached", "sliding"])
def test_rubber_keeps_its_heat_between_passes(motion):
    """Its surface cools by conduction; the next pass begins on warmer rubber."""
    warm = wet("freeze")
    rubber = warm.rubber.model_copy(update={"heat": True})
    ice = warm.ice.model_copy(update={"motion": motion})
    sliding = started(
        scene_from_dict(warm.model_copy(update={"rubber": rubber, "ice": ice}).as_dict())
    )
    ledger = Ledger(sliding)
    slid(sliding, ledger)
    columns = sliding.frame.rubber.column
    end = sliding.current.interface.rubber
    sliding.begin_pass()
    ledger.begin()
    begin = sliding.current.interface.rubber
    np.testing.assert_allclose(columns.heat(begin), columns.heat(end), rtol=1e-9, atol=1e-9)
    rises = [columns.surface_temperature(one) - warm.ice.temperature for one in (end, begin)]
    assert 0.0 < rises[1].max() < 0.5 * rises[0].max()
    slid(sliding, ledger)
    assert abs(ledger.imbalance) < 5e-3


def test_ice_enters_as_it_is_at_first_above_a_base_of_another_temperature():
    grid = SurfaceGrid([np.linspace(0.0, 1e-3, 11)], np.arange(11), MPI.COMM_SELF)
    ice = GridColumns(grid, 269.15, 1.0, ground=Ground(1e-3, held=263.15))
    frame = OnIce(FilmLaw(CONTACT_TABLES["B"], None, 1e4), ice, 70e-9)
    state = frame.start(70e-9, 0)
    shifted = frame.shift_window(state, Travel(2e-4, 2e-4)).state
    np.testing.assert_array_equal(shifted.ice, state.ice)
    assert ice.surface_temperature(shifted.ice) == pytest.approx(269.15, abs=0.1)
