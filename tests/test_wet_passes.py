"""Wet ice pass after pass: points, and rows of them, that hand their water on."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.film.conditions import scene_conditions, scene_passes
from iceslide_fem.film.passes import column_for, next_start
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.point import point_history
from iceslide_fem.runs.point_pass import first_state, one_pass
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import BOTTOMLESS, MELTING_ENTHALPY
from iceslide_fem.workflow.planning.passes import surface_before_last

pytestmark = pytest.mark.quick
FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
WATER, LUG, PRESSURE, TIME, FIRST = 20e-6, 20e-3, 2e5, 5e-3, 70e-9


def scene(between="keep", water=WATER, model="point", **changes):
    tables = {
        "rubber": {"compound": "B", "length": LUG, "width": LUG, "height": 8e-3},
        "load": {"pressure": PRESSURE, "speed": 4.0, "duration": TIME, "passes": 4, "period": 7e-3},
        "ice": {"temperature": "-1 degC", "water": water},
        "film": {"voids": "carry", "contact": str(FILE), "between": between},
        "numerics": {"tolerance": 1e-2},
    }
    for name, table in changes.items():
        tables[name] = tables[name] | table
    return scene_from_dict({"name": "wet", "model": model} | tables)


def history(given):
    """Rows of a history and of its passes."""
    passes = []
    rows, _ = point_history(given, passes.append)
    return rows, passes


def ends(rows):
    """First and last row of every pass."""
    numbers = np.array([row.pass_ for row in rows])
    first = np.flatnonzero(np.diff(numbers, prepend=0))
    last = np.append(first[1:], len(rows)) - 1
    return [(rows[i], rows[j]) for i, j in zip(first, last, strict=True)]


def test_liquid_water_is_handed_on_to_the_last_drop():
    rows, _ = history(scene(film={"refreeze": "nothing"}))
    passes = ends(rows)
    assert passes[0][0].squeezed_height_m == WATER
    for (_, before), (after, _) in zip(passes[:-1], passes[1:], strict=True):
        assert after.squeezed_height_m == before.squeezed_height_m
        assert after.film_height_m == pytest.approx(before.film_height_m, rel=1e-12)
        assert after.mu == pytest.approx(before.mu, rel=1e-12)


def test_four_passes_squeeze_kept_water_as_one_of_four_times_the_length():
    """Water that bears all of the load all the time, against the closed form."""
    _, passes = history(scene(film={"refreeze": "nothing"}))
    due = (WATER**-2 + 2.0 * PRESSURE * TIME * np.arange(1, 5) / (1.8e-3 * LUG**2)) ** -0.5
    assert [one.squeezed_height_m for one in passes] == pytest.approx(due, rel=3e-3)
    assert (np.diff([one.mu_mean for one in passes]) > 0.0).all()


def test_a_row_of_blocks_meets_what_the_one_before_has_left():
    alone = {"passes": 1, "period": None}
    rubber = {"rows": 3, "row_pitch": 28e-3}
    _, rows = history(scene("freeze", load=alone, rubber=rubber, ice={"motion": "sliding"}))
    _, kept = history(scene(load={"passes": 3}, ice={"motion": "sliding"}))
    for name in ("mu_mean", "squeezed_height_m", "film_height_m"):
        found, due = ([getattr(one, name) for one in passes] for passes in (rows, kept))
        assert found == pytest.approx(due, rel=1e-9)


def test_drained_ice_is_as_ice_that_was_never_wet():
    """After a rest that is long enough for its heat to be gone."""
    two = {"passes": 2, "period": 1e4}
    _, drained = history(scene("drain", load=two))
    _, dry = history(scene("drain", water=0.0, load=two, film={"refreeze": "area"}))
    for name in ("mu_mean", "mu_end", "squeezed_height_m", "film_height_m", "melt_onset_s"):
        assert getattr(drained[1], name) == pytest.approx(getattr(dry[0], name), rel=2e-3)
    assert drained[0].mu_mean < 0.05 * dry[0].mu_mean


@pytest.mark.parametrize("period", [7e-3, 0.1, 100.0])
def test_water_that_freezes_gives_its_heat_to_the_ice(period):
    """rho L per volume of film and voids; what the rest is too short for stays."""
    given = scene("freeze", load={"period": period})
    conditions, passes, law = scene_conditions(given), scene_passes(given), law_of(given)
    ice = column_for(conditions, passes, 1e-3, BOTTOMLESS)
    _, end = one_pass(given, law, ice, first_state(given, law, ice), shown=False)
    after = next_start(end.state, law, ice, passes, FIRST, TIME)
    before, left = (
        float(law.film_height(state)[0] + state.squeezed_height[0]) for state in (end.state, after)
    )
    gained = float(ice.heat(after.ice)[0] - ice.heat(end.state.ice)[0])
    assert gained == pytest.approx(MELTING_ENTHALPY * (before - left), rel=1e-9)
    assert FIRST * (1.0 - 1e-12) <= left < before
    assert (left == pytest.approx(FIRST, rel=1e-12)) == (period == 100.0)


def test_more_water_freezes_in_a_longer_rest():
    means = [
        [one.mu_mean for one in history(scene("freeze", load={"passes": 2, "period": period}))[1]]
        for period in (7e-3, 1.0, 100.0)
    ]
    assert means[1][0] == pytest.approx(means[0][0], rel=1e-5)  # the ice is meshed deeper
    assert means[2][0] == pytest.approx(means[0][0], rel=1e-5)
    assert means[0][1] < means[1][1] < means[2][1]


def test_energies_and_melting_count_from_the_start_of_each_pass():
    rows, passes = history(scene(rubber={"sipes": 4}))
    for (first, last), found in zip(ends(rows), passes, strict=True):
        assert first.friction_work_J == 0.0 < last.friction_work_J == found.friction_work_J
        assert abs(last.energy_imbalance) < 1e-4
        melting = [row for row in rows if row.pass_ == found.pass_ and row.melted_fraction]
        assert found.melt_onset_s == pytest.approx(melting[0].time_s - found.start_s)


@pytest.mark.parametrize(
    ("between", "refreeze"),
    [("keep", "nothing"), ("keep", "area"), ("drain", "area"), ("freeze", "area")],
)
def test_an_estimate_counts_the_heat_of_water_that_freezes(between, refreeze):
    """About: within half of the rise, of which frozen water is most."""
    given = scene(between, load={"period": 100.0}, film={"refreeze": refreeze})
    _, passes = history(given)
    rises = [surface_before_last(given) - 272.15, passes[-1].surface_start_C + 1.0]
    assert 0.5 < rises[0] / rises[1] < 2.0
    assert (rises[1] > 0.05) == (given.between == "all")
