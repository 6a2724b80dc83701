"""Friction of many points at once is that of their runs, whatever their physics."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.film.conditions import varied_conditions
from iceslide_fem.runs.many_points import OUTPUTS, Rows, friction, shared_by
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.variation import with_values

CASES = Path(__file__).parent.parent / "cases"
SPEEDS, KELVIN = np.array([1.0, 4.0]), np.array([263.15, 269.15])
SLIDING = ["ice.motion=sliding", "load.duration=5ms", "rubber.length=8mm"]
COLUMN = "ice.heat=column"
KINDS = {
    "attached": [COLUMN],
    "half-space": ["ice.heat=half-space"],
    "sliding": [COLUMN, *SLIDING],
    "rubber-heat": [COLUMN, "rubber.heat=true"],
    "water-table": [COLUMN, "water.viscosity=[['-10 degC', 2.6e-3], ['0 degC', 1.79e-3]]"],
    "sliding-water-table": [
        COLUMN,
        *SLIDING,
        "water.viscosity=[['-10 degC', 2.6e-3], ['0 degC', 1.79e-3]]",
    ],
    "dry": [COLUMN, "film.dry_stress=0.45MPa", "film.dry_softening=13.5K"],
    "sliding-dry": [COLUMN, *SLIDING, "film.dry_stress=0.45MPa", "film.initial_height=0"],
    "ageing": [
        COLUMN,
        "film.contact_age=true",
        "rubber.prony=[[0.3, 0.005]]",
        "rubber.modulus_is=long-term",
    ],
    "passes": [COLUMN, "load.passes=3", "load.period=0.1s"],
    "fixed-steps": [COLUMN, "numerics.film_integrator=implicit-euler", "numerics.max_step=10us"],
    "coulomb": ["friction.law=coulomb", "friction.mu=0.2", COLUMN],
}


def point(*changes):
    return load_scene(CASES / "thesis_1bar.toml", ["model=point", *changes])


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_that_of_runs(kind):
    scenes = [point(*KINDS[kind]), point(*KINDS[kind], "load.pressure=2bar")]
    times = np.linspace(0.0, 3e-3, 4)
    found = friction(scenes, Rows(speed=SPEEDS, temperature=KELVIN), times)
    for number, scene in enumerate(scenes):
        for row in range(2):
            changes = {"load.speed": SPEEDS[row], "ice.temperature": KELVIN[row]}
            history, entries = point_history(with_values(scene, changes))
            for name in OUTPUTS:
                mu = getattr(found, name)[number, row]
                assert mu == pytest.approx(entries[name], rel=3e-3), name
            if kind != "passes":
                own = np.array([(one.time_s, one.mu) for one in history]).T
                assert found.samples[number, row] == pytest.approx(
                    np.interp(times, *own), rel=1.5e-2
                )
    assert not found.failures


def test_scenes_of_all_kinds_at_once():
    scenes = [point(*changes) for changes in KINDS.values()]
    together = friction(scenes, Rows(speed=SPEEDS)).mu_mean
    for number, scene in enumerate(scenes):
        assert together[number] == pytest.approx(
            friction([scene], Rows(speed=SPEEDS)).mu_mean[0], rel=2e-3
        )


def test_loads_of_rows_are_without_the_factors_of_the_scene():
    rows = Rows(pressure=np.array([1e5]))
    for changes in ([COLUMN], ["friction.law=coulomb", "friction.mu=0.2", COLUMN]):
        plain, scaled = (point(*changes, *more) for more in ([], ["load.pressure_scale=3"]))
        assert friction([scaled], rows).mu_mean == pytest.approx(friction([plain], rows).mu_mean)


def test_physics_with_steps_of_their_own_run_alone():
    alone = {kind for kind, changes in KINDS.items() if shared_by(point(*changes)) is None}
    assert alone == {"passes", "coulomb", "fixed-steps"}


def test_the_time_on_sliding_ice_follows_the_speed():
    scene = point(COLUMN, *SLIDING)
    found = varied_conditions(scene, speed=[1.0, 4.0, 8.0])
    assert found.duration == pytest.approx([5e-3, 2e-3, 1e-3])
    assert varied_conditions(point(COLUMN), speed=[1.0, 4.0]).duration == pytest.approx(7e-3)


def test_more_scenes_than_a_call_takes_are_split(monkeypatch):
    scenes = [point(COLUMN, f"load.pressure={p}bar") for p in (1, 2, 3, 4, 5)]
    whole = friction(scenes).mu_mean
    monkeypatch.setattr("iceslide_fem.runs.many_points.CHUNK", 2)
    assert friction(scenes).mu_mean == pytest.approx(whole, rel=1e-3)
