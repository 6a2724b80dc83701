"""Lines, and data of one's own for every module of `iceslide footprint`."""

import json

import numpy as np
import pytest
from program import exit_code, rows_of

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.macroscopic import State, heat_model
from iceslide_fem.preprocess.footprint.pressure_map import gaussian_profile
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.runtime.errors import SceneError

LENGTH, POINTS, ROWS = 0.18, 40, 4
X, PRESSURE = gaussian_profile(LENGTH, 2e5, POINTS)
MAP = np.tile(PRESSURE, (ROWS, 1))
SIZE = {"length": LENGTH, "width": 0.1}


def surveyed(**values):
    """With the thesis's balance."""
    case = FootprintCase.of({"thesis_balance": True, **values})
    return survey(case, read_footprint(case))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A profile, the map that has it in every row, temperatures and states of that map."""
    folder = tmp_path_factory.mktemp("entries")
    rows = [f"{1e3 * x:.12g},{p / 1e5:.12g}" for x, p in zip(X, PRESSURE, strict=True)]
    (folder / "line.csv").write_text("\n".join(["cell_mm, pressure_bar", *rows]) + "\n")
    np.save(folder / "map.npy", MAP)
    case = FootprintCase.of({"pressure_map": str(folder / "map.npy"), **SIZE})
    moving = heat_model(read_footprint(case).pressure_map, case.moving)
    np.savetxt(folder / "celsius.txt", moving.temperature - 273.15, fmt="%.12g")
    np.savetxt(folder / "states.csv", moving.state, delimiter=",", fmt="%d")
    np.savetxt(folder / "dry.csv", np.ones(MAP.shape), delimiter=";", fmt="%d")
    return folder


def test_a_line_is_the_map_that_is_constant_across(files):
    line = surveyed(line=str(files / "line.csv"))
    whole = surveyed(pressure_map=str(files / "map.npy"), **SIZE)
    row = surveyed(pressure_map=str(files / "map.npy"), row=ROWS - 1, **SIZE)
    for name in ("thesis", "moving_source"):
        for part in ("flux", "rise", "temperature", "state", "mu"):
            expected = getattr(line.models[name], part)
            for other, count in ((whole, ROWS), (row, 1)):
                values = getattr(other.models[name], part)
                assert values == pytest.approx(np.tile(expected, (count, 1)), rel=1e-9, abs=1e-12)
    assert whole.film.shear == pytest.approx(np.tile(line.film.shear, (ROWS, 1)), rel=1e-9)
    figures = summary(line)
    assert figures["film"] == pytest.approx(summary(whole)["film"])
    assert figures["line"] == {"pixels": POINTS, "row": None}
    assert summary(row)["line"]["row"] == ROWS - 1 and "line" not in summary(whole)


def test_temperatures_of_module_2_entered_as_ones_own_give_its_friction(files):
    own = surveyed(
        pressure_map=str(files / "map.npy"), temperature_map=str(files / "celsius.txt"), **SIZE
    )
    given, moving = own.models["given"], own.models["moving_source"]
    assert given.mu == pytest.approx(moving.mu, rel=1e-6, abs=1e-9)
    assert given.balance == pytest.approx(moving.balance, rel=1e-9)
    figures = summary(own)["given"]
    assert figures["trailing_edge_temperature_C"] > figures["leading_edge_temperature_C"]
    edge = moving.temperature[0, [0, -1]] - 273.15
    assert figures["trailing_edge_temperature_C"] == pytest.approx(edge[0])
    assert figures["leading_edge_temperature_C"] == pytest.approx(edge[1])


def test_states_of_ones_own_decide_module_3(files):
    plain = surveyed(pressure_map=str(files / "map.npy"), **SIZE)
    same, dry = (
        surveyed(pressure_map=str(files / "map.npy"), state_map=str(files / name), **SIZE)
        for name in ("states.csv", "dry.csv")
    )
    assert same.models["moving_source"].mu == pytest.approx(plain.models["moving_source"].mu)
    assert summary(dry)["moving_source"]["dry_share"] == 1.0
    expected = (
        (0.19 + 2.22)
        / 1e-4
        * plain.models["moving_source"].rise.mean()
        / plain.models["moving_source"].power
    )
    assert dry.models["moving_source"].balance.mu == pytest.approx(expected)
    assert dry.film.shear == pytest.approx(plain.film.shear)


def test_ice_that_melts_below_zero_is_wet_where_it_melts(files):
    """And its curves over temperature end below its melting temperature."""
    own = {"melting_temperature": "-5degC", "temperature": "-9degC"}
    same, salty = (
        surveyed(pressure_map=str(files / "map.npy"), **SIZE, **given)
        for given in ({"temperature": "-4degC"}, own)
    )
    assert salty.film.melting.any()
    assert (salty.state[salty.film.melting] == State.WET).all()
    assert (salty.state == same.state).all()
    curves, pure = salty.curves, same.curves
    whole = same.film.mean_friction(same.read.pressure_map)
    assert pure.film[pure.temperature == same.case.temperature] == pytest.approx(whole)
    assert curves.temperature == pytest.approx(pure.temperature - 5.0)
    assert curves.film == pytest.approx(pure.film) and curves.peng == pytest.approx(pure.peng)


def test_maps_have_their_first_row_on_top(tmp_path):
    upper = MAP.copy()
    upper[1:] = 0.0
    np.save(tmp_path / "map.npy", upper)
    read = read_footprint(FootprintCase.of({"pressure_map": str(tmp_path / "map.npy"), **SIZE}))
    assert read.pressure_map.pressure[-1] == pytest.approx(PRESSURE)
    assert not read.pressure_map.pressure[:-1].any()


@pytest.mark.parametrize("separator", [",", ";", ", ", "\t", " ; "])
def test_maps_have_any_separator_which_may_end_a_row(separator, tmp_path):
    rows = [[3e5, 2e5, 1e5], [2e5, 1e5, 0.0]]
    for end in ("", separator):
        text = "\r\n".join(separator.join(map(str, row)) + end for row in rows)
        (tmp_path / "map.txt").write_text(text)
        case = FootprintCase.of({"pressure_map": str(tmp_path / "map.txt"), **SIZE})
        assert read_footprint(case).pressure_map.pressure[::-1].tolist() == rows


def test_a_map_that_is_an_archive_is_a_sentence(tmp_path):
    (tmp_path / "map.npy").write_bytes(b"PK\x03\x04, as archives begin")
    case = FootprintCase.of({"pressure_map": str(tmp_path / "map.npy"), **SIZE})
    with pytest.raises(SceneError, match="is no matrix of numbers that NumPy"):
        read_footprint(case)


def test_a_map_of_temperatures_has_some(tmp_path):
    (tmp_path / "p").write_text("1e5 2e5\n")
    (tmp_path / "t").write_text("nan nan\n")
    maps = {"pressure_map": str(tmp_path / "p"), "temperature_map": str(tmp_path / "t")}
    maps["thesis_balance"] = True
    with pytest.raises(SceneError, match="has no temperature in it"):
        read_footprint(FootprintCase.of({**maps, **SIZE}))


def test_the_threshold_is_that_of_profiles_too(files):
    for source in ({"line": str(files / "line.csv")}, {"gaussian": "180mm,2bar,30mm"}):
        pressure = read_footprint(FootprintCase.of({**source, "threshold": "1bar"})).pressure_map
        touching = pressure.pressure[pressure.contact]
        assert 1e5 < touching.min() < 1.1e5 and pressure.pressure.min() == 0.0


def test_nothing_touches_where_a_gaussian_has_died_away():
    pressure = read_footprint(FootprintCase.of({"gaussian": "180mm,4bar,4mm"})).pressure_map
    found = pressure.pressure[pressure.contact]
    assert found.min() > 1.0
    assert pressure.load == pytest.approx(4e5 * 4e-3 * (2.0 * np.pi) ** 0.5, rel=1e-6)


def test_columns_of_a_profile_are_the_entries_of_its_modules(tmp_path):
    text = "cell_m,pressure_Pa,temperature_C,state\n0.001,0,5,0\n0.002,2e5,-1,2\n0.003,1e5,-3,1\n"
    (tmp_path / "own.csv").write_text(text)
    out = tmp_path / "out"
    assert (
        exit_code(
            "footprint",
            "--line",
            tmp_path / "own.csv",
            "--thesis-balance",
            "--out",
            out,
            "--no-report",
        )
        == 0
    )
    table = rows_of(out / "line.csv")
    assert [float(row["temperature_given_C"]) for row in table] == pytest.approx([-4.0, -1.0, -3.0])
    assert [float(row["x_m"]) for row in table] == [0.001, 0.002, 0.003]
    assert [float(row["state_moving"]) for row in table] == [0, 2, 1]
    power = 1.5e5 * 3.0
    mixed, dry = (0.19 + 2.22 + 0.56) * 3.0, (0.19 + 2.22) * 1.0
    expected = [0.0, mixed / 2 / 1e-4 / power, dry / 2 / 1e-4 / power]
    assert [float(row["mu_given"]) for row in table] == pytest.approx(expected)
    figures = json.loads((out / "summary.json").read_text())
    assert figures["given"]["mu_balance"] == pytest.approx(sum(expected))
    written = {"line.csv", "line.png", "page.json", "summary.json"}
    assert {path.name for path in out.iterdir()} == written


def test_options_of_the_macroscopic_model_reach_it(files):
    case = FootprintCase.of(
        {
            "line": str(files / "line.csv"),
            "thesis_balance": True,
            "air_temperature": "2degC",
            "ice_material": "3,900,1000",
            "tread_material": "0.3,1000,2000",
            "water_conductivity": "0.6",
            "thesis_time": "2s",
        }
    )
    model = case.thesis
    assert model.warmer_ice == pytest.approx(-6.0)
    assert (model.ice.conductivity, model.tread.conductivity) == (3.0, 0.3)
    assert (model.water_conductivity, model.time, case.moving.source) == (0.6, 2.0, "moving")
    assert case.moving.effusivity == pytest.approx((3.0 * 900.0 * 1000.0) ** 0.5)


@pytest.mark.parametrize(("unit", "pascals"), [("kPa", 1e3), ("bar", 1e5), ("psi", 6894.757)])
def test_pressures_have_the_unit_that_their_file_or_the_option_says(unit, pascals, tmp_path):
    numbers = "\n".join(" ".join(f"{p / pascals:.9g}" for p in row) for row in MAP)
    (tmp_path / "named").write_text(f"Pressure [{unit}]\n{numbers}\n")
    (tmp_path / "plain").write_text(numbers + "\n")
    np.save(tmp_path / "map.npy", MAP / pascals)
    named = {"pressure_map": str(tmp_path / "named"), **SIZE}
    plain = {"pressure_map": str(tmp_path / "plain"), "pressure_unit": unit, **SIZE}
    saved = {"pressure_map": str(tmp_path / "map.npy"), "pressure_unit": unit, **SIZE}
    rows = "\n".join(f"{1e3 * x:.12g};{p / pascals:.9g}" for x, p in zip(X, PRESSURE, strict=True))
    (tmp_path / "line").write_text(f"cell (mm);pressure ({unit})\n{rows}\n")
    (tmp_path / "bare").write_text(f"cell_mm;pressure\n{rows}\n")
    line = {"line": str(tmp_path / "line")}
    bare = {"line": str(tmp_path / "bare"), "pressure_unit": unit}
    for values in (named, plain, saved, line, bare, named | {"pressure_unit": unit}):
        found = read_footprint(FootprintCase.of(values)).pressure_map.pressure
        assert found[0] == pytest.approx(np.where(PRESSURE > 1.0, PRESSURE, 0.0), rel=1e-6)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e-3, "are they in kPa or psi? a heading or --pressure-unit kPa says so"),
        (1e-5, "bar"),
        (1e-6, "MPa"),
        (30.0, "allowed: 0.05 to 50 bar"),
        (1e4, "allowed: 0 to 1e+07 Pa"),
    ],
)
def test_pressures_of_no_tyre_are_refused_with_their_likely_unit(factor, words, tmp_path):
    even = np.full((4, 5), 2e5) * factor
    np.save(tmp_path / "map.npy", even)
    rows = "".join(f"{x},{p}\n" for x, p in enumerate(even[0]))
    (tmp_path / "line.csv").write_text("x_mm,pressure_Pa\n" + rows)
    whole = {"pressure_map": str(tmp_path / "map.npy"), **SIZE}
    for given in (whole, {"line": str(tmp_path / "line.csv")}, whole | {"load": "3kN"}):
        with pytest.raises(SceneError) as refusal:
            read_footprint(FootprintCase.of(given))
        assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_load_of_another_unit_is_refused_and_a_large_factor_said(tmp_path):
    np.save(tmp_path / "map.npy", MAP)
    given = {"pressure_map": str(tmp_path / "map.npy"), **SIZE}
    with pytest.raises(SceneError, match="--load 3 N has a mean pressure of .* none of a tyre"):
        read_footprint(FootprintCase.of(given | {"load": "3"}))
    read = read_footprint(FootprintCase.of(given | {"load": "4kN"}))
    assert read.pressure_map.load == pytest.approx(4000.0) and read.notes == ()
    read = read_footprint(FootprintCase.of(given | {"load": "200N"}))
    factor = f"{read.load_factor:.3g}"
    assert read.notes == (f"--load multiplies the pressures that were read by {factor}",)


def test_units_that_contradict_each_other_are_a_sentence(tmp_path):
    (tmp_path / "map").write_text("p (kPa)\n200 300\n")
    given = {"pressure_map": str(tmp_path / "map"), **SIZE}
    with pytest.raises(SceneError, match="--pressure-unit bar contradicts .*map, which is in kPa"):
        read_footprint(FootprintCase.of(given | {"pressure_unit": "bar"}))
    with pytest.raises(SceneError, match='--pressure-unit "kg" is not a unit of pressure; allowed'):
        FootprintCase.of(given | {"pressure_unit": "kg"})
    with pytest.raises(SceneError, match="--frame 1: .*map has no frames"):
        read_footprint(FootprintCase.of(given | {"frame": "1"}))


def test_places_without_a_value_touch_nowhere(tmp_path):
    text = ";;;\n;2,5;3;\n;1,5;;\n;;;\n"
    (tmp_path / "map.csv").write_text("p in bar\n" + text)
    read = read_footprint(FootprintCase.of({"pressure_map": str(tmp_path / "map.csv"), **SIZE}))
    expected = [[0, 0, 0, 0], [0, 1.5e5, 0, 0], [0, 2.5e5, 3e5, 0], [0, 0, 0, 0]]
    assert read.pressure_map.pressure == pytest.approx(np.array(expected, dtype=float))


def test_temperatures_may_be_in_kelvin(tmp_path):
    (tmp_path / "p").write_text("2e5 3e5\n")
    (tmp_path / "t").write_text("# temperature [K]\n270.15;271,5\n".replace("270.15", "270,15"))
    maps = {"pressure_map": str(tmp_path / "p"), "temperature_map": str(tmp_path / "t")}
    maps["thesis_balance"] = True
    read = read_footprint(FootprintCase.of({**maps, **SIZE}))
    assert read.temperature == pytest.approx(np.array([[270.15, 271.5]]))


FRAMES = """\
DATA_TYPE MOVIE
VERSION I-Scan 7.60
ROWS 2
COLS 3
ROW_SPACING 8.0 mm
COL_SPACING 5.0 mm
UNITS kPa
ASCII_DATA @@

Frame 7
B,100.0,200.0
0.0,150.0,B

Frame 8
B,200.0,300.0
0.0,250.0,B

Frame 9
B,1.0,2.0
0.0,1.0,B
@@
"""


def test_frames_of_a_sensor_have_their_units_and_sizes(tmp_path):
    for name, text in {
        "a.asf": FRAMES,
        "b.csv": FRAMES.replace(" mm\n", " mm,,\r\n").replace("\n\n", "\n,,\n"),
        "c.asf": FRAMES.replace(",", ";").replace(".0", ",0").replace("7,60", "7.60"),
        "d.asf": FRAMES.replace("8.0 mm", "0.8 cm").replace("kPa", "KPA"),
    }.items():
        (tmp_path / name).write_text(text)
        read = read_footprint(FootprintCase.of({"pressure_map": str(tmp_path / name)}))
        footprint = read.pressure_map
        expected = 1e3 * np.array([[0.0, 250.0, 0.0], [0.0, 200.0, 300.0]])
        assert footprint.pressure == pytest.approx(expected), name
        assert (footprint.dx, footprint.dy) == pytest.approx((5e-3, 8e-3))
        assert footprint.load == pytest.approx(750e3 * 40e-6)
        assert "frame 8 of 3 is read, that of the largest force, in kPa" in read.notes[0]
    case = FootprintCase.of({"pressure_map": str(tmp_path / "a.asf"), "frame": "7"})
    assert read_footprint(case).pressure_map.pressure.max() == pytest.approx(200e3)
    (tmp_path / "n.asf").write_text(FRAMES.replace("kPa", "N").replace("00.0", "0.0"))
    case = FootprintCase.of({"pressure_map": str(tmp_path / "n.asf"), "frame": "7"})
    assert read_footprint(case).pressure_map.load == pytest.approx(10.0 + 20.0 + 150.0)


@pytest.mark.parametrize(
    ("old", "new", "values", "words"),
    [
        ("kPa", "RAW", {}, 'has UNITS "RAW" in its head; allowed: a pressure such as kPa'),
        ("ROWS 2", "ROWS 3", {}, "frame 7 has 2 rows of 3; its head says 3 of 3"),
        ("ROWS 2", "ROWS two", {}, 'has ROWS "two" in its head; allowed: a whole number'),
        ("8.0 mm", "8.0", {}, 'has ROW_SPACING "8.0" in its head; allowed: say "2.0 mm"'),
        ("150.0", "x", {}, 'frame 7: row 2 (line 3), column 2: "x" is not a number'),
        ("kPa", "kPa", {"frame": "3"}, "which has the frames 7 to 9"),
        ("kPa", "kPa", {"length": 0.5}, "--length 500 mm contradicts the file"),
        ("Frame ", "Bild ", {}, "has no line Frame 1"),
    ],
)
def test_frames_that_cannot_be_read_are_a_sentence(old, new, values, words, tmp_path):
    (tmp_path / "a.asf").write_text(FRAMES.replace(old, new))
    with pytest.raises(SceneError) as refusal:
        read_footprint(FootprintCase.of({"pressure_map": str(tmp_path / "a.asf")} | values))
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_friction_that_no_rubber_has_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "map").write_text("6e3 6e3\n")
    words = ["--pressure-map", "map", *PIXELS, "--viscosity", "5Pa*s", "--out", "out"]
    assert exit_code("footprint", *words) == 2
    assert "which no rubber has on ice; allowed: up to 5" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


BALANCE = ["--thesis-balance"]
LINE, PIXELS = "x_m,pressure_Pa\n0,1e5\n1e-3,2e5\n", ["--length", "180mm", "--width", "100mm"]


@pytest.mark.parametrize(
    ("text", "arguments", "words"),
    [
        (LINE, ["--line", "f", "--length", "1m"], "--length does not fit --line"),
        (LINE, ["--line", "f", "--pressure-map", "f"], "give one of IMAGE, --pressure-map, --line"),
        (LINE, [], "given: none of them"),
        (
            LINE,
            ["--gaussian", "180mm"],
            '--gaussian = "180mm" is not LENGTH,PEAK,SIGMA, say 180mm,4bar,30mm',
        ),
        (LINE, ["--gaussian", "180mm,4bar,9m"], "--gaussian"),
        (LINE, ["--gaussian", "180mm,4bar", "--load", "3kN"], "--load does not fit --gaussian"),
        (LINE, ["--line", "f", "--ice-material", "2,900"], "is not CONDUCTIVITY,DENSITY,HEAT"),
        (
            LINE,
            ["--line", "f", "--ice-material", "2,900,1"],
            '"2,900,1" has a heat capacity that is out',
        ),
        (LINE, ["--line", "f", "--air-temperature", "99degC"], "--air-temperature"),
        ("x_m,p\n0,1\n", ["--line", "f"], "given: x_m, p"),
        ("x_m\n0\n1\n", ["--line", "f"], "has no column pressure_Pa; needed: x_m, pressure_Pa"),
        ("x_m,pressure_Pa\n0,1e5\n", ["--line", "f"], "two or more"),
        ("x_m,pressure_Pa\n0,1e5\n1,nan\n", ["--line", "f"], "no finite number"),
        ("cell_mm,pressure_bar\n0,1\n1,2\n3,1\n", ["--line", "f"], "cell must rise in even steps"),
        ("x_mm,pressure_bar\n0,1\n3,2\n1,1\n", ["--line", "f"], "x must rise, in the direction"),
        ("x_mm,pressure_bar\n0,1\n6e3,2\n", ["--line", "f"], "x covers 6 m; allowed: 1e-05 to 5 m"),
        ("x_mm,cell_mm,pressure_bar\n0,0,1\n6,6,2\n", ["--line", "f"], "x_m is of points and cell"),
        ("x_mm,pressure_Pa\n0,-1\n1,2\n", ["--line", "f"], "has pressures from -1 to 2 Pa"),
        ("x_mm,pressure_Pa\n0,0\n1,0\n", ["--line", "f"], "nothing is in contact"),
        ("x_mm,pressure_bar,state\n0,1,9\n1,2,1\n", ["--line", "f"], "other states than 0"),
        ("1 2\n3\n", ["--pressure-map", "f", *PIXELS], "line 1 has 2 values; the others have 1"),
        ("1e5 2e5\n", ["--pressure-map", "f"], "--length and --width are missing"),
        ("1e5 2e5\n", ["--pressure-map", "f", *PIXELS, "--legend", "0,0,9,9"], "does not fit"),
        ("1e5 2e5\n", ["--pressure-map", "f", *PIXELS, "--row", "1"], "has rows 0 to 0"),
        ("1e5 2e5\n", ["--pressure-map", "f", *PIXELS, "--threshold", "3e5"], "no pixel is in"),
        (
            "1e5 2e5\n",
            ["--pressure-map", "f", *PIXELS, "--state-map", "f", *BALANCE],
            "other states",
        ),
        (
            "9e5 9e5\n",
            ["--pressure-map", "f", *PIXELS, "--temperature-map", "g", *BALANCE],
            "must be the same",
        ),
        ("1e5,0;2e5,0\n", ["--pressure-map", "f", *PIXELS], "is not a number"),
        ("1e5,0 2e5,0\n", ["--pressure-map", "f", *PIXELS], "is not a number"),
        ("1e5 2e5\n", ["--pressure-map", "f", *PIXELS, "--load", "1e6"], "allowed: 100 bar"),
        (LINE, ["--line", "f", "--threshold", "3e5"], "no pixel is in contact"),
        (
            LINE,
            ["--line", "f", "--depth", "1mm"],
            "--depth is of the thesis's balance; give --thesis",
        ),
        ("x_mm,pressure_bar,state\n0,1,1\n1,2,1\n", ["--line", "f"], "has temperatures or states"),
        (LINE, ["--gaussian", "5m,4bar,1mm"], "is less than a pixel, LENGTH / 540 = 9.26 mm"),
        (
            "x_mm,pressure_bar,state\n0,9,0\n1,9,0\n",
            ["--line", "f", *BALANCE],
            "has no contact (0) where",
        ),
    ],
)
def test_wrong_entries_are_a_sentence(text, arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f").write_text(text)
    (tmp_path / "g").write_text("-1 -1 -1\n")
    assert exit_code("footprint", *arguments) == 2
    said = capsys.readouterr()
    assert words in said.err and said.err.startswith("iceslide: ") and said.err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["f", "g"]
