"""What is read, drawn, planned and swept of runs that slide over the same ice again."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from program import rows_of

from iceslide_fem.app.runs import StartedRun
from iceslide_fem.postprocess.report.of_run import page_of_run
from iceslide_fem.postprocess.report.of_runs import page_of_runs
from iceslide_fem.postprocess.report.page import Chart
from iceslide_fem.postprocess.report.words import in_words
from iceslide_fem.postprocess.results import differences, read_run
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.simulate import run
from iceslide_fem.workflow.planning.cost import estimate
from iceslide_fem.workflow.planning.info import describe
from iceslide_fem.workflow.sweep.points import simulate_points

pytestmark = pytest.mark.quick
PASSES, PERIOD, TIME = 3, 0.5, 5e-3


def values(**tables):
    whole = {
        "name": "turns",
        "model": "point",
        "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01},
        "load": {"pressure": 2e5, "speed": 4.0, "duration": TIME},
        "ice": {"temperature": 263.15, "motion": "sliding"},
        "numerics": {"tolerance": 1e-2},
    }
    whole["load"] |= {"passes": PASSES, "period": PERIOD}
    for table, given in tables.items():
        whole[table] = whole.get(table, {}) | given
    return whole


def scene(**tables):
    return scene_from_dict(values(**tables))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Of a run with its picture."""
    out = tmp_path_factory.mktemp("turns")
    run(scene(), out)
    return out


def test_the_summary_says_when_the_voids_are_full(tmp_path):
    """In the second pass of four: the first row where they are."""
    contact = {"k": 0.4, "D": 40e-6, "H_V": 1.2e-6}
    load = {"pressure": 3e5, "passes": 4, "period": 0.012}
    wet = scene(film=contact, load=load, ice={"temperature": 271.15, "motion": "attached"})
    summary, (rows,) = run(wet, tmp_path), (read_run(tmp_path).history,)
    full = rows["time_s"][rows["saturated_fraction"] > 0.0]
    assert summary["saturation_s"] == pytest.approx(full[0], rel=1e-9)
    assert 0.012 < full[0] < 0.024
    dry = run(scene(), tmp_path / "dry")
    assert dry["saturation_s"] is None


def test_rests_do_not_count(folder):
    found = read_run(folder)
    assert found.history["time_s"][-1] == pytest.approx(2 * PERIOD + TIME)
    assert found.sliding_time[-1] == pytest.approx(PASSES * TIME)
    assert found.mean("mu") == pytest.approx(found.summary["mu_mean"], rel=1e-3)
    table = pd.DataFrame(found.passes)
    assert table["mu_mean"].mean() == pytest.approx(found.summary["mu_mean"])
    assert not differences(found, found).any()


def test_one_pass_is_a_run_of_its_own(folder):
    found = read_run(folder)
    last = found.one_pass(-1)
    assert last.history["time_s"][0] == 0.0
    assert last.history["time_s"][-1] == pytest.approx(TIME)
    assert last.summary["mu_mean"] == found.passes["mu_mean"][-1]
    assert last.mean("mu") == pytest.approx(last.summary["mu_mean"], rel=1e-3)
    assert last.history["mu"].size == found.passes["steps"][-1] + 1
    assert list(last.phases) == ["warming", "melting"]
    assert last.one_pass(1) is last
    with pytest.raises(ValueError, match="allowed: 1 to 3"):
        found.one_pass(4)


def test_passes_long_after_the_first_keep_their_times(tmp_path):
    """At 2e4 s ten digits leave 10 us of a time, and no step of a pass is as long at first."""
    run(scene(load={"period": 1e4}), tmp_path, pictures=False)
    found = read_run(tmp_path)
    first, last = found.one_pass(1), found.one_pass(-1)
    assert (np.diff(last.history["time_s"]) > 0.0).all()
    assert first.history["time_s"][-1] == last.history["time_s"][-1] == TIME


def test_the_same_run_replaces_itself(tmp_path):
    """The table of passes is one of the results, and goes where there are none."""
    run(scene(), tmp_path, pictures=False)
    run(scene(), tmp_path, pictures=False)
    assert (tmp_path / "passes.csv").is_file()
    run(scene(load={"passes": 1, "period": None}), tmp_path, pictures=False, force=True)
    assert not (tmp_path / "passes.csv").exists()


def test_report_is_over_passes_and_within_them(folder):
    page = page_of_run(read_run(folder))
    charts = [part for section in page.sections for part in section.parts if type(part) is Chart]
    over = {chart.name: chart for chart in charts if chart.name.startswith("passes-")}
    assert list(over) == ["passes-mu", "passes-temperatures", "passes-water", "passes-onset"]
    assert "in pass 3" in over["passes-mu"].says
    mu = next(chart for chart in charts if chart.name == "mu")
    assert [curve.name for curve in mu.curves] == ["pass 1", "pass 3"]
    within = [chart for chart in charts if chart.name not in over and chart.name != "preload"]
    assert all(np.max(curve.x) <= 1e3 * TIME * 1.001 for c in within for curve in c.curves)
    assert len({chart.name for chart in charts}) == len(charts)
    assert (folder / "report.png").stat().st_size > 20_000


def test_runs_with_passes_side_by_side(folder, tmp_path):
    run(scene(film={"between": "keep"}), tmp_path, pictures=False)
    page = page_of_runs([folder, tmp_path])
    charts = [part for section in page.sections for part in section.parts if type(part) is Chart]
    assert len(charts[0].curves) == 4
    assert "pass 3" in next(chart for chart in charts if chart.name == "mu").curves[0].name


def test_words_say_how_often():
    words = in_words(scene().as_dict())
    assert "3 times, once every 0.5 s; between passes water freezes" in words
    rows = {"rows": 4, "row_pitch": 0.028}
    alone = {"passes": 1, "period": None}
    assert "4 such blocks" in in_words(scene(load=alone, rubber=rows).as_dict())


def test_a_sweep_has_the_run_of_each_case(folder):
    two, three = simulate_points([scene(load={"passes": number}) for number in (2, PASSES)])
    found = read_run(folder)
    assert three.summary["mu_mean"] == pytest.approx(found.summary["mu_mean"], rel=1e-12)
    assert two.summary["passes"] == 2
    last = found.one_pass(-1)
    times = np.linspace(0.0, TIME, three.curves["mu"].size)
    np.testing.assert_allclose(
        three.curves["mu"], np.interp(times, last.history["time_s"], last.history["mu"]), rtol=1e-6
    )


def test_a_page_that_follows_a_run_sees_sliding_time(folder, tmp_path):
    (tmp_path / "log").touch()
    over = SimpleNamespace(poll=lambda: 0)
    rows = StartedRun(scene(), folder, over, tmp_path / "log", begun=0.0).progress()["rows"]
    assert rows[-1][0] == pytest.approx(1e3 * PASSES * TIME)
    assert (np.diff([time for time, _ in rows]) >= 0.0).all()


def info(**tables):
    return {row.quantity: row for row in describe(scene(**tables)) if row.group == "passes"}


def test_info_says_how_warm_the_ice_gets(tmp_path):
    """About: within a fifth of the rise, which is less as friction falls from pass to pass."""
    load = {"passes": 20, "period": 1.0}
    said = info(load=load)
    assert said["passes"].value == "20, one every 1 s"
    run(scene(load=load), tmp_path, pictures=False)
    begins = float(rows_of(tmp_path / "passes.csv")[-1]["surface_start_C"])
    told = said["surface before the last pass"].value
    assert told.startswith("about ")
    assert float(told.split()[1]) + 10.0 == pytest.approx(begins + 10.0, rel=0.2)
    thin = info(load=load, ice={"depth": 1e-3, "base": "held"})["surface before the last pass"]
    assert -10.0 < float(thin.value.split()[1]) < -9.0
    rows = info(load={"passes": 1, "period": None}, rubber={"rows": 4, "row_pitch": 0.028})
    assert rows["rows"].value == "4, one every 7 ms"
    much = info(load={"passes": 100000, "period": 0.01}, ice={"temperature": 270.15})
    assert much["surface before the last pass"].value == "about 0 degC"


def test_passes_cost_each_their_steps():
    one = estimate(scene(load={"passes": 1, "period": None}))
    many = estimate(scene(load={"passes": 1000}))
    assert many.steps == 1000 * one.steps
    assert many.time > one.time + 5.0
