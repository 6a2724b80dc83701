"""Hysteresis on rough ice: the theory, its table, the law with it at points and in blocks."""

import json
from pathlib import Path

import numpy as np
import pytest
from program import exit_code, rows_of
from scipy.integrate import quad, trapezoid

from iceslide_fem.film.conditions import conditions_at
from iceslide_fem.film.hysteresis import Hysteresis, hysteresis_of
from iceslide_fem.laws.film_of_scene import film_law
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.variation import with_values
from iceslide_fem.surfaces.measured_spectrum import measured
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum, self_affine
from iceslide_fem.surfaces.rough_ice import Moduli, sliding
from iceslide_fem.surfaces.surface import Surface

pytestmark = pytest.mark.quick

CASE = Path(__file__).parent.parent / "cases" / "rough_ice.toml"
# Rubber and rows of reference numbers, computed apart with the formulas of `surfaces.rough_ice`:
# speed (m/s), temperature (degC), pressure (Pa); Hurst, longest, shortest wave, rms height (m);
# mu_h with gamma = 1, P at the shortest wave, mu_h with gamma = 0.5, mu_h with rubber as rough.
ARMS = 0.6e6 * 1.9 ** np.arange(1, 10)
RUBBER = Moduli(2e6, ARMS, 10.0 ** -np.arange(1, 10))
WLF = Shift(7.4005, 121.6, 293.15)
FINE, COARSE, SHORT = (0.8, 2e-3, 2e-6, 3e-6), (1.0, 5e-3, 10e-6), (0.8, 1e-3, 1e-6, 1e-6)
ROWS = [
    (1e-3, -20, 2e5, FINE, 0.038589910, 0.054925864, 0.0219848, 0.0385109),
    (1e-2, -20, 2e5, FINE, 0.040429718, 0.029204947, 0.0219928, 0.0404004),
    (1.0, -5, 2e5, FINE, 0.040522449, 0.024266147, 0.0218236, 0.0405007),
    (1.0, -5, 2e5, (*COARSE, 10e-6), 0.022695261, 0.078037510, 0.0133214, 0.0226637),
    (10.0, -5, 2e5, (*COARSE, 30e-6), 0.074773554, 0.013902947, 0.0387849, 0.0747343),
    (0.1, -10, 3e5, SHORT, 0.025270495, 0.061614803, 0.0146029, 0.0252580),
]


def surface_of(figures):
    hurst, longest, shortest, rms = figures
    return self_affine(rms, hurst, longest, shortest)


@pytest.mark.parametrize("row", ROWS)
def test_reference_numbers(row):
    speed, celsius, pressure, figures, mu, fraction, corrected, both = row
    ice, reduced = surface_of(figures), speed * WLF(celsius + ZERO_CELSIUS)
    found = sliding(ice, RUBBER, reduced, pressure)
    assert found.mu[0] == pytest.approx(mu, rel=1e-6)
    assert found.contact_fraction[0] == pytest.approx(fraction, rel=1e-6)
    assert sliding(ice, RUBBER, reduced, pressure, 0.5).mu[0] == pytest.approx(corrected, rel=5e-6)
    assert sliding(ice, RUBBER, reduced, pressure, 1.0, ice).mu[0] == pytest.approx(both, rel=5e-6)


def test_smooth_limit():
    """Where all of the area touches mu_h is a linear response: it grows with the height squared."""
    rms = 1e-9
    found = sliding(self_affine(rms, 0.8, 2e-3, 2e-6), RUBBER, WLF(268.15), 2e5)
    assert found.mu[0] / rms**2 == pytest.approx(6.8360567e10, rel=1e-6)
    assert found.contact_fraction[0] == pytest.approx(1.0)


@pytest.mark.parametrize("frequency", [1e-3, 3.0, 4e4, 1e12])
def test_means_over_the_angle_are_closed(frequency):
    def modulus(phi):
        turned = 1j * frequency * np.cos(phi) * RUBBER.times
        return RUBBER.long_term + (turned / (1.0 + turned) * ARMS).sum()

    def mean(function):
        return quad(function, 0.0, 0.5 * np.pi, epsabs=0.0, epsrel=1e-10, limit=400)[0] / (
            0.5 * np.pi
        )

    loss, square = RUBBER.means(np.array([frequency]))
    assert loss[0] == pytest.approx(mean(lambda x: np.cos(x) * modulus(x).imag), rel=1e-8)
    assert square[0] == pytest.approx(mean(lambda x: abs(modulus(x)) ** 2), rel=1e-8)


def test_spectra():
    """The rms height is that of all waves; rows between two of one power law change nothing."""
    ice = self_affine(3e-6, 0.8, 2e-3, 2e-6)
    assert ice.rms == pytest.approx(3e-6) and ice.longest == pytest.approx(2e-3)
    q = np.geomspace(*ice.q, 100_001)
    slope = np.sqrt(2.0 * np.pi * trapezoid(q**4 * ice(q), np.log(q)))
    assert ice.slope == pytest.approx(slope, rel=1e-6)
    rows = np.geomspace(*ice.q, 7)
    several = PowerSpectrum(tuple(rows), tuple(ice(rows)))
    one, other = (sliding(each, RUBBER, 1.0, 2e5).mu[0] for each in (ice, several))
    assert other == pytest.approx(one, rel=1e-7)
    assert ice.between(1e-3, 1e-5).rms < ice.rms == pytest.approx(ice.scaled(3e-6).rms)


def a_map(size=512, pixel=5e-6, hurst=0.8, seed=1):
    """A periodic self-affine map with waves from its side down to four pixels."""
    draw = np.random.default_rng(seed)
    q = 2.0 * np.pi * np.hypot(*np.meshgrid(*(np.fft.fftfreq(size, pixel),) * 2))
    with np.errstate(divide="ignore"):
        amplitude = np.where((q > 0.0) & (q <= 2.0 * np.pi / (4 * pixel)), q ** (-1.0 - hurst), 0.0)
    noise = np.fft.fft2(draw.standard_normal((size, size)))
    heights = np.fft.ifft2(amplitude * noise).real
    return Surface(3e-6 * heights / heights.std(), pixel, True)


def test_the_spectrum_of_a_map_is_that_of_its_figures():
    surface = a_map()
    found = measured(surface, 20e-6)
    assert found.rms == pytest.approx(3e-6, rel=0.01)
    assert found.shortest == pytest.approx(20e-6, rel=0.02)
    expected = self_affine(found.rms, 0.8, found.longest, found.shortest)
    for ice in (found, expected):
        assert 0.0 < sliding(ice, RUBBER, 1.0, 2e5).mu[0]
    ours, theirs = (sliding(each, RUBBER, 1.0, 2e5).mu[0] for each in (found, expected))
    assert ours == pytest.approx(theirs, rel=0.1)


@pytest.fixture(scope="module")
def scene():
    return load_scene(CASE)


def test_the_scene_has_the_rubber_of_the_reference(scene):
    law = hysteresis_of(scene)
    assert law.rubber.long_term == pytest.approx(2e6, rel=1e-6)
    assert law.rubber.arms[::-1] == pytest.approx(ARMS, rel=1e-6)
    assert hysteresis_of(scene) is law


def test_the_table_is_the_theory(scene):
    law = hysteresis_of(scene)
    draw = np.random.default_rng(5)
    speed, pressure = 10.0 ** draw.uniform(-6, 1.5, 60), 10.0 ** draw.uniform(4, 6.5, 60)
    kelvin = draw.uniform(240.0, 273.0, 60)
    tau, by_pressure, by_speed = law.shear(pressure, speed, kelvin)
    exact = sliding(law.ice, law.rubber, speed * law.shift(kelvin), pressure).mu
    assert tau / pressure == pytest.approx(exact, rel=5e-4)
    few = law.exact(pressure[:5], speed[:5], kelvin[:5])
    assert few[0] == pytest.approx((exact * pressure)[:5], rel=1e-9)
    for one, other in zip(few, (tau, by_pressure, by_speed), strict=True):
        assert one == pytest.approx(other[:5], rel=0.02, abs=1e-3 * np.abs(one).max())
    for found, step, moved in (
        (by_pressure, 1e-5 * pressure, law.shear(1.00001 * pressure, speed, kelvin)[0]),
        (by_speed, 1e-5 * speed, law.shear(pressure, 1.00001 * speed, kelvin)[0]),
    ):
        assert found == pytest.approx(
            (moved - tau) / step, rel=1e-3, abs=1e-6 * np.abs(found).max()
        )


def test_at_rest_and_without_pressure_there_is_none(scene):
    law = hysteresis_of(scene)
    tau, by_pressure, by_speed = law.shear(
        np.array([2e5, 0.0, -1e5]), np.array([0.0, 1.0, 1.0]), 268.0
    )
    assert (tau == 0.0).all() and np.isfinite(by_speed).all() and by_speed[0] > 0.0
    forth, back = (law.shear(np.array([2e5]), np.array([v]), 268.0)[0][0] for v in (1.0, -1.0))
    assert forth == -back > 0.0


def test_a_point_has_the_sum(scene):
    """Film and dry contact do not feel hysteresis, so mu is more by mu_h, and energies close."""
    import iceslide_fem

    smooth = scene.model_copy(
        update={"ice": scene.ice.model_copy(update={"roughness": type(scene.ice.roughness)()})}
    )
    law = hysteresis_of(scene)
    more = law.shear(np.array([2e5]), np.array([1.0]), scene.rubber_temperature)[0][0] / 2e5
    assert more == pytest.approx(0.040522449, rel=1e-4)
    rough, plain = (conditions_at(one, 2e5, 1.0, 0.02) for one in (scene, smooth))
    found, without = (iceslide_fem.point.simulate(one, tolerance=1e-3) for one in (rough, plain))
    for name in ("mu_mean", "mu_end"):
        gained = getattr(found, name)[0] - getattr(without, name)[0]
        assert gained == pytest.approx(more, rel=1e-3)
    assert found.film_height == pytest.approx(without.film_height, rel=1e-6)


def test_energies_of_a_run_have_an_entry(tmp_path):
    out = tmp_path / "out"
    assert exit_code("run", CASE, "--out", out) == 0
    last = rows_of(out / "history.csv")[-1]
    work, made = float(last["friction_work_J"]), float(last["hysteresis_heat_J"])
    assert 0.04 * work < made < work
    assert abs(float(last["energy_imbalance"])) < 1e-3


def test_derivatives_of_the_law(scene):
    law = film_law(scene)
    state = law.initial(law.first.height, 3)
    shear = law.at_start(law.first.height, 3)
    p, v = np.array([1e5, 2e5, 4e5]), np.array([0.5, 1.0, 2.0])
    tau, by_pressure, by_speed = shear(p, v)
    assert state[0].size == 3
    assert by_pressure == pytest.approx((shear(p * 1.000001, v)[0] - tau) / (p * 1e-6), rel=1e-3)
    assert by_speed == pytest.approx((shear(p, v * 1.000001)[0] - tau) / (v * 1e-6), rel=1e-3)


def test_the_command(tmp_path, capsys):
    out = tmp_path / "out"
    assert exit_code(
        "hysteresis", CASE, "--temperature", "-20degC,-5degC", "--pressure", "2bar",
        "--speed", "1cm/s,1m/s", "--out", out,
    ) == 0  # fmt: skip
    printed = capsys.readouterr().out
    assert "mu_h" in printed and "shortest wave" in printed
    rows = rows_of(out / "hysteresis.csv")
    assert len(rows) == 5
    assert float(rows[0]["mu_hysteresis"]) == pytest.approx(0.040522449, rel=1e-5)
    assert float(rows[1]["mu_hysteresis"]) == pytest.approx(0.040429718, rel=1e-5)
    figures = json.loads((out / "summary.json").read_text())
    assert figures["contact_fraction"] == pytest.approx(0.024266147, rel=1e-5)
    cut = {round(1e6 * one["shortest"], 2): one["mu"] for one in figures["cut_offs"]}
    assert cut[2.0] == pytest.approx(0.0405224, rel=1e-5) and cut[20.0] < 0.03 < 0.06 < cut[0.2]
    for name in ("speed", "waves", "cut_off"):
        assert (out / f"{name}.png").stat().st_size > 10_000
    assert "report.html" in {path.name for path in out.iterdir()}


def test_a_map_of_ice(tmp_path):
    surface = a_map(128, 10e-6)
    np.save(tmp_path / "ice.npy", surface.heights)
    changes = ["ice.roughness.rms=0", "ice.roughness.shortest=40um", "ice.roughness.pixel=10um"]
    text = CASE.read_text().replace('longest = "2 mm"\n', 'map = "ice.npy"\n')
    text = text.replace("surfaces/compound_B.csv", str(CASE.parent / "surfaces/compound_B.csv"))
    (tmp_path / "scene.toml").write_text(text)
    found = load_scene(tmp_path / "scene.toml", changes).ice.roughness.spectrum
    assert found.rms == pytest.approx(3e-6, rel=0.2)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["ice.roughness.longest=1um"], ["ice.roughness.longest", "at least 2 times"]),
        (["ice.roughness.rms=1mm"], ["rms slope", "allowed: up to 2"]),
        (["ice.roughness.map=nothing.npy"], ["ice.roughness.map", "not a file"]),
        (["ice.roughness.pixel=1um"], ["ice.roughness.pixel", "missing"]),
        (["ice.roughness.rms=3"], ["ice.roughness.rms", "allowed"]),
        (["friction.law=coulomb", "friction.mu=0.1"], ["contradict"]),
    ],
)
def test_wrong_roughness_is_one_sentence(changes, words):
    with pytest.raises(SceneError) as fault:
        load_scene(CASE, changes)
    assert all(word in str(fault.value) for word in words), fault.value
    assert "\n" not in str(fault.value)


def test_figures_of_the_ice_may_vary(scene):
    rough, smooth = (with_values(scene, {"ice.roughness.rms": rms}) for rms in (2e-6, 0.0))
    assert hysteresis_of(rough).ice.rms == pytest.approx(2e-6) and hysteresis_of(smooth) is None
    assert rough.ice.roughness.hurst == scene.ice.roughness.hurst


def test_a_sweep_over_the_ice_says_nothing_of_missing_friction(tmp_path, capsys):
    """It has dry friction, which holds where nothing melts."""
    out = tmp_path / "out"
    vary = "--vary", "ice.roughness.rms=0um,3um"
    assert exit_code("sweep", CASE, *vary, "--no-report", "--out", out) == 0
    assert "no dry friction" not in "".join(capsys.readouterr())
    smooth, rough = (float(row["mu_mean"]) for row in rows_of(out / "sweep.csv"))
    assert rough - smooth == pytest.approx(0.0405, rel=0.02)


def test_rubber_that_does_not_relax_has_no_hysteresis(tmp_path):
    text = CASE.read_text()
    start, end = text.index("modulus_is"), text.index("length = ")
    (tmp_path / "scene.toml").write_text(text[:start] + text[end:])
    with pytest.raises(SceneError, match="needs rubber that relaxes"):
        load_scene(
            tmp_path / "scene.toml",
            ["film.contact=" + str(CASE.parent / "surfaces/compound_B.csv")],
        )


def test_smooth_ice_is_refused_by_the_command(tmp_path, capsys):
    assert (
        exit_code("hysteresis", CASE, "--set", "ice.roughness.rms=0", "--out", tmp_path / "out")
        == 2
    )
    assert "smooth ice" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_arms_of_elastic_rubber():
    relaxation = Relaxation(Prony((0.5,), (1e-3,)), WLF)
    law = Hysteresis(self_affine(1e-6, 0.8, 1e-3, 1e-5), Moduli.of(4e6, relaxation), WLF, 1.0)
    slow, fast = (law.shear(np.array([2e5]), np.array([v]), 293.15)[0][0] for v in (1e-9, 1e3))
    middle = law.shear(np.array([2e5]), np.array([0.1]), 293.15)[0][0]
    assert 0.0 < slow < middle > fast > 0.0
