"""Wheels over the same ice again and again: against passes of a point, and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from program import exit_code

from iceslide_fem.preprocess.footprint.film_map import Lines, film_map, one_pass, start_after
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
PIXELS, SPEED, TRANSIT, PASSES = 80, 4.0, 5e-3, 4
DRY = {"dry_stress": 4.5e5, "dry_softening": 13.5, "initial_height": 0.0}
WET = {"voids": "carry"}
FREEZES = {**DRY, "between": "freeze", "refreeze": "film"}


def scene(film, ice=None, **repeated):
    repeated = repeated or {"passes": PASSES, "period": 20e-3}
    return scene_from_dict(
        {
            "name": "again",
            "model": "point",
            "rubber": {"compound": "B", "length": 20e-3, "width": 20e-3, "height": 8e-3},
            "load": {"pressure": 2e5, "speed": SPEED, "duration": TRANSIT} | repeated,
            "ice": {"temperature": "-2 degC"} | (ice or {}),
            "film": {"contact": str(FILE)} | film,
        }
    )  # fmt: skip


def ride_of(given, slip=1.0):
    ride = Ride.of(given, SPEED / slip, SPEED, given.ice.temperature, given.rubber.length)
    return ride._replace(water_speed=1.0)  # as at a point


def strip(slip=1.0, margin=0):
    pressure = np.zeros((2, PIXELS + 2 * margin))
    pressure[0, margin : margin + PIXELS] = 2e5
    return PressureMap(pressure, SPEED / slip * TRANSIT / PIXELS, 1e-3)


@pytest.mark.parametrize("margin", [0, 7])
@pytest.mark.parametrize(
    ("film", "ice"),
    [
        ({"between": "keep"}, {}),
        ({"between": "drain"}, {}),
        ({"between": "freeze"}, {}),
        ({**DRY, "between": "freeze"}, {}),
        (FREEZES, {}),
        ({**WET, "between": "keep"}, {"water": 5e-6}),
        ({**WET, "between": "freeze"}, {"water": 5e-6}),
    ],
    ids=["keep", "drain", "freeze", "dry", "refreeze", "wet", "wet freeze"],
)  # fmt: skip
def test_a_uniform_line_is_a_point_of_as_many_passes(film, ice, margin):
    given, passes = scene(film, ice), []
    point_history(given, passes.append)
    ride, footprint = ride_of(given), strip(margin=margin)
    below = Lines(footprint.pressure, np.full(len(footprint.pressure), footprint.dx / ride.speed))
    start = None
    for due in passes:
        found = one_pass(below, ride, given.contact_parameters, 1e-3, start=start)
        assert found.films.mean_friction(footprint) == pytest.approx(due.mu_mean, rel=3e-3)
        start = start_after(found, below, ride, 1e-3)
    last = film_map(footprint, ride, given.contact_parameters, 1e-3)
    np.testing.assert_array_equal(last.shear, found.films.shear)
    assert passes[-1].mu_mean != pytest.approx(passes[0].mu_mean, rel=0.02)


def test_a_wheel_whose_rubber_slides_everywhere_is_a_point_of_as_many_passes():
    given, passes = scene({"between": "keep"}), []
    point_history(given, passes.append)
    footprint = PressureMap(strip().pressure[:1], 20e-3 / PIXELS, 1e-3)
    contact = FilmContact(ride_of(given), given.contact_parameters, 1e-3)
    (locked,) = friction(footprint, [Rolling(SPEED, 1.0)], Tread(7e7), contact)
    assert locked.mu == pytest.approx(passes[-1].mu_mean, rel=3e-3)


def test_a_wheel_slips_before_it_on_ice_that_it_has_warmed():
    """In a long rest the ice cools, and drained ice is as new."""
    footprint = PressureMap(strip().pressure[:1], 20e-3 / PIXELS, 1e-3)
    rolls = [Rolling(20.0 / 3.6, slip) for slip in (0.03, 0.1, 1.0)]

    def mu(**changes):
        given = scene({**DRY, "between": "drain"}, **changes)
        contact = FilmContact(ride_of(given), given.contact_parameters, 1e-3)
        return np.array([p.mu for p in friction(footprint, rolls, Tread(7e7), contact)])

    once, soon, late = mu(passes=1), mu(passes=4, period=10e-3), mu(passes=4, period=1e4)
    assert late == pytest.approx(once, rel=2e-3)
    assert (soon < once).all() and soon[1] < 0.99 * once[1]


def test_the_command_says_how_many_passes_and_refuses_a_short_period(tmp_path, capsys):
    file, text = tmp_path / "a.toml", (
        'name = "a"\nmodel = "point"\n[rubber]\ncompound = "B"\n[load]\npressure = "2 bar"\n'
        'speed = 4.0\nduration = "1 ms"\npasses = 3\nperiod = "{}"\n'
    )  # fmt: skip
    words = ["wheel", "--gaussian", "60mm,2bar,20mm", "--speed", "20km/h", "--slip", "0.1,1"]
    words += ["--stiffness", "7e7Pa/m", "--scene", file, "--out", tmp_path / "out", "--no-report"]
    file.write_text(text.format("5 ms"), encoding="utf-8")
    assert exit_code(*words) == 2
    assert "load.period = 0.005 s" in capsys.readouterr().err
    file.write_text(text.format("0.1 s"), encoding="utf-8")
    assert exit_code(*words) == 0
    assert "last of so many passes" in capsys.readouterr().out
    found = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert found["wheel"]["passes"] == 3
