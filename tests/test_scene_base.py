"""Scenes on the base of another file, and scenes with other values."""

from pathlib import Path

import pytest

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.fingerprint import fingerprint, scene_hash

pytestmark = pytest.mark.quick

WHOLE = """
name = "first"
model = "point"
[rubber]
compound = "B"
length = "2 mm"
[load]
pressure = "1 bar"
speed = "2 m/s"
duration = "5 ms"
"""


@pytest.fixture
def files(tmp_path):
    """A function that writes scene files by name -> text; returns the folder."""

    def write(**texts):
        for name, text in texts.items():
            path = tmp_path / f"{name}.toml"
            path.write_text(text, encoding="utf-8")
        return tmp_path

    return write


def test_a_scene_has_the_values_of_its_base_and_its_own_over_them(files):
    folder = files(
        first=WHOLE,
        second='base = "first.toml"\nname = "second"\n[load]\nspeed = "3 m/s"\n',
        third='base = "second.toml"\n[load]\npressure = "4 bar"\n[ice]\ntemperature = "-8 degC"\n',
    )
    scene = load_scene(folder / "third.toml", ["load.duration=1ms"])
    assert (scene.name, scene.load.pressure, scene.load.speed) == ("second", 4e5, 3.0)
    assert scene.load.duration == 1e-3 and scene.rubber.length == 2e-3
    assert scene.ice.temperature == pytest.approx(265.15)


def test_a_scene_is_known_by_what_is_in_it_and_not_by_its_base(files):
    folder = files(
        first=WHOLE,
        based='base = "first.toml"\n[load]\nspeed = 3\n',
        alone=WHOLE.replace('"2 m/s"', "3.0"),
    )
    based, alone = (load_scene(folder / f"{name}.toml") for name in ("based", "alone"))
    assert based == alone and scene_hash(based) == scene_hash(alone)
    assert fingerprint(based) == fingerprint(alone)


def test_files_are_relative_to_the_file_that_names_them(files, tmp_path):
    (tmp_path / "inner").mkdir()
    rows = "time (ms), pressure (bar)\n0, 1\n2, 3\n"
    (tmp_path / "inner" / "load.csv").write_text(rows, encoding="utf-8")
    folder = files(outer='base = "inner/first.toml"\n')
    text = WHOLE.replace('"1 bar"', '"load.csv"')
    (folder / "inner" / "first.toml").write_text(text, encoding="utf-8")
    assert load_scene(folder / "outer.toml").load.pressures.largest == pytest.approx(3e5)


@pytest.mark.parametrize(
    "texts, words",
    [
        ({"a": 'base = "a.toml"'}, "has the base .*a.toml, which is based on it in turn"),
        (
            {"a": 'base = "b.toml"', "b": 'base = "c.toml"', "c": 'base = "b.toml"'},
            "c.toml has the base .*b.toml, which is based on it in turn",
        ),
        ({"a": 'base = "none.toml"'}, "cannot read the scene file .*none.toml"),
        ({"a": "base = 3"}, r'a.toml is no scene file; allowed: as in base = "other.toml"'),
        (
            {"a": 'base = "b0.toml"'} | {f"b{n}": f'base = "b{n + 1}.toml"' for n in range(9)},
            "a.toml has more than 8 bases, one of the other",
        ),
        ({"a": 'base = "b.toml"', "b": "[load\n"}, "b.toml is not valid TOML"),
        ({"a": 'base = "b.toml"\n[load]\nspeed = "x"', "b": WHOLE}, 'load.speed = "x"'),
    ],
)
def test_a_base_that_cannot_be_is_one_sentence(files, texts, words):
    with pytest.raises(SceneError, match=words):
        load_scene(files(**texts) / "a.toml")


def test_a_ladder_writes_a_scene_that_finds_its_base(files, tmp_path, monkeypatch):
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.runs.model_levels import ModelLevel
    from iceslide_fem.workflow.ladder.runs import write_scene

    folder = files(first=WHOLE, second='# mine\nbase = "first.toml"\n[load]\nspeed = 4\n')
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    write_scene(folder / "second.toml", [], ModelLevel("slice", "column", 1.0), Path("new.toml"))
    scene = load_scene("new.toml")
    assert (scene.model, scene.ice.heat, scene.load.speed) == ("slice", "column", 4.0)
    assert "# mine" in Path("new.toml").read_text(encoding="utf-8")


def test_a_scene_with_other_values_is_a_new_one(files):
    scene = load_scene(files(first=WHOLE) / "first.toml")
    dotted = scene.replace({"load.pressure": "3 bar", "load.speed": 1})
    nested = scene.replace({"load": {"pressure": "3 bar", "speed": 1.0}})
    assert dotted == nested and dotted.load.pressure == 3e5 and scene.load.pressure == 1e5
    assert scene.replace({}) == scene
    constants = {"compound": None, "C10": "0.2 MPa", "C01": "0.1 MPa", "nu": 0.49}
    other = scene.replace({"rubber": constants, "film": {"k": 0.3, "D": 6e-4, "H_V": 2e-6}})
    assert other.rubber.C10 == 2e5
    with pytest.raises(SceneError, match="did you mean load.pressure"):
        scene.replace({"load.presure": 1.0})
    with pytest.raises(SceneError, match="goes through speed, which is not a table"):
        scene.replace({"load.speed.x": 1.0})
