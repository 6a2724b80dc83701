"""A tread of rubber that relaxes, against quadrature of the hereditary integral; the carcass."""

import numpy as np
import pytest
from scipy.integrate import quad

from iceslide_fem.laws.table import law_of
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.law_contact import LawContact
from iceslide_fem.preprocess.wheel.tread import Tread, stiffness_of
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict

pytestmark = pytest.mark.quick

V, LENGTH, HEIGHT = 20.0 / 3.6, 0.12, 8e-3  # m/s, m, m
G = 0.546e6  # Pa, long-term
ARMS = [(0.5, 1e-7), (0.3, 1e-5), (0.1, 1e-4), (0.05, 1e-3), (0.025, 1e-2)]
SCENE = """name = "soft"
model = "point"
[rubber]
C10 = "0.1662 MPa"
C01 = "0.1068 MPa"
D1 = "0.000737 1/MPa"
prony = [[0.5, "0.1 us"], [0.3, "10 us"], [0.1, "0.1 ms"], [0.05, "1 ms"], [0.025, "10 ms"]]
modulus_is = "long-term"
{more}
[load]
pressure = "2 bar"
speed = "4 m/s"
duration = "5 ms"
[ice]
temperature = "-4 degC"
[friction]
law = "coulomb"
mu = {mu}
"""


def modulus(time, slower=1.0):
    """c(t) of a slick tread, Pa/m."""
    left = 1.0 - sum(g for g, _ in ARMS)
    arms = sum(g * np.exp(-time / (slower * tau)) for g, tau in ARMS)
    return G / HEIGHT * (left + arms) / left


def stress(time, rate, slower=1.0):
    """tau(t) under a stretch at a constant `rate` (m/s), by adaptive quadrature."""
    points = [slower * tau for _, tau in ARMS if slower * tau < time]
    found, _ = quad(modulus, 0.0, time, args=(slower,), points=points, limit=500, epsrel=1e-11)
    return rate * found


def case(tmp_path, mu, more="", **options):
    file = tmp_path / "soft.toml"
    file.write_text(SCENE.format(mu=mu, more=more), encoding="utf-8")
    given = {"gaussian": "120mm,2bar,5m", "speed": f"{V!r} m/s", "scene": file}
    return WheelCase.of(given | options)


def point(given, slip):
    """The wheel at one slip ratio, and its tread."""
    footprint = read_source(given).pressure_map
    (member,) = given.members
    tread = stiffness_of(given, footprint).tread(given.pattern, member.temperature)
    contact = coulomb(given.law.friction.mu)
    (found,) = friction(footprint, [Rolling(V, slip)], tread, contact)
    return found, tread, footprint


def coulomb(mu):
    return LawContact(
        law_of(
            scene_from_dict(
                {
                    "name": "a", "model": "slice", "rubber": {"compound": "B"},
                    "load": {"pressure": 1e5, "speed": 1.0, "duration": 1e-3},
                    "friction": {"law": "coulomb", "mu": mu},
                }
            )
        ),
        269.15,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("more", "slower"),
    [("", 1.0), ('wlf = { C1 = 7.4, C2 = "121.6 K", reference = "20 degC" }', None)],
    ids=["no shift", "WLF"],
)
def test_a_bristle_that_sticks_has_the_hereditary_integral(tmp_path, more, slower):
    slip = 1e-3
    given = case(tmp_path, 2.0, more)
    found, tread, footprint = point(given, slip)
    assert found.sliding == 0.0
    slower = slower or 10.0 ** (7.4 * 24.0 / (121.6 - 24.0))
    transit = LENGTH / (V * (1.0 - slip))
    rate = V * slip
    over = np.array([stress(time, rate, slower) for time in np.linspace(0.0, transit, 241)])
    mean = 0.5 * (over[1:] + over[:-1]).mean() / footprint.mean_pressure
    assert found.mu == pytest.approx(mean, rel=2e-4)
    assert tread.after(transit) == pytest.approx(over[-1] / (rate * transit), rel=1e-9)


def test_the_first_bristles_that_slide(tmp_path):
    """Uniform pressure: all stick until the integral is mu p, and slide from there on."""
    mu, slip = 0.2, 0.02
    found, *_ = point(case(tmp_path, mu), slip)
    rate, transit = V * slip, LENGTH / (V * (1.0 - slip))
    low, high = 0.0, transit
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stress(middle, rate) < mu * 2e5 else (low, middle)
    assert found.sliding == pytest.approx(1.0 - low / transit, abs=1e-4)


def history(limit, stretch, kernel):
    """Stress of a bristle under `limit` (n,), and where it slides; no arm is kept.

    Every step stretches it by `stretch` (m), or by what the limit allows; `kernel` is c at the age
    of a stretch.
    """
    n = limit.size
    steps, found, slides = np.zeros(n), np.zeros(n), np.zeros(n, dtype=bool)
    for i in range(n):
        before = kernel[1 : i + 1][::-1] @ steps[:i]
        allowed = (limit[i] - before) / kernel[0]
        slides[i] = allowed < stretch
        steps[i] = min(stretch, allowed)
        found[i] = before + kernel[0] * steps[i]
    return found, slides


def test_a_bristle_slides_and_sticks_again_from_its_state():
    """Two humps of pressure: the bristle slides where the first one falls, and sticks below the
    second one, with arms that remember both.
    """
    mu, slip, cells = 0.3, 0.01, 480
    arms = [(0.3, 1e-3), (0.4, 8e-3)]
    left = 1.0 - sum(g for g, _ in arms)
    c0 = 6.825e7 / left
    x = (np.arange(cells) + 0.5) * LENGTH / cells
    pressure = 1.5e5 - 1e5 * np.cos(4.0 * np.pi * x / LENGTH)
    footprint = PressureMap(pressure[None, ::-1].copy(), LENGTH / cells, 1.0)
    tread = Tread(c0, None, Prony(*zip(*arms, strict=True)))
    (found,) = friction(footprint, [Rolling(V, slip)], tread, coulomb(mu))

    fine = 8000
    dt = LENGTH / (V * (1.0 - slip)) / fine
    at = (np.arange(fine) + 1.0) * LENGTH / fine
    limit = mu * (1.5e5 - 1e5 * np.cos(4.0 * np.pi * at / LENGTH))
    lags = (np.arange(fine) + 0.5) * dt
    kernel = c0 * (left + sum(g * np.exp(-lags / tau) for g, tau in arms))
    taken, slides = history(limit, V * slip * dt, kernel)
    assert np.count_nonzero(np.diff(slides.astype(int)) == -1) >= 1  # it sticks again
    assert found.mu == pytest.approx(taken.mean() / pressure.mean(), rel=1e-3)
    assert found.sliding == pytest.approx(slides.mean(), abs=5e-3)
    elastic, *_ = friction(footprint, [Rolling(V, slip)], Tread(c0 * left), coulomb(mu))
    assert abs(found.mu / elastic.mu - 1.0) > 0.02


def test_a_tread_that_relaxed_long_ago_is_elastic(tmp_path):
    slips = [0.002, 0.01, 0.05, 1.0]
    soft, stiff = G / HEIGHT, G / HEIGHT / 0.025
    at_once = Prony((0.9, 0.075), (1e-12, 1e-11))
    rolls = [Rolling(V, slip) for slip in slips]
    footprint = read_source(case(tmp_path, 0.2)).pressure_map
    relaxed = friction(footprint, rolls, Tread(stiff, None, at_once), coulomb(0.2))
    elastic = friction(footprint, rolls, Tread(soft), coulomb(0.2))
    assert [one.mu for one in relaxed] == pytest.approx([one.mu for one in elastic], rel=1e-6)


def test_compliances_of_tread_and_carcass_add(tmp_path):
    prony = Prony(*zip(*ARMS, strict=True))
    frequency = np.geomspace(1e-2, 1e9, 40)
    for ratio in (0.01, 1.0, 50.0):
        both = prony.in_series(ratio)
        modulus = prony.dynamic(frequency)
        assert both.dynamic(frequency) == pytest.approx(
            (1.0 + ratio) * modulus / (1.0 + ratio * modulus), rel=1e-9
        )
    soft, *_ = point(case(tmp_path, 2.0, stiffness="6e7Pa/m", carcass="3e7Pa/m"), 1e-3)
    same, *_ = point(case(tmp_path, 2.0, stiffness="2e7Pa/m"), 1e-3)
    assert soft.mu == pytest.approx(same.mu, rel=1e-12)
    alone, series = (
        point(case(tmp_path, 2.0, **more), 1e-3)[1].after(1e3)
        for more in ({}, {"carcass": "6e7Pa/m"})
    )
    assert 1.0 / series == pytest.approx(1.0 / alone + 1.0 / 6e7, rel=1e-5)


def test_the_tread_relaxes_at_the_temperature_of_each_member(tmp_path):
    wlf = 'wlf = { C1 = 7.4, C2 = "121.6 K", reference = "20 degC" }'
    given = case(tmp_path, 0.2, wlf, vary=["temperature=-20degC,-2degC"])
    stiffness = stiffness_of(given, read_source(given).pressure_map)
    cold, warm = (
        stiffness.tread(None, member.temperature).after(20e-3) for member in given.members
    )
    assert cold > 2.0 * warm > 2.0 * stiffness.value
    with pytest.raises(SceneError, match="no shift at -110 degC"):
        stiffness.tread(None, 163.15)
