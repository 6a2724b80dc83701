"""The coupled step: against the point level, its ledger, its rejected steps, its ranks."""

import csv
import itertools
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from program import rows_of, run

pytest.importorskip("dolfinx")
from slides import CASES, quarrelling, refusal, slide, started, thesis, turned, uniform  # noqa: E402

from iceslide_fem.coupling.coupled_step import CoupledStep  # noqa: E402
from iceslide_fem.coupling.drainage import Undrained  # noqa: E402
from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.plate import Plate  # noqa: E402
from iceslide_fem.coupling.relaxing import Elastic  # noqa: E402
from iceslide_fem.coupling.step_error import LIMITS, StepError, StepRejected  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.film.point import Conditions, simulate  # noqa: E402
from iceslide_fem.laws.film_of_scene import default_ramp  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.runs.pace import Pace  # noqa: E402
from iceslide_fem.runs.schedule import Schedule  # noqa: E402
from iceslide_fem.runs.summary import Results  # noqa: E402
from iceslide_fem.runtime.errors import NotConverged, SimulationStopped  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe


@pytest.mark.parametrize("heat", ["column", "half-space", "continuum"])
def test_uniform_pressure_gives_the_point_level(heat):
    scene = uniform(heat)
    rows = slide(scene)
    conditions = Conditions.of(
        pressure=5e5,
        speed=4.0,
        temperature=269.15,
        k=0.405,
        D=46.5e-6,
        H_V=0.56e-6,
        initial_height=70e-9,
        duration=6e-3,
    )
    level = "half-space" if heat == "half-space" else "column"
    point = simulate(conditions, level, tolerance=1e-5, times=rows["time_s"])
    difference = np.abs(rows["mu"] / point.samples[:, 0] - 1.0)
    assert difference.max() < (7e-3 if heat == "continuum" else 2e-3)
    assert difference.mean() < 2e-3
    assert rows["saturated_fraction"][-1] > 0.9
    assert point.saturation[0] < 6e-3


def test_tolerance_bounds_mu_at_every_moment_though_points_melt_and_lift_off():
    """Points that begin to melt or lift off turn the block's speed, and with it mu."""
    changes = ["numerics.refinement=0.5", "load.duration=1.4ms", "numerics.max_step=0.2ms"]
    run, exact = (
        slide(thesis(*changes, f"numerics.tolerance={size}")) for size in ("1e-3", "2e-4")
    )
    times = np.linspace(0.0, 1.4e-3, 500)
    mu, reference = (np.interp(times, rows["time_s"], rows["mu"]) for rows in (run, exact))
    assert run["contact_fraction"][-1] < 0.95 * run["contact_fraction"][0]  # points have lifted off
    assert np.abs(mu / reference - 1.0).max() < 1e-3
    assert len(run["time_s"]) < 140


def test_friction_that_dies_away_as_foreseen_is_no_corner():
    """Behind a plate that has stopped each step took away 0.3 % of it, at a tolerance of 1e-3."""
    changes = ["numerics.refinement=0.25", "numerics.tolerance=1e-3", "load.duration=0.04ms"]
    stop = "load.speed=[['0 ms', '3 m/s'], ['0.03 ms', '0 m/s']]"
    mu = slide(thesis(*changes, stop))["mu"]
    assert mu[-1] < 0.3 * mu[0] and len(mu) < 200


@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_energy_ledger_closes(heat):
    rows = slide(thesis(f"ice.heat={heat}"))
    late = rows["time_s"] > 1e-4
    assert np.abs(rows["energy_imbalance"][late]).max() < 1e-3
    assert np.abs(rows["energy_imbalance"][-1]) < 1e-4
    assert rows["latent_heat_J"][-1] > 0.02 * rows["friction_work_J"][-1]
    # The film grows from what was melted, less what was squeezed out: another count of latent heat.
    assert rows["friction_force_N"][-1] == pytest.approx(
        rows["mu"][-1] * rows["normal_force_N"][-1]
    )


def test_normal_force_is_the_load_at_every_step():
    rows = slide(thesis("load.duration=1ms"))
    assert rows["normal_force_N"] == pytest.approx(0.1, rel=1e-5)


def test_methods_without_an_error_estimate_take_equal_steps():
    changes = ["numerics.film_integrator=implicit-euler", "numerics.max_step=0.04ms"]
    rows = slide(thesis("load.duration=1ms", "numerics.refinement=0.5", *changes))
    assert rows["step_s"][1:] == pytest.approx(0.04e-3)


def test_pressures_outside_the_table_count_only_where_the_table_is_read(tmp_path):
    short = ["load.duration=20us", "numerics.refinement=0.5"]
    local = run(thesis(*short), tmp_path / "local")
    nominal = run(thesis(*short, "film.pressure=nominal"), tmp_path / "nominal")
    assert 0.1 < local["outside_table_fraction"] < 1.0
    assert nominal["outside_table_fraction"] == 0.0


def step_of(sliding, block, error):
    """What makes the trial steps of `sliding`, with another `block` and `error`."""
    elastic, drainage = Elastic(), Undrained(sliding.block)
    plate = Plate(sliding.block)
    return CoupledStep(block, sliding.frame, plate, sliding.motion_law, elastic, drainage, error)


class Stubborn:
    """A block that finds no equilibrium on every first attempt."""

    def __init__(self, block):
        self.block, self.attempts = block, 0

    def __getattr__(self, name):
        return getattr(self.block, name)

    def balance(self, *given):
        self.attempts += 1
        if self.attempts % 2:
            raise NotConverged("a point enters and leaves the range of fading")
        return self.block.balance(*given)


def test_where_shear_that_fades_in_has_no_equilibrium_its_fading_is_held():
    sliding = started(thesis("load.duration=1ms", "numerics.refinement=0.5"))
    for _ in range(8):
        sliding.advance()
    start, block = sliding.checkpoint_state(), Stubborn(sliding.block)
    error = StepError(sliding.block, 1e-3)
    accepted = step_of(sliding, block, error).attempt(sliding.current, start.dt, start.film_dt)
    assert block.attempts >= 2 and accepted.solved
    assert block.normal_force(accepted.state.contact) == pytest.approx(0.1, rel=1e-4)


def heating(fraction):
    """The same step, of whose work so much more has become heat."""

    def change(step):
        work = step.forces[0] * 3.0 * step.dt
        return step._replace(dissipation=fraction * work)

    return change


def test_no_step_is_accepted_whose_energy_does_not_close():
    sliding = started(thesis("load.duration=1ms", "numerics.refinement=0.25"))
    sliding.advance()
    state = sliding.checkpoint_state()._replace(quiescent=False)
    sliding.restore(state._replace(dt=1e-5))  # longer than a jump
    assert not refusal(sliding, heating(5e-3))
    sliding.restore(state._replace(dt=1e-5))
    assert refusal(sliding, heating(0.02)) == "the step's energy does not close: the block snaps"
    sliding.restore(state._replace(dt=1e-8))  # a small jump, however, may happen in a moment
    assert not refusal(sliding, heating(0.02))
    sliding.restore(state._replace(dt=1e-8))
    assert "the block snaps" in refusal(sliding, heating(200.0))


def test_no_step_is_accepted_whose_friction_pushes():
    sliding = started(thesis("load.duration=1ms", "numerics.refinement=0.25"))
    pushes = "rubber that springs back would push the block forward"
    assert refusal(sliding, turned(1.0)) == pushes


def test_a_step_that_is_no_number_ends_the_trials():
    sliding = started(thesis("load.duration=1ms", "numerics.refinement=0.25"))
    sliding.restore(sliding.checkpoint_state()._replace(dt=np.nan))
    with pytest.raises(SimulationStopped, match="no step is accepted"):
        sliding.advance()


def test_friction_that_springs_back_has_no_negative_error():
    sliding = started(thesis("load.duration=1ms", "numerics.refinement=0.25"))
    accepted = sliding.advance()
    step = accepted.subcycles.substeps[-1]
    error = StepError(sliding.block, 1e-3)
    forwards = error.of_film(step)
    backwards = step._replace(loads=step.loads._replace(viscous=-step.loads.viscous))
    assert error.of_film(backwards) == forwards > 0.0


def test_small_friction_is_as_accurate_as_large():
    changes = ["load.pressure=10bar", "load.speed=1mm/s", "load.duration=1ms"]
    runs = [
        slide(thesis(*changes, "numerics.refinement=0.25", f"numerics.tolerance={tolerance}"))
        for tolerance in (1e-2, 1e-3)
    ]
    curves = [np.interp(runs[0]["time_s"], rows["time_s"], rows["mu"]) for rows in runs]
    np.testing.assert_allclose(*curves, rtol=5e-3)


def test_a_coarse_window_does_not_thin_out_the_contact_points():
    scene = thesis("ice.motion=sliding", "ice.cell=0.5mm", "numerics.refinement=0.5")
    assert build_block(scene, MPI.COMM_SELF).surface.weights.shape[1] >= 4


def test_a_fixed_step_that_is_too_long_is_named():
    changes = ["numerics.film_integrator=explicit-euler", "numerics.max_step=0.5ms"]
    sliding = started(thesis("load.duration=5ms", "numerics.refinement=0.25", *changes))
    with pytest.raises(SimulationStopped, match=r"fixed steps of 0\.0005 s: give a shorter numeri"):
        for _ in range(10):
            sliding.advance()


def test_a_tall_block_that_finds_no_equilibrium_buckles():
    tall = ["rubber.height=10mm", "numerics.refinement=0.25", "numerics.tolerance=1e-2"]
    with pytest.raises(SimulationStopped, match="of the load unbalanced.*as a column buckles") as r:
        started(thesis(*tall, "load.pressure=3bar"))
    assert "10 times as tall as thick" in str(r.value) and "nan" not in str(r.value)


def test_a_run_says_what_makes_it_doubtful():
    results = Results()
    results.rows = [(0.0, 0.3), (5e-4, 1.8), (1e-3, 0.4)]
    assert results.entries()["warnings"] == []  # nor by a law that knows no films
    results.imbalance, results.bottom, results.sides = -0.03, 0.6, 0.1
    results.sipe_opening, results.outside_table_fraction = -2e-5, 0.4
    results.thinnest_film = 0.17e-9
    results.peak = 1.8
    assert results.entries()["warnings"][4].startswith("the ice does not melt: ")
    results.melted = 0.01
    assert results.entries()["warnings"][4].startswith("on more than 99% of the contact")
    results.melted = 0.7
    said = results.entries()["warnings"]
    figures = [
        "3.0% of the friction work is too much",
        "60%",
        "10%",
        "40%",
        "0.17 nm",
        "rises to 1.8",
    ]
    assert len(said) == len(figures)
    assert all(figure in sentence for figure, sentence in zip(figures, said, strict=True))


class Clockwork:
    """A slide whose steps get shorter and shorter, by a clock of ten seconds per look at it."""

    def __init__(self, shrink, **numerics):
        scene = thesis(*(f"numerics.{key}={value}" for key, value in numerics.items()))
        block = SimpleNamespace(
            scene=scene,
            surface=SimpleNamespace(comm=MPI.COMM_SELF),
            limit_met=lambda: "it chatters",
        )
        self.sliding = SimpleNamespace(
            block=block, current=SimpleNamespace(time=0.0), moment="some moment"
        )
        self.shrink, self.saved, self.clock = shrink, [], itertools.count(step=10.0)

    def run(self, steps):
        pace = Pace(self.sliding, lambda: self.saved.append(1), lambda: next(self.clock))
        dt = 1e-5 * self.sliding.block.scene.load.duration
        for _ in range(steps):
            self.sliding.current.time += dt
            dt *= self.shrink
            pace(SimpleNamespace(accepted=True, time=self.sliding.current.time))


def test_a_run_whose_end_recedes_stops_with_a_checkpoint():
    chattering = Clockwork(shrink=0.99)
    with pytest.raises(SimulationStopped, match="its end recedes.*hours are left.*it chatters"):
        chattering.run(100_000)
    assert chattering.saved == [1]
    Clockwork(shrink=1.0).run(50_000)  # long, but it comes nearer
    Clockwork(shrink=0.99, time_limit=1e7).run(2000)


@pytest.mark.parametrize(
    ("looks", "stage"),
    [
        (1, "before sliding, when its mesh is made"),
        (2, "before sliding, when pressing it at"),
        (4, "before sliding, when bringing it to"),
        (30, "at t = 0.* ms of 7 ms"),
    ],
)
def test_a_time_limit_ends_a_run_at_any_stage_and_says_which(tmp_path, looks, stage):
    ticks = itertools.chain(itertools.repeat(0.0, looks), itertools.repeat(100.0))
    schedule = Schedule(every=1e9, clock=lambda: next(ticks))
    scene = thesis("numerics.time_limit=50", "numerics.refinement=0.25", "numerics.tolerance=0.1")
    with pytest.raises(SimulationStopped, match=f"{stage}.*: numerics.time_limit = 50 s is over"):
        run(scene, tmp_path, schedule=schedule)
    assert stage.split(",")[0].split(".*")[0] in (tmp_path / "stopped.txt").read_text()
    assert (tmp_path / "summary.json").is_file() == stage.startswith("at")


@pytest.mark.parametrize(
    ("changes", "steps"),
    [
        # Block and film that may differ by 3 % do not close the energies of a step to 1 %: 508.
        (("numerics.tolerance=0.1", "numerics.refinement=0.25"), 80),
        # Shear that follows pressure like a friction coefficient of 200: it stopped after 41.
        (
            (
                "load.pressure=0.2bar",
                "load.speed=30",
                "load.duration=0.1ms",
                "numerics.tolerance=3e-2",
                "numerics.refinement=0.25",
            ),
            160,
        ),
    ],
)
def test_steps_do_not_chatter(changes, steps):
    sliding = started(thesis(*changes))
    rejected = sum(accepted.rejected for accepted in itertools.islice(sliding.steps(), steps))
    assert sliding.current.time == sliding.block.scene.load.duration
    assert rejected < steps / 2


@pytest.mark.parametrize("duration", ["0.02ms", "0.004ms"])
def test_a_short_slide_needs_no_jump(duration):
    """A block that rests while friction grows by a share of the tolerance is left behind by more
    than what slides past in a step: the shorter of these slides stopped.
    """
    rows = {}
    for tolerance in ("1e-2", "1e-3"):
        changes = ["model=slice", f"load.duration={duration}", f"numerics.tolerance={tolerance}"]
        sliding = started(load_scene(CASES / "tread_block.toml", changes))
        ledger, steps = Ledger(sliding), list(sliding.steps())
        for accepted in steps:
            ledger.add(accepted)
        rows[tolerance] = slide_row(sliding, ledger, steps[-1])
        assert not any(step.rejected for step in steps)
        assert abs(ledger.imbalance) < 1e-4
    assert rows["1e-2"].mu == pytest.approx(rows["1e-3"].mu, rel=1e-3)


def test_shear_fades_in_no_more_steeply_than_a_friction_coefficient_of_ten():
    def ramp(*changes):
        scene = thesis(*changes)
        return default_ramp(scene, scene.initial_height)

    assert ramp() == 0.05e5  # p: mu at t = 0 is 0.2
    assert ramp("load.pressure=0.2bar", "load.speed=15") == pytest.approx(
        0.266 * 1.8e-3 * 15.0 / 70e-9 / 10.0
    )
    assert ramp("load.pressure=0.1bar", "load.speed=40") == 0.1e5  # at most p


def test_a_rejected_step_leaves_no_trace():
    scene = thesis("load.duration=1ms")
    sliding = started(scene)
    for _ in range(12):
        sliding.advance()
    before = sliding.current
    copies = [
        np.array(part, copy=True) for part in (before.motion.displacements, *before.interface)
    ]
    strict = StepError(sliding.block, 1e-3, replace(LIMITS, local=1e-9))
    with pytest.raises(StepRejected):
        step_of(sliding, sliding.block, strict).attempt(before, 0.3e-3, 1e-5)
    assert sliding.current is before
    for part, copy in zip((before.motion.displacements, *before.interface), copies, strict=True):
        np.testing.assert_array_equal(part, copy)

    sliding.restore(sliding.checkpoint_state()._replace(dt=0.9e-3))
    after_rejections = sliding.advance()
    assert after_rejections.rejected > 0
    undisturbed = started(scene)
    for _ in range(12):
        undisturbed.advance()
    undisturbed.restore(undisturbed.checkpoint_state()._replace(dt=after_rejections.dt))
    direct = undisturbed.advance()
    assert direct.rejected == 0 and direct.dt == after_rejections.dt
    np.testing.assert_allclose(
        after_rejections.state.interface.log_height,
        direct.state.interface.log_height,
        atol=1e-5,
    )


@pytest.mark.mpi
@pytest.mark.parametrize("heat", ["column", "continuum"])
def test_the_same_friction_on_any_number_of_ranks(heat):
    scene = thesis(f"ice.heat={heat}", "load.duration=3ms", "numerics.tolerance=1e-2")
    together = slide(scene, MPI.COMM_WORLD)
    alone = slide(scene, MPI.COMM_SELF)
    times = np.linspace(0.0, 3e-3, 40)
    curves = [np.interp(times, rows["time_s"], rows["mu"]) for rows in (together, alone)]
    np.testing.assert_allclose(*curves, rtol=1e-3)
    assert together["ice_heat_J"][-1] == pytest.approx(alone["ice_heat_J"][-1], rel=1e-3)


def test_refusing_to_go_on_says_where_and_keeps_what_was_accepted(tmp_path):
    scene = thesis("load.duration=1ms", quarrelling(tmp_path, 2e-4))
    words = r"stops at t = 0\.\d+ ms of 1 ms: no step is accepted.*touches the ice"
    with pytest.raises(SimulationStopped, match=words):
        run(scene, tmp_path / "out")
    rows = rows_of(tmp_path / "out" / "history.csv")
    assert 1.8e-4 < float(rows[-1]["time_s"]) <= 2e-4
    assert "stops at" in (tmp_path / "out" / "summary.json").read_text()


def test_a_killed_run_leaves_readable_rows_and_can_be_run_again(tmp_path):
    command = [sys.executable, "-m", "iceslide_fem.cli", "run", str(CASES / "thesis_1bar.toml")]
    changes = ["model=slice", "numerics.tolerance=1e-3", "ice.heat=column"]
    for change in changes:
        command += ["--set", change]
    history = tmp_path / "history.csv"
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    running = subprocess.Popen(
        [*command, "--out", str(tmp_path)],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + 60.0
    while not (history.is_file() and history.read_text().count("\n") > 20):
        assert time.monotonic() < deadline and running.poll() is None
        time.sleep(0.02)
    running.send_signal(signal.SIGKILL)
    running.wait()
    text = history.read_text()
    rows = list(csv.DictReader(text[: text.rfind("\n")].splitlines()))
    assert len(rows) >= 19 and all(np.isfinite(float(row["mu"])) for row in rows)
    assert not (tmp_path / "summary.json").exists()
    again = [*command, "--set", "load.duration=0.5ms", "--out", str(tmp_path)]
    refused = subprocess.run(again, env=environment, capture_output=True, text=True)
    assert refused.returncode == 2 and "--restart" in refused.stderr
    assert history.read_text() == text  # nothing is lost
    assert subprocess.run([*again, "--force"], env=environment).returncode == 0
    assert (tmp_path / "report.png").stat().st_size > 10_000


def test_a_step_ends_where_friction_leaves_the_straight_line():
    """What film and heat have done before a turn is not done again: the step is no trial that is
    refused, only shorter. Its first substeps are those of a step of their own.
    """
    sliding = started(thesis("numerics.tolerance=1e-2", "numerics.max_step=2ms"))
    for _ in range(12):
        sliding.advance()
    before = sliding.current.time
    sliding.restore(sliding.checkpoint_state()._replace(dt=1e-3))
    step = sliding.advance()
    assert step.rejected == 0 and 0.1e-3 < step.dt < 0.5e-3
    assert sliding.current.time == pytest.approx(before + step.dt, rel=1e-12)
    whole = step.subcycles
    for count in range(1, len(whole.ends)):
        found = whole.first(count)
        assert found.substeps == whole.substeps[:count] and found.ends[-1] == 1.0
        assert all(np.diff((0.0, *found.ends)) > 0.0)
        assert found.next_dt == whole.substeps[count].step.dt
    assert count > 1


def test_as_many_parts_are_one_step_as_friction_is_straight_in():
    sliding = started(thesis("load.duration=0.1ms", "numerics.tolerance=1e-2"))
    error = StepError(sliding.block, 1e-3)
    ends, straight = [0.2, 0.4, 0.6, 1.0], [1.0, 1.2, 1.4, 1.6, 2.0]
    assert error.straight_parts(straight, ends) == (4, pytest.approx(0.0, abs=1e-9))
    turns = [1.0, 1.2, 1.4, 1.6, 1.6]
    parts, bend = error.straight_parts(turns, ends)
    assert parts == 3 and bend == pytest.approx(0.0, abs=1e-9)
    assert error.of_line(turns, ends) > 1.0
    assert error.straight_parts([1.0, 2.0, 1.0], [0.5, 1.0]) == (1, 0.0)
