"""`iceslide roughness`: files in, table and pictures out, one sentence for what is wrong."""

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from program import exit_code, rows_of
from surface_spec import SPEC

from iceslide_fem.preprocess.roughness.case import RoughnessCase, material
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.survey import COLUMNS, parameters, survey, table
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene, scene_from_dict
from iceslide_fem.scene.contact_table import ContactTable, read_contact_table
from iceslide_fem.scene.materials import YOUNGS_MODULUS
from iceslide_fem.surfaces.read import read_surface
from iceslide_fem.surfaces.surface import Surface, levelled, low_passed

SURFACES = Path(__file__).parent.parent / "cases" / "surfaces"
TWO = {"pressures": "1bar:5bar:2", "realisations": "2"}


@pytest.fixture
def spec(tmp_path):
    (tmp_path / "surface.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path / "surface.toml"


@pytest.fixture(scope="module")
def heights():
    values = {"rms_height": 4e-6, "hurst": 0.5, "rolloff": 2e-4, "shortest_wave": 7e-5}
    return generate(SurfaceSpec.model_validate(values | {"size": 4e-4, "pixels": 40})).heights


def test_from_a_surface_to_a_scene_in_two_commands(spec, tmp_path, capsys):
    out = tmp_path / "out"
    options = ["--realisations", 2, "--pressures", "0.5bar:8bar:4", "--out", out]
    assert exit_code("roughness", spec, *options) == 0
    printed = capsys.readouterr().out
    assert "k is above 0.9 from" in printed and "contact.csv" in printed and "±" in printed
    rows = rows_of(out / "contact.csv")
    assert tuple(rows[0]) == COLUMNS and len(rows) == 4
    columns = {name: np.array([float(row[name]) for row in rows]) for name in COLUMNS}
    assert (np.diff(columns["k"]) > 0).all() and (np.diff(columns["H_V_m"]) < 0).all()
    assert (columns["k_std"] > 0).all() and (columns["k"] < columns["k_raw"]).all()
    found = json.loads((out / "surface.json").read_text())
    assert found["rms_height_m"] == pytest.approx(5.8e-6)
    assert found["cut_offs"]["shortest_wave_m"] == 70e-6 and found["realisations"] == 2
    assert found["solver"]["largest_error"] <= found["solver"]["tolerance"]
    assert found["modulus_Pa"] == pytest.approx(1.64e6 / 0.75)
    for name in ("map", "contact", "parameters", "spectrum"):
        assert (out / f"{name}.png").stat().st_size > 10_000
    scene = scene_from_dict(
        {
            "name": "a",
            "model": "point",
            "rubber": {"compound": "B"},
            "load": {"pressure": "0.5 bar", "speed": 3, "duration": "1 ms"},
            "film": {"contact": str(out / "contact.csv")},
        }
    )
    assert scene.outside_table() is None
    assert scene.contact_parameters(5e4).k == pytest.approx(columns["k"][0])


def test_k_of_another_compound_is_that_at_another_pressure(spec):
    """k_A(p) = k_B(p E_B / E_A), exactly; so are D and H_V."""
    ratio = YOUNGS_MODULUS["B"] / YOUNGS_MODULUS["A"]
    given = {"surface": str(spec), "realisations": "1"}
    soft = survey(RoughnessCase.of(given | {"compound": "A", "pressures": "1bar:2bar:2"})).mean
    ends = f"{ratio:.17g}bar:{2 * ratio:.17g}bar:2"
    medium = survey(RoughnessCase.of(given | {"pressures": ends})).mean
    for one, other in zip(soft, medium, strict=True):
        assert one == pytest.approx(other, rel=1e-4)


def test_rubber_by_modulus_and_by_scene(spec, tmp_path):
    case = RoughnessCase.of({"surface": str(spec), "modulus": "1.5 MPa"})
    assert material(case).modulus == pytest.approx(2e6)
    text = 'name = "s"\nmodel = "point"\n[rubber]\n{}\n[load]\npressure = 1e5\nspeed = 3\n'
    text += "duration = 1e-3\n[film]\nk = 0.3\nD = 3e-5\nH_V = 2e-6\n"
    (tmp_path / "s.toml").write_text(text.format("C10 = 2e5\nC01 = 1e5\nnu = 0.49"))
    case = RoughnessCase.of({"surface": str(spec), "scene": str(tmp_path / "s.toml")})
    rubber = load_scene(tmp_path / "s.toml").mooney_rivlin
    assert material(case).modulus == pytest.approx(rubber.youngs_modulus / (1 - 0.49**2))
    (tmp_path / "s.toml").write_text(text.format('compound = "B"'))
    case = RoughnessCase.of({"surface": str(spec), "scene": str(tmp_path / "s.toml")})
    assert material(case)[:2] == ("compound B", pytest.approx(1.64e6 / 0.75))


def test_one_map_has_no_deviations(heights, tmp_path):
    np.save(tmp_path / "map.npy", heights)
    given = {"surface": str(tmp_path / "map.npy"), "pixel": "10um", **TWO}
    result = survey(RoughnessCase.of(given | {"shortest_wave": "70um"}))
    assert np.isnan(result.deviation.k).all() and result.found.shape == (1, 2, 6)
    assert ",,," in table(result)
    raw = survey(RoughnessCase.of(given | {"definition": "thesis"}))
    assert raw.cut_off is None and raw.surface.heights.shape == (40, 40)


def test_a_map_is_pressed_on_the_pixels_that_its_shortest_wave_needs(tmp_path, capsys):
    """k within 1 %, H_V within 0.1 % of those on all pixels; both are said."""
    spec = {"rms_height": 4e-6, "hurst": 0.8, "rolloff": 1.5e-4, "shortest_wave": 8e-6}
    spec |= {"size": 1e-3, "pixels": 480, "seed": 2}
    fine = generate(SurfaceSpec.model_validate(spec)).heights
    np.save(tmp_path / "map.npy", fine[:432, :])
    options = ["--pixel", "2.08333um", "--pressures", "0.5bar:3bar:2", "--shortest-wave", "50um"]
    assert exit_code("roughness", tmp_path / "map.npy", *options, "--out", tmp_path / "out") == 0
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "480 x 432 pixels of 2.083 um" in said and "270 x 243 pixels of 3.704 um, " in said
    found = json.loads((tmp_path / "out" / "surface.json").read_text())
    assert found["pixels"] == [270, 243] and found["measured"]["pixels"] == [480, 432]
    assert found["cut_offs"]["size_m"] == pytest.approx([1e-3, 0.9e-3], rel=1e-5)
    assert found["measured"]["pixel_m"] == pytest.approx(2.08333e-6)
    rows = rows_of(tmp_path / "out" / "contact.csv")
    level = levelled(Surface(fine[:432, :], 2.08333e-6, periodic=False))
    exact = parameters(low_passed(level, 50e-6), YOUNGS_MODULUS["B"] / 0.75, np.array([0.5e5, 3e5]))
    assert [float(row["k"]) for row in rows] == pytest.approx(exact.k, rel=0.01)
    assert [float(row["H_V_m"]) for row in rows] == pytest.approx(exact.H_V, rel=1e-3)


def test_pixels_beyond_the_machines_memory_are_refused(heights, tmp_path, monkeypatch, capsys):
    np.save(tmp_path / "map.npy", heights)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: SimpleNamespace(total=0.2e9))
    words = [tmp_path / "map.npy", "--pixel", "10um", "--shortest-wave", "70um"]
    assert exit_code("roughness", *words, "--out", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert "0.0016 million pixels take about 0.2 GB of memory, and there are 0.2 GB" in said
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


def x3p(path, heights, pixel, kind="D", mask=None, scale=1.0):
    data = (heights / scale).astype({"D": "<f8", "F": "<f4", "I": "<i2"}[kind]).tobytes()
    valid = "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>" if mask is not None else ""
    xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{pixel}</Increment></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{pixel}</Increment></CY>
<CZ><AxisType>A</AxisType><DataType>{kind}</DataType><Increment>{scale}</Increment></CZ>
</Axes></Record1><Record3><MatrixDimension><SizeX>{heights.shape[1]}</SizeX>
<SizeY>{heights.shape[0]}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink>{valid}</DataLink></Record3></p:ISO5436_2>"""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("bindata/data.bin", data)
        if mask is not None:
            bits = np.packbits(mask.ravel(), bitorder="little").tobytes()
            archive.writestr("bindata/valid.bin", bits)


def test_every_format_gives_the_same_map(heights, tmp_path):
    expected = heights[:, :30]
    um = 1e6 * expected
    y, x = np.indices(expected.shape)
    np.save(tmp_path / "a.npy", um)
    np.savetxt(tmp_path / "a.csv", um, delimiter=",")
    np.savetxt(tmp_path / "a.txt", um, header="heights in um")
    text = "\n".join(";".join(f"{value:.9g}" for value in row) + ";" for row in um)
    (tmp_path / "comma.csv").write_text(text.replace(".", ","))
    points = np.column_stack([10.0 * x.ravel(), 10.0 * y.ravel(), um.ravel()])
    np.random.default_rng(1).shuffle(points)
    np.savetxt(tmp_path / "a.xyz", points)
    np.savetxt(tmp_path / "points.csv", points, delimiter=",", header="x,y,z", comments="")
    for name, pixel in [("a.npy", 1e-5), ("a.csv", 1e-5), ("a.txt", 1e-5), ("comma.csv", 1e-5)] + [
        ("a.xyz", None),
        ("points.csv", None),
        ("a.xyz", 1e-5),
    ]:
        found = read_surface(tmp_path / name, pixel, 1e-6)
        assert found.heights == pytest.approx(expected, abs=1e-12), name
        assert found.pixel == pytest.approx(1e-5) and not found.periodic
    for kind, scale in (("D", 1.0), ("F", 1.0), ("I", 1e-9)):
        x3p(tmp_path / "a.x3p", expected, 1e-5, kind, scale=scale)
        found = read_surface(tmp_path / "a.x3p", None, None)
        assert found.heights == pytest.approx(expected, abs=1e-9 if kind == "I" else 1e-12)


def test_missing_heights_of_every_format(heights, tmp_path):
    holes = 1e6 * heights
    holes[3, 4] = holes[20, 0] = np.nan
    there = np.isfinite(holes)
    x3p(tmp_path / "a.x3p", np.nan_to_num(1e-6 * holes), 1e-5, mask=there)
    rows = [["***" if np.isnan(value) else f"{value:.9g}" for value in row] for row in holes]
    (tmp_path / "a.txt").write_text("\n".join("\t".join(row) for row in rows))
    (tmp_path / "a.csv").write_text("\n".join(",".join(row) for row in rows).replace("***", ""))
    y, x = np.indices(holes.shape)
    np.savetxt(tmp_path / "a.xyz", np.column_stack([10 * x[there], 10 * y[there], holes[there]]))
    for name in ("a.x3p", "a.txt", "a.csv", "a.xyz"):
        pixel = 1e-5 if name in ("a.txt", "a.csv") else None
        unit = None if name == "a.x3p" else 1e-6
        found = read_surface(tmp_path / name, pixel, unit).heights
        assert np.array_equal(np.isfinite(found), there), name
        assert found[there] == pytest.approx(1e-6 * holes[there], abs=1e-12)


@pytest.mark.parametrize("first", ["1.5E+00", "NaN", "BAD", '"1.5"', "***"])
def test_a_first_row_of_numbers_is_no_head(first, heights, tmp_path):
    rows = [[f"{value:.9g}" for value in row] for row in 1e6 * heights]
    rows[0][0] = first
    (tmp_path / "a.csv").write_text("\n".join(",".join(row) for row in rows))
    found = read_surface(tmp_path / "a.csv", 1e-5, 1e-6).heights
    assert found.shape == heights.shape
    assert np.nan_to_num(found[0, 0]) == pytest.approx(1.5e-6 if "1.5" in first else 0.0)
    assert found.ravel()[1:] == pytest.approx(heights.ravel()[1:], abs=1e-12)


def test_a_column_without_heights_stays_in_its_place(heights, tmp_path):
    holes = 1e6 * heights
    holes[:, 7] = np.nan
    np.savetxt(tmp_path / "a.csv", holes, delimiter=",")
    found = read_surface(tmp_path / "a.csv", 1e-5, 1e-6).heights
    assert np.array_equal(np.isnan(found), np.isnan(holes))


@pytest.mark.parametrize("pixel", [0.0, -1e-5, float("nan"), 1.0])
def test_pixels_of_a_file_have_a_size(pixel, heights, tmp_path):
    x3p(tmp_path / "a.x3p", heights, pixel)
    with pytest.raises(SceneError, match="m; allowed: 1e-09 to 0.01 m"):
        read_surface(tmp_path / "a.x3p", None, 1.0)


@pytest.mark.parametrize(
    ("name", "content", "options", "words"),
    [
        ("none.npy", None, [], "none.npy is not a file"),
        ("n" * 300 + ".npy", None, ["--out", "out"], ".npy is not a file"),
        ("a.npy", b"not an array", [], "is no matrix of numbers that NumPy has saved"),
        ("a.npy", np.zeros(5), [], "is no matrix of numbers that NumPy"),
        ("a.npy", np.zeros((5, 5), complex), [], "is no matrix of numbers that NumPy"),
        ("a.npy", np.eye(20), [], "has no pixel size: give it, as in --pixel 17.5um"),
        ("a.npy", np.eye(8), ["--pixel", "1um"], "8 x 8 pixels; allowed: 16 or more"),
        ("a.npy", np.ones((20, 20)), ["--pixel", "1um"], "the map is flat"),
        ("a.npy", np.full((20, 20), np.nan), ["--pixel", "1um"], "infinite, or none at all"),
        ("a.npy", np.full((20, 20), np.inf), ["--pixel", "1um"], "infinite, or none at all"),
        ("a.npy", np.eye(20), ["--pixel", "1 kg"], '--pixel = "1 kg" has the wrong unit'),
        ("a.npy", np.eye(20), ["--pixel", "1um", "--height-unit", "kg"], "not a unit of length"),
        ("a.csv", b"1,2\n3,4,5\n", ["--pixel", "1um"], "line 1 has 2 values; the others have 3"),
        ("a.csv", b"1,2\n3,x\n", ["--pixel", "1um"], 'row 2, column 2: "x" is not a number'),
        ("a.csv", b"\n# nothing\n", ["--pixel", "1um"], "has no numbers in it"),
        ("a.xyz", b"x y z\n", ["--pixel", "1um"], "has no numbers in it"),
        ("a.txt", b"\x00\x01\x02\x03", ["--pixel", "1um"], "it is not a text file"),
        ("a.csv", b"1,a,2\n3,4,5\n", ["--pixel", "1um"], '"a" is not a number'),
        ("a.csv", b"x,y\nTrue,True\n", ["--pixel", "1um"], "has no numbers in it"),
        (
            "a.npy",
            b"PK\x03\x04, as archives begin",
            [],
            "is no matrix of numbers that NumPy has saved",
        ),
        ("a.xyz", b"0 0 1\n1 0 1\n2.5 0 1\n3 7 1\n", [], "do not lie on a regular grid"),
        (
            "a.xyz",
            b"0 0 1\n1 0 1\n0 9 1\n1 9 2\n0 18 0\n1 18 1\n0 27 1\n1 27 2\n",
            ["--height-unit", "um"],
            "2 x 28 pixels",
        ),
        ("a.xyz", b"0 0 1\n0 1 1\n0 2 1\n0 3 1\n", [], "all points have the same x"),
        (
            "a.xyz",
            b"0 0 1\n1 0 1\n0 1 1\n1 1 1\n",
            ["--height-unit", "um"],
            "2 x 2 pixels; allowed: 16 or more",
        ),
        ("a.x3p", b"not a zip archive", [], "is not an X3P file that can be read"),
        ("a.toml", b"rms_height =", [], "is not valid TOML"),
        ("a.toml", SPEC.replace("hurst", "hurts").encode(), [], "did you mean hurst?"),
        ("a.toml", SPEC.replace("0.2", "2").encode(), [], "hurst = 2 is out of range"),
        ("a.toml", SPEC.replace('"5.8 um"', "5.8").encode(), [], "a plain number is in m"),
        ("a.toml", (SPEC + "rms_slope = 0.3").encode(), [], "give one of rms_height and rms_slope"),
        ("a.toml", SPEC.replace("175 um", "60 um").encode(), [], "must not fall in this order"),
        ("a.toml", SPEC.replace("70 um", "35 um").encode(), [], "has 2.24 pixels of 15.62 um"),
        ("a.toml", (SPEC + "skewness = -2").encode(), ["--realisations", "0"], "--realisations"),
        ("a.toml", SPEC.encode(), ["--pixel", "1um"], "--pixel has no meaning"),
        ("a.toml", SPEC.encode(), ["--shortest-wave", "50um"], "is shorter than that of"),
        ("a.toml", SPEC.encode(), ["--shortest-wave", "0.5mm"], "longer than a quarter of the map"),
        (
            "a.toml",
            SPEC.encode(),
            ["--compound", "D"],
            "--compound = \"D\" is not available; allowed: 'A'",
        ),
        ("a.toml", SPEC.encode(), ["--compound", "B", "--modulus", "1MPa"], "contradict"),
        ("a.toml", SPEC.encode(), ["--modulus", "1bar/s"], "--modulus"),
        ("a.toml", SPEC.encode(), ["--definition", "other"], "allowed: 'hydrodynamic' or 'thesis'"),
        (
            "a.toml",
            SPEC.encode(),
            ["--pressures", "1bar"],
            "has 1 value; allowed: 2 to 200, as in 0.2bar:20bar:12",
        ),
        ("a.toml", SPEC.encode(), ["--pressures", "1bar:5bar:1"], "one value from 1bar to 5bar"),
        (
            "a.toml",
            SPEC.encode(),
            ["--pressures", "5bar:1bar:3"],
            "is not rising; allowed: as in 0.2bar:20bar:12",
        ),
        ("a.toml", SPEC.encode(), ["--pressures", "1m:5bar:3"], "has the wrong unit"),
        ("a.toml", SPEC.encode(), ["--scene", "no.toml"], "--scene"),
    ],
)
def test_bad_input_is_one_sentence(name, content, options, words, tmp_path, capsys):
    path = tmp_path / name
    if isinstance(content, np.ndarray):
        np.save(path, content)
    elif content is not None:
        path.write_bytes(content)
    out = tmp_path / "out"
    with np.errstate(all="ignore"):
        code = exit_code("roughness", path, *options, "--out", out)
    error = capsys.readouterr().err
    assert code == 2 and words in error, error
    assert error.startswith("iceslide: ") and error.count("\n") == 1
    assert not out.exists()


def test_too_few_pixels_are_refused_except_for_the_source_s_definitions(heights, tmp_path):
    np.save(tmp_path / "map.npy", heights)
    given = {"surface": str(tmp_path / "map.npy"), "pixel": "10um", **TWO}
    with pytest.raises(SceneError, match=r"has 3.5 pixels of 10 um; allowed: 4 or more"):
        survey(RoughnessCase.of(given))
    assert survey(RoughnessCase.of(given | {"definition": "thesis"})).mean.k[0] > 0.0


def test_steep_surfaces_are_said(tmp_path, capsys):
    steep = re.sub("rms_height.*", "rms_slope = 0.7", SPEC)
    (tmp_path / "a.toml").write_text(steep)
    words = ["--realisations", "1", "--pressures", "1bar:2bar:2", "--out", tmp_path / "out"]
    assert exit_code("roughness", tmp_path / "a.toml", *words) == 0
    assert "the rms slope is 0.70: above 0.6" in capsys.readouterr().out


def test_heights_of_another_unit_are_refused(tmp_path, capsys):
    heights = np.random.default_rng(1).normal(size=(64, 64))  # micrometres, meant
    np.save(tmp_path / "a.npy", heights)
    words = ["--pixel", "8um", "--pressures", "1bar:2bar:2", "--out", tmp_path / "out"]
    assert exit_code("roughness", tmp_path / "a.npy", *words) == 2
    assert "slope of 5.26e+04" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert exit_code("roughness", tmp_path / "a.npy", *words, "--height-unit", "um") == 0


def test_skewness_beyond_the_spectrum_is_said(tmp_path):
    values = {"rms_height": 1e-6, "hurst": 0, "rolloff": 1e-3, "shortest_wave": 9e-4}
    values |= {"size": 1e-3, "pixels": 64, "skewness": 2.0}
    with pytest.raises(SceneError, match="skewness = 2 cannot be had with this spectrum"):
        generate(SurfaceSpec.model_validate(values))


def test_vendors_formats_need_an_optional_reader(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "surfalize", None)
    (tmp_path / "a.sur").write_bytes(b"x")
    with pytest.raises(SceneError, match="pip install surfalize"):
        read_surface(tmp_path / "a.sur", None, None)


def test_shipped_tables_are_of_one_surface():
    """k_A(p) = k_B(p E_B / E_A) to what straight lines in log-log leave; and of compound_B.toml."""
    tables = {
        name: read_contact_table(SURFACES / f"compound_{name}.csv", "table") for name in "ABC"
    }
    p = np.geomspace(1e4, 8e5, 30)
    for name in "AC":
        medium = tables["B"](p * YOUNGS_MODULUS["B"] / YOUNGS_MODULUS[name])
        assert tables[name](p).k == pytest.approx(medium.k, rel=1e-2)
        assert tables[name](p).H_V == pytest.approx(medium.H_V, rel=0.1)
    given = {"surface": str(SURFACES / "compound_B.toml"), "realisations": "2"}
    found = survey(RoughnessCase.of(given | {"pressures": "1bar:5bar:2"})).mean
    shipped = tables["B"]([1e5, 5e5])
    for one, other in zip(found[:3], shipped[:3], strict=True):
        assert one == pytest.approx(other, rel=0.1)
    assert shipped.k[0] == pytest.approx(0.266, rel=0.07)
    assert shipped.D[0] == pytest.approx(29e-6, rel=0.07)
    assert shipped.H_V == pytest.approx([2.86e-6, 0.56e-6], rel=0.07)
    scene = load_scene(SURFACES.parent / "rough_1bar.toml")
    assert isinstance(scene.contact_parameters, ContactTable)
    assert scene.contact_parameters.pressure[:: len(shipped.k) * 9] == (2e3, 2e6)


def test_heights_that_are_far_too_small_are_in_another_unit(tmp_path):
    """Micrometres that were divided once too often: nothing would be open under any pressure."""
    heights = 3e-11 * np.random.default_rng(1).standard_normal((32, 32))
    np.save(tmp_path / "map.npy", heights)
    words = ["roughness", str(tmp_path / "map.npy"), "--pixel", "10um", "--definition", "thesis"]
    done = subprocess.run(
        [sys.executable, "-m", "iceslide_fem.cli", *words, "--out", str(tmp_path / "out")],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    assert "allowed: slopes of 1e-05 to 10 (--height-unit says" in done.stderr
