"""`iceslide wheel`: its files, families, stiffness, and one sentence for all that is wrong."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from program import exit_code, numbers_of

from iceslide_fem.preprocess.footprint.synthetic import Tread, grey_picture, save
from iceslide_fem.preprocess.wheel import block_shear
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import COMPOUNDS

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
LINE = ("--gaussian", "120mm,2bar,30mm", "--speed", "20km/h")
SURFACE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
FOOTPRINT = Tread(ribs=3, pitch=36e-3, sipe=4e-3).footprint((14, 54))
LAW = """\
name = "law"
model = "slice"
[rubber]
compound = "B"
[load]
pressure = "1 bar"
speed = "1 m/s"
duration = "1 ms"
[ice]
temperature = "-6 degC"
"""


def wheel(*words, report=False):
    return exit_code("wheel", *words, *([] if report else ["--no-report"]))


def rows(out):
    return numbers_of(out / "mu_slip.csv")


def summary(out):
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def test_a_line_leaves_table_picture_summary_and_page(tmp_path, capsys):
    out = tmp_path / "out"
    assert wheel(*LINE, "--slip", "0:1:6", "--out", out, report=True) == 0
    printed = capsys.readouterr().out
    assert "peak mu" in printed and "G / H" in printed and "report.html" in printed
    found, figures = rows(out), summary(out)
    assert [row["slip"] for row in found] == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    (member,) = figures["curves"]
    best = max(found, key=lambda row: row["mu"])
    assert member["peak_mu"] == pytest.approx(best["mu"], rel=1e-6)
    assert member["slip_at_peak"] == best["slip"]
    assert member["peak_over_locked"] == pytest.approx(best["mu"] / found[-1]["mu"], rel=1e-6)
    assert member["slope_at_0"] > 0.0
    assert figures["wheel"]["stiffness_Pa_per_m"] == pytest.approx(
        COMPOUNDS["B"].shear_modulus / 8e-3
    )
    assert found[0]["mu"] == 0.0 and np.isnan(found[0]["mean_film_m"])
    with Image.open(out / "mu_slip.png") as image:
        assert min(image.size) > 500
    before = (out / "mu_slip.csv").read_bytes()
    assert "friction over slip" in (out / "report.html").read_text("utf-8").lower()
    assert wheel(*LINE, "--slip", "0:1:6", "--out", out) == 0
    assert (out / "mu_slip.csv").read_bytes() == before
    assert not (out / "report.html").exists()
    assert wheel(*LINE, "--slip", "0:1:5", "--out", out) == 2
    assert "results of other input" in capsys.readouterr().err


def test_a_locked_wheel_is_that_of_a_footprint(tmp_path):
    options = ("--gaussian", "120mm,2bar,30mm", "--speed", "20km/h", "--temperature", "-6degC")
    assert wheel(*options, "--slip", "1", "--out", tmp_path / "wheel") == 0
    assert exit_code("footprint", *options, "--no-report", "--out", tmp_path / "foot") == 0
    film = summary(tmp_path / "foot")["film"]
    (row,) = rows(tmp_path / "wheel")
    assert row["mu"] == pytest.approx(film["mu_mean"], rel=5e-3)
    assert row["melting_fraction"] == pytest.approx(film["melting_share"], abs=5e-3)


def test_a_picture_and_a_family(tmp_path):
    picture = save(grey_picture(FOOTPRINT, 4e5), tmp_path / "grey.png")
    words = [picture, "--length", "180mm", "--width", "140mm", "--max-pressure", "4bar"]
    words += ["--load", "3kN", "--slip", "0.1,1", "--stiffness", "9e6N/m^2"]
    words += ["--vary", "speed=20km/h,50km/h", "--vary", "temperature=-10degC,-2degC"]
    out = tmp_path / "out"
    assert wheel(*words, "--out", out, report=True) == 0
    found, figures = rows(out), summary(out)
    assert len(found) == 8 and len(figures["curves"]) == 4
    assert {row["temperature_C"] for row in found} == {-10.0, -2.0}
    assert {row["speed_m_s"] for row in found} == {5.5555556, 13.888889}
    assert figures["wheel"]["load_N"] == pytest.approx(3000.0)
    width = figures["wheel"]["contact_area_m2"] / (49 * 180e-3 / 54)
    assert figures["wheel"]["stiffness_Pa_per_m"] == pytest.approx(9e6 / width, rel=0.05)
    alone = tmp_path / "alone"
    words = [*words[: words.index("--vary")], "--speed", "50km/h", "--temperature", "-2degC"]
    assert wheel(*words, "--out", alone) == 0
    assert rows(alone) == found[6:]


def test_a_slip_angle_is_symmetric(tmp_path):
    for name, angle in (("left", "3deg"), ("right", "-3deg")):
        words = ("--slip", "-0.2,0.2,1", "--slip-angle", angle, "--out", tmp_path / name)
        assert wheel(*LINE, *words) == 0
    left, right = rows(tmp_path / "left"), rows(tmp_path / "right")
    for one, other in zip(left, right, strict=True):
        assert one["mu"] == other["mu"] and one["mu_across"] == -other["mu_across"] > 0.0
    assert left[0]["mu"] < 0.0 < left[1]["mu"]


def test_a_scene_says_what_rubs(tmp_path, capsys):
    (tmp_path / "law.toml").write_text(LAW, encoding="utf-8")
    scene = ("--scene", tmp_path / "law.toml", "--slip", "0.2,1")
    assert wheel(*LINE, *scene, "--out", tmp_path / "a") == 0
    assert wheel(*LINE, "--temperature", "-6degC", *scene[2:], "--out", tmp_path / "b") == 0
    assert rows(tmp_path / "a") == rows(tmp_path / "b")
    assert wheel(*LINE, *scene, "--compound", "B", "--out", tmp_path / "c") == 2
    assert "--scene and --compound contradict each other" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--slip", "0:1.2:5"], "allowed: -1 to 1"),
        (["--slip", "a"], "is not of the form 0:1:21"),
        (["--slip", "0:1:0"], "allowed: 1 to 1001"),
        (
            ["--slip", "0:0.05:1"],
            'write "0" for one value, or "0:1:21" for 0 to 1 in steps of 0.05',
        ),
        (["--slip", "0.1:0.7:1"], "one value from 0.1 to 0.7, because a range is first:last:count"),
        (["--stiffness", "0Pa/m"], "allowed: 1e4 Pa/m to 1e15 Pa/m"),
        (["--stiffness", "-5e6N/m^2"], "is out of range"),
        (["--stiffness", "5e6"], 'neither "auto" nor a number with its unit'),
        (["--stiffness", "5e6N/m^2"], "one line has no width"),
        (["--pitch", "28mm", "--groove", "28mm"], "leaves no block"),
        (["--pitch", "28mm"], "--pitch is of a pattern; give --groove, too"),
        (["--slip-angle", "50deg"], "--slip-angle"),
        (["--vary", "load=3kN,4kN"], "allowed keys: speed and temperature"),
        (["--vary", "speed=1"], "--vary speed and --speed contradict each other"),
        (["--vary", "temperature=-2degC,5degC"], "--vary temperature"),
        (["--melting-temperature", "-5degC"], "is not below"),
        (["--temperature-map", "x"], "No such option"),
        (["--line", "x.csv"], "--line"),
        (["--threshold", "50bar"], "no pixel is in contact"),
        (["--scene", "nowhere.toml"], "is not a file"),
        (["--compound", "Z"], "--compound"),
    ],
)
def test_what_is_wrong_is_one_sentence_and_leaves_nothing(words, said, tmp_path, capsys):
    out = tmp_path / "out"
    assert wheel(*LINE, *words, "--out", out) == 2
    error = capsys.readouterr().err
    assert said in error and "Traceback" not in error
    assert not out.exists()


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ('[film]\npressure = "nominal"', "film.pressure"),
    ],
)
def test_a_law_that_a_wheel_does_not_take(tables, said, tmp_path, capsys):
    (tmp_path / "law.toml").write_text(LAW + tables, encoding="utf-8")
    out = tmp_path / "out"
    assert wheel(*LINE, "--scene", tmp_path / "law.toml", "--out", out) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


WET = f'water = "20 um"\n[film]\nvoids = "carry"\ncontact = "{SURFACE}"'


@pytest.mark.parametrize(
    ("tables", "mu"),
    [
        ('[friction]\nlaw = "coulomb"\nmu = 0.2', 0.2),
        (WET, 0.1762),
        (WET + '\nrefreeze = "nothing"', 0.2240),
    ],
    ids=["coulomb", "wet", "wet, nothing freezes"],
)
def test_any_law_of_a_scene_rubs_below_a_wheel(tables, mu, tmp_path):
    (tmp_path / "law.toml").write_text(LAW + tables, encoding="utf-8")
    out = tmp_path / "out"
    few = "--slip", "0,0.1,1"
    assert wheel(*LINE, *few, "--scene", tmp_path / "law.toml", "--out", out) == 0
    found = json.loads((out / "summary.json").read_text(encoding="utf-8"))["curves"][0]["locked_mu"]
    assert found == pytest.approx(mu, rel=1e-2)


def test_a_car_that_brakes(tmp_path):
    out = tmp_path / "out"
    given = *LINE, "--stiffness", "68.25e6Pa/m", "--slip", "0,0.2,1", "--abs"
    assert wheel(*given, "--end-speed", "14km/h", "--out", out) == 0
    stops = json.loads((out / "summary.json").read_text(encoding="utf-8"))["stops"]
    distances = [stops[name]["distance_m"] for name in ("ideal", "threshold", "locked")]
    assert sorted(distances) == distances and distances[0] > 1.0
    assert (out / "stops.png").stat().st_size > 10_000
    assert (out / "stops.csv").read_text(encoding="utf-8").startswith("control,time_s")
    assert wheel(*given, "--end-speed", "14km/h", "--out", out) == 0  # a repeat
    assert wheel(*given, "--end-speed", "15km/h", "--out", out) == 2
    assert wheel(*given[:-1], "--out", out, "--force") == 0
    assert not list(out.glob("stops.*"))


def test_the_stop_of_a_footprint_is_of_the_car_that_it_carries(tmp_path, capsys):
    """A wheel of 1 kg m2 and 0.3 m locks, and loses all of its energy."""
    np.save(tmp_path / "even.npy", np.full((1, 12), 2e5))
    words = ["--pressure-map", tmp_path / "even.npy", "--length", "120mm", "--width", "100mm"]
    words += ["--abs", "--speed", "20km/h", "--end-speed", "15km/h", "--slip", "1"]
    words += ["--stiffness", "68.25e6Pa/m", "--load", "2kN"]
    assert wheel(*words, "--out", tmp_path / "out") == 0
    figures = summary(tmp_path / "out")
    mass = figures["wheel"]["mass_kg"]
    assert mass == pytest.approx(2000.0 / 9.80665)
    lost = 0.5 * mass * (20**2 - 15**2) / 3.6**2 + 0.5 * (20 / 3.6 / 0.3) ** 2
    assert figures["stops"]["locked"]["kinetic_energy_J"] == pytest.approx(lost, rel=1e-6)
    assert wheel(*words, "--mass", "300kg", "--out", tmp_path / "both") == 2
    assert "--load and --mass contradict each other" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--mass", "300kg"], "give --abs"),
        (["--build-below", "0.2"], "give --abs"),
        (["--abs", "--build-below", "0.4"], "is not below --release-above 0.3"),
        (["--abs", "--measure", "20km/h"], "is not of the form 20km/h:5km/h"),
        (["--abs", "--measure", "5km/h:20km/h"], "does not go down"),
        (["--abs", "--measure", "60km/h:5km/h"], "is not within the stop, 20 to 5 km/h"),
        (["--abs", "--end-speed", "60km/h"], "is not below --speed"),
        (["--abs", "--slip-angle", "3deg"], "a stop goes straight"),
    ],
)
def test_what_is_no_stop_gets_one_sentence(words, said, tmp_path, capsys):
    assert wheel(*LINE, *words, "--out", tmp_path / "out") == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_without_dolfinx_a_number_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setenv("ICESLIDE_CACHE", str(tmp_path / "cache"))
    ended = subprocess.CompletedProcess([], 2, "", "iceslide: there is no DOLFINx\n")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: ended)
    with pytest.raises(SceneError, match=r"there is no DOLFINx\); give --stiffness a number"):
        block_shear.block_stiffness(COMPOUNDS["B"], 20e-3, 8e-3)
    assert not list(tmp_path.rglob("*.json"))


def test_the_core_imports_no_finite_elements():
    code = (
        "import sys; import iceslide_fem.preprocess.wheel.command; "
        "assert not {'dolfinx', 'mpi4py', 'petsc4py'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


def test_slip_ratios_without_melting_are_said(tmp_path, capsys):
    """The peak lies where hardly any ice melts, though the locked wheel melts most of it."""
    line = ("--gaussian", "30mm,1bar,8mm", "--speed", "50km/h", "--temperature", "-10degC")
    assert wheel(*line, "--slip", "0:1:21", "--out", tmp_path / "out") == 0
    found = rows(tmp_path / "out")
    peak = max(found, key=lambda row: row["mu"])
    cold = max(row["slip"] for row in found if row["melting_fraction"] < 0.5)
    assert peak["slip"] <= cold and found[-1]["melting_fraction"] > 0.9
    said = " ".join(summary(tmp_path / "out")["warnings"])
    share = f"({peak['melting_fraction']:.0%} melts)"
    assert f"up to a slip ratio of {cold:g}, the peak of mu among them {share}" in said
    assert share in " ".join(capsys.readouterr().out.split())
