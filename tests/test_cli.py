"""The command line: exit codes, one sentence on standard error, nothing written on bad input."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from program import exit_code

import iceslide_fem
from iceslide_fem import simulate
from iceslide_fem.commands.run import print_summary
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.errors import SimulationStopped

CASES = Path(__file__).parent.parent / "cases"
CASE = str(CASES / "thesis_1bar.toml")
SUMMARY = {"mu_peak": 0.53071, "saturation_s": None, "steps": 140, "scene": {"name": "x"}}


@pytest.fixture
def in_empty_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def simulated(monkeypatch, in_empty_directory):
    """Stands in for the simulation; a list of the arguments of every call."""
    calls = []

    def run(scene, out, petsc_options=(), *checkpoints):
        calls.append((scene, out, list(petsc_options)))
        out.mkdir(parents=True)
        (out / "summary.json").touch()
        return SUMMARY

    monkeypatch.setattr(simulate, "run", run)
    return calls


def iceslide(*arguments: str, **kwargs) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "iceslide_fem.cli", *arguments]
    return subprocess.run(command, capture_output=True, encoding="utf-8", **kwargs)


@pytest.mark.quick
def test_help_loads_nothing_heavy():
    code = (
        "import sys; from iceslide_fem.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print([m for m in ('numpy', 'pint', 'dolfinx', 'gmsh', 'pyvista') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "run" in done.stdout and "info" in done.stdout and "view" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_collector_looks_past_imports_that_stay_and_goes_on():
    code = """
import gc
from iceslide_fem.runtime.launch import imports_that_stay
said = []
try:
    with imports_that_stay():
        import json, no_such_module
except ImportError:
    said += [gc.isenabled(), gc.get_freeze_count()]
with imports_that_stay():
    said += [gc.isenabled()]
said += [gc.isenabled(), gc.get_freeze_count()]
with imports_that_stay():  # once is enough
    said += [gc.isenabled()]
print(*said, gc.get_freeze_count())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    *said, kept, again, still_kept = done.stdout.split()
    assert said == ["True", "0", "False", "True"] and again == "True"
    assert int(kept) > 1000 and still_kept == kept


def test_names_are_utf8_in_the_c_locale():
    words = "info", CASE, "--set", "rubber.compound=ü"
    done = iceslide(*words, env=os.environ | {"PYTHONUTF8": "0", "LC_ALL": "C"})
    assert done.returncode == 2
    assert done.stderr.startswith('iceslide: rubber.compound = "ü" is not known')


def test_a_name_that_is_no_utf8_is_refused_in_a_sentence():
    done = iceslide("info", b"sc\xe4ne.toml")
    assert done.returncode == 2
    assert done.stderr == (
        'iceslide: "sc ne.toml" is not in UTF-8: rename the file, or set the locale '
        "(LC_ALL=C.UTF-8)\n"
    )


def without_home(home, folder):
    """Variables of a user whose home is not the tests' own, and whose temporary `folder` is."""
    here = {"HOME": home, "TMPDIR": str(folder), "XDG_CACHE_HOME": "", "ICESLIDE_CACHE": ""}
    return os.environ | here


@pytest.mark.parametrize("home", ["/proc", "/proc/none"])
def test_without_a_home_compiled_forms_are_kept_in_a_temporary_folder(tmp_path, home):
    code = "from iceslide_fem.fenics.cache import cache_folder; print(cache_folder())"
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, env=without_home(home, tmp_path), capture_output=True, text=True)
    assert done.stdout == f"{tmp_path}/iceslide-{os.getuid()}\n"


def test_a_home_that_cannot_be_written_stops_no_run(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    words = ["run", CASE, "--out", str(tmp_path / "out"), "--no-report"]
    for change in ("model=slice", "load.duration=1us", "numerics.refinement=0.3"):
        words += ["--set", change]
    done = iceslide(*words, env=without_home("/proc/none", tmp_path))
    assert done.returncode == 0, done.stderr
    kept = tmp_path / f"iceslide-{os.getuid()}"
    assert done.stderr.count(f"kept in {kept} (ICESLIDE_CACHE") == 1
    assert [*kept.glob("forms-*")] and kept.stat().st_mode & 0o77 == 0


def test_run_passes_scene_directory_and_petsc_options(simulated, capsys):
    assert exit_code("run", CASE, "--set", "load.pressure=3bar", "--", "-log_view", "-x", "1") == 0
    ((scene, out, petsc_options),) = simulated
    assert scene.load.pressure == 3e5
    assert out == Path("results/thesis_1bar")
    assert petsc_options == ["-log_view", "-x", "1"]
    printed = capsys.readouterr().out
    assert "0.5307" in printed and "did not happen" in printed
    assert printed.splitlines()[-1] == "results/thesis_1bar/summary.json"


@pytest.mark.quick
def test_run_takes_several_overrides_and_a_directory(simulated):
    assert exit_code("run", CASE, "--out", "here", "--set", "name=a", "--set", "model=slice") == 0
    ((scene, out, petsc_options),) = simulated
    assert (scene.name, scene.model, out, petsc_options) == ("a", "slice", Path("here"), [])


def test_run_says_that_the_pressure_is_outside_the_table(simulated, capsys):
    exit_code("run", CASE, "--set", "load.pressure=6bar")
    assert capsys.readouterr().out.count("given from 1 to 5 bar") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nowhere.toml"], "cannot read the scene file nowhere.toml"),
        (["info", "nowhere.toml"], "cannot read the scene file nowhere.toml"),
        (["run", CASE, "--set", "load.presure=3bar"], "did you mean load.pressure?"),
        (["run", CASE, "--set", "load.pressure=3 K"], "wrong unit"),
        (
            ["run", CASE, "--set", "rubber.heat=true", "--set", "rubber.height=50um"],
            "too thin for rubber.heat",
        ),
        (["run", CASE, "--set", "rubber.C10=1MPa"], "contradict"),
        (["run", CASE, "second.toml"], '"second.toml" is one too many'),
        (["run", CASE, "--out", CASE], "is not a directory one may write to"),
        (["run", CASE, "--out", CASE + "/deeper"], "is not a directory one may write to"),
        (["run", CASE, "--out", "x" * 300], "File name too long"),
        (["run", "--restart", "."], "holds no checkpoint"),
        (["run", "--restart", ".", "--set", "model=slice"], "holds no checkpoint"),
        (["run", CASE, "--checkpoint-at", "2mm"], '--checkpoint-at "2mm" has the wrong unit'),
        (["run", CASE, "--checkpoint-at", "-1ms"], '--checkpoint-at "-1ms" is out of range'),
        (["run", CASE, "--checkpoint-at", "8ms"], "allowed: 0 to the duration of the run, 7 ms"),
        (["run", CASE, "--checkpoint-every", "1e999"], "--checkpoint-every inf is no number"),
        (["run", CASE, "--out", ""], 'a folder has a name; given: ""'),
        (["sweep", CASE, "--vary", "load.speed=1,2", "--out", ""], "a folder has a name"),
        (["run", "--restart", ""], "a folder has a name"),
        (["run", "--restart", ".", "--force"], "as it is"),
        (["sweep", CASE], "give --vary"),
        (["sweep", CASE, "--vary", "load.pressure=1bar", "--cores-per-case", "99"], "allowed here"),
        (["view", "."], "holds no finished run"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(arguments, words, in_empty_directory):
    done = iceslide(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.startswith("iceslide: ") and done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert list(in_empty_directory.iterdir()) == []


@pytest.mark.parametrize("arguments", [["run"], ["run", CASE, "--nonsense"], ["walk"]])
def test_wrong_usage_is_exit_code_2(arguments, in_empty_directory):
    done = iceslide(*arguments)
    assert done.returncode == 2
    assert "Usage" in done.stderr and "Traceback" not in done.stderr
    assert list(in_empty_directory.iterdir()) == []


@pytest.mark.parametrize("word", ["-h", "--help"])
@pytest.mark.parametrize("command", [[], ["run"], ["sweep"], ["footprint"]])
def test_help_has_a_short_name(command, word, capsys):
    assert exit_code(*command, word) == 0
    assert "Usage: iceslide" in capsys.readouterr().out


def test_version(capsys):
    assert exit_code("--version") == 0
    assert capsys.readouterr().out == f"iceslide_fem {iceslide_fem.__version__}\n"


POINT = ["run", CASE, "--set", "model=point", "--set", "ice.heat=column", "--out", "out"]


@pytest.mark.parametrize(
    ("screen", "exit_code"), [("> /dev/full", 3), (">&-", 0), ("| true", 0), (">&- 2>&-", 0)]
)
def test_a_screen_that_is_gone_ends_no_run(screen, exit_code, in_empty_directory):
    words = shlex.join([sys.executable, "-m", "iceslide_fem.cli", *POINT])
    script = f"set -o pipefail; {words} {screen}"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True)
    assert done.returncode == exit_code
    assert "Traceback" not in done.stderr
    assert done.stderr == ("iceslide: cannot print: No space left on device\n" * (exit_code == 3))
    run = read_run(in_empty_directory / "out")
    assert run.summary["mu_peak"] > 0.5 and len(run.history["mu"]) == run.summary["steps"] + 1


def test_a_terminal_that_knows_few_letters_ends_no_command(in_empty_directory):
    environment = os.environ | {"PYTHONIOENCODING": "latin-1", "PYTHONUTF8": "0"}
    command = [sys.executable, "-m", "iceslide_fem.cli", "info", CASE, "--set", "load.speed=1m/s"]
    done = subprocess.run(command, capture_output=True, env=environment)
    assert done.returncode == 0 and b"Traceback" not in done.stderr
    assert "°C".encode("latin-1") in done.stdout or b"unknowns" in done.stdout


def test_a_stopped_simulation_is_one_sentence_and_exit_code_3(simulated, monkeypatch, capsys):
    def stop(*arguments):
        raise SimulationStopped("the block lost contact at 1.2 ms")

    monkeypatch.setattr(simulate, "run", stop)
    assert exit_code("run", CASE) == 3
    assert capsys.readouterr().err == "iceslide: the block lost contact at 1.2 ms\n"


@pytest.mark.parametrize("variable", ["OMPI_COMM_WORLD_RANK", "PMI_RANK"])
def test_only_rank_0_prints(variable, in_empty_directory):
    for rank in ("0", "1"):
        environment = os.environ | {variable: rank}
        info = iceslide("info", CASE, env=environment)
        wrong = iceslide("info", CASE, "--set", "model=blok", env=environment)
        assert (info.returncode, wrong.returncode) == (0, 2)
        assert bool(info.stdout) == bool(wrong.stderr) == (rank == "0")


def test_info_knows_the_scales_of_the_thesis_case(capsys):
    assert exit_code("info", CASE) == 0
    printed = capsys.readouterr().out.replace("\u03bc", "\u00b5")  # pint writes either µ
    # sqrt(alpha t) after 7 ms, and over L; v L / alpha; H sqrt(rho/G); k eta v / (h0 p)
    for value in ("88 µm", "0.088", "2.71e+03", "44.9 µs", "0.205"):
        assert value in printed
    # of the rubber, of the ice, and what they will take
    for value in ("unknowns, rubber", "unknowns, ice", "steps", " GB", "on one core"):
        assert value in printed


def rows_of_info(capsys, *words):
    """What `iceslide info` says: quantity -> value."""
    assert exit_code("info", *words) == 0
    lines = [line.split("│") for line in capsys.readouterr().out.splitlines() if "│" in line]
    return {cells[2].strip(): cells[3].strip() for cells in lines if cells[2].strip()}


@pytest.mark.quick
def test_info_of_a_point_has_no_rubber(capsys):
    rows = rows_of_info(capsys, CASE, "--set", "model=point", "--set", "ice.heat=column")
    assert rows["warm layer in ice"] == "88 µm" and rows["friction at t = 0"] == "0.205"
    assert int(rows["steps"].removeprefix("about ")) == pytest.approx(140, abs=40)
    assert not {"Young's modulus", "unknowns, rubber", "cells of rubber"} & rows.keys()


def test_info_says_when_heat_spreads_sideways(capsys):
    exit_code("info", CASE, "--set", "load.duration=70ms")
    assert "continuum" in capsys.readouterr().out
    exit_code("info", CASE, "--set", "load.duration=1ms")
    assert "suffice" in capsys.readouterr().out


def test_info_measures_a_users_mesh(capsys):
    rows = rows_of_info(capsys, str(CASES / "user_mesh.toml"))
    assert rows["transit time"] == "2 ms"  # of 6 mm at 3 m/s
    assert int(rows["cells of rubber"]) > 100


def test_info_says_what_inertia_would_change(capsys):
    case = str(CASES / "tread_block.toml")
    assert rows_of_info(capsys, case)["inertia left out"] == "0.28"
    assert "inertia left out" not in rows_of_info(capsys, case, "--set", "rubber.inertia=true")


def test_a_summary_says_what_did_not_happen_and_nothing_of_what_there_is_not(capsys, tmp_path):
    summary = {"mu_peak": 0.5, "saturation_s": None, "sipe_opening_m": None, "stopped": None}
    print_summary(summary, tmp_path, [])
    printed = capsys.readouterr().out
    assert printed.count("did not happen") == 1 and "saturation_s" in printed
    assert "sipe" not in printed and "stopped" not in printed


def test_case_scripts_take_the_same_options(in_empty_directory):
    script = str(CASES / "paper_5bar.py")
    command = [sys.executable, script, "--set", "model=blok"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 2
    assert 'model = "blok"' in done.stderr
