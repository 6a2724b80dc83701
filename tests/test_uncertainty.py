"""The spread of mu from that of inputs: distributions, sampling, control variate, refusals."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from program import exit_code, numbers_of
from scipy.stats import lognorm, norm, truncnorm

import iceslide_fem
from iceslide_fem.inference.uncertainty import propagate
from iceslide_fem.inference.uncertainty.propagate import spread_of_points, spread_of_runs
from iceslide_fem.inference.uncertainty.sampling import Inputs, read_calibration
from iceslide_fem.runs.many_points import Friction, friction
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.distribution import CUT, read_distribution

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
EVEN = (np.arange(2000) + 0.5) / 2000


def scene(*changes):
    return load_scene(CASE, ["model=point", "ice.heat=column", *changes])


def values(key, text, *changes):
    return read_distribution(scene(*changes), key, text).at(EVEN)


def test_a_normal_one_ends_at_its_cut():
    found = values("ice.temperature", "-4degC+-0.5K")
    assert found == pytest.approx(truncnorm.ppf(EVEN, -CUT, CUT, 269.15, 0.5), abs=1e-6)
    assert values("film.k_scale", "2+-10%").std() == pytest.approx(0.2, rel=0.01)
    assert values("water.viscosity", "±5%").mean() == pytest.approx(scene().viscosity, rel=1e-6)


def test_a_log_normal_one_has_the_scenes_median():
    found = values("load.pressure", "~10%")
    assert np.median(found) == pytest.approx(1e5, rel=1e-3)
    exact = lognorm(np.sqrt(np.log(1.01)), scale=1e5)
    assert found.std() == pytest.approx(exact.std(), rel=0.01)


def test_an_even_one_and_the_range_of_its_key():
    found = values("load.pressure", "1bar..2bar")
    assert (found.min(), found.max()) == pytest.approx((1e5, 2e5), rel=1e-3)
    assert values("film.k_scale", "90+-10").max() <= 100.0
    assert values("ice.temperature", "-0.1degC+-0.5K").max() <= 273.15


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        ("film.k_scale", "10%", "is of no known form"),
        ("film.k_scale", "~x%", "is of no known form"),
        ("film.k_scal", "~10%", "did you mean film.k_scale"),
        ("film.carrier", "~10%", "film.carrier is not a number"),
        ("load.pressure", "2bar..1bar", "the wrong way round"),
        ("load.pressure", "1bar+-1mm", "standard deviation"),
        ("load.pressure", "1bar+-0bar", "more than 0"),
        ("load.pressure", "1mm+-1bar", "has a value that"),
        ("ice.temperature", "-4degC+-0.5degC", "in degrees"),
        ("film.dry_softening", "~10%", "no positive film.dry_softening"),
        ("film.dry_softening", "+-10%", "has no mean"),
    ],
)
def test_what_is_no_distribution_is_refused(key, text, words):
    with pytest.raises(SceneError, match=words):
        read_distribution(scene(), key, text)


def test_the_published_scene_under_uncertain_inputs():
    """Figures of another sampler with 1024 points; 0.05 of the standard deviation."""
    texts = {"film.k_scale": "1+-10%", "film.D_scale": "1+-10%", "film.H_V_scale": "1+-10%",
             "ice.temperature": "-4degC+-0.5K", "water.viscosity": "+-5%",
             "ice.conductivity": "+-5%"}  # fmt: skip
    base = load_scene(CASE, ["model=point"])
    inputs = Inputs([read_distribution(base, key, text) for key, text in texts.items()])
    mu = spread_of_points(base, inputs, 1024, "mu_mean").mu
    assert mu.mean() == pytest.approx(0.353327, abs=0.05 * 0.033)
    assert mu.std() == pytest.approx(0.032983, rel=0.02)
    assert np.quantile(mu, [0.025, 0.975]) == pytest.approx([0.289375, 0.418977], abs=0.05 * 0.033)


def made_up(of_inputs):
    """A friction that is a function of the inputs."""

    def found(scenes, rows=None, times=()):
        mu = np.array([[of_inputs(one)] for one in scenes])
        return Friction(mu, mu, mu, np.zeros((*mu.shape, 0)), {})

    return found


def test_indices_of_a_function_with_a_known_variance(monkeypatch):
    """mu = 1 + 3 a + 4 b: parts 0.36 and 0.64; a product of two has none alone."""
    pair = [read_distribution(scene(), key, "1+-10%") for key in ("film.k_scale", "film.D_scale")]
    line = made_up(lambda one: 1.0 + 3.0 * one.film.k_scale + 4.0 * one.film.D_scale)
    monkeypatch.setattr(propagate, "friction", line)
    found = spread_of_points(scene(), Inputs(pair), 512, "mu_mean")
    first, total = np.array(list(found.indices.values())).T
    assert first == pytest.approx([0.36, 0.64], abs=0.03)
    assert total == pytest.approx([0.36, 0.64], abs=0.03)
    both = made_up(lambda one: (one.film.k_scale - 1.0) * (one.film.D_scale - 1.0))
    monkeypatch.setattr(propagate, "friction", both)
    first, total = np.array(list(spread_of_points(scene(), Inputs(pair), 512, "mu_mean")
                                 .indices.values())).T  # fmt: skip
    assert np.abs(first).max() < 0.1 and total == pytest.approx([1.0, 1.0], abs=0.15)


def test_few_runs_and_many_points_give_the_spread_of_runs(monkeypatch, tmp_path):
    pair = [read_distribution(scene(), key, "1+-10%") for key in ("film.k_scale", "film.D_scale")]

    def point(one):
        return 3.0 * one.film.k_scale + 4.0 * one.film.D_scale

    monkeypatch.setattr(propagate, "friction", made_up(point))

    def run(scenes, folder):
        return np.array([0.1 + 0.5 * point(one) for one in scenes])

    found = spread_of_runs(scene("model=slice"), Inputs(pair), 8, "mu_mean", run, tmp_path)
    assert found.runs.slope == pytest.approx(0.5) and found.runs.offset == pytest.approx(0.1)
    assert found.runs.correlation == pytest.approx(1.0)
    assert found.mu.std() == pytest.approx(0.25, rel=0.02)
    assert found.mu.mean() == pytest.approx(3.6, rel=1e-3)


def test_failed_samples_are_counted_and_many_of_them_stop(monkeypatch):
    inputs = Inputs([read_distribution(scene(), "film.k_scale", "1+-10%")])

    def some(share):
        def found(scenes, rows=None, times=()):
            mu = np.ones((len(scenes), 1))
            failed = range(int(share * len(scenes)))
            mu[list(failed)] = np.nan
            return Friction(mu, mu, mu, np.zeros((*mu.shape, 0)), {(i, 0): "why" for i in failed})

        return found

    monkeypatch.setattr(propagate, "friction", some(0.04))
    found = spread_of_points(scene(), inputs, 128, "mu_mean")
    assert len(found.samples.reasons) == 5
    monkeypatch.setattr(propagate, "friction", some(0.06))
    with pytest.raises(SimulationStopped, match="7 of 128 samples failed, more than 5%"):
        spread_of_points(scene(), inputs, 128, "mu_mean")


def calibration(folder, covariance):
    content = {
        "parameters": {
            key: {"estimate": value, "bounds": [value / 10.0, value * 10.0]}
            for key, value in (("film.dry_stress", 0.45e6), ("film.dry_softening", 13.5))
        },
        "covariance_of_ln": covariance,
    }
    (folder / "calibration.json").write_text(json.dumps(content))
    return folder / "calibration.json"


def test_parameters_of_a_calibration_vary_together(tmp_path):
    wanted = np.array([[0.04, 0.038], [0.038, 0.04]])
    found = read_calibration(calibration(tmp_path, wanted.tolist()))
    quantiles = np.random.default_rng(0).random((4000, 2))
    z = np.log(found.at(quantiles))
    assert np.cov(z.T) == pytest.approx(wanted, rel=0.06)
    assert z.mean(axis=0) == pytest.approx(np.log([0.45e6, 13.5]), abs=0.02)
    assert Inputs([], found).groups == {"calibration": [0, 1]}


def test_the_command_and_its_files(tmp_path, capsys):
    text = CASE.read_text() + '\n[uncertainty]\n"film.k_scale" = "~10%"\n'
    (tmp_path / "scene.toml").write_text(text)
    out = tmp_path / "out"
    words = ["uncertainty", tmp_path / "scene.toml", "--set=model=point", f"--out={out}",
             "--input=ice.temperature=+-0.5K", "--samples=128"]  # fmt: skip
    assert exit_code(*words) == 0
    assert "with a standard deviation of" in capsys.readouterr().out
    figures = json.loads((out / "uncertainty.json").read_text())
    assert set(figures["inputs"]) == {"film.k_scale", "ice.temperature"}
    rows = numbers_of(out / "samples.csv")
    assert np.mean([row["mu_mean"] for row in rows]) == pytest.approx(figures["mean"])
    assert {path.name for path in out.iterdir()} >= {"report.html", "distribution.png"}
    one = rows[3]
    base = load_scene(CASE, ["model=point", f"film.k_scale={one['film.k_scale']}",
                             f"ice.temperature={one['ice.temperature']}"])  # fmt: skip
    assert friction([base]).mu_mean[0, 0] == pytest.approx(one["mu_mean"], rel=1e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "nothing in"),
        (["--input=film.k_scale"], "is not of the form"),
        (["--input=film.dry_stress=1bar+-10%"], "film.dry_stress is no number in this scene"),
        (["--from=none.json"], "none.json"),
        (["--input=film.k_scale=~10%", "--samples=3"], "samples"),
    ],
)
def test_wrong_input_is_refused_in_a_sentence(words, said, tmp_path, capsys):
    out = tmp_path / "out"
    assert exit_code("uncertainty", CASE, "--set=model=point", f"--out={out}", *words) == 2
    shown = capsys.readouterr().err
    assert said in shown and len(shown.strip().splitlines()) == 1 and not out.exists()


@pytest.mark.fe
def test_slices_by_few_runs(tmp_path):
    changes = {"model": "slice", "numerics.refinement": "0.5", "numerics.tolerance": "3e-2",
               "ice.heat": "column", "load.duration": "1 ms"}  # fmt: skip
    found = iceslide_fem.uncertainty(
        CASE, {"film.k_scale": "~10%", "film.D_scale": "~10%"}, runs=4, change=changes,
        out=tmp_path / "out",
    )  # fmt: skip
    assert found.attrs["control_variate.correlation"] > 0.95
    assert found["mu"].sizes == {"sample": 10_000}
    assert norm.sf(3) < float(found["mu"].std()) < 0.1
    assert len(numbers_of(tmp_path / "out" / "runs.csv")) == 4


WHEEL = "--gaussian 60mm,2bar,30mm --speed 20km/h --slip 0.03,0.1,1"


def test_a_wheel_by_few_of_them(tmp_path, capsys):
    """Its peak follows the dry stress, as a point's friction does."""
    words = ["uncertainty", CASE.parent / "cold_point.toml", "--input=film.dry_stress=~10%",
             "--runs=4", f"--wheel={WHEEL}", f"--out={tmp_path / 'out'}"]  # fmt: skip
    assert exit_code(*words) == 0
    figures = json.loads((tmp_path / "out" / "uncertainty.json").read_text())
    assert figures["model"] == "wheel" and figures["output"] == "mu_peak"
    assert figures["control_variate"]["correlation"] > 0.95
    assert 0.04 < figures["std"] / figures["mean"] < 0.12
    capsys.readouterr()


def test_a_footprint_by_few_of_them(tmp_path, capsys):
    found = iceslide_fem.uncertainty(
        CASE.parent / "cold_point.toml", {"film.dry_stress": "~10%"}, runs=4,
        footprint="--gaussian 60mm,2bar,30mm --speed 3m/s", out=tmp_path / "out",
    )  # fmt: skip
    assert found.attrs["model"] == "footprint" and found.attrs["output"] == "mu_mean"
    assert found.attrs["control_variate.correlation"] > 0.9
    assert 0.01 < found.attrs["std"] / found.attrs["mean"] < 0.12
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--output=mu_locked"], "is that of a wheel; give --wheel"),
        (["--output=mu_mean", f"--wheel={WHEEL}"], "is none of a wheel"),
        ([f"--wheel={WHEEL} --scene a.toml"], "takes no --scene"),
        (["--wheel=--gaussian 60mm,2bar,30mm --slipp 1"], "slipp is not a known"),
        ([f"--wheel={WHEEL}", "--input=load.speed=~10%"], "load.speed does not act on a wheel"),
        ([f"--footprint={WHEEL}", f"--wheel={WHEEL}"], "contradict each other"),
        (
            ["--footprint=--gaussian 60mm,2bar,30mm", "--input=film.k_scale=~10%"],
            "film.k_scale does not act on a footprint",
        ),
        (["--footprint=--gaussian 60mm,2bar,30mm --viscosity 1e-3"], "takes no --viscosity"),
    ],
)
def test_a_wheel_that_cannot_be_is_refused(words, said, tmp_path, capsys):
    out = tmp_path / "out"
    case = CASE.parent / "cold_point.toml"
    asked = ["uncertainty", case, "--input=film.dry_stress=~10%", f"--out={out}", *words]
    assert exit_code(*asked) == 2
    shown = capsys.readouterr().err
    assert said in shown and len(shown.strip().splitlines()) == 1 and not out.exists()


def test_names_of_the_package():
    assert SimpleNamespace(**{name: getattr(iceslide_fem, name) for name in
                              ("calibrate", "uncertainty")})  # fmt: skip
