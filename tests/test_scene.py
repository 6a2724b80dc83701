"""Scenes: units, overrides, and one clear sentence for every kind of bad input."""

import json
import re
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, load_scene, put, scene_from_dict
from iceslide_fem.scene.fields import leaves, quantity_of
from iceslide_fem.scene.materials import COMPOUNDS
from iceslide_fem.scene.rows import RowsOf
from iceslide_fem.scene.toml import read_scene

pytestmark = pytest.mark.quick

CASES = sorted((Path(__file__).parent.parent / "cases").glob("*.toml"))
CASE = Path(__file__).parent.parent / "cases" / "paper_1bar.toml"
BASE = {
    "name": "base",
    "model": "block",
    "rubber": {"compound": "B"},
    "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "7 ms"},
}
CONSTANTS = {"C10": "0.2 MPa", "C01": "0.1 MPa", "nu": 0.49}
CONTACT = {"k": 0.3, "D": "30 um", "H_V": "2 um"}


def changed(changes: dict) -> dict:
    """BASE with the dotted keys of `changes` set."""
    data = deepcopy(BASE)
    for key, value in changes.items():
        put(data, key, value)
    return data


def refusal(changes: dict) -> str:
    with pytest.raises(SceneError) as caught:
        scene_from_dict(changed(changes))
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_strings_with_units_become_si():
    scene = scene_from_dict(changed({"ice.temperature": "-4 degC", "film": dict(CONTACT)}))
    assert scene.load.pressure == 1e5
    assert scene.load.speed == 3.0
    assert scene.load.duration == 0.007
    assert scene.ice.temperature == 269.15
    assert (scene.film.k, scene.film.D, scene.film.H_V) == (0.3, 3e-5, 2e-6)


@pytest.mark.parametrize(
    ("key", "text", "expected"),
    [
        ("load.pressure", "0.2 MPa", 2e5),
        ("load.pressure", "2e5 Pa", 2e5),
        ("load.pressure", 200000, 2e5),
        ("load.speed", "3.6 km/h", 1.0),
        ("ice.temperature", "-10°C", 263.15),
        ("ice.temperature", "\N{MINUS SIGN}10 °C", 263.15),  # copied from a page
        ("ice.temperature", 263.15, 263.15),
        ("rubber.length", "20mm", 0.02),
        ("numerics.penalty", "50 MPa/mm", 5e10),
        ("film.initial_height", "70 nm", 7e-8),
    ],
)
def test_every_way_to_write_a_quantity(key, text, expected):
    table, name = key.split(".")
    scene = scene_from_dict(changed({key: text}))
    assert getattr(getattr(scene, table), name) == pytest.approx(expected, rel=1e-14)


def test_defaults():
    scene = scene_from_dict(BASE)
    assert scene.rubber.length == scene.rubber.width == scene.rubber.height == 1e-3
    assert (scene.load.static_friction, scene.film.initial_height) == (0.1, 70e-9)
    assert (scene.ice.motion, scene.ice.temperature) == ("attached", 269.15)
    assert (scene.numerics.tolerance, scene.numerics.refinement) == (1e-3, 1.0)


def test_as_dict_is_json_and_reads_back():
    scene = scene_from_dict(changed({"rubber": dict(CONSTANTS), "film": dict(CONTACT)}))
    assert scene_from_dict(json.loads(json.dumps(scene.as_dict()))) == scene


def test_scene_is_frozen():
    scene = scene_from_dict(BASE)
    with pytest.raises(ValueError, match="frozen"):
        scene.load.pressure = 2e5


def test_mooney_rivlin_of_compound_and_of_constants():
    assert scene_from_dict(BASE).mooney_rivlin == COMPOUNDS["B"]
    by_nu = scene_from_dict(changed({"rubber": dict(CONSTANTS), "film": dict(CONTACT)}))
    assert by_nu.mooney_rivlin.poissons_ratio == pytest.approx(0.49, rel=1e-12)
    by_D1 = {"C10": "166.2 MPa", "C01": "106.8 MPa", "D1": "0.0055 1/MPa"}
    rubber = scene_from_dict(changed({"rubber": by_D1, "film": dict(CONTACT)})).mooney_rivlin
    assert (rubber.C10, rubber.D1) == pytest.approx((166.2e6, 5.5e-9), rel=1e-12)


def test_contact_parameters_follow_the_table_unless_given():
    table = scene_from_dict(changed({"load.pressure": "5 bar"})).contact_parameters
    assert table(5e5).k == pytest.approx(0.405)
    constant = scene_from_dict(changed({"film": dict(CONTACT)})).contact_parameters
    assert constant(5e5).k == 0.3


TABLE = "pressure_Pa,k,D_m,H_V_m\n2e4,0.1,2e-5,6e-6\n1e5,0.25,3e-5,3e-6\n1e6,0.7,9e-5,4e-7\n"


def with_table(tmp_path, text, **film):
    (tmp_path / "contact.csv").write_text(text, encoding="utf-8")
    return changed({"film": {"contact": str(tmp_path / "contact.csv"), **film}})


def test_a_contact_file_replaces_the_table(tmp_path):
    table = scene_from_dict(with_table(tmp_path, TABLE)).contact_parameters
    assert [float(part) for part in table(1e5)[:3]] == pytest.approx([0.25, 3e-5, 3e-6])
    middle = table((2e4 * 1e5) ** 0.5)
    assert middle.k == pytest.approx((0.1 * 0.25) ** 0.5, rel=1e-12)
    assert middle.H_V == pytest.approx((6e-6 * 3e-6) ** 0.5, rel=1e-12)
    for p in (3e4, 9e4, 2e5, 9e5):
        slope = (table(1.001 * p).k - table(0.999 * p).k) / (0.002 * p)
        assert table(p).dk_dp == pytest.approx(slope, rel=1e-5)
    assert float(table(1e4).k) == pytest.approx(0.1) and table(1e4).dk_dp == 0.0
    assert list(table.outside([1.9e4, 2e4, 1e6, 1.1e6])) == [True, False, False, True]
    assert table(np.full((2, 3), 1e5)).k.shape == (2, 3)


def test_every_file_of_rows_is_relative_to_the_scene(tmp_path):
    tables = {
        "load": {"pressure": "ms, bar", "speed": "ms, m/s"},
        "ice": {"conductivity": "degC, W/m/K", "heat_capacity": "degC, J/kg/K", "water": "mm, um"},
        "water": {"viscosity": "degC, mPa*s"},
        "film": {"initial_height": "degC, nm", "dry_stress": "degC, kPa", "dry_rows": "1, 1"},
    }
    lines = ['name = "x"', 'model = "slice"', "[rubber]", 'compound = "B"']
    for table, keys in tables.items():
        lines.append(f"[{table}]")
        lines += [f'{key} = "{key}.csv"' for key in keys]
    (tmp_path / "scene.toml").write_text("\n".join(lines), encoding="utf-8")
    read = read_scene(tmp_path / "scene.toml")
    for table, keys in tables.items():
        assert read[table] == {key: str(tmp_path / f"{key}.csv") for key in keys}
    known = {key for key, field in leaves(Scene) if isinstance(quantity_of(field), RowsOf)}
    assert known == {f"{table}.{key}" for table, keys in tables.items() for key in keys}


def test_a_contact_file_is_relative_to_the_scene_and_may_be_written_by_hand(tmp_path):
    folder = tmp_path / "there"
    folder.mkdir()
    (folder / "by_hand.csv").write_text(
        "# B on ice\n k , pressure_Pa, H_V_m, D_m, remark\n0.2, 5e4, 4e-6, 2e-5, x\n"
        "0.5, 5e5, 1e-6, 5e-5, y\n",
        encoding="utf-8-sig",
    )
    (folder / "scene.toml").write_text(
        'name = "x"\nmodel = "point"\n[rubber]\nC10 = 2e5\nC01 = 0\nnu = 0.49\n'
        '[load]\npressure = "6 bar"\nspeed = 3\nduration = "1 ms"\n'
        '[film]\ncontact = "by_hand.csv"\n',
        encoding="utf-8",
    )
    scene = load_scene(folder / "scene.toml")
    assert scene.contact_parameters(5e5).k == pytest.approx(0.5)
    message = scene.outside_table()
    assert message is not None and "by_hand.csv" in message and "0.5 to 5 bar" in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no numbers in it"),
        ("pressure_Pa,k,D_m\n1e5,0.3,2e-5\n", "no column H_V_m"),
        (TABLE.splitlines()[0], "has no numbers in it"),
        ("\n".join(TABLE.splitlines()[:2]), "1 pressure; allowed: 2 or more"),
        (TABLE.replace("0.25", "x"), 'row 2 (line 3), column 2 (k): "x" is not a number'),
        (TABLE.replace("0.25", "nan"), "row 2 (line 3): k is missing"),
        (
            TABLE.replace("0.25", "1.2"),
            "row 2 (line 3): k = 1.2 is out of range; allowed: 1e-06 to 1",
        ),
        (TABLE.replace("2e4", "0.2"), "row 1 (line 2): pressure_Pa = 0.2 is out of range"),
        (TABLE.replace("2e-5", "20"), "row 1 (line 2): D_m = 20 is out of range"),
        (TABLE.replace("2e4", "2e6"), "rows 1 and 2: pressure_Pa must rise"),
        (TABLE.replace("0.7", "0.105"), "rows 2 and 3: k must not fall"),
        (TABLE.replace("4e-7", "4e-6"), "rows 2 and 3: H_V_m must not rise"),
        (TABLE.replace(",D_m", ",k"), "has the column k twice"),
        ("a" * 200_000, "has no numbers in it"),
        (TABLE.replace("1e6,0.7,9e-5,4e-7", "1e6,0.7"), "line 4 has 2 values; the others have 4"),
    ],
)
def test_bad_contact_files_are_one_sentence(tmp_path, text, words):
    with pytest.raises(SceneError) as caught:
        scene_from_dict(with_table(tmp_path, text))
    assert words in str(caught.value) and "contact.csv" in str(caught.value)
    assert str(caught.value).startswith("film.contact") and "\n" not in str(caught.value)


def test_a_contact_file_that_is_none_or_one_too_many(tmp_path):
    with pytest.raises(SceneError, match="film.contact.*is not a file"):
        scene_from_dict(changed({"film": {"contact": str(tmp_path / "none.csv")}}))
    with pytest.raises(SceneError, match="film.contact and film.k contradict"):
        scene_from_dict(with_table(tmp_path, TABLE, **CONTACT))
    (tmp_path / "contact.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="not a text file"):
        scene_from_dict(changed({"film": {"contact": str(tmp_path / "contact.csv")}}))


def test_nominal_pressure_outside_the_table_is_said_once():
    assert scene_from_dict(changed({"load.pressure": "5 bar"})).outside_table() is None
    assert scene_from_dict(changed({"load.pressure": "1 bar"})).outside_table() is None
    message = scene_from_dict(changed({"load.pressure": "6 bar"})).outside_table()
    assert message is not None and "1 to 5 bar" in message and "6 bar" in message
    given = changed({"load.pressure": "6 bar", "film": dict(CONTACT)})
    assert scene_from_dict(given).outside_table() is None


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        # unit
        ("load.pressure", "3 m/s", ['load.pressure = "3 m/s"', "wrong unit", "0.01 bar"]),
        ("load.pressure", "3 baar", ["unknown unit", "baar", "100 bar"]),
        ("load.pressure", "3 m/(", ["unknown unit"]),
        ("load.speed", "3", ['load.speed = "3"', "no unit", "m/s"]),
        ("load.speed", "fast", ["not a number with a unit"]),
        ("ice.temperature", "-4 C", ["wrong unit", "degC"]),
        ("film.k", "3 mm", ["wrong unit"]),
        # range
        ("load.pressure", "-1 bar", ["load.pressure", "out of range", "0.01 bar", "100 bar"]),
        ("load.pressure", float("nan"), ["out of range"]),
        ("load.pressure", 10**400, ["out of range"]),
        ("load.speed", 0, ["load.speed = 0", "out of range", "m/s"]),
        ("ice.temperature", "0 degC", ["out of range", "-0.001 degC"]),
        ("ice.temperature", 273.15, ["ice.temperature = 273.15", "out of range"]),
        ("ice.temperature", -4, ["ice.temperature = -4", "a plain number is in K", "degC"]),
        ("numerics.tolerance", 1.0, ["numerics.tolerance = 1.0", "1e-6 to 0.1"]),
        ("numerics.refinement", 100, ["0.25 to 8"]),
        ("numerics.penalty", "0.001 MPa/mm", ["sink 100 mm into the ice", "1 MPa/mm"]),
        ("numerics.shear_ramp_pressure", "10 bar", ["10 bar is above load.pressure = 1 bar"]),
        ("rubber.nu", 0.5, ["rubber.nu", "0.4995"]),
        # type
        ("load.pressure", True, ["not a number"]),
        ("load.pressure", [1], ["has 1 row; allowed: a number, or 2 to"]),
        ("load", 3, ["load = 3", "not a table", "[load]"]),
        ("rubber.heat", "yes", ["rubber.heat", 'true, false or "mesh"']),
        ("name", "a/b", ["name", "letters from a to z"]),
        ("name", 3, ["name = 3"]),
        ("rubber.mesh", "no-such.msh", ["rubber.mesh", "no-such.msh", "not a file"]),
        # choice
        ("model", "blok", ['model = "blok"', "'point', 'slice', 'block' or 'auto'"]),
        ("ice.heat", "columns", ["ice.heat", "'half-space', 'column', 'continuum' or 'mesh'"]),
        ("numerics.film_integrator", "rk4", ["'sdirk2'", "'explicit-euler'"]),
        # unknown key
        ("load.presure", 1, ["load.presure", "did you mean load.pressure?"]),
        ("load.temperature", 1, ["did you mean", "ice.temperature?"]),
        ("film.hv", 1, ["did you mean film.H_V?"]),
        ("temprature", 1, ["did you mean", "ice.temperature?"]),
        ("film.foo", 1, ["film.foo", "allowed: film.carrier, film.pressure, film.k"]),
        # compound
        ("rubber.compound", "A", ["1.10 MPa", "rubber.C10", "D1", "film.k, film.D and film.H_V"]),
        ("rubber.compound", "C", ["2.04 MPa", "rubber.C10"]),
        ("rubber.compound", "X", ['"X" is not known', '"B"']),
    ],
)
def test_one_bad_value(key, value, words):
    message = refusal({key: value})
    assert all(word in message for word in words), message


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rubber.C10": "1 MPa"}, ["rubber.compound", "rubber.C10", "contradict"]),
        (
            {"rubber": CONSTANTS | {"D1": "0.07 1/MPa"}},
            ["rubber.D1 and rubber.nu contradict", "one of them"],
        ),
        ({"rubber": {}}, ['compound = "B"', "C10, C01"]),
        ({"rubber": {"C10": "1 MPa", "C01": "1 MPa"}}, ["one of D1 and nu", "given: C10, C01"]),
        ({"rubber": CONSTANTS | {"C10": 0, "C01": 0}}, ["both 0"]),
        ({"rubber": CONSTANTS}, ["film.k, film.D and film.H_V are missing"]),
        ({"film.k": 0.3}, ["film has k only", "together"]),
        ({"film.k": 0.3, "film.D": "30 um"}, ["film has k and D only"]),
        (
            {"ice.heat": "half-space", "ice.motion": "sliding"},
            ["half-space", "sliding", "'column', 'continuum' or 'mesh'"],
        ),
        (
            {"model": "point", "ice.motion": "sliding", "film.carrier": "rubber"},
            ["film.carrier", "point", 'or film.carrier = "ice"'],
        ),
        (
            {"model": "point", "ice.motion": "sliding", "rubber.heat": True},
            ["rubber.heat", "point", '"slice" or "block"'],
        ),
        (
            {"rubber.heat": True, "ice.heat": "half-space"},
            ["half-space", "rubber.heat", "'column', 'continuum' or 'mesh'"],
        ),
        ({"rubber.heat": True, "rubber.height": 1e-4}, ["rubber.height = 0.1 mm is too thin"]),
    ],
)
def test_contradictions(changes, words):
    message = refusal(changes)
    assert all(word in message for word in words), message


def test_heat_on_the_mesh_of_the_rubber_takes_blocks_of_any_height():
    data = deepcopy(BASE)
    data["rubber"] |= {"heat": "mesh", "height": 1e-4}
    data["ice"] = data.get("ice", {}) | {"heat": "mesh", "motion": "attached"}
    assert scene_from_dict(data).rubber.heat == "mesh"


def test_missing_keys():
    data = deepcopy(BASE)
    del data["load"]["speed"]
    with pytest.raises(SceneError, match=r"^load\.speed is missing$"):
        scene_from_dict(data)
    with pytest.raises(SceneError, match="^name, model, .* and .* are missing$"):
        scene_from_dict({})


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_the_cases_are_valid_and_named_after_their_files(path):
    scene = load_scene(path)
    assert scene.name == path.stem
    assert path.with_suffix(".py").is_file()
    if path.stem in ("tread_block", "siped_block", "siped_tread"):
        assert scene.ice.motion == "sliding" and scene.rubber.length == pytest.approx(20e-3)
        return
    if path.stem in ("load_step", "friction_tester", "braking_wheel"):
        assert scene.load.changes
        return
    if path.stem == "thin_ice":
        assert [layer.thickness for layer in scene.ice.stack] == [1e-3, 10e-3]
        assert scene.ice.held == scene.ice.temperature == pytest.approx(263.15)
        return
    if path.stem in ("cold_point", "cold_block"):
        assert scene.film.dry_softens and scene.initial_height == 0.0
        assert scene.rubber.inertia == (scene.model != "point")
        return
    if path.stem == "rough_ice":
        assert scene.ice.roughness.is_rough and scene.rubber.relaxation is not None
        return
    if path.stem in ("wet_slick", "wet_siped"):
        assert scene.ice.water == pytest.approx(20e-6) and scene.film.voids == "carry"
        assert len(scene.rubber.cuts) == (4 if path.stem == "wet_siped" else 0)
        return
    if path.stem == "friction_drum":
        assert scene.several_passes and scene.ice.held == scene.ice.temperature
        return
    if path.stem == "cad_tread":
        assert scene.rubber.step is not None and scene.rubber.is_drawn
        return
    if path.stem == "user_mesh":
        assert scene.rubber.mesh is not None and scene.rubber.mesh.is_file()
        return
    pressure = float(re.search(r"_(\d)bar", path.stem)[1]) * 1e5
    of_thesis, of_paper = (3.0, 7e-3), (4.0, 5e-3)
    source = {"thesis": of_thesis, "rough": of_thesis, "paper": of_paper}[path.stem.split("_")[0]]
    assert (scene.load.pressure, scene.load.speed, scene.load.duration) == (pressure, *source)
    assert scene.outside_table() is None


def test_overrides():
    scene = load_scene(
        CASE, ["load.pressure=3bar", "model=slice", "ice.heat = column", "load.speed=2"]
    )
    assert (scene.load.pressure, scene.load.speed) == (3e5, 2.0)
    assert (scene.model, scene.ice.heat) == ("slice", "column")


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("load.pressure", ["load.pressure", "load.pressure=3bar"]),
        ("=3", ["form"]),
        ("load..speed=3", ["form"]),
        ("name.x=3", ["name.x goes through name", "not a table"]),
        ("load.presure=3bar", ["did you mean load.pressure?"]),
        ("load.pressure=3", ["load.pressure = 3", "out of range", "a plain number is in Pa"]),
        ("load.pressure=", ['load.pressure = ""', "not a number"]),
    ],
)
def test_bad_overrides(override, words):
    with pytest.raises(SceneError) as caught:
        load_scene(CASE, [override])
    assert all(word in str(caught.value) for word in words), caught.value


def test_unreadable_files(tmp_path):
    with pytest.raises(SceneError, match="cannot read the scene file .*nowhere.toml"):
        load_scene(tmp_path / "nowhere.toml")
    with pytest.raises(SceneError, match="cannot read the scene file"):
        load_scene(tmp_path)
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="not UTF-8"):
        load_scene(binary)
    bare_unit = tmp_path / "bare.toml"
    bare_unit.write_text("[load]\npressure = 1 bar\n")
    with pytest.raises(SceneError, match=r"not valid TOML.*line 2.*in quotes"):
        load_scene(bare_unit)


def test_a_mesh_is_found_beside_its_scene(tmp_path):
    (tmp_path / "tread.msh").touch()
    text = CASE.read_text().replace("[rubber]", '[rubber]\nmesh = "tread.msh"')
    (tmp_path / "scene.toml").write_text(text)
    assert load_scene(tmp_path / "scene.toml").rubber.mesh == tmp_path / "tread.msh"
