"""Results for programs: one JSON object on standard output, words elsewhere; shell completion."""

import json
import os
import subprocess
import sys

import pytest
from program import exit_code

from iceslide_fem import simulate
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.terminal import LongTask, without_progress
from iceslide_fem.scene.cases import cases_folder

pytestmark = pytest.mark.quick

CASES = cases_folder()
CASE = str(CASES / "thesis_1bar.toml")
POINT = [CASE, "--set", "model=point", "--set", "load.duration=1ms"]
LINE = ["--gaussian", "120mm,2bar,30mm"]


@pytest.fixture(autouse=True)
def in_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answer(capsys, *words):
    """The object that a command prints, and its words on standard error."""
    assert exit_code(*words, "--json") == 0
    printed = capsys.readouterr()
    return json.loads(printed.out), printed.err


@pytest.mark.parametrize(
    "words, keys",
    [
        (["info", *POINT], {"name", "model", "rows", "notes"}),
        (["run", *POINT], {"folder", "mu_mean", "verdict", "scene"}),
        (["sweep", *POINT, "--vary", "load.speed=1,2"], {"folder", "verdict", "cases"}),
        (["footprint", *LINE], {"folder", "footprint", "case"}),
        (["wheel", *LINE, "--slip", "0.1,1"], {"folder", "wheel", "command"}),
        (["rubber", str(CASES / "rubber" / "synthetic_dma.csv")], {"folder", "prony", "toml"}),
        (["hysteresis", str(CASES / "rough_ice.toml")], {"folder", "case"}),
        (["cases"], {"folder", "cases"}),
    ],
    ids=lambda part: part[0] if isinstance(part, list) else "",
)
def test_a_result_is_one_object_and_words_are_elsewhere(capsys, words, keys):
    found, said = answer(capsys, *words)
    assert keys <= set(found) and said.strip()
    silent, said = answer(capsys, *words, "-q")
    assert set(silent) == set(found) and said == ""


def test_the_object_of_a_run_is_its_summary(capsys, in_empty_directory):
    found, _ = answer(capsys, "run", *POINT, "--no-report")
    there = json.loads((in_empty_directory / found.pop("folder") / "summary.json").read_bytes())
    assert found == {key: value for key, value in there.items() if key != "checksum"}


def test_the_object_of_a_sweep_has_its_table(capsys):
    found, said = answer(capsys, "sweep", *POINT, "--vary", "load.speed=1,2", "--no-report")
    assert [case["load.speed"] for case in found["cases"]] == [1.0, 2.0]
    assert {case["status"] for case in found["cases"]} == {"done"}
    assert found["cases"][0]["melt_onset_s"] is None
    assert "2 cases, 0 of them done before" in said


def test_quiet_leaves_results_and_takes_progress(capsys):
    assert exit_code("sweep", *POINT, "--vary", "load.speed=1,2", "--no-report", "-q") == 0
    printed = capsys.readouterr().out
    assert "sweep.csv" in printed and "done before" not in printed
    with without_progress(), LongTask(1.0) as task:
        assert not task._shown
    assert LongTask(1.0)._shown


def test_what_was_found_before_a_stop_is_an_object_too(monkeypatch, capsys):
    def stop(scene, out, *arguments, **more):
        out.mkdir(parents=True)
        (out / "summary.json").write_text('{"mu_mean": 0.3, "stopped": "lost contact"}')
        raise SimulationStopped("lost contact")

    monkeypatch.setattr(simulate, "run", stop)
    assert exit_code("run", *POINT, "--no-report", "--json") == 3
    printed = capsys.readouterr()
    assert json.loads(printed.out) == {
        "folder": "results/thesis_1bar",
        "mu_mean": 0.3,
        "stopped": "lost contact",
    }
    assert printed.err.splitlines()[-1] == "iceslide: lost contact"


def test_wrong_input_is_no_object(capsys):
    assert exit_code("run", CASE, "--set", "model=blok", "--json", "-q") == 2
    printed = capsys.readouterr()
    assert printed.out == "" and printed.err.startswith('iceslide: model = "blok"')


def iceslide(words, **variables):
    """What a shell gets from `iceslide` with these words."""
    done = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m iceslide_fem {words}; exit $?"],
        env=os.environ | variables,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_shell_completes_commands_and_options():
    script = iceslide("--show-completion bash")
    assert "_ICESLIDE_COMPLETE=complete_bash" in script and "complete -o default" in script
    asked = {"_ICESLIDE_COMPLETE": "complete_bash"}
    assert iceslide("", COMP_WORDS="iceslide swe", COMP_CWORD="1", **asked).split() == ["sweep"]
    typed = {"COMP_WORDS": "iceslide footprint --gau", "COMP_CWORD": "2"}
    assert iceslide("", **typed, **asked).split() == ["--gaussian"]
    assert iceslide("--version").startswith("iceslide_fem ")
