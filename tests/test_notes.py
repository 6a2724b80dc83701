"""What a scene says in vain, and where it leaves the operating envelope."""

import html
from pathlib import Path

import pytest

from iceslide_fem.runs.doubts import before_run
from iceslide_fem.runs.notes import buckling_pressure, notes
from iceslide_fem.scene import load_scene
from iceslide_fem.simulate import run
from iceslide_fem.workflow.report import report

pytestmark = pytest.mark.quick

CASES = Path(__file__).parent.parent / "cases"
POINT = ["model=point", "ice.heat=column"]


def noted(*changes, case="thesis_1bar"):
    return notes(load_scene(CASES / f"{case}.toml", changes))


@pytest.mark.parametrize("case", sorted(path.stem for path in CASES.glob("*.toml")))
def test_the_cases_have_no_notes(case):
    points = ["ice below a point passes in L / v = 5 ms; mu is that of the block"]
    if case == "rough_ice":
        (note,) = noted(case=case)
        assert note.startswith("hysteresis adds to film.dry_stress")
        return
    assert noted(case=case) == (points if case == "friction_drum" else [])


@pytest.mark.parametrize(
    ("changes", "note"),
    [
        (["ice.cell=10um"], 'ice.cell has no effect with ice.motion = "attached"'),
        (
            ["ice.cell=10um", "ice.trail=1mm", "film.carrier=rubber"],
            'ice.cell and ice.trail and film.carrier have no effect with ice.motion = "attached"',
        ),
        (
            ["ice.heat=column", "ice.margin=1mm"],
            'ice.margin has no effect with ice.heat = "column"',
        ),
        (
            ["model=slice", "ice.motion=sliding", "ice.margin=1mm"],
            "ice.margin has no effect below a slice that slides: ice.trail is what lies behind it",
        ),
        ([*POINT, "rubber.inertia=true"], 'rubber.inertia has no effect with model = "point"'),
        (
            [*POINT, "numerics.refinement=2"],
            'numerics.refinement has no effect with model = "point"',
        ),
        (["rubber.sipe_depth=0.2mm"], "rubber.sipe_depth has no effect without rubber.sipes"),
        (["rubber.mesh_unit=mm"], "rubber.mesh_unit has no effect without rubber.mesh"),
        (
            ["rubber.density=1000"],
            "rubber.density has no effect without rubber.heat or rubber.inertia",
        ),
    ],
)
def test_what_has_no_effect_is_said_in_one_line(changes, note):
    assert noted(*changes) == [note]


def test_relaxation_at_a_point_needs_an_age():
    soft = ['rubber.prony=[[0.5, "1 ms"]]', "rubber.modulus_is=long-term"]
    said = "rubber.prony has no effect at a point without film.contact_age"
    said += ": its contact is taken as old"
    assert said in noted(*POINT, *soft)
    assert said not in noted(*soft) + noted(*POINT, *soft, "film.contact_age=true")


def test_columns_far_outside_their_range_are_in_doubt_in_plan_run_and_report(tmp_path):
    """100 s under 2 mm: heat reaches 5.3 times as far, and the mean mu is half of the true one."""
    changes = [*POINT, "rubber.length=2mm", "rubber.width=2mm", "load.duration=100s"]
    scene = load_scene(CASES / "thesis_1bar.toml", [*changes, "load.speed=0.01m/s"])
    (doubt,) = (each for each in before_run(scene) if "sideways" in each)
    assert "= 5.3 of the contact's shortest side" in doubt
    summary = run(scene, tmp_path)
    assert doubt in summary["warnings"]
    page = html.unescape(report([tmp_path]).read_text(encoding="utf-8"))
    assert f"{doubt[0].upper()}{doubt[1:]}." in page
    short = load_scene(CASES / "thesis_1bar.toml", POINT)
    assert not any("sideways" in each for each in before_run(short))


@pytest.mark.parametrize(
    ("changes", "doubted"),
    [
        (["load.duration=70ms", "ice.heat=column"], True),
        (["load.duration=70ms", "ice.heat=continuum"], False),
        (["load.duration=70ms", "ice.heat=column", "ice.motion=sliding"], False),
    ],
)
def test_columns_below_blocks_are_in_doubt_where_heat_spreads(changes, doubted):
    doubts = before_run(load_scene(CASES / "thesis_1bar.toml", ["model=slice", *changes]))
    assert any("sideways" in each for each in doubts) == doubted


def test_lengths_beside_a_mesh_are_noted():
    (note,) = noted("rubber.length=3mm", "rubber.height=4mm", case="user_mesh")
    assert note.startswith("rubber.length and rubber.height have no effect on the shape")


def test_what_has_an_effect_is_not_noted():
    assert noted("ice.margin=1mm") == []
    assert noted("rubber.inertia=true", "rubber.density=1000") == []
    passing = ["ice.motion=sliding", "film.carrier=rubber", "ice.cell=10um", "ice.trail=1mm"]
    assert noted(*passing, "ice.margin=1mm", "ice.heat=column") == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["load.speed=0.1mm/s"], "load.speed = 100 µm/s is outside"),
        (["load.speed=40"], "load.speed = 40 m/s is outside"),
        (["load.pressure=0.1bar"], "load.pressure = 0.1 bar is outside"),
        (["load.pressure=7bar"], "0.2 bar to 5 bar"),
        (["ice.temperature=-60degC"], "ice.temperature = -60 degC is outside"),
        (["film.initial_height=5um"], "film.initial_height = 5 µm is outside"),
        (["load.pressure=0.2bar", "load.speed=30"], "friction at t = 0 is 10.3"),
        (["rubber.height=10mm"], "10 times as tall as thick, buckles at about 0.13 bar"),
        (["numerics.penalty=5MPa/mm"], "numerics.penalty = 5e+09 Pa/m is 3.1 E / H"),
        (["numerics.shear_ramp_pressure=0.5bar"], "is 0.5 p; 0.002 to 0.2 p are known to work"),
    ],
)
def test_scenes_beyond_the_envelope_are_noted(changes, words):
    assert any(words in note.replace("\u03bc", "\u00b5") for note in noted(*changes))


def test_the_envelope_is_that_of_the_page():
    page = (CASES.parent / "docs" / "validation" / "stability.md").read_text()
    for row in (
        "| 1 nm | 1 µm |",
        "| 1 mm/s | 30 m/s |",
        "| -40 °C | -0.1 °C |",
        "| 0.2 bar | 5 bar |",
    ):
        assert row in page
    assert "| 10 E/H | 1000 E/H |" in page and "| 0.2 % | 20 % of the nominal pressure |" in page


def test_buckling_of_slender_and_of_stocky_blocks():
    E, G = 1.5e6, 0.5e6
    assert buckling_pressure(E, G, 1e-3, 0.1) == pytest.approx(9.8696 * E / 12e4, rel=1e-3)
    assert buckling_pressure(E, G, 1e-3, 1e-3) < 0.5 * 9.8696 * E / 12


def test_run_info_and_summary_have_the_notes(tmp_path, capsys):
    pytest.importorskip("iceslide_fem.fenics.compat")
    import json

    from iceslide_fem.cli import main

    words = [str(CASES / "thesis_1bar.toml"), "--set", "load.duration=0.1ms"]
    words += [word for change in (*POINT, "ice.cell=10um") for word in ("--set", change)]
    for command in (["info", *words], ["run", *words, "--out", str(tmp_path / "run")]):
        with pytest.raises(SystemExit):
            main(command)
        printed = capsys.readouterr().out
        assert printed.count("Note: ice.cell has no effect") == 1
        assert printed.count("does not melt: the film law has no dry friction") == 1
    unused, dry = json.loads((tmp_path / "run" / "summary.json").read_text())["warnings"]
    assert unused == 'ice.cell has no effect with model = "point"'
    assert dry.startswith("the ice does not melt: ")
