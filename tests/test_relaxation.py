"""Prony series, the creep that belongs to them, and the shift of times."""

import numpy as np
import pytest

from iceslide_fem.relaxation.prony import Prony, Relaxation, delayed, mean_response
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict

pytestmark = pytest.mark.quick

ONE = Prony((0.3,), (5e-3,))
ARRHENIUS = {"C1": 7.4, "C2": 121, "arrhenius_below": 250, "activation_energy": 1e5}
UNIVERSAL = Shift(17.44, 51.6, 223.15)  # about a glass transition at -50 degC


def many_arms(seed=0, n=20):
    rng = np.random.default_rng(seed)
    g = rng.uniform(0.0, 1.0, n) ** 3
    return Prony(tuple(0.98 * g / g.sum()), tuple(np.logspace(-9, 5, n)))


def test_a_standard_linear_solid_creeps_as_its_closed_form():
    compliance = ONE.creep.compliance([0.0, 5e-3, 1e9])
    assert compliance == pytest.approx([1.0, 1.215749, 1.428571], abs=1e-6)
    assert 1.0 / ONE.modulus(5e-3) == pytest.approx(1.234014, abs=1e-6)  # which is not the creep


@pytest.mark.parametrize("prony", [ONE, many_arms(), many_arms(1, 50)])
def test_creep_and_relaxation_are_each_others_inverse(prony):
    frequency, creep = np.logspace(-10, 11, 200), prony.creep
    arms = np.array(creep.fractions) / (1.0 + 1j * frequency[:, None] * np.array(creep.times))
    assert prony.dynamic(frequency) * (1.0 + arms.sum(axis=1)) == pytest.approx(1.0, abs=1e-11)
    assert 1.0 + sum(creep.fractions) == pytest.approx(1.0 / prony.long_term)
    assert (np.diff(creep.times) > 0.0).all()


def test_loss_modulus_of_one_arm():
    assert 546e3 * ONE.dynamic(200.0).imag == pytest.approx(81900.0)


def test_delayed_values_follow_a_line_exactly():
    x = np.array([1e-9, 1e-3, 0.019, 0.021, 1.0, 40.0])
    exact = x + np.expm1(-x)  # of a value that rises as fast as the time, from 0
    assert delayed(np.zeros(6), np.zeros(6), x, x) == pytest.approx(exact, rel=1e-6)
    assert mean_response(x) == pytest.approx(exact / x, rel=1e-6)


def test_steps_of_a_line_are_as_exact_as_one():
    first = delayed(0.2, 1.0, 2.0, 0.3)
    assert delayed(first, 2.0, 3.0, 0.3) == pytest.approx(float(delayed(0.2, 1.0, 3.0, 0.6)))


def test_universal_constants_move_to_a_reference_of_20_degrees():
    moved = UNIVERSAL.moved(293.15)
    assert (moved.C1, moved.C2) == pytest.approx((7.4005, 121.6), abs=1e-4)
    assert np.log10(moved([269.15, 253.15, 293.15])) == pytest.approx([1.820, 3.628, 0.0], abs=5e-4)
    assert moved(293.15 - 121.6) == np.inf


def test_arrhenius_goes_on_from_wlf():
    shift = Shift(7.4, 121.6, 293.15, arrhenius_below=243.15, activation_energy=100e3)
    below = np.log(shift(233.15) / shift(243.15))
    assert below == pytest.approx(100e3 / 8.314462618 * (1.0 / 233.15 - 1.0 / 243.15))
    assert shift(250.0) == pytest.approx(float(Shift(7.4, 121.6, 293.15)(250.0)))


def test_cold_rubber_relaxes_later():
    cold = Relaxation(ONE, UNIVERSAL.moved(293.15))
    assert cold.modulus(5e-3 * 10**1.82, 269.15) == pytest.approx(
        float(ONE.modulus(5e-3)), rel=1e-3
    )


def scene(**rubber):
    keys = {"compound": "B", "prony": [[0.3, "5 ms"]], "modulus_is": "long-term"} | rubber
    load = {"pressure": "1 bar", "speed": "1 m/s", "duration": "1 ms"}
    return scene_from_dict({"name": "a", "model": "slice", "rubber": keys, "load": load})


def test_constants_of_a_scene_are_the_instantaneous_ones():
    given, now = scene(modulus_is="instantaneous").mooney_rivlin, scene().mooney_rivlin
    assert (given.C10, given.C01) == (0.1662e6, 0.1068e6)
    assert (now.C10, now.C01) == pytest.approx((0.1662e6 / 0.7, 0.1068e6 / 0.7))
    assert now.D1 == given.D1
    assert scene_from_dict(scene().as_dict()) == scene()


@pytest.mark.parametrize(
    ("rubber", "said"),
    [
        ({"prony": [[0.3]]}, "arm 1 is no pair"),
        ({"prony": []}, "no list of 1 to 60 arms"),
        ({"prony": [[0.6, 1.0], [0.5, 2.0]]}, "1.1 in sum"),
        ({"prony": [[0.1, 1.0], [0.3, 1.0]]}, "the same tau"),
        ({"modulus_is": None}, "rubber.modulus_is is missing"),
        ({"prony": None}, "only for rubber that relaxes"),
        ({"prony": [[0.98, 1.0]]}, "Poisson's ratio of"),
        ({"wlf": {"C1": 7.4, "C2": 10, "reference": "20 degC"}}, "no shift at -4 degC"),
        ({"wlf": {"C1": 7.4, "C2": 121, "reference": 293, "arrhenius_below": 250}}, "together"),
        ({"wlf": {**ARRHENIUS, "reference": "240 K"}}, "colder than arrhenius_below = 250 K"),
    ],
)
def test_what_is_no_relaxation_gets_one_sentence(rubber, said):
    with pytest.raises(SceneError, match=said):
        scene(**rubber)
