"""The one reader of tables: what spreadsheets and instruments write, and what is refused."""

import codecs

import numpy as np
import pytest

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.tables.columns import Wanted, find_columns, heading_unit
from iceslide_fem.runtime.tables.grid import decoded, grid, read_text
from iceslide_fem.runtime.tables.layout import parse, read_table
from iceslide_fem.runtime.units import si_unit, to_si
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table

pytestmark = pytest.mark.quick

VALUES = [[0.5, -1.25, 3.0], [1e-3, 2.0, 40.75]]


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-32", "latin-1", "cp1252"]
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_every_encoding_and_end_of_line(encoding, end, tmp_path):
    text = end.join(["Höhe (µm);Größe (mm)", "1,5;2,25", "-3;4"])
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    table = read_table(tmp_path / "a.csv", "the table")
    assert table.heading == ("Höhe (µm)", "Größe (mm)")
    assert table.numbers().tolist() == [[1.5, 2.25], [-3.0, 4.0]]


def test_a_spreadsheet_is_no_text(tmp_path):
    (tmp_path / "a.csv").write_bytes(b"PK\3\4 and so on")
    with pytest.raises(SceneError, match="is a spreadsheet or an archive; save it as CSV"):
        read_table(tmp_path / "a.csv", "the table")


def test_utf_16_is_told_without_a_mark():
    for encoding in ("utf-16-le", "utf-16-be"):
        assert decoded("1;2\n".encode(encoding)) == "1;2\n"
    assert decoded(codecs.BOM_UTF16_BE + "ä".encode("utf-16-be")) == "ä"


@pytest.mark.parametrize(
    "content", [b"\x89PNG\r\n\x1a\n\x00\x01", b"\x01\x02\x03", b"\xff\xfe\x00"]
)
def test_what_is_no_text_is_a_sentence(content, tmp_path):
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(SceneError, match="cannot read the table .*: it is not a text file$"):
        read_text(tmp_path / "a", "the table")


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "  ", ", ", " ; "])
@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("ends", [False, True])
def test_separators_and_decimal_marks(separator, comma, ends):
    if comma and separator.strip() == ",":
        pytest.skip("commas cannot be both")
    rows = [separator.join(f"{value:g}" for value in row) for row in VALUES]
    text = "\n".join(row + separator * ends for row in rows)
    table = parse(text.replace(".", ",") if comma else text, "the table")
    assert table.numbers().tolist() == VALUES


def test_cells_that_are_empty_beside_decimal_commas():
    table = parse("a\tb\tc\n118816,80\t\t\n\t250598,15\t\n", "t")
    assert table.width == 3 and table.separator == "\t"
    assert np.nan_to_num(table.numbers()).tolist() == [[118816.8, 0, 0], [0, 250598.15, 0]]


def test_quotes_remarks_blank_lines_and_the_separator_of_excel():
    text = 'sep=,\n# a remark\n% another\n"a","b"\n\n"0,5","1,25"\n"2","3"\n'
    table = parse(text, "the table")
    assert table.heading == ("a", "b") and table.above == ("a remark", "another")
    assert table.numbers().tolist() == [[0.5, 1.25], [2.0, 3.0]]


def test_missing_values_and_exponents():
    words = ["", "NaN", "n/a", "#N/A", "#NV", "null", "---", "***", "BAD", "1.#QNAN"]
    values = parse("\n".join(f"{word};1D+03;\N{MINUS SIGN}2e-1" for word in words), "t").numbers()
    assert np.isnan(values[:, 0]).all() and (values[:, 1:] == [1000.0, -0.2]).all()


def test_rows_of_missing_values_stay_and_a_last_separator_goes():
    table = parse(";;;\n;1;2;\n;3;4;\n", "t")  # a map with nothing along its sides
    assert np.isnan(table.numbers()[0]).all() and table.numbers().shape == (3, 4)
    assert parse("1;2;\n3;4;\n", "t").numbers().tolist() == [[1, 2], [3, 4]]
    assert parse("a;b\n1;2;\n;4;\n", "t").numbers().shape == (2, 2)
    tabs = parse("\t\t\n1\t2\t3\n\t\t5\n", "t").numbers()
    assert np.isnan(tabs[0]).all() and tabs.shape == (3, 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1.234,5;2\n3;4\n", '"1.234,5", with marks between thousands'),
        ('"1,234.5","2"\n"3","4"\n', '"1,234.5", with marks between thousands'),
        ("1,234,567;2\n3;4\n", '"1,234,567", with marks between thousands'),
        ("1,234;2,345\n3,111;4,222\n", "could have a mark between thousands or a decimal one"),
        ("1.200;1.500\n2.000;3.000\n", "could have a mark between thousands or a decimal one"),
        ('"1,234","2,345"\n"3,111","4,222"\n', "could have a mark between thousands"),
        ("1.234.567;0,5\n2;3\n", '"1.234.567" is not a number: allowed are numbers without marks'),
        ("1'234;0.5\n2;3\n", "is not a number: allowed are numbers without marks"),
        ("1\N{NO-BREAK SPACE}234;0.5\n2;3\n", "is not a number: allowed are numbers without marks"),
        ("1.5;2,5\n3;4\n", "has decimal commas and decimal points"),
        ("0,5\t1\n1.5\t2\n", 'row 2, column 1: "1.5" is not a number beside others with decimal'),
        ("1;2\n3;x\n", 'the table: row 2, column 2: "x" is not a number'),
        ("a;b\n1;2\n3;x\n", 'row 2 (line 3), column 2 (b): "x" is not a number'),
        ("1;2\n3;1_000\n", '"1_000" is not a number'),
        ("1;2\n3;4;5\n3;4\n", "line 2 has 3 values; the others have 2"),
        ("1,2\n3\n4,5\n", "line 2 has 1 value; the others have 2"),
        ('a;b\n1;="2,5"\n3;4\n', 'column 2 (b): "="2,5" is not a number'),
        ("a;b\n1,5;2.5\n3,5;4.5\n", "has decimal commas and decimal points"),
        ("a;b\n", "has no numbers in it"),
        ("\n# only this\n", "has no numbers in it"),
    ],
)
def test_what_could_be_misread_is_refused(text, words):
    with pytest.raises(SceneError, match="^the table[^\n]*$") as refusal:
        parse(text, "the table").numbers()
    assert words in str(refusal.value)


def test_other_numbers_tell_what_a_comma_is():
    assert parse("0,500;1,234\n1;2\n", "t").numbers()[0].tolist() == [0.5, 1.234]
    assert parse("1200;1,234\n1;2\n", "t").numbers()[0].tolist() == [1200.0, 1.234]


@pytest.mark.parametrize("last", ["7", "-7", "0.5"])
def test_all_lines_decide_on_the_decimal_mark(last):
    """A last row of whole numbers is no sign of a decimal point."""
    rows = ["0,5;1,5"] * 30 + [f"{last};8".replace(".", ",")]
    assert parse("\n".join(rows), "t").numbers()[-1].tolist() == [float(last), 8.0]


@pytest.mark.parametrize(
    ("heading", "unit", "given"),
    [
        ("pressure (bar)", "Pa", "bar"),
        ("pressure [kPa]", "Pa", "kPa"),
        ("pressure / MPa", "Pa", "MPa"),
        ("Druck in N/cm2", "Pa", "N/cm^2"),
        ("pressure_kPa", "Pa", "kPa"),
        ("PRESSURE (PSI)", "Pa", "psi"),
        ("p (mPa)", "Pa", "mPa"),
        ("speed_m_per_s", "m/s", "m/s"),
        ("speed_m_s", "m/s", "m/s"),
        ("T (°C)", "K", "degC"),
        ("temperature_C", "K", "degC"),
        ("H_V_um", "m", "um"),
        ("z [µm]", "m", "µm"),
        ("k (-)", "", ""),
        ("pressure", "Pa", None),
        ("pressure (m)", "Pa", None),
    ],
)
def test_units_in_headings(heading, unit, given):
    assert heading_unit(heading, unit) == given


@pytest.mark.parametrize("text", ["mPas", "mPa.s", "mPa s", "mPa·s", "cP"])
def test_units_of_viscosity_have_any_spelling(text):
    assert to_si(f"1 {si_unit(text, 'Pa*s')}", "Pa*s") == 1e-3


def test_units_of_pressure_have_any_spelling():
    for text, pascals in [("N/cm²", 1e4), ("KPA", 1e3), ("Bar", 1e5), ("kp/cm2", 98066.5)]:
        assert to_si(f"1 {si_unit(text, 'Pa')}", "Pa") == pytest.approx(pascals)
    assert si_unit("kg", "Pa") is None and si_unit("", "Pa") is None


def test_headings_that_are_padded_or_have_columns_without_names():
    table = parse("TIME       ;PRESSURE (bar)    ;Status;;\n1 ;2,5 ;ok;;\n2 ;3,5 ;ok;;\n", "t")
    assert table.heading[:2] == ("TIME", "PRESSURE (bar)")
    found = find_columns(table, [Wanted("pressure", "Pa")], ["pressure"])
    assert found["pressure"] == pytest.approx([2.5e5, 3.5e5])
    assert np.isnan(parse("1\t....\n2\t3\n", "t").numbers()[0, 1])


def test_columns_are_found_by_name_in_any_unit_and_order():
    text = ";comment;Temperature (°F);pressure [kPa]\n0;warm;32;1,5\n1;cold;14;2\n"
    wanted = Wanted("pressure", "Pa"), Wanted("temperature", "K"), Wanted("state", "")
    found = find_columns(parse(text, "t"), wanted, ("pressure",))
    assert found["pressure"] == pytest.approx([1500.0, 2000.0])
    assert found["temperature"] == pytest.approx([273.15, 263.15]) and set(found) == {
        "pressure",
        "temperature",
    }
    below = parse("Pressure\tTemperature\nbar\t°C\n1\t0\n2\t-10\n", "t")
    found = find_columns(below, wanted, ("pressure", "temperature"))
    assert found["pressure"] == pytest.approx([1e5, 2e5])
    assert found["temperature"] == pytest.approx([273.15, 263.15])


@pytest.mark.parametrize(
    ("heading", "words"),
    [
        ("x,pressure", "column 2 (pressure) says no unit; allowed: pressure_Pa, or another"),
        ("x,pressure (kg)", 'column 2 (pressure (kg)) has the wrong unit "kg"'),
        ("x,p", "has no column pressure_Pa; needed: pressure_Pa; given: x, p"),
        ("pressure_Pa,pressure_bar", "twice, as pressure_Pa and pressure_bar"),
    ],
)
def test_columns_without_names_or_units_are_a_sentence(heading, words):
    with pytest.raises(SceneError) as refusal:
        find_columns(parse(f"{heading}\n1,2\n3,4\n", "t"), [Wanted("pressure", "Pa")], ["pressure"])
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_empty_rows_below_the_last_one_of_a_spreadsheet_are_none(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("pressure_bar;k;D_um;H_V_um\n1;0,1;90;9\n2;0,2;80;8\n;;;\n;;;\n")
    assert read_contact_table(path, "film.contact").pressure == (1e5, 2e5)
    path.write_text("t (ms),v (m/s)\n0,1\n5,2\n,\n")
    load = {"pressure": 1e5, "speed": str(path), "duration": 5e-3}
    scene = scene_from_dict(
        {"name": "a", "model": "point", "rubber": {"compound": "B"}, "load": load}
    )
    assert scene.load.speed == ((0.0, 1.0), (5e-3, 2.0))


@pytest.mark.parametrize(
    "text",
    [
        ",0,1,2,3\n0,5.5,6.0,7.0,9.0\n1,8.0,9.5,1.0,3.0\n",
        "0,1,2,3\n5.5,6.0,7.0,9.0\n8.0,9.5,1.0,3.0\n",
        "y\\x,0.0,0.5,1.0,1.5\n0.0,5.5,6,7,9\n0.5,8,9.5,1,3\n",
        "y\\x;0,0;0,5;1,0;1,5\n0,0;5,5;6;7;9\n0,5;8;9,5;1;3\n",
        ";0,0;0,5;1,0;1,5\n0,0;5,5;6;7;9\n0,5;8;9,5;1;3\n",
        ",a,b,c,d\n0,5.5,6,7,9\n1,8,9.5,1,3\n",
        "5.5,6,7,9\n8,9.5,1,3\n",
    ],
)
def test_names_and_numbers_of_rows_and_columns_are_no_values(text):
    found = grid(parse(text, "t"))
    assert found.values.tolist() == [[5.5, 6, 7, 9], [8, 9.5, 1, 3]]
    assert len(found.notes) == (0 if text.startswith("5.5") else 1)


def test_places_beside_a_corner_with_a_number_are_no_values():
    places = 0.5 * np.arange(5.0)
    values = np.array([[(7 * i + 3 * j) % 11 for j in range(5)] for i in range(5)], float)
    ramp = np.add.outer(places, places)
    for corner in (0.0, 5.0):
        for inside, shape in ((values, (5, 5)), (ramp, (6, 6))):
            rows = np.block([[np.array([[corner]]), places[None]], [places[:, None], inside]])
            text = "".join(";".join(map(str, row)) + "\n" for row in rows.tolist())
            assert grid(parse(text, "t")).values.shape == shape


def test_a_last_column_that_is_missing_or_a_separator_that_ends_rows_is_said():
    found = grid(parse(";1;2;\n;3;4;\n", "t"))
    assert found.values.shape == (2, 4)
    assert found.notes[0].startswith("its last column is empty throughout and is taken for missing")
    found = grid(parse("1;2;\n;4;\n1;2;\n", "t"))
    assert found.values.shape == (3, 2)
    assert found.notes[0].startswith("a separator ends every row, which is taken for no further")
    # A map whose last column is its only gap has the same text.
    found = grid(parse("1;2;\n3;4;\n", "t"))
    assert found.values.tolist() == [[1, 2], [3, 4]]
    assert found.notes[0].startswith("a separator ends every row, which is taken for no further")
    assert grid(parse("1;2\n3;4\n", "t")).notes == ()
    found = grid(parse(";0;1;2;\n0;5.5;6;7;\n1;8;9.5;1;\n", "t"))
    assert found.values.shape == (2, 3) and len(found.notes) == 2


LAYOUTS = [(";", "."), (";", ","), ("\t", "."), ("\t", ","), (None, "."), (None, ","), (",", ".")]
GAPS = ["", "NaN", "n/a", "***", "---", "#N/A", "BAD"]


def laid_out(random):
    """A text, and the values that it holds: any separator, decimal mark, gaps, quotes, heading."""
    values = random.normal(size=random.integers([2, 2], [9, 9])) * 10.0 ** random.integers(-3, 4)
    values = np.array([[float(f"{value:.5g}") for value in row] for row in values])
    gaps = random.random(values.shape) < random.choice([0.0, 0.1, 0.5])
    gaps[0] = gaps[:, 0] = False
    values[gaps] = np.nan
    separator, decimal = LAYOUTS[random.integers(len(LAYOUTS))]
    gap = GAPS[random.integers(1 if separator is None else 0, len(GAPS))]
    written = random.choice(["{:.5g}", "{:.7f}", "{:+.4e}", "{:.4E}"])
    quote = random.choice(["", '"']) if separator is not None else ""
    between = separator or random.choice([" ", "   ", " \t"])
    between += random.choice(["", " "]) if separator in (",", ";") else ""
    rows = [
        [
            gap if np.isnan(v) else quote + written.format(v).replace(".", decimal) + quote
            for v in row
        ]
        for row in values
    ]
    # One number that cannot have a mark between thousands.
    values[0, 0], rows[0][0] = 0.5, f"{quote}0{decimal}5{quote}"
    if random.random() < 0.5:
        rows.insert(0, [f"{name}_um" for name in "abcdefgh"[: values.shape[1]]])
    end = separator if separator is not None and random.random() < 0.3 else ""
    lines = [between.join(row) + end for row in rows]
    for remark in random.choice(["", "# measured: 1 mm", "// x"], 2):
        lines.insert(random.integers(len(lines) + 1), remark)
    return random.choice(["\n", "\r\n"]).join(lines), values


def test_random_layouts_are_read_as_they_were_written():
    for seed in range(400):
        text, values = laid_out(np.random.default_rng(seed))
        found = parse(text, f"seed {seed}").numbers()
        np.testing.assert_allclose(found, values, rtol=1e-9, atol=1e-7, err_msg=text)


def test_a_first_row_that_could_be_either_is_refused():
    with pytest.raises(SceneError, match="first row counts from 0 to 3: numbers of the col"):
        grid(parse("0,1,2,3\n9,2,3,4\n", "t"))
    ramp = "0,1,2,3\n1,2,3,4\n2,3,4,5\n"
    assert grid(parse(ramp, "t")).values.shape == (3, 4)


def test_a_contact_table_from_a_spreadsheet(tmp_path):
    text = "Pressure (bar);k (-);D (µm);H_V (µm)\r\n0,2;0,1;20;6\r\n1;0,25;30;3\r\n"
    for encoding in ("utf-8-sig", "utf-16", "cp1252"):
        (tmp_path / "contact.csv").write_bytes(text.encode(encoding))
        table = read_contact_table(tmp_path / "contact.csv", "film.contact")
        assert table.pressure == pytest.approx((2e4, 1e5)) and table.k.values == (0.1, 0.25)
        assert table.D.values == pytest.approx((2e-5, 3e-5))
        assert table.H_V.values == pytest.approx((6e-6, 3e-6))


@pytest.mark.parametrize(
    "text",
    [
        "\ufefftime (ms);speed (km/h)\r\n0;3,6\r\n1,5;14,4\r\n",
        "time (ms)\tspeed (km/h)\n0\t3.6\n1.5\t14.4\n",
        ",time_ms,speed_km_per_h\n0,0,3.6\n1,1.5,14.4\n",
        "time;speed\nms;km/h\n0;3,6\n1,5;14,4\n",
        "time (ms)   speed (km/h)\n0     3.6\n1.5  14.4\n",
        "time_ms speed_km_per_h\n0 3,6\n1,5 14,4\n",
        "Unnamed: 0,time_ms,speed_km_per_h\n0,0,3.6\n1,1.5,14.4\n",
        'sep=;\r\n"time (ms)";"speed (km/h)"\r\n"0";"3,6"\r\n"1,5";"14,4"\r\n',
    ],
)
def test_loads_over_time_from_a_spreadsheet(text, tmp_path):
    (tmp_path / "speed.csv").write_text(text, encoding="utf-8")
    load = {"pressure": 1e5, "speed": str(tmp_path / "speed.csv"), "duration": 1e-3}
    scene = scene_from_dict(
        {"name": "a", "model": "point", "rubber": {"compound": "B"}, "load": load}
    )
    (zero, slow), (late, fast) = scene.load.speed
    assert (zero, slow, late, fast) == pytest.approx((0.0, 1.0, 1.5e-3, 4.0))
