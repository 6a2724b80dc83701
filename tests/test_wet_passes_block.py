"""Slices that slide over the same wet ice again: water handed on, restarted, on several ranks."""

import numpy as np
import pytest
from program import rows_of, run

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import started  # noqa: E402

from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import MELTING_ENTHALPY  # noqa: E402

pytestmark = pytest.mark.fe
WATER, FIRST = 5e-6, 70e-9


def scene(between, water=WATER, period=50e-3, passes=2, refreeze="area"):
    return scene_from_dict(
        {
            "name": "wet", "model": "slice",
            "rubber": {"compound": "B", "length": 8e-3, "width": 8e-3, "height": 4e-3},
            "load": {
                "pressure": 5e5, "speed": 6.0, "duration": 0.3e-3, "passes": passes,
                "period": period,
            },
            "ice": {"temperature": "-1 degC", "water": water, "motion": "attached"},
            "film": {"voids": "carry", "between": between, "refreeze": refreeze},
            "numerics": {"tolerance": 1e-2, "refinement": 0.5},
        }
    )  # fmt: skip


def slid(sliding):
    """The slide at the end of its pass."""
    for _ in sliding.steps():
        pass
    return sliding


def mu(sliding):
    return sliding.current.mechanics.friction_force / (sliding.block.force * sliding.block.scale)


@pytest.mark.mpi
def test_kept_water_is_handed_on_to_the_last_drop():
    sliding = slid(started(scene("keep", refreeze="nothing"), MPI.COMM_WORLD))
    before = sliding.current.interface
    sliding.begin_pass()
    after = sliding.current.interface
    np.testing.assert_array_equal(after.squeezed_height, before.squeezed_height)
    np.testing.assert_allclose(after.log_height, before.log_height, rtol=1e-12)
    end = slid(sliding).current
    gained = (end.interface.squeezed_height - after.squeezed_height) * end.loads.area
    assert sliding.block.surface.comm.allreduce(float(gained.sum())) < 0.0


def test_drained_ice_is_as_ice_that_was_never_wet():
    """After a rest that is long enough for its heat to be gone."""
    drained = slid(started(scene("drain", period=1e4)))
    drained.begin_pass()
    state = drained.current.interface
    assert not state.squeezed_height.any()
    np.testing.assert_allclose(np.exp(state.log_height), FIRST)
    dry = slid(started(scene("drain", water=0.0)))
    assert mu(slid(drained)) == pytest.approx(mu(dry), rel=2e-3)


@pytest.mark.mpi
@pytest.mark.parametrize("period", [50e-3, 100.0])
def test_water_that_freezes_gives_its_heat_to_the_ice(period):
    """rho L per volume of film and voids; what the rest is too short for stays."""
    sliding = slid(started(scene("freeze", period=period), MPI.COMM_WORLD))
    before = sliding.current.interface
    sliding.begin_pass()
    after = sliding.current.interface
    heat = [sliding.frame.ice.profile(state.ice).heat for state in (before, after)]
    water = [np.exp(state.log_height) + state.squeezed_height for state in (before, after)]
    frozen = water[0] - water[1]
    np.testing.assert_allclose(heat[1] - heat[0], MELTING_ENTHALPY * frozen, rtol=1e-6)
    left = water[1] - FIRST
    assert (left > 0.0).all() if period < 1.0 else np.allclose(left, 0.0, atol=1e-15)


@pytest.mark.mpi
def test_the_same_on_any_number_of_ranks():
    wet = scene("freeze")
    ends = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        sliding = slid(started(wet, comm))
        sliding.begin_pass()
        ends.append(mu(slid(sliding)))
    assert ends[0] == pytest.approx(ends[1], rel=1e-5)


@pytest.mark.parametrize("begun", [False, True], ids=["before the rest", "after it"])
def test_a_run_goes_on_between_two_passes(begun):
    wet = scene("freeze")
    whole = slid(started(wet))
    if begun:
        whole.begin_pass()
    again = resumed(build_block(wet, MPI.COMM_SELF), checkpoint_tables(whole))
    assert again.pass_is_over != begun
    for one, other in zip(*(at.current.interface for at in (again, whole)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-9)
    ends = []
    for sliding in (whole, again):
        if not begun:
            sliding.begin_pass()
        assert sliding.number == 2
        ends.append(mu(slid(sliding)))
    assert ends[1] == pytest.approx(ends[0], rel=1e-3)  # a tenth of the tolerance


def test_tables_of_a_run(tmp_path):
    """Energies and water count from the start of each pass, and every one closes."""
    run(scene("keep", passes=3), tmp_path)
    history = rows_of(tmp_path / "history.csv")
    passes = rows_of(tmp_path / "passes.csv")
    assert [row["pass"] for row in passes] == ["1", "2", "3"]
    water = [float(row["squeezed_height_m"]) for row in passes]
    assert WATER > water[0] > water[1] > water[2] > 1e-6
    for found in passes:
        rows = [row for row in history if row["pass"] == found["pass"]]
        assert float(rows[0]["friction_work_J"]) == 0.0
        assert rows[-1]["friction_work_J"] == found["friction_work_J"]
        assert abs(float(rows[-1]["energy_imbalance"])) < 1e-2
