"""What a result is worth: its errors in words, and whether the law holds there."""

import json
from pathlib import Path

import pytest
from program import exit_code

from iceslide_fem.runs.many_points import friction
from iceslide_fem.runs.verdict import input_band, verdict
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.variation import with_values

CASES = Path(__file__).parent.parent / "cases"
MELTS = {"mu_mean": 0.33, "melt_onset_s": 1e-3, "outside_table_fraction": 0.0}


def scene(case="thesis_1bar", *changes):
    return load_scene(CASES / f"{case}.toml", changes)


def test_the_errors_of_a_block_and_their_worst():
    found = verdict(scene(), MELTS)
    assert found.numerical == pytest.approx(1e-3 + 0.005) and found.inputs is None
    assert "± 0.002 (steps and mesh)" in found.sentence
    assert f"most by {found.worst.name}" in found.sentence
    assert "inputs taken as exact. Ice melts" in found.sentence and not found.doubtful
    finer = verdict(scene("thesis_1bar", "numerics.refinement=2"), MELTS)
    assert finer.numerical == pytest.approx(1e-3 + 0.0025)


@pytest.mark.parametrize(
    ("case", "entries", "words", "doubtful"),
    [
        ("thesis_1bar", {"melt_onset_s": None}, "mu is in doubt", True),
        ("cold_point", {"melt_onset_s": None}, "dry friction or water of the scene", False),
        ("thesis_1bar", {"outside_table_fraction": 0.5}, "50% of the contact is outside", True),
    ],
)
def test_where_the_law_holds(case, entries, words, doubtful):
    found = verdict(scene(case), MELTS | entries)
    assert words in found.sentence and found.doubtful == doubtful


def test_inputs_to_first_order_are_those_of_samples():
    """One input: the band is 1.96 standard deviations of mu."""
    base = load_scene(CASES / "thesis_1bar.toml", ["model=point", "ice.heat=column"])
    spread = base.model_copy(update={"uncertainty": {"film.k_scale": "1+-5%"}})
    low, mu, high = friction(
        [with_values(base, {"film.k_scale": k}) for k in (0.95, 1.0, 1.05)]
    ).mu_mean[:, 0]
    assert input_band(spread) == pytest.approx(1.96 * (high - low) / 2 / mu, rel=0.02)
    assert input_band(base) is None


def test_it_stands_on_top_of_a_result(tmp_path, capsys):
    text = (CASES / "cold_point.toml").read_text() + '\n[uncertainty]\n"film.dry_stress" = "~10%"\n'
    (tmp_path / "scene.toml").write_text(text.replace("surfaces/", f"{CASES}/surfaces/"))
    out = tmp_path / "out"
    words = ["run", tmp_path / "scene.toml", f"--out={out}"]
    assert exit_code(*words) == 0
    said = capsys.readouterr().out
    summary = json.loads((out / "summary.json").read_text())
    assert summary["verdict"]["sentence"] in " ".join(said.split())
    assert summary["verdict"]["inputs"] == pytest.approx(0.196 * summary["mu_mean"], rel=0.2)
    assert "(inputs)" in (out / "report.html").read_text()


def test_a_wrong_spread_is_refused_before_the_run(tmp_path, capsys):
    text = (CASES / "thesis_1bar.toml").read_text() + '\n[uncertainty]\n"film.k_scal" = "~10%"\n'
    (tmp_path / "scene.toml").write_text(text)
    out = tmp_path / "out"
    assert exit_code("run", tmp_path / "scene.toml", "--set=model=point", f"--out={out}") == 2
    assert "did you mean film.k_scale" in capsys.readouterr().err and not out.exists()


def test_many_cases_have_one_sentence(tmp_path, capsys):
    out = tmp_path / "out"
    words = ["sweep", CASES / "thesis_1bar.toml", "--set=model=point", "--set=ice.heat=column",
             "--vary=load.pressure=1bar,2bar", f"--out={out}"]  # fmt: skip
    assert exit_code(*words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "in 2 cases: ± 0.1% (steps and mesh), model ±" in said
    assert "in 2 cases" in (out / "report.html").read_text()
