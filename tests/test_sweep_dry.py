"""Sweeps over dry shear: all points of a call are as each alone."""

from collections import Counter

import numpy as np
import pytest

from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.workflow.sweep import make_plan, run_sweep
from iceslide_fem.workflow.sweep.points import simulate_points
from iceslide_fem.workflow.sweep.table import SAMPLES

pytestmark = pytest.mark.quick

KEYS = {"dry_stress": 3.3e5, "dry_softening": 10.0, "initial_height": 0.0}
ROWS = {"dry_stress": [[263.15, 3e5], [270.15, 1e5], [273.15, 2e4]], "initial_height": 2e-8}


def point(celsius, speed=4.0, **film):
    return scene_from_dict(
        {
            "name": "cold",
            "model": "point",
            "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01},
            "load": {"pressure": 2e5, "speed": speed, "duration": 5e-3},
            "ice": {"temperature": celsius + 273.15},
            "film": film,
            "numerics": {"tolerance": 1e-3},
        }
    )


def test_a_call_of_many_is_each_alone():
    """Film law, numbers and rows, melting and not; three calls, one for each number of rows."""
    scenes = [point(celsius, speed, **KEYS) for celsius in (-4.0, -0.3) for speed in (0.5, 4.0)]
    scenes += [point(-2.0), point(-1.0, **ROWS), point(-0.2, dry_residual=2.0, **KEYS)]
    outcomes = simulate_points(scenes)
    # those of a call share its seconds
    calls = Counter(outcome.summary["wall_s"] for outcome in outcomes)
    assert sorted(calls.values()) == [1, 1, 5]
    for scene, outcome in zip(scenes, outcomes, strict=True):
        rows, single = point_history(scene)
        for name in ("mu_peak", "mu_mean", "mu_end", "melt_onset_s"):
            expected = single[name]
            found = outcome.summary[name]
            assert found == (expected and pytest.approx(expected, rel=2e-3)), name
        assert outcome.summary["warnings"] == single["warnings"]
        assert abs(outcome.summary["energy_imbalance"]) < 1e-4
        time = np.linspace(0.0, 5e-3, SAMPLES)
        for name, curve in outcome.curves.items():
            row = np.interp(time, *([getattr(r, key) for r in rows] for key in ("time_s", name)))
            np.testing.assert_allclose(curve, row, rtol=1e-2, atol=1e-10, err_msg=name)


def test_its_keys_can_be_varied(tmp_path):
    file = tmp_path / "cold.toml"
    file.write_text(
        'name = "cold"\nmodel = "point"\n'
        '[rubber]\ncompound = "B"\nlength = 0.02\nwidth = 0.02\nheight = 0.01\n'
        '[load]\npressure = 2e5\nspeed = 4\nduration = 5e-3\n[ice]\ntemperature = "-2degC"\n'
        "[film]\ndry_stress = 3e5\ninitial_height = 0\n"
    )
    plan = make_plan(
        [file],
        ["film.dry_softening=10K"],
        ["film.dry_stress=2bar:4bar:3", "film.dry_softening=5K,10K", "film.dry_residual=0.5K,5K"],
    )
    dataset = run_sweep(plan, tmp_path / "out", None)
    assert (dataset["status"] == "done").all()
    mu = dataset["mu_mean"].values
    assert (np.diff(mu, axis=0) > 0.0).all()
    assert (np.diff(mu, axis=1) < 0.0).all() and (np.diff(mu, axis=2) > 0.0).all()
