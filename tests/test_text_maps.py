"""Height maps as text with headers, and X3P as others write it: sizes, units, missing heights."""

import zipfile

import numpy as np
import pytest

from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.survey import summary, survey
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.surfaces.read import read_surface
from iceslide_fem.surfaces.surface import levelled

pytestmark = pytest.mark.quick

SIDE, ROWS, COLUMNS = 2.5e-6, 18, 24
Y, X = np.indices((ROWS, COLUMNS))
HEIGHTS = 3e-6 * np.sin(0.5 * X + 0.2) + 1e-6 * np.cos(0.9 * Y) + 2e-8 * X * Y


def rows(values, separator="\t", form=".9g"):
    return "\n".join(separator.join(format(value, form) for value in row) for row in values) + "\n"


def check(path, pixel=None, unit=None, rtol=1e-6):
    found = read_surface(path, pixel, unit)
    assert found.pixel == pytest.approx(SIDE, rel=1e-6)
    assert found.heights == pytest.approx(HEIGHTS, abs=rtol * 3e-6, nan_ok=True)
    return found


GWYDDION = "# Channel: Topo\n# Width: 60 \N{MICRO SIGN}m\n# Height: 45 \N{MICRO SIGN}m\n"


@pytest.mark.parametrize(
    ("head", "factor"),
    [
        (GWYDDION + "# Value units: m\n", 1.0),
        (GWYDDION + "# Value units: nm\n", 1e9),
        (GWYDDION.replace("60 \N{MICRO SIGN}m", "0,06 mm") + "# Value units: m\n", 1.0),
        ("Pixel size [um]: 2.5\nHeights in um\n", 1e6),
        ("# dx = 2.5e-3 mm\n# dy = 2.5e-3 mm\n# z [nm]\n", 1e9),
        ("Höhe in µm;;\nPixelgröße;2,5 µm;\n".replace(";", " "), 1e6),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_headers_say_sizes_and_units(head, factor, encoding, tmp_path):
    (tmp_path / "a.txt").write_bytes((head + rows(factor * HEIGHTS)).encode(encoding))
    found = check(tmp_path / "a.txt")
    assert any("its header has heights in" in note for note in found.notes)
    assert any("its header gives pixels of 2.5 x 2.5 um" in note for note in found.notes)


@pytest.mark.parametrize(
    ("head", "separator"),
    [
        ('"XY calibration","2500","nm"\n"Unit","um"\n', ","),
        ("Spacing X;2.5;um\nSpacing Y;2.5;um\nHeights in;um\n", ";"),
    ],
)
def test_headers_may_have_cells_of_their_own(head, separator, tmp_path):
    (tmp_path / "a.csv").write_text(head + rows(1e6 * HEIGHTS, separator, ".9f"))
    check(tmp_path / "a.csv")


def test_a_header_and_an_option_that_contradict_each_other(tmp_path):
    (tmp_path / "a.txt").write_text("# heights in um\n" + rows(1e6 * HEIGHTS))
    check(tmp_path / "a.txt", SIDE)
    check(tmp_path / "a.txt", SIDE, 1e-6)
    with pytest.raises(SceneError, match="--height-unit contradicts .*a.txt, whose heights are in"):
        read_surface(tmp_path / "a.txt", SIDE, 1e-9)
    (tmp_path / "b.txt").write_text("# Width: 60 um\n# Height: 45 um\n" + rows(HEIGHTS))
    with pytest.raises(SceneError, match="--pixel 9 um contradicts"):
        read_surface(tmp_path / "b.txt", 9e-6, None)


ESRI = "ncols 24\nnrows 18\nxllcorner 0\nyllcorner 0.0\ncellsize 2.5\nNODATA_value -9999\n"


@pytest.mark.parametrize("comma", [False, True])
def test_esri_grids(comma, tmp_path):
    values = 1e6 * HEIGHTS
    values[3, 4] = -9999
    text = ESRI + rows(values, " ")
    if comma:
        text = text.replace(".", ",").upper().replace("E-", "e-")
    (tmp_path / "a.asc").write_text(text)
    found = read_surface(tmp_path / "a.asc", None, 1e-6)
    assert found.pixel == pytest.approx(SIDE) and np.isnan(found.heights[3, 4])
    there = np.isfinite(found.heights)
    assert there.sum() == HEIGHTS.size - 1
    assert found.heights[there] == pytest.approx(HEIGHTS[there], abs=1e-11)
    wrapped = " ".join(f"{value:.6g}" for value in values.ravel()).replace(" ", "\n", 5)
    (tmp_path / "b.asc").write_text(ESRI + wrapped)
    assert read_surface(tmp_path / "b.asc", None, 1e-6).heights.shape == (ROWS, COLUMNS)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("nrows 18", "nrows 17", "has 432 heights; its header says 17 rows of 24"),
        ("cellsize 2.5\n", "", "has no cellsize in its header"),
        ("nrows 18\n", "", "has no nrows in its header"),
        ("ncols 24", "ncols many", "line 1"),
        ("cellsize 2.5", "cellsize small", 'cellsize = "small" is not a number'),
    ],
)
def test_esri_grids_that_cannot_be_read(old, new, words, tmp_path):
    (tmp_path / "a.asc").write_text(ESRI.replace(old, new) + rows(HEIGHTS, " "))
    with pytest.raises(SceneError) as refusal:
        read_surface(tmp_path / "a.asc", None, None)
    if words != "line 1":
        assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("heading", "factors"),
    [
        ("x_mm,y_mm,z_um", (1e3, 1e3, 1e6)),
        ("X [mm],Y [mm],Z [µm]", (1e3, 1e3, 1e6)),
        ("x (um),y (um),z (nm)", (1e6, 1e6, 1e9)),
        ("x,y,z", (1.0, 1.0, 1.0)),
    ],
)
def test_points_have_the_unit_of_each_column(heading, factors, tmp_path):
    points = np.column_stack([SIDE * X.ravel(), SIDE * Y.ravel(), HEIGHTS.ravel()]) * factors
    body = rows(points, ",", ".12g")
    (tmp_path / "a.csv").write_text(heading + "\n" + body, encoding="cp1252")
    check(tmp_path / "a.csv")
    turned = rows(points[::-1, [2, 0, 1]], ";", ".12g").replace(".", ",")
    names = heading.split(",")
    (tmp_path / "b.csv").write_text(";".join([names[2], *names[:2]]) + "\n" + turned)
    check(tmp_path / "b.csv")
    index = "".join(f"{i},{line}\n" for i, line in enumerate(body.splitlines()))
    (tmp_path / "c.csv").write_text(f",{heading}\n{index}")
    check(tmp_path / "c.csv")
    if factors[2] != 1.0:
        with pytest.raises(SceneError, match="--height-unit contradicts"):
            read_surface(tmp_path / "a.csv", None, 1e-3)


def test_several_points_at_one_place_are_refused(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 1\n1 0 1\n0 1 1\n1 1 2\n1 1 3\n")
    with pytest.raises(SceneError, match="has several points at one place"):
        read_surface(tmp_path / "a.xyz", None, 1e-6)


@pytest.mark.parametrize("mark", ["-9999", "1e38", "-3.4e38", "9999"])
def test_a_number_that_marks_missing_heights_is_no_height(mark, tmp_path):
    text = rows(1e6 * HEIGHTS).split("\n")
    for row in (2, 5):
        cells = text[row].split("\t")
        cells[row] = mark
        text[row] = "\t".join(cells)
    (tmp_path / "a.txt").write_text("\n".join(text))
    found = read_surface(tmp_path / "a.txt", SIDE, 1e-6)
    assert np.isnan(found.heights).sum() == 2
    assert "0.46% of its heights are exactly" in found.notes[0]
    assert "far from all others: they are taken for missing ones" in found.notes[0]


@pytest.mark.parametrize("mark", [0.0, 2e-6])
def test_missing_heights_that_have_a_value_of_heights_are_told_by_their_neighbours(mark, tmp_path):
    fine = np.sin(0.05 * np.arange(200) + 0.3) * np.cos(0.07 * np.arange(150))[:, None] * 3e-6
    lost = np.random.default_rng(2).random(fine.shape) < 0.06
    np.save(tmp_path / "a.npy", np.where(lost, mark, fine))
    found = read_surface(tmp_path / "a.npy", SIDE, None)
    assert (np.isnan(found.heights) == lost).all()
    assert "apart from those beside them: they are taken for missing ones" in found.notes[0]
    filled = levelled(found)
    assert "of its heights are missing and filled" in filled.notes[-1]
    np.save(
        tmp_path / "b.npy", np.where(np.random.default_rng(3).random(fine.shape) < 0.15, mark, fine)
    )
    with pytest.raises(SceneError, match="of the map's heights are missing; allowed: up to 10%"):
        levelled(read_surface(tmp_path / "b.npy", SIDE, None))


def test_flat_places_and_steps_of_the_instrument_are_heights(tmp_path):
    fine = np.sin(0.05 * np.arange(200) + 0.3) * np.cos(0.07 * np.arange(150))[:, None] * 3e-6
    np.save(tmp_path / "cut.npy", np.minimum(fine, 1e-6))
    cut = read_surface(tmp_path / "cut.npy", SIDE, None)
    assert np.isfinite(cut.heights).all() and "are the same, 1 um, and flat places" in cut.notes[0]
    np.save(tmp_path / "steps.npy", np.round(fine / 5e-8) * 5e-8)
    steps = read_surface(tmp_path / "steps.npy", SIDE, None)
    assert np.isfinite(steps.heights).all() and steps.notes == ()


def x3p(path, heights, sides, folder="", kind="D", link="bindata/data.bin"):
    xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{sides[0]}</Increment></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{sides[1]}</Increment></CY>
<CZ><AxisType>A</AxisType><DataType>{kind}</DataType><Increment>1</Increment></CZ>
</Axes></Record1><Record3><MatrixDimension><SizeX>{heights.shape[1]}</SizeX>
<SizeY>{heights.shape[0]}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>{link}</PointDataLink></DataLink></Record3></p:ISO5436_2>"""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(folder + "main.xml", xml)
        archive.writestr(folder + "bindata/data.bin", heights.astype("<f8").tobytes())


@pytest.mark.parametrize("folder", ["", "scan/", "a/b/", "scan\\"])
@pytest.mark.parametrize("link", ["bindata/data.bin", "bindata\\data.bin", " ./bindata/data.bin "])
def test_members_of_x3p_may_be_in_a_folder(folder, link, tmp_path):
    x3p(tmp_path / "a.x3p", HEIGHTS, (SIDE, SIDE), folder, link=link)
    check(tmp_path / "a.x3p")


def test_x3p_in_other_units_than_its_standard_has(tmp_path):
    x3p(tmp_path / "a.x3p", 1e6 * HEIGHTS, (1e6 * SIDE, 1e6 * SIDE))
    with pytest.raises(SceneError, match=r"pixels of 2.5 x 2.5 m; .*--height-unit says what its"):
        read_surface(tmp_path / "a.x3p", None, None)
    found = check(tmp_path / "a.x3p", None, 1e-6)
    assert "--height-unit" in found.notes[0]


def test_x3p_that_is_damaged_says_how(tmp_path):
    x3p(tmp_path / "a.x3p", HEIGHTS[1:], (SIDE, SIDE))
    with zipfile.ZipFile(tmp_path / "a.x3p") as archive:
        xml, data = archive.read("main.xml"), archive.read("bindata/data.bin")
    with zipfile.ZipFile(tmp_path / "b.x3p", "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("bindata/data.bin", data[:-8])
    with pytest.raises(SceneError, match="it has 407 heights; its head says 17 rows of 24"):
        read_surface(tmp_path / "b.x3p", None, None)
    with zipfile.ZipFile(tmp_path / "c.x3p", "w") as archive:
        archive.writestr("main.xml", xml.replace(b"SizeX", b"SizeW"))
        archive.writestr("bindata/data.bin", data)
    with pytest.raises(SceneError, match="can be read: its SizeX is missing"):
        read_surface(tmp_path / "c.x3p", None, None)
    with zipfile.ZipFile(tmp_path / "d.x3p", "w") as archive:
        archive.writestr("other.xml", xml)
    with pytest.raises(SceneError, match="it has no main.xml"):
        read_surface(tmp_path / "d.x3p", None, None)


@pytest.mark.parametrize("along", ["x", "y"])
def test_unequal_pixels_are_made_square_by_splines(along, tmp_path):
    every = HEIGHTS[:, ::2] if along == "x" else HEIGHTS[::2]
    sides = (2 * SIDE, SIDE) if along == "x" else (SIDE, 2 * SIDE)
    x3p(tmp_path / "a.x3p", every, sides)
    found = read_surface(tmp_path / "a.x3p", None, None)
    expected = HEIGHTS[:, :-1] if along == "x" else HEIGHTS[:-1]
    assert found.pixel == SIDE and found.heights.shape == expected.shape
    assert found.heights[:, ::2][::2] == pytest.approx(expected[:, ::2][::2], abs=1e-12)
    inside = np.s_[4:-4, 4:-4]
    assert found.heights[inside] == pytest.approx(expected[inside], abs=8e-8)
    assert f"made square, 2.5 um, by cubic splines along {along}" in found.notes[0]
    holes = every.copy()
    holes[4, 5] = np.nan
    x3p(tmp_path / "b.x3p", holes, sides)
    assert np.isnan(read_surface(tmp_path / "b.x3p", None, None).heights).sum() == 3
    x3p(tmp_path / "c.x3p", every, (20 * SIDE, SIDE))
    with pytest.raises(SceneError, match="allowed: sides up to 10 times as long as the other"):
        read_surface(tmp_path / "c.x3p", None, None)


def test_a_pixel_rounded_in_its_file_has_four_to_the_wave(tmp_path):
    """8.75 um as a number of 32 bits is a little more than that."""
    y, x = np.indices((64, 64))
    heights = 1e-6 * np.sin(0.3 * x) * np.cos(0.2 * y)
    given = {"pressures": "1bar:5bar:2"}
    x3p(tmp_path / "b.x3p", heights, (5e-6, 10e-6))  # the coarser side counts
    with pytest.raises(SceneError, match="has 3.5 pixels of 10 um; allowed: 4 or more"):
        survey(RoughnessCase.of(given | {"surface": str(tmp_path / "b.x3p")}))
    for pixel, allowed in ((float(np.float32(8.75e-6)), True), (8.79e-6, False)):
        x3p(tmp_path / "a.x3p", heights, (pixel, pixel))
        case = RoughnessCase.of(given | {"surface": str(tmp_path / "a.x3p")})
        if allowed:
            result = survey(case)
        else:
            with pytest.raises(SceneError, match="has 3.982 pixels of 8.79 um; allowed: 4 or more"):
                survey(case)
    figures = summary(result)
    assert figures["measured"]["rms_height"] == pytest.approx(0.5e-6, rel=0.05)
    assert figures["rms_height_m"] <= figures["measured"]["rms_height"]


ZYGO = """Zygo XYZ Data File - Format 1
0 3 0 0 "Fri Nov 27 10:00:00 2026"
0 0 24 18 1 255
10 20 24 18
""
""
""
0 0.5 6.328e-07 0.5 1 0 2.5e-06 1787677163
3 2 0 0 0 666666 0 ""
0 0 1 33 0 0 0.1 60.4318 2 50
0 1 100 0 0 0 0 0 0 0
0 ""
1 5 0
#
"""


def test_xyz_files_of_zygo_have_their_pixel_in_the_head(tmp_path):
    points = np.column_stack([X.ravel() + 10, Y.ravel() + 20, 1e6 * HEIGHTS.ravel()])
    body = "".join(f"{x:.0f} {y:.0f} {z:.9g}\n" for x, y, z in points)
    (tmp_path / "a.xyz").write_text(ZYGO + body + "#\n")
    assert "read as um, as MetroPro writes" in check(tmp_path / "a.xyz").notes[0]
    holes = body.split("\n")
    holes[5] = "15 20 No Data"
    (tmp_path / "b.xyz").write_text(ZYGO + "\n".join(holes) + "#\n")
    found = read_surface(tmp_path / "b.xyz", None, 1e-6)
    assert np.isnan(found.heights[0, 5]) and np.isfinite(found.heights).sum() == HEIGHTS.size - 1
    (tmp_path / "c.xyz").write_text(ZYGO.replace("2.5e-06", "0") + body)
    with pytest.raises(SceneError, match="has no pixel size in its head"):
        read_surface(tmp_path / "c.xyz", None, None)
    (tmp_path / "d.asc").write_text("Zygo ASCII Data File - Format 2\n0 3 0 0\n#\n1 2 3\n#\n")
    with pytest.raises(SceneError, match="is a Zygo ASCII file, which is not read"):
        read_surface(tmp_path / "d.asc", None, None)


@pytest.mark.parametrize("in_nm", [0, 1])
def test_ascii_files_of_wyko(in_nm, tmp_path):
    factor = 1e9 if in_nm else 1e9 / (632.8 / 2)
    values = factor * HEIGHTS[::-1].T  # lines are columns, from below
    text = f"Wyko ASCII Data File Format 0\t{in_nm}\t1\nX Size\t{COLUMNS}\nY Size\t{ROWS}\n"
    text += "Block Name\tType\tLength\tValue\nPixel_size\t7\t4\t0.0025\nWavelength\t7\t4\t632.8\n"
    text += "Mult\t7\t4\t2\nRAW_DATA\t3\t48\t\n" + rows(values)
    (tmp_path / "a.asc").write_text(text + "Intensity\t3\t48\t\n" + rows(values))
    check(tmp_path / "a.asc")
    (tmp_path / "b.asc").write_text(text.replace(f"{values[3, 4]:.9g}", "Bad"))
    assert np.isnan(read_surface(tmp_path / "b.asc", None, None).heights).sum() == 1
    (tmp_path / "c.asc").write_text(text.replace("Mult", "Malt").replace("Pixel_size", "Size"))
    with pytest.raises(SceneError, match="head of a Wyko ASCII file that is not whole"):
        read_surface(tmp_path / "c.asc", None, None)


@pytest.mark.parametrize(
    "head",
    [
        "# File Format = ASCII\n# x-pixels = 24\n# y-pixels = 18\n# x-length = 60000\n"
        "# y-length = 45000\n# x-unit = nm\n# y-unit = nm\n# z-unit = nm\n",
        "# Kanal: Topographie\n# Breite: 60,00 µm\n# Höhe: 45,00 µm\n# Einheiten: nm\n",
        "# Canal : Topo\n# Largeur : 60 µm\n# Hauteur : 45 µm\n# Unités : nm\n",
        "# Channel: Topo\n# Width: 60 Âµm\n# Height: 45 Âµm\n# Value units: nm\n",
    ],
)
def test_heads_of_other_programs_and_languages(head, tmp_path):
    (tmp_path / "a.txt").write_text(head + rows(1e9 * HEIGHTS), encoding="utf-8")
    check(tmp_path / "a.txt")


def test_esri_grids_of_unequal_sides(tmp_path):
    text = ESRI.replace("cellsize 2.5", "dx 2.5\ndy 5.0").replace("nrows 18", "nrows 9")
    (tmp_path / "a.asc").write_text(text + rows(1e6 * HEIGHTS[::2], " "))
    found = read_surface(tmp_path / "a.asc", None, 1e-6)
    assert found.pixel == pytest.approx(SIDE) and found.heights.shape == (17, 24)
    assert found.heights[::2] == pytest.approx(HEIGHTS[::2], abs=1e-11)
