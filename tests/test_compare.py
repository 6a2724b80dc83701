"""Which candidate is better: reading, conditions, ratios and bands, words, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
from program import exit_code

import iceslide_fem
from iceslide_fem.inference.compare.candidates import Condition, read_candidates
from iceslide_fem.inference.compare.inputs import BAND, read_inputs
from iceslide_fem.inference.compare.ratios import Ratio, flags, sentence
from iceslide_fem.inference.compare.values import values_of_scenes
from iceslide_fem.runs.doubts import by_kind, in_ranges
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.variation import with_values

CASES = Path(__file__).parent.parent / "cases"
TYRES = CASES / "tyres"
POINT = (CASES / "cold_point.toml").read_text()
SOFTER = '[variations.A]\nfilm.dry_stress = "0.55 MPa"\n'


def files(folder, **texts):
    """Files beside the cases' surfaces; each one's path."""
    for name, text in texts.items():
        text = text.replace('"surfaces/', f'"{CASES}/surfaces/')
        (folder / f"{name}.toml").write_text(text)
    return [folder / f"{name}.toml" for name in texts]


def test_a_variation_is_the_reference_with_other_keys(tmp_path):
    one, other = read_candidates(*_split(files(tmp_path, REF=POINT, more=SOFTER)), {})
    assert (one.name, other.name) == ("REF", "A")
    assert other.scene.film.dry_stress == 0.55e6
    changed = with_values(other.scene, {"film.dry_stress": float(one.scene.film.dry_stress)})
    assert changed == one.scene


def _split(paths):
    first, *others = paths
    return first, others


def test_ratios_of_points_are_those_of_their_friction(tmp_path):
    paths = files(tmp_path, REF=POINT, more=SOFTER)
    found = iceslide_fem.compare(
        *paths, temperature=["-20 degC", "-5 degC"], out=tmp_path / "out", output="mu_peak"
    )
    one, other = read_candidates(*_split(paths), {})
    scenes = [
        Condition(273.15 + celsius).of(each).scene for each in (one, other) for celsius in (-20, -5)
    ]
    mu = friction(scenes).mu_peak[:, 0].reshape(2, 2)
    assert found["value"].values == pytest.approx(mu.T)
    assert found["ratio"].sel(candidate="A").values == pytest.approx(mu[1] / mu[0])
    assert (found["ratio"].sel(candidate="REF") == 1.0).all()
    assert found["temperature_C"].values == pytest.approx([-20.0, -5.0])
    assert set(found["verdict"].values.ravel()) == {"reference", "better"}
    assert np.isnan(found["ratio_inputs"]).all()
    assert (found["ratio_numerical"] < 5e-3).all()


def test_what_candidates_share_cancels_and_what_is_their_own_does_not(tmp_path):
    paths = files(tmp_path, REF=POINT, more=SOFTER)
    candidates = read_candidates(*_split(paths), {})
    grid = [[one] for one in candidates]
    texts = {"film.dry_stress": "~10%"}

    def bands(own):
        inputs = read_inputs(candidates, texts, own)
        found = values_of_scenes(grid, [["a"], ["b"]], inputs, "mu_mean", tmp_path).slopes
        return [float(each(1)[0]) for each in (found.band_of_value, found.band_of_ratio)]

    value, ratio = bands(())
    assert 0.0 < ratio < 0.3 * value
    assert bands(())[0] == bands(("film.dry_stress",))[0]
    apart = bands(("film.dry_stress",))[1]
    assert apart > value


def test_a_band_of_one_input_is_its_slope(tmp_path):
    (path,) = files(tmp_path, REF=POINT)
    (one,) = read_candidates(path, [], {})
    inputs = read_inputs([one], {"film.k_scale": "1+-1%"}, ())
    found = values_of_scenes([[one]], [["a"]], inputs, "mu_mean", tmp_path).slopes
    mu = friction([with_values(one.scene, {"film.k_scale": k}) for k in (0.999, 1.001)]).mu_mean
    slope = np.log(mu[1, 0] / mu[0, 0]) / np.log(1.001 / 0.999)
    assert found.band_of_value(0)[0] == pytest.approx(BAND * 0.01 * slope, rel=1e-3)


def test_bands_say_better_worse_or_alike():
    assert Ratio(1.10, 0.01, 0.02).verdict == "better"
    assert Ratio(0.95, 0.01, 0.02).verdict == "worse"
    assert Ratio(1.02, 0.01, 0.02).verdict == "alike"
    assert Ratio(1.10, 0.01).percent == "8.9 to 11 %"
    assert Ratio(0.90, 0.0).percent == "10 %"


def test_sentences_are_plain():
    ratios = {"-8 °C": Ratio(1.135, 0.01), "-4 °C": Ratio(1.10, 0.0), "-1 °C": Ratio(1.0, 0.01)}
    said = sentence("A", "REF", True, ratios, "film.dry_stress")
    assert said == (
        "A brakes 12 to 15 % better at -8 °C, 10 % at -4 °C; at -1 °C cannot be told apart from "
        "REF. What moves the ratio most is film.dry_stress."
    )
    alone = sentence("B", "REF", False, {"as given": Ratio(0.9, 0.0)})
    assert alone == "B has 10 % less friction."


def test_warnings_that_differ_in_numbers_are_one_with_their_ranges():
    said = [
        "the film is 2.5 nm high at -4 degC on tyre_1; allowed: 5",
        "the film is 0.9 nm high at -10 degC on tyre_1; allowed: 5",
        "there is no water",
    ]
    film, water = by_kind(zip("abc", said, strict=True))
    assert [name for name, _ in film] == ["a", "b"] and water == [("c", said[2])]
    together = "the film is 0.9 … 2.5 nm high at -10 … -4 degC on tyre_1; allowed: 5"
    assert in_ranges([each for _, each in film]) == together


def test_rules_for_tyres_are_said():
    said = flags({"-8 °C": 1.7, "-4 °C": 1.3}, {"A": {"-4 °C": Ratio(1.2, 0.0)}})
    assert said[0].endswith("0.9 to 1.6 m/s², where ISO 19447 wants it: 1.7 m/s² at -8 °C")
    assert "reaches 1.18 at -4 °C" in said[1]
    assert "may reach" in flags({}, {"A": {"-4 °C": Ratio(1.18, 0.01)}})[0]
    assert "is below" in flags({}, {"A": {"-4 °C": Ratio(1.1, 0.01)}})[0]


def test_wheels_are_compared_by_their_peaks_and_inputs(tmp_path):
    paths = TYRES / "reference.toml", TYRES / "candidates.toml"
    own = "--input", "wheel.stiffness=~5%", "--own", "wheel.stiffness"
    assert exit_code("compare", *paths, *own, "--out", tmp_path / "out", "--no-report") == 0
    found = json.loads((tmp_path / "out" / "compare.json").read_text())
    (place,) = found["conditions"]
    tyres = place["candidates"]
    assert tyres["A"]["verdict"] == "better" and tyres["B"]["verdict"] == "worse"
    assert 1.1 < tyres["A"]["ratio"] < 0.55 / 0.45
    assert 0.0 < tyres["A"]["ratio_inputs"] < 0.05
    assert found["different"]["wheel.groove"] == [None, None, 0.004]
    assert (tmp_path / "out" / "compare.png").is_file()


def test_slices_are_compared_and_their_runs_kept(tmp_path):
    scene = """
name = "small"
model = "slice"
[rubber]
compound = "B"
length = "20 mm"
width = "10 mm"
height = "8 mm"
[load]
pressure = "1 bar"
speed = "3 m/s"
duration = "0.3 ms"
[numerics]
tolerance = 1e-2
refinement = 0.5
[output]
times = 2
"""
    more = "[variations.MORE]\nfilm.k_scale = 1.2\n"
    paths = files(tmp_path, REF=scene, more=more)
    found = iceslide_fem.compare(*paths, out=tmp_path / "out")
    assert found["ratio"].shape == (1, 2) and np.isfinite(found["ratio"]).all()
    runs = sorted(path.name for path in (tmp_path / "out" / "cases").iterdir())
    assert runs == ["MORE_as_given", "REF_as_given"]


@pytest.mark.parametrize(
    ("texts", "words", "sentence"),
    [
        ({"REF": POINT, "A": POINT}, ["--stop", "25km/h"], "--stop is of wheels"),
        ({"REF": POINT, "A": POINT}, ["--output", "mu_locked"], "is none of scenes"),
        ({"REF": POINT, "A": POINT}, ["--measure", "20km/h:5km/h"], "give --stop, too"),
        ({"REF": POINT, "A": POINT}, ["--own", "film.k_scale"], "is not uncertain"),
        ({"REF": POINT, "A": POINT}, ["--input", "wheel.stiffness=~5%"], "is of wheels"),
        ({"REF": POINT, "A": POINT}, ["--temperature", "5degC"], "--temperature"),
        ({"REF": POINT, "A": '[wheel]\nline = "x.csv"\n'}, [], "is not a file"),
        ({"REF": POINT, "A": '[variations]\nx = 1\n'}, [], "variations.x is not a table"),
        ({"REF": SOFTER, "A": POINT}, [], "and is not the first"),
        ({"REF": POINT, "A": SOFTER + '[film]\nk = 1\n'}, [], "tables [variations.NAME] only"),
        ({"REF": POINT, "A": '[variations.REF]\nname = "x"\n'}, [], "have the name REF"),
        ({"REF": POINT, "A": '[variations.B]\nfilm.dry_stres = 1e5\n'}, [], "film.dry_stres"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_sentence(texts, words, sentence, tmp_path, capsys):
    paths = files(tmp_path, **texts)
    out = tmp_path / "out"
    assert exit_code("compare", *paths, *words, "--out", out) == 2
    said = capsys.readouterr().err
    assert sentence in said and said.count("\n") == 1, said
    assert not out.exists()


def test_a_fault_names_its_file(tmp_path, capsys):
    paths = files(tmp_path, REF=POINT, A=POINT.replace("dry_stress", "dry_stres"))
    assert exit_code("compare", *paths, "--out", tmp_path / "out") == 2
    assert f"{paths[1]}: film.dry_stres" in capsys.readouterr().err


def test_scenes_and_wheels_are_not_mixed(tmp_path):
    (path,) = files(tmp_path, REF=POINT)
    with pytest.raises(SceneError, match="all of one kind"):
        read_candidates(path, [TYRES / "reference.toml"], {})
