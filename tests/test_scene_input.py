"""Scene files and quantities that are damaged or hostile: one sentence at once, never a hang."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import readable, to_si
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.toml import parsed, read_scene

pytestmark = pytest.mark.quick

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"


def refusal(path, *overrides):
    with pytest.raises(SceneError) as caught:
        load_scene(path, overrides)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 400
    return message


def written(folder, text):
    path = folder / "scene.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_a_unit_that_is_a_computation_is_not_evaluated():
    """Pint would compute 9**9**9, with 369 million digits."""
    code = (
        "from iceslide_fem.runtime.units import to_si\n"
        "for text in ('1 9**9**9*Pa', '1 Pa*9^9^9', '1 ((km^9)^9)^9/((m^9)^9)^9', '1 m^9^9'):\n"
        "    try: to_si(text, 'Pa')\n"
        "    except ValueError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout.count("unknown unit") == 4


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("2 W/(m^2 K)", "W/m^2/K", 2.0),
        ("2 W m^-2 K**-1", "W/m^2/K", 2.0),
        ("2 W/m²/K", "W/m^2/K", 2.0),
        ("0.07 1/MPa", "1/Pa", 7e-8),
        ("0.07 MPa⁻¹", "1/Pa", 7e-8),
        ("5 μm", "m", 5e-6),
        ("-4 °C", "K", 269.15),
        ("3 %", "", 0.03),
    ],
)
def test_units_as_people_write_them(text, unit, value):
    assert to_si(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["1 °µ", "1 ²", "1 m2.5", "1 'm", "1 m__", "١ m", "1 " + "(" * 80, "9" * 999]
)
def test_what_pint_stumbles_over_is_a_value_error(text):
    with pytest.raises(ValueError, match="unit"):
        to_si(text, "m")


@pytest.mark.parametrize(
    ("value", "text"),
    [(8.8e-5, "88 µm"), (9.9999e-10, "1 nm"), (0.9996, "1 m"), (1234.0, "1.23 km")],
)
def test_lengths_are_rounded_before_they_get_a_prefix(value, text):
    assert readable(value, "m") == text


def test_a_byte_order_mark_is_skipped(tmp_path):
    path = written(tmp_path, b"\xef\xbb\xbf" + CASE.read_bytes())
    assert load_scene(path) == load_scene(CASE)


@pytest.mark.parametrize(
    "text",
    [
        "x = " + "[" * 100_000,
        "x = " + "[" * 200 + "]" * 200,
        "x = " + "{a = " * 5000,
        ".".join("a" * 5000) + " = 1",
        "[" + ".".join("a" * 5000) + "]",
    ],
    ids=["open", "closed", "tables", "dotted", "heading"],
)
def test_what_is_nested_deeply_is_refused(text, tmp_path):
    assert "nested too deeply" in refusal(written(tmp_path, text))


def test_a_deep_override_is_refused():
    assert "nested too deeply" in refusal(CASE, ".".join("a" * 3000) + "=1")
    assert "load.speed" in refusal(CASE, "load.speed=" + "[" * 10_000)


@pytest.mark.parametrize("digits", ["1" * 5000, "0x" + "f" * 5000])
def test_endless_numbers_are_refused(digits, tmp_path):
    text = CASE.read_text().replace('"3 m/s"', digits)
    assert len(refusal(written(tmp_path, text))) < 300


def test_only_regular_files_of_a_size_are_read(tmp_path):
    assert "not a regular file" in refusal(Path("/dev/zero"))
    os.mkfifo(tmp_path / "pipe.toml")
    assert "not a regular file" in refusal(tmp_path / "pipe.toml")
    assert "not a regular file" in refusal(tmp_path)
    with open(tmp_path / "large.toml", "wb") as file:
        file.truncate(10**9)
    assert "1000 MB; allowed: up to 10 MB" in refusal(tmp_path / "large.toml")
    for key in ("rubber.mesh", "film.contact"):
        assert "is not a file" in refusal(CASE, f"{key}=/dev/zero")
        assert "is not a file" in refusal(CASE, f"{key}={'x' * 5000}")
        assert "is not a file" in refusal(CASE, f'{key}="a\\u0000b"')


def test_messages_stay_on_one_line(tmp_path):
    text = CASE.read_text().replace("[load]", '[load]\n"\\u001b[31mred\\nline" = 1')
    assert "red line" in refusal(written(tmp_path, text))
    assert "not a known key" in refusal(CASE, "x" * 10_000 + "=1")
    assert "is not a name" in refusal(CASE, "name=" + "x" * 10_000)
    assert "allowed: up to 100 letters from a to z" in refusal(CASE, "name=Prüfung")


@pytest.mark.parametrize(
    ("line", "hinted"),
    [
        ("pressure = 1 bar", True),
        ("pressure = 1bar", True),
        ("pressure = 1e5 Pa # remark", True),
        ("temperature = -4 °C", True),
        ("pressure = bar", False),
        ("pressure = ", False),
        ("pressure == 3", False),
        ("[load", False),
        ('pressure = "1 bar', False),
    ],
)
def test_the_hint_at_quotes_follows_what_it_mends(line, hinted, tmp_path):
    assert ("in quotes" in refusal(written(tmp_path, f'name = "x"\n{line}\n'))) == hinted


def test_a_key_without_its_table_is_found_where_it_is_meant():
    assert "did you mean load.pressure or film.pressure?" in refusal(CASE, "pressure=3bar")
    assert "did you mean load.speed?" in refusal(CASE, "speed=3")


def test_text_that_is_no_toml_is_a_string():
    assert parsed("[" * 10_000) == "[" * 10_000
    assert parsed("1" * 5000) == "1" * 5000
    assert read_scene(CASE, ["load.pressure=3bar"])["load"]["pressure"] == "3bar"


@pytest.mark.parametrize(
    ("varied", "words"),
    [
        (["load.pressure=1bar:5bar:100000000"], "a count of 2 to 100000"),
        (["load.pressure=1bar:5bar:" + "9" * 5000], "with a whole count"),
        (["load.pressure=1bar:5bar:1000", "load.speed=1:5:1000"], "the sweep has 1000000 cases"),
        (["film.k=true:false:3"], 'film.k = "true" is not a number'),
        ([f"load.pressure=1{'0' * 400}:2:3"], "is not a number"),
        (["load.pressure=nan:2:3"], "is not a number"),
    ],
)
def test_sweeps_are_counted_before_they_are_built(varied, words):
    from iceslide_fem.workflow.sweep.plan import make_plan

    with pytest.raises(SceneError) as caught:
        make_plan([CASE], [], varied)
    assert words in str(caught.value)
