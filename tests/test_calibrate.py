"""Parameters from measured friction: known ones are found, doubt is said, wrong input refused."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from program import exit_code

import iceslide_fem
from iceslide_fem.inference.calibrate.fit import fit, leave_one_out
from iceslide_fem.inference.calibrate.measured import read_measured
from iceslide_fem.inference.calibrate.problem import Problem, fitted
from iceslide_fem.runs.many_points import Rows, friction
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.variation import with_values

CASE = Path(__file__).parent.parent / "cases" / "cold_point.toml"
TRUE = {"film.dry_stress": 0.45e6, "film.dry_softening": 13.5, "film.dry_residual": 0.5}
FIT = {
    "film.dry_stress": "10kPa:10MPa",
    "film.dry_softening": "1K:100K",
    "film.dry_residual": "0.02K:5K",
}
HEAD = "speed (m/s),pressure (bar),temperature (degC),mu"


@pytest.fixture
def iceslide(capsys):
    def call(*words):
        code = exit_code(*words)
        said = capsys.readouterr()
        return SimpleNamespace(returncode=code, stdout=said.out, stderr=said.err)

    return call


def scene(*changes):
    return load_scene(CASE, changes)


def rows(speeds=(0.03, 0.3, 1.0, 3.0), bars=(1.5, 3.0), celsius=(-20.0, -10.0, -5.0, -2.0)):
    v, p, T = map(np.ravel, np.meshgrid(speeds, bars, celsius, indexing="ij"))
    return Rows(1e5 * p, v, 273.15 + T, 20e-3 / v)


def mu_of(loads, values=TRUE):
    return friction([with_values(scene(), values)], loads).mu_mean[0]


def data(folder, loads, mu, head=HEAD):
    path = folder / "tester.csv"
    lines = [
        f"{v:.9g},{p / 1e5:.9g},{T - 273.15:.9g},{m:.9g}"
        for v, p, T, m in zip(loads.speed, loads.pressure, loads.temperature, mu, strict=True)
    ]
    path.write_text("\n".join([head, *lines]))
    return path


def problem(path, asked, *changes, **more):
    changed = scene(*changes)
    given = read_measured(path, changed, 20e-3, **more)
    return Problem(changed, given, fitted(changed, asked), "mu_mean")


def test_parameters_of_noisy_data_and_their_intervals(tmp_path):
    """32 rows at 5 % noise: figures of an independent least-squares program."""
    loads = rows()
    mu = mu_of(loads) * (1.0 + 0.05 * np.random.default_rng(7).standard_normal(32))
    start = ["film.dry_stress=0.3MPa", "film.dry_softening=8K", "film.dry_residual=1K"]
    asked = problem(data(tmp_path, loads, mu), FIT, *start)
    found = fit(asked)
    assert np.exp(found.best.z) == pytest.approx([441.49e3, 13.731, 0.5169], rel=1e-3)
    errors = np.sqrt(np.diag(found.covariance))
    assert errors == pytest.approx([0.02585, 0.03686, 0.12561], rel=0.02)
    ends = np.exp([(one.low, one.high) for one in found.intervals])
    assert ends == pytest.approx(
        np.array([[418.9e3, 466.3e3], [12.72, 14.84], [0.3874, 0.6542]]), rel=5e-3
    )
    rest, unseen = 0.05 * found.best.residuals, 0.05 * leave_one_out(asked, found.best)
    assert (rest**2).sum() == pytest.approx(0.062893, rel=1e-3)
    assert np.sqrt(np.mean(unseen**2)) == pytest.approx(0.04723, rel=5e-3)


def test_scipys_own_fit_finds_the_same(tmp_path):
    from scipy.optimize import curve_fit

    loads = rows(bars=(2.0,), speeds=(0.1, 1.0))
    mu = mu_of(loads) * (1.0 + 0.03 * np.random.default_rng(1).standard_normal(8))
    asked = {key: FIT[key] for key in ("film.dry_stress", "film.dry_softening")}
    found = fit(problem(data(tmp_path, loads, mu), asked))

    def model(_, *ln):
        return np.log(mu_of(loads, TRUE | dict(zip(asked, np.exp(ln), strict=True))))

    z, covariance = curve_fit(
        model, None, np.log(mu), np.log([0.3e6, 10.0]), method="lm", epsfcn=1e-4
    )
    assert found.best.z == pytest.approx(z, abs=1e-3)
    assert found.covariance == pytest.approx(covariance, rel=0.05)


def test_what_only_a_ratio_determines_is_said(tmp_path, iceslide):
    """Near melting the strength is stress times a difference of temperature over softening.

    So the interval of the residual is that of a fit of the stress alone at any softening.
    """
    loads = rows(speeds=(0.01, 0.03), celsius=(-3.0, -2.0, -1.0))
    noise = 0.05 * np.random.default_rng(3).standard_normal(12)
    path = data(tmp_path, loads, mu_of(loads) * (1.0 + noise))
    options = [f"--fit={key}={bounds}" for key, bounds in FIT.items()]
    ran = iceslide("calibrate", path, CASE, *options, "--over=20mm", f"--out={tmp_path / 'out'}")
    assert ran.returncode == 0, ran.stderr
    assert "only film.dry_stress / film.dry_softening is" in " ".join(ran.stdout.split())
    figures = json.loads((tmp_path / "out" / "calibration.json").read_text())
    for key in ("film.dry_stress", "film.dry_softening"):
        assert figures["parameters"][key]["high"] is None
    residual = figures["parameters"]["film.dry_residual"]
    assert [residual["low"], residual["high"]] == pytest.approx([0.1629, 0.8324], rel=0.01)
    assert any("does not close" in one for one in figures["warnings"])


def test_a_parameter_at_its_bound_and_one_without_effect(tmp_path):
    loads = rows(celsius=(-20.0,))
    path = data(tmp_path, loads, mu_of(loads))
    asked = {"film.dry_stress": "0.3MPa:0.4MPa", "rubber.height": "1mm:20mm"}
    out = tmp_path / "out"
    found = iceslide_fem.calibrate(
        path, CASE, asked, over="20mm", change={"film.dry_stress": "0.35MPa"}, out=out
    )
    warnings = json.loads((out / "calibration.json").read_text())["warnings"]
    assert any("film.dry_stress is at its upper bound, 400 kPa" in one for one in warnings)
    assert any("rubber.height has no effect" in one for one in warnings)
    assert found["estimate"].sel(parameter="film.dry_stress") == pytest.approx(0.4e6)


def test_the_snippet_is_a_part_of_a_scene(tmp_path, iceslide):
    loads = rows(speeds=(0.3, 1.0))
    path = data(tmp_path, loads, mu_of(loads))
    out = tmp_path / "out"
    ran = iceslide("calibrate", path, CASE, "--fit=film.dry_stress=10kPa:10MPa", "--over=20mm",
                   f"--out={out}")  # fmt: skip
    assert ran.returncode == 0 and "95% intervals by profiles" in ran.stdout
    assert 'dry_stress = "450 kPa"' in (out / "snippet.toml").read_text()
    names = {path.name for path in out.iterdir()}
    assert names >= {"calibration.json", "residuals.csv", "report.html", "measured.png"}
    figures = json.loads((out / "calibration.json").read_text())
    one = figures["parameters"]["film.dry_stress"]
    assert one["low"] < one["estimate"] < one["high"] and one["unit"] == "Pa"


def test_forces_sigma_and_series_are_read(tmp_path):
    own = scene()
    loads = rows(speeds=(0.3, 1.0), bars=(2.0,), celsius=(-10.0, -5.0))
    mu = mu_of(loads)
    area = own.rubber.length * own.rubber.width
    lines = ["speed_m_s,temperature_C,friction_force (N),sigma_mu"]
    pressure = own.load.pressures.first
    lines += [f"{v},{T - 273.15},{m * pressure * area},{0.02 * m}" for v, T, m in
              zip(loads.speed, loads.temperature, mu, strict=True)]  # fmt: skip
    (tmp_path / "force.csv").write_text("\n".join(lines))
    read = read_measured(tmp_path / "force.csv", own)
    assert read.mu == pytest.approx(mu) and read.sigma == pytest.approx(0.02) and read.known
    times = np.linspace(1e-3, 15e-3, 12)
    values = friction([with_values(own, TRUE)], loads, times).samples[0]
    lines = ["speed (m/s),pressure (bar),temperature (degC),series"]
    for number in range(4):
        kept = slice(number, None, 2)  # of different times
        text = "\n".join(f"{t},{m}" for t, m in zip(times[kept], values[number, kept], strict=True))
        (tmp_path / f"{number}.csv").write_text("time_s,mu\n" + text)
        v, T = loads.speed[number], loads.temperature[number]
        lines.append(f"{v},2.0,{T - 273.15},{number}.csv")
    (tmp_path / "series.csv").write_text("\n".join(lines))
    found = fit(problem(tmp_path / "series.csv", {"film.dry_stress": "10kPa:10MPa"}, noise=0.01))
    assert np.exp(found.best.z) == pytest.approx([0.45e6], rel=2e-3)


ROW = "1,2,-5,0.3"
GOOD = "\n".join([HEAD, *[ROW] * 4])


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("speed,pressure (bar),mu\n1,2,0.3\n1,2,0.3\n1,2,0.3", [], "says no unit"),
        (f"{HEAD}\n{ROW}\n{ROW}\n1,2,-5,-0.1", [], "mu = -0.1 is out of range"),
        (f"{HEAD}\n{ROW}\n{ROW}", [], "has 2 rows, and 1 parameters need at least 3"),
        (GOOD.replace("mu", "friction"), [], "neither of mu and friction_force_N"),
        (GOOD, ["--fit=film.dry_stres=1kPa:1MPa"], "did you mean film.dry_stress"),
        (GOOD, ["--fit=film.carrier=1:2"], "film.carrier is not a number"),
        (GOOD, ["--fit=film.D_scale=2:3"], "does not hold the scene's film.D_scale = 1"),
        (GOOD, ["--fit=film.D_scale=2"], "is not of the form film.D_scale=low:high"),
        (GOOD, ["--fit=film.D_scale=0:2"], "out of range"),
        (GOOD, ["--fit=load.speed=0.1:9"], "has speed, and --fit load.speed fits it, too"),
        (GOOD.replace("1,2,-5", "1,2,5"), [], "temperature"),
        (GOOD, ["--noise=0"], "out of range"),
        (GOOD, ["--fit=film.k=0.1:0.9"], "film has k only; give k, D and H_V together"),
    ],
)  # fmt: skip
def test_wrong_input_is_refused_in_a_sentence(text, options, words, tmp_path, iceslide):
    path = tmp_path / "tester.csv"
    path.write_text(text)
    asked = options or ["--fit=film.dry_stress=10kPa:10MPa"]
    if not any(one.startswith("--fit") for one in asked):
        asked = [*asked, "--fit=film.dry_stress=10kPa:10MPa"]
    out = tmp_path / "out"
    ran = iceslide("calibrate", path, CASE, *asked, f"--out={out}")
    assert ran.returncode == 2 and words in ran.stderr, ran.stderr
    assert len(ran.stderr.strip().splitlines()) == 1 and not out.exists()


def test_sigma_of_zero_is_refused(tmp_path):
    path = tmp_path / "tester.csv"
    path.write_text("\n".join([HEAD + ",sigma_mu", *[ROW + ",0"] * 4]))
    with pytest.raises(SceneError, match="sigma_mu = 0 is out of range"):
        read_measured(path, scene())


def test_nothing_to_fit_is_said(tmp_path, iceslide):
    (tmp_path / "tester.csv").write_text(GOOD)
    ran = iceslide("calibrate", tmp_path / "tester.csv", CASE)
    assert ran.returncode == 2 and "there is nothing to fit" in ran.stderr
