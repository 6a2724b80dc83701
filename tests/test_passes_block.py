"""Slices that slide over the same ice several times: any ice, any number of ranks, restarted."""

import numpy as np
import pytest
from program import rows_of, run

pytest.importorskip("dolfinx")
from slides import CASES, started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.scene.materials import MELTING_ENTHALPY  # noqa: E402

pytestmark = pytest.mark.fe
REST, FIRST = 0.0495, 70e-9  # s, m


def scene(*changes):
    short = [
        "model=slice", "numerics.tolerance=1e-2", "numerics.refinement=0.5", "ice.heat=column",
        "load.duration=0.5ms", "load.passes=3", "load.period=50ms",
    ]  # fmt: skip
    return load_scene(CASES / "thesis_1bar.toml", [*short, *changes])


def passes(sliding):
    """mu at the end of each pass, and the mean temperature (K) of the ice when it begins."""
    mu, kelvin = [], []
    while True:
        now = sliding.current
        warm = sliding.frame.ice_temperature(now.interface, now.loads)
        whole = sliding.block.total(np.ones_like(warm), now.loads.area)
        kelvin.append(sliding.block.total(warm, now.loads.area) / whole)
        for _ in sliding.steps():
            pass
        mu.append(sliding.current.mechanics.friction_force / sliding.block.force)
        if not sliding.pass_is_over:
            return np.array(mu), np.array(kelvin)
        sliding.begin_pass()


@pytest.mark.mpi
@pytest.mark.parametrize("heat", ["column", "continuum", "mesh"])
def test_every_pass_begins_on_warmer_ice(heat):
    """Sideways conduction takes a part of it; continuum and meshed ice agree."""
    mu, kelvin = passes(started(scene(f"ice.heat={heat}"), MPI.COMM_WORLD))
    rises = kelvin - kelvin[0]
    assert (np.diff(kelvin) > 0.0).all()
    due = [0.0397, 0.0678] if heat == "column" else [0.0424, 0.0725]
    np.testing.assert_allclose(rises[1:], due, rtol=0.01)
    np.testing.assert_allclose(mu, mu[0], rtol=1e-3)  # nothing melts, and films begin alike


@pytest.mark.mpi
def test_a_rest_keeps_all_heat_and_water_gives_its_own():
    """Of columns, whose base is far away."""
    ends = {}
    for between in ("drain", "freeze"):
        warm = "ice.temperature=-0.5degC"
        sliding = started(scene(f"film.between={between}", warm), MPI.COMM_WORLD)
        for _ in sliding.steps():
            pass
        before = sliding.current.interface
        water = np.exp(before.log_height) + before.squeezed_height - FIRST
        water = np.maximum(water, 0.0)  # of the ice; the first film is none that has melted
        sliding.begin_pass()
        after = sliding.current.interface
        heats = [sliding.frame.ice.profile(state.ice).heat for state in (before, after)]
        given = heats[1] - heats[0]
        due = MELTING_ENTHALPY * water if between == "freeze" else np.zeros_like(water)
        np.testing.assert_allclose(given, due, atol=1e-9 * max(float(due.max(initial=0)), 1.0))
        ends[between] = given
    assert ends["freeze"].max(initial=1.0) > 0.0


def test_a_run_goes_on_from_the_middle_of_a_pass():
    whole = started(scene())
    for _ in whole.steps():
        pass
    whole.begin_pass()
    for _, _ in zip(whole.steps(), range(8), strict=False):
        pass
    saved = checkpoint_tables(whole)
    again = resumed(build_block(scene(), MPI.COMM_SELF), saved)
    assert again.number == 2
    ends = [passes(sliding)[0] for sliding in (whole, again)]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9)


def test_tables_of_a_run(tmp_path):
    """history.csv counts rests, passes.csv has a row for each, the mean counts sliding alone."""
    summary = run(scene(), tmp_path)
    history = rows_of(tmp_path / "history.csv")
    found = rows_of(tmp_path / "passes.csv")
    assert [row["pass"] for row in found] == ["1", "2", "3"]
    times = np.array([float(row["time_s"]) for row in history])
    assert times[-1] == pytest.approx(2 * 50e-3 + 0.5e-3)
    gaps = np.diff(times)
    np.testing.assert_allclose(gaps[gaps > 1e-3], REST)
    assert abs(float(history[-1]["energy_imbalance"])) < 1e-2
    mean = np.mean([float(row["mu_mean"]) for row in found])
    assert summary["mu_mean"] == pytest.approx(mean, rel=1e-6)
    assert summary["passes"] == 3
    assert summary["mu_mean_last_pass"] == pytest.approx(float(found[-1]["mu_mean"]))


def test_energies_count_from_the_beginning_of_a_pass():
    sliding = started(scene())
    ledger = Ledger(sliding)
    for accepted in sliding.steps():
        ledger.add(accepted)
    work = ledger.friction_work
    sliding.begin_pass()
    ledger.begin()
    assert ledger.friction_work == 0.0
    for accepted in sliding.steps():
        ledger.add(accepted)
    assert ledger.friction_work == pytest.approx(work, rel=1e-2)


@pytest.mark.quick
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["ice.motion=sliding", "load.duration=0.2ms"], "too short for load.passes"),
        (["ice.motion=sliding", "film.carrier=rubber"], "film.carrier"),
        (["rubber.wall_friction=0.3"], "wall_friction"),
        (["load.speed=[['0 ms', '3 m/s'], ['0.5 ms', '1 m/s']]"], "rows of load"),
        (["load.passes=1", "load.period=none"], "load.period"),
    ],
)
def test_what_blocks_cannot_do_in_passes_is_one_sentence(changes, words):
    with pytest.raises(SceneError, match=words):
        scene(*changes)
