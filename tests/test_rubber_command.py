"""`iceslide rubber`: a DMA table or a scene in, a [rubber], tables and pictures out."""

import json
import tomllib
from pathlib import Path

import pytest
from program import exit_code, rows_of

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene, scene_from_dict

pytestmark = pytest.mark.quick

DMA = Path(__file__).parent.parent / "cases" / "rubber" / "synthetic_dma.csv"
LOAD = {"pressure": "1 bar", "speed": "1 m/s", "duration": "1 ms"}
WRITTEN = (
    "rubber.toml rubber.csv shift_factors.csv rubber.json report.html master_curve.png "
    "shift_factors.png temperature.png relaxation.png stress.png"
).split()
SCENE = """\
name = "made"
model = "slice"
[rubber]
compound = "B"
prony = [[0.3, "5 ms"]]
modulus_is = "long-term"
wlf = { C1 = 7.4, C2 = 121.6, reference = "20 degC" }
[load]
pressure = "1 bar"
speed = "1 m/s"
duration = "1 ms"
"""


def scene(rubber, **tables):
    film = {"k": 0.3, "D": 3e-5, "H_V": 2e-6}
    given = {"name": "a", "model": "slice", "rubber": rubber, "load": LOAD, "film": film}
    return scene_from_dict(given | tables)


@pytest.fixture
def small(tmp_path):
    """The table without some of its isotherms."""
    lines = DMA.read_text(encoding="utf-8").splitlines()[2:]
    kept = [line for line in lines if line.split(",")[1] not in ("-10", "10", "50")]
    (tmp_path / "small.csv").write_text("\n".join(kept), encoding="utf-8")
    return tmp_path / "small.csv"


def test_from_a_table_to_a_scene(small, tmp_path, capsys):
    out = tmp_path / "out"
    assert exit_code("rubber", small, "--out", out) == 0
    printed = capsys.readouterr().out
    assert "WLF" in printed and "rms of ln E'" in printed and "largest deviation" in printed
    assert all((out / name).stat().st_size > 100 for name in WRITTEN)
    rubber = tomllib.loads((out / "rubber.toml").read_text(encoding="utf-8"))["rubber"]
    found = scene(rubber)
    summary = json.loads((out / "rubber.json").read_text())
    assert found.mooney_rivlin.shear_modulus == pytest.approx(
        summary["instantaneous_modulus_Pa"] / 3.0
    )
    assert found.rubber.relaxation.shift.C1 == pytest.approx(7.4, rel=0.01)
    assert found.rubber.relaxation.prony.long_term == pytest.approx(0.01, rel=0.02)
    rows = rows_of(out / "shift_factors.csv")
    temperatures = [float(row["temperature_C"]) for row in rows]
    assert temperatures == [-40.0, -30.0, -20.0, 0.0, 20.0, 30.0, 40.0, 60.0]
    by_law, alone = ([float(row[name]) for row in rows] for name in list(rows[0])[1:])
    assert by_law == pytest.approx(alone, abs=0.02)
    assert exit_code("rubber", small, "--out", out) == 0  # the same again
    assert exit_code("rubber", small, "--reference", "0degC", "--out", out) == 2
    assert "results of other input (reference is None there" in capsys.readouterr().err


def test_a_scene_fits_its_own_table(tmp_path):
    given = {"compound": "B", "D1": 6.9e-10, "dma": str(DMA), "modulus_is": "long-term"}
    found = scene(given)
    relaxation = found.rubber.relaxation
    assert found.mooney_rivlin.C10 == pytest.approx(0.1662e6 / relaxation.prony.long_term)
    assert relaxation is found.rubber.relaxation  # fitted once
    assert scene_from_dict(found.as_dict()) == found
    assert found.files == {("rubber", "dma"): DMA}
    own = scene(given | {"wlf": {"C1": 7.4005, "C2": 121.6, "reference": "20 degC"}})
    assert own.rubber.relaxation.shift.C1 == 7.4005
    text = SCENE.replace('prony = [[0.3, "5 ms"]]', 'D1 = 6.9e-10\ndma = "table.csv"')
    (tmp_path / "table.csv").write_bytes(DMA.read_bytes())
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    assert load_scene(tmp_path / "s.toml").rubber.dma == tmp_path / "table.csv"
    assert exit_code("rubber", tmp_path / "s.toml", "--out", tmp_path / "out") == 0


@pytest.mark.parametrize(
    ("rubber", "said"),
    [
        ({"prony": [[0.3, 1.0]]}, "rubber.prony and rubber.dma contradict each other"),
        ({"modulus_is": None}, "rubber.modulus_is is missing: rubber.dma does not say"),
        ({"dma": "nowhere.csv"}, "is not a file"),
        ({"wlf": {"C1": 7.4, "C2": 50, "reference": "20 degC"}}, "no value at -40 degC"),
    ],
)
def test_what_is_no_table_of_a_scene_gets_one_sentence(rubber, said):
    with pytest.raises(SceneError, match=said):
        scene({"compound": "B", "dma": str(DMA), "modulus_is": "long-term"} | rubber)


def test_a_table_that_is_empty_gets_one_sentence(tmp_path):
    (tmp_path / "a.csv").write_text("frequency_Hz,temperature_C,E' (Pa),E'' (Pa)\n")
    with pytest.raises(SceneError, match="rubber.dma"):
        scene({"compound": "B", "dma": str(tmp_path / "a.csv"), "modulus_is": "long-term"})


def test_the_rubber_of_a_scene_is_shown_as_it_is(tmp_path, capsys):
    (tmp_path / "s.toml").write_text(SCENE, encoding="utf-8")
    out = tmp_path / "out"
    words = ["--rates", "1,100", "--temperatures", "-20degC,20degC", "--out", out]
    assert exit_code("rubber", tmp_path / "s.toml", *words) == 0
    rubber = tomllib.loads((out / "rubber.toml").read_text(encoding="utf-8"))["rubber"]
    assert rubber["compound"] == "B" and rubber["prony"] == [[0.3, 0.005]]
    rows = rows_of(out / "rubber.csv")
    summary = json.loads((out / "rubber.json").read_text())
    ends = [float(row["E_Pa"]) for row in (rows[0], rows[-1])]
    now = summary["instantaneous_modulus_Pa"]
    assert ends == pytest.approx([now, 0.7 * now], rel=1e-2)
    assert "WLF" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a.toml", "--of", "E"], "--of has no meaning for a scene"),
        (["elastic.toml"], "is elastic: it has neither rubber.prony nor rubber.dma"),
        (["dma.csv", "--of", "F"], "--of"),
        (["dma.csv", "--of", "G"], "has moduli E, and G was asked for"),
        (["dma.csv", "--wlf", "7.4,121.6"], "is not of the form 7.4,121.6,20degC"),
        (["dma.csv", "--wlf", "7.4,-3,20degC"], "is not of the form 7.4,121.6,20degC"),
        (["dma.csv", "--wlf", "7.4,121.6,20degC", "--arrhenius-below", "0degC"], "contradict"),
        (["dma.csv", "--wlf", "7.4,50,20degC"], "no value at -40 degC"),
        (["dma.csv", "--reference", "20bar"], "--reference"),
        (["dma.csv", "--rates", "fast"], "--rates"),
        (["dma.csv", "--temperatures", "1,2"], "--temperatures"),
        (["dma.csv", "--temperatures", "-120degC"], "no value at -120 degC; allowed: warmer"),
        (["dma.csv", "--modulus-is", "long"], "--modulus-is"),
        (["one.csv", "--reference", "0degC"], "--reference has no meaning"),
        (["nothing.csv"], "nothing.csv"),
        (["text.csv"], "text.csv"),
    ],
)  # fmt: skip
def test_wrong_input_gets_one_sentence_and_nothing_is_written(tmp_path, capsys, words, said):
    lines = DMA.read_text(encoding="utf-8").splitlines()[2:]
    lines[0] = "f (Hz),T (degC),E' (Pa),E'' (Pa)"
    (tmp_path / "dma.csv").write_text("\n".join(lines), encoding="utf-8")
    at_20 = [line for line in lines if line.split(",")[1] in ("T (degC)", "20")]
    (tmp_path / "one.csv").write_text("\n".join(at_20), encoding="utf-8")
    (tmp_path / "a.toml").write_text(SCENE, encoding="utf-8")
    elastic = [line for line in SCENE.splitlines() if line.split(" ")[0] not in RELAXES]
    (tmp_path / "elastic.toml").write_text("\n".join(elastic), encoding="utf-8")
    (tmp_path / "text.csv").write_text("no table at all\n", encoding="utf-8")
    file, *options = words
    out = tmp_path / "out"
    assert exit_code("rubber", tmp_path / file, *options, "--out", out) == 2
    error = capsys.readouterr().err
    assert said in error and error.startswith("iceslide: ") and error.count("\n") == 1
    assert not out.exists()


RELAXES = ("prony", "modulus_is", "wlf")
