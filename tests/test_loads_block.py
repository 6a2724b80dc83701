"""Loads that go in time on slices: exact comparisons, energy, restart, ranks."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

pytest.importorskip("iceslide_fem.fenics.compat")

from slides import refusal, slide, started, turned  # noqa: E402
from test_loads import RISE, scene  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402

pytestmark = pytest.mark.fe

NUMERICS = {"refinement": 0.5, "tolerance": 1e-2}
SLOWS = [["0 ms", "3 m/s"], ["0.2 ms", "3 m/s"], ["0.6 ms", "1 m/s"]]
SLIDING = {"motion": "sliding"}
KINDS = {
    "attached": {},
    "continuum": {"ice": {"temperature": "-1 degC", "heat": "continuum"}},
    "on ice": {"ice": {"temperature": "-1 degC", **SLIDING}},
    "on rubber": {"ice": {"temperature": "-1 degC", **SLIDING}, "film": {"carrier": "rubber"}},
    "inertia": {"rubber": {"inertia": True}},
}


def a_slice(kind="attached", duration="1 ms", **load):
    return scene("slice", numerics=NUMERICS, duration=duration, **KINDS[kind], **load)


@pytest.mark.parametrize("kind", ["attached", "on ice"])
def test_a_table_of_equal_values_gives_the_constant_slide(kind):
    equal = {"speed": [["0 ms", 3.0], ["9 ms", 3.0]], "pressure": [[0, 1e5], [1, 1e5]]}
    constant, table = (slide(a_slice(kind, "0.3 ms", **load)) for load in ({}, equal))
    for name in ("time_s", "mu", "slip_m", "film_height_m", "friction_work_J", "load_work_J"):
        size = abs(constant[name]).max()
        np.testing.assert_allclose(table[name], constant[name], rtol=1e-9, atol=1e-12 * size)


@pytest.mark.parametrize("off", [-1, 1])
def test_a_row_one_rounding_off_the_end_is_the_end(off):
    """Of the run: its last row is at the duration to the last digit, from where it may go on."""
    end = float(np.nextafter(1e-4, off))
    rows = slide(a_slice(duration="0.1 ms", speed=[[0, 3.0], [end, 3.1]]))
    assert rows["time_s"][-1] == 1e-4 and np.diff(rows["time_s"]).min() > 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_energy_closes_and_the_columns_follow_the_loads(kind):
    made = a_slice(kind, pressure=RISE, speed=SLOWS)
    rows = slide(made)
    times = rows["time_s"]
    assert abs(rows["energy_imbalance"][-1]) < 1e-3
    np.testing.assert_array_equal(rows["speed_m_per_s"], made.load.speeds(times))
    np.testing.assert_array_equal(rows["nominal_pressure_Pa"], made.load.pressures(times))
    for corner in (0.2e-3, 0.4e-3, 0.6e-3):  # steps end there
        assert abs(times - corner).min() < 1e-15
    # the plate weighs what it should (with inertia but for its waves), slides as far as it should
    velocity_error = 0.05 if kind == "inertia" else 1e-4
    np.testing.assert_allclose(
        rows["normal_force_N"], 1e-6 * made.load.pressures(times), rtol=velocity_error
    )
    assert rows["slip_m"][-1] == pytest.approx(3.0 * 0.2e-3 + 2.0 * 0.4e-3 + 0.4e-3, rel=1e-12)
    power = trapezoid(rows["friction_force_N"] * rows["speed_m_per_s"], times)
    assert rows["friction_work_J"][-1] == pytest.approx(power, rel=2e-3)


def test_a_step_in_speed_is_two_runs_joined_by_a_restart():
    change, after = 0.3, 0.3001  # ms
    step = a_slice(speed=[[f"{change} ms", "1 m/s"], [f"{after} ms", "3 m/s"]])
    slow = a_slice(speed=[["0 ms", "1 m/s"], [f"{change} ms", "1 m/s"], ["2 ms", "1 m/s"]])
    first = started(slow)
    while first.current.time < 0.9999e-3 * change:
        first.advance()
    assert first.current.time == pytest.approx(1e-3 * change, rel=1e-12)
    block = build_block(a_slice(speed="3 m/s"), MPI.COMM_SELF)
    joined = resumed(block, checkpoint_tables(first))
    times, mu = [], []
    ledger = Ledger(joined)
    for accepted in joined.steps():
        ledger.add(accepted)
        times.append(joined.current.time)
        mu.append(ledger.friction_force() / block.normal_force(block.contact))
    rows = slide(step)
    later = np.linspace(0.4e-3, 1e-3, 13)
    found = np.interp(later, rows["time_s"], rows["mu"])
    np.testing.assert_allclose(found, np.interp(later, times, mu), rtol=5e-3)


def test_a_restart_on_a_ramp_gives_the_same():
    made = a_slice("on ice", "0.6 ms", pressure=RISE, speed=SLOWS)
    whole = started(made)
    while whole.current.time < 0.35e-3:
        whole.advance()
    again = resumed(build_block(made, MPI.COMM_SELF), checkpoint_tables(whole))
    whole.block.equilibrium.forget()  # as one that goes on: other iterations lead to other steps
    for sliding in (whole, again):
        for _ in sliding.steps():
            pass
    force = [one.current.mechanics.friction_force for one in (whole, again)]
    assert force[1] == pytest.approx(force[0], rel=1e-6)
    assert again.current.loads.offset == pytest.approx(whole.current.loads.offset, rel=1e-9)


def test_a_plate_that_comes_to_rest_has_no_friction():
    rows = slide(a_slice(speed=[["0.2 ms", "3 m/s"], ["0.5 ms", "0 m/s"]]))
    assert abs(rows["mu"][-1]) < 1e-4 < 0.1 < rows["mu"][0]
    assert abs(rows["energy_imbalance"][-1]) < 1e-3
    assert rows["film_height_m"][-1] < rows["film_height_m"][rows["time_s"] > 0.6e-3][0]


def test_behind_a_corner_of_the_plate_steps_are_as_short_as_they_have_to_be():
    sliding = started(a_slice(duration="0.8 ms", speed=SLOWS))
    rejected = {step.state.time - step.dt: step.rejected for step in sliding.steps()}
    for corner in (0.2e-3, 0.6e-3):
        behind = min(rejected, key=lambda time: abs(time - corner))
        assert behind == pytest.approx(corner, rel=1e-9) and rejected[behind] <= 1


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_rubber_pushes_with_no_more_than_it_was_sheared_by(factor):
    """What springs back has been stored: friction may turn round, but not grow so."""
    made = a_slice(duration="1 ms", speed=SLOWS)
    sliding = started(made)
    for _ in range(4):
        sliding.advance()
    strongest = sliding.current.largest_friction_force
    assert strongest >= sliding.current.mechanics.friction_force > 0.0
    reason = refusal(sliding, turned(factor))
    assert ("with more than it was sheared by" in reason) == (factor > 1.0)


@pytest.mark.mpi
def test_several_ranks_give_the_same():
    made = a_slice("on ice", "0.4 ms", pressure=RISE, speed=SLOWS)
    together, alone = slide(made, MPI.COMM_WORLD), slide(made)
    assert together["mu"][-1] == pytest.approx(alone["mu"][-1], rel=1e-6)
    assert together["friction_work_J"][-1] == pytest.approx(alone["friction_work_J"][-1], rel=1e-6)


def test_a_plate_that_starts_at_once_is_followed_in_steps_that_grow():
    sliding = started(
        a_slice(speed=[["0 ms", "0 m/s"], ["0.3 ms", "0 m/s"], ["0.3001 ms", "3 m/s"]])
    )
    steps = 0
    while sliding.current.time < 0.32e-3:
        sliding.advance()
        steps += 1
    assert steps < 150
