"""Estimates of what may be neglected, the levels that follow, and the ladder that is run."""

from pathlib import Path

import numpy as np
import pytest
from program import rows_of

from iceslide_fem.runs.model_levels import ModelLevel, cheapest, on_level, resolved
from iceslide_fem.runs.simplifications import simplifications
from iceslide_fem.scene import load_scene
from iceslide_fem.workflow.ladder.levels import levels

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
# A stiff, thin block without transverse strain: pressure is uniform but for its edges.
UNIFORM = [
    "rubber={C10='200 MPa', C01='0 MPa', nu=0.0, length='20 mm', width='20 mm', height='0.1 mm'}",
    "film={k=0.266, D='29 um', H_V='2.86 um'}",
]


def thesis(*changes):
    return load_scene(CASE, changes)


def test_a_cube_of_soft_rubber_may_neglect_nothing():
    found = simplifications(thesis("numerics.tolerance=1e-3"))
    assert found.bending.number > 1.0  # an edge lifts off
    assert all(one.effect > 1e-3 for one in found)
    assert found.inertia.number == pytest.approx(0.03, abs=0.01)  # a shear wave takes 45 us
    assert cheapest(thesis()) == ModelLevel("block", "continuum", 1.0)


@pytest.mark.quick
def test_a_stiff_flat_block_is_a_point():
    scene = thesis("model=auto", "ice.heat=column", "numerics.tolerance=1e-2", *UNIFORM)
    found = simplifications(scene)
    assert found.confinement.number == 0.0
    assert found.uniform_pressure < 1e-2
    assert resolved(scene).model == "point"
    # nothing of it holds where the ice passes: a point has no kinematics
    assert resolved(load_scene(CASE, [*UNIFORM, "model=auto", "ice.motion=sliding",
                                      "ice.heat=column"])).model != "point"  # fmt: skip


def test_a_wide_block_is_a_slice_and_chooses_its_ice(tmp_path):
    wide = ["model=auto", "rubber.width=1 m", "numerics.tolerance=1e-2"]
    assert resolved(thesis(*wide)).model == "slice"
    text = CASE.read_text().replace('heat = "continuum"', "").replace('"7 ms"', '"0.1 ms"')
    (tmp_path / "scene.toml").write_text(text)
    chosen = load_scene(tmp_path / "scene.toml", [*wide, "rubber.length=10mm"])
    assert resolved(chosen).ice.heat == "column"
    assert resolved(thesis(*wide)).ice.heat == "continuum"  # as the scene gives it


def test_the_closed_form_is_exact_until_something_melts():
    # At the tolerance of estimates; steps to a flux that jumps are shorter.
    assert simplifications(thesis("load.duration=1 ms")).closed_form.effect < 2e-4
    assert simplifications(thesis()).closed_form.effect == pytest.approx(0.286, abs=0.01)
    assert simplifications(thesis("ice.motion=sliding")).closed_form.effect == 0.0  # has none


def test_other_models_are_left_alone():
    scene = thesis("model=slice")
    assert resolved(scene) is scene
    assert on_level(scene, ModelLevel("point", "column", 1.0)).model == "point"


@pytest.mark.parametrize(
    ("changes", "kinds"),
    [
        ([], ["half-space", "column", "continuum"]),
        (["ice.heat=mesh"], ["half-space", "column", "continuum", "mesh"]),
        (["ice.heat=mesh", "ice.depth=1mm"], ["column", "mesh"]),
    ],
)
def test_ice_on_a_mesh_is_the_top_level_where_the_scene_has_it(changes, kinds):
    scene = thesis(*changes)
    chosen, skipped = levels(scene, simplifications(scene), (1.0,))
    assert chosen[-1] == ModelLevel("block", kinds[-1], 1.0)
    assert {level.heat for level in [*chosen, *skipped]} == set(kinds)


@pytest.mark.quick
def test_a_mesh_is_of_one_model(tmp_path):
    (tmp_path / "mesh.msh").write_text("a mesh of a slice, or of a block")
    for model, own in ("slice", "slice"), ("block", "block"):
        scene = thesis(f"model={model}", f"rubber.mesh={tmp_path / 'mesh.msh'}")
        chosen, skipped = levels(scene, simplifications(scene), (0.5, 1.0))
        assert {level.model for level in [*chosen, *skipped]} == {"point", own}
        assert {level.refinement for level in chosen} == {1.0}


@pytest.mark.quick
def test_every_level_is_a_valid_scene():
    """With heat in the rubber there is no half-space; refinements stay where scenes allow them."""
    for changes in ["rubber.heat=true"], ["numerics.refinement=0.25"], ["numerics.refinement=8"]:
        scene = thesis(*changes)
        chosen, skipped = levels(scene, simplifications(scene), (0.5, 1.0, 2.0))
        assert chosen
        for level in [*chosen, *skipped]:
            assert on_level(scene, level).numerics.refinement == level.refinement


@pytest.mark.fe
def test_ladder_says_which_level_is_enough_and_writes_it(tmp_path, capsys):
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.cli import main
    from iceslide_fem.postprocess.results import read_run

    # a pressure that is even to 2 %: the slice agrees with the point, and the block isn't run
    changes = ["rubber.width=1 m", "load.duration=0.3 ms", "numerics.tolerance=0.05"]
    words = [word for change in changes for word in ("--set", change)]
    with pytest.raises(SystemExit) as caught:
        main(["ladder", str(CASE), *words, "--refine", "0.25", "--out", str(tmp_path)])
    said = capsys.readouterr().out
    assert caught.value.code == 0, said
    assert "block_column_x0.25" in said and "same as the slice" in said
    assert "slice_half-space_x0.25" in said and "same as columns" in said
    assert not (tmp_path / "block_column_x0.25").exists()
    assert (tmp_path / "ladder.png").stat().st_size > 10_000
    written = load_scene(tmp_path / "thesis_1bar.toml")
    assert "# The thesis's LS-DYNA run" in (tmp_path / "thesis_1bar.toml").read_text()
    assert written.model == "point" and written.rubber.width == 1.0
    assert written.load.duration == pytest.approx(3e-4)
    # and it is within the tolerance of the finest level
    point, finest = (read_run(tmp_path / name) for name in ("point_column", "slice_column_x0.25"))
    for time in np.linspace(0.0, 3e-4, 7):
        assert point.at("mu", time) == pytest.approx(finest.at("mu", time), rel=0.05)


@pytest.mark.fe
def test_a_written_scene_finds_its_files_from_elsewhere(tmp_path, monkeypatch):
    """Rows of a load are a file beside the scene, and the folder of the result is another one."""
    from iceslide_fem.workflow.ladder.runs import write_scene

    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "speed.csv").write_text("time_s,speed_m_per_s\n0,1\n1e-3,2\n")
    text = CASE.read_text().replace('speed = "3 m/s"', 'speed = "speed.csv"')
    (tmp_path / "there" / "scene.toml").write_text(text.replace('"7 ms"', '"1 ms"'))
    monkeypatch.chdir(tmp_path)
    level = ModelLevel("slice", "column", 1.0)
    write_scene(Path("there/scene.toml"), [], level, tmp_path / "written.toml")
    monkeypatch.chdir("/")
    written = load_scene(tmp_path / "written.toml")
    assert (written.model, written.load.speeds.largest) == ("slice", 2.0)


@pytest.mark.fe
def test_auto_runs_what_it_says(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.simulate import run

    scene = thesis("model=auto", "ice.heat=column", "numerics.tolerance=1e-2", *UNIFORM)
    summary = run(scene, tmp_path)
    assert summary["scene"]["model"] == "point"
    assert float(rows_of(tmp_path / "history.csv")[-1]["time_s"]) == pytest.approx(7e-3)
