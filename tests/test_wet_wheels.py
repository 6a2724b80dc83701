"""Wheels on wet ice near melting: little water behind a groove, stops that are too weak."""

from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.film.carrying import Carried
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.limiting_shear import LimitingShear, ShearStrength
from iceslide_fem.film.loads import film_loads
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import StepControl
from iceslide_fem.film.voids import Voids
from iceslide_fem.inference.compare.command import COMPARE
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
from iceslide_fem.preprocess.wheel.slip_table import slip_table
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.preprocess.work import run
from iceslide_fem.runs.many_points import friction
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import ICE, MELTING_TEMPERATURE
from iceslide_fem.scene.variation import with_values

CASES = Path(__file__).parent.parent / "cases"
SURFACE = CASES / "surfaces" / "compound_B.csv"
WHEEL = {
    "line": str(CASES / "tyres" / "even_2bar.csv"), "contact": str(SURFACE),
    "initial_height": "0 nm", "dry_stress": "0.45 MPa", "dry_softening": "13.5 K",
    "stiffness": "58 MPa/m", "pitch": "28 mm", "groove": "8 mm", "temperature": "-5 degC",
    "water": "20um",
}  # fmt: skip


@pytest.mark.parametrize(("speed", "slip"), [(5.0 / 3.6, 0.464), (1.925, 0.735)])
def test_nanometres_of_water_behind_a_groove_do_not_stop_a_wheel(speed, slip):
    case = WheelCase.of(WHEEL)
    footprint = read_source(case).pressure_map
    below = below_wheel(case, footprint, stiffness_of(case, footprint))
    speeds = np.array([speed, 1.01 * speed])
    found = slip_table(footprint, speeds, np.array([0.0, slip, 1.0]), *below).mu
    assert (found[:, 1:] > 0.02).all() and (found < 0.1).all()
    assert found[1] == pytest.approx(found[0], rel=0.03)


@pytest.mark.parametrize("water", [1e-10, 2.5e-9])
def test_little_water_freezes_once(water):
    """Its latent heat goes into bare ice, and none besides."""
    n, p = 1, np.full(1, 2.8e5)
    table = read_contact_table(SURFACE, "film.contact")
    k, D, H_V, _ = table(p)
    limit = LimitingShear.of(ShearStrength.softening(4.5e5, 13.5, 0.5), 1.8e-3, 0.64, True)
    carried = Carried(Voids(table, 0.02), p, np.ones(n), 1.8e-3)
    loads = film_loads(
        p, np.full(n, 0.64), k, D, H_V, 1.8e-3, None, limit, carried, refreeze="area"
    )
    ice = Column(MELTING_TEMPERATURE - 1.5, np.array([1e-2]))
    internal = np.array([[0.0], [2e4], [0.0], [0.02]])
    dry = limit.log_height(np.zeros(n))
    state = InterfaceState(dry, np.full(n, water), ice.initial(n), internal=internal)
    control = StepControl(INTEGRATORS["sdirk2"], 1e-2)
    step = control.trial(state, loads, loads, np.full(n, 1e-7), ice, np.full(n, 1.5)).step
    assert step.state.squeezed_height[0] == pytest.approx(0.0, abs=1e-15)
    assert step.latent_heat[0] == pytest.approx(-ICE.melting_enthalpy * water, rel=1e-6)
    assert step.ice_heat[0] == pytest.approx(step.friction_work[0] - step.latent_heat[0])


@pytest.mark.parametrize("celsius", [-0.38, -1.5, -16.0])
def test_a_molecule_of_water_on_cold_ice_is_none(celsius):
    """A point on less water than a molecule's height has the friction of one without water."""
    given = {
        "ice.temperature": MELTING_TEMPERATURE + celsius, "film.voids": "carry",
        "film.refreeze": "area",
    }  # fmt: skip
    some = [
        with_values(load_scene(CASES / "cold_point.toml"), {**given, "ice.water": w})
        for w in (0.0, 3e-10, 1e-9)
    ]
    without, less, nanometre = friction(some).mu_mean[:, 0]
    assert less == pytest.approx(without, rel=1e-3)
    assert nanometre == pytest.approx(without, rel=3e-3)


def test_a_control_that_finds_no_friction_leaves_the_others(tmp_path):
    """On 20 um of water thresholds hold a slip without friction; the peak has a ratio."""
    cells = "".join(f"{0.024 * (i + 0.5):.6g},2e5\n" for i in range(5))
    (tmp_path / "line.csv").write_text("x_m,pressure_Pa\n" + cells, encoding="utf-8")
    asked = {key: value for key, value in WHEEL.items() if key != "temperature"}
    asked["line"] = str(tmp_path / "line.csv")
    texts = [f'{key} = "{value}"' for key, value in asked.items()]
    wheel = "\n".join(["[wheel]", *texts])
    other = '[variations.stiff]\nstiffness = "70 MPa/m"\n'
    (tmp_path / "a.toml").write_text(wheel, encoding="utf-8")
    (tmp_path / "b.toml").write_text(other, encoding="utf-8")
    given = {
        "source": tmp_path / "a.toml", "others": (tmp_path / "b.toml",), "temperature": "-5degC",
        "stop": "25km/h", "measure": "20km/h:5km/h", "output": "deceleration_ideal",
    }  # fmt: skip
    done = run(COMPARE, given, tmp_path / "out")
    (place,) = done.figures["conditions"]
    stiff = place["candidates"]["stiff"]
    assert stiff["ratio"] == pytest.approx(1.0, abs=0.05)
    assert "deceleration_threshold" not in stiff or stiff["deceleration_threshold"] is None
    assert any("too weak" in text for text in done.figures["warnings"])
