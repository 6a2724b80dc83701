"""Instruments' files of known size and rms, written byte by byte from their published layouts."""

import io
import json
import struct
import zipfile
import zlib

import numpy as np
import pytest

from iceslide_fem.cli import main
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.surfaces.read import read_surface

pytestmark = pytest.mark.quick

ROWS, COLUMNS, SIDE = 18, 24, 2e-6
Y, X = np.indices((ROWS, COLUMNS))
# Metres; no two rows or columns are alike, so that nothing may be turned or mirrored unseen.
HEIGHTS = 3e-6 * np.sin(0.5 * X + 0.2) + 1e-6 * np.cos(0.9 * Y) + 2e-8 * X * Y
HOLES = [(3, 4), (17, 0)]


def padded(text, size):
    return text.encode().ljust(size, b"\0")


def wyko(heights, aspect=1.0, kind="<f4"):
    """Wyko/Vision OPD: Gwyddion's wykofile.c; columns upwards, in wavelengths (nm) over mult."""
    wavelength, mult = 633.0, 2 if kind == "<f4" else 300
    values = 1e9 * heights / (wavelength / mult)
    bad = 1e38 if kind == "<f4" else 32767
    values = values if kind == "<f4" else np.rint(values)
    values[np.isnan(values)] = bad
    columns = np.rot90(values, -1).astype(kind)  # (columns, rows)
    array = struct.pack("<3H", *columns.shape, np.dtype(kind).itemsize) + columns.tobytes()
    blocks = [
        ("RAW_DATA", 3, array),
        ("Wavelength", 7, struct.pack("<f", wavelength)),
        ("Mult", 6, struct.pack("<h", mult)),
        ("Aspect", 7, struct.pack("<f", aspect)),
        ("Pixel_size", 7, struct.pack("<f", 1e3 * SIDE)),
        ("Title", 5, b"made by hand\0\0"),
    ]

    def entry(name, kind, size):
        return padded(name, 16) + struct.pack("<hlH", kind, size, 0)

    directory = b"".join(entry(name, kind, len(data)) for name, kind, data in blocks)
    first = entry("Directory", 1, len(directory) + 24)
    return b"\1\0" + first + directory + b"".join(data for _, _, data in blocks)


def surf(heights, bits=32, units=("mm", "mm", "nm"), packed=False):
    """Digital Surf: the 512-byte header of the SURF format, 1-1."""
    per = {"mm": 1e-3, "um": 1e-6, "\N{MICRO SIGN}m": 1e-6, "nm": 1e-9}
    step = np.nanmax(np.abs(heights)) / (2 ** (bits - 1) - 10)
    points = np.rint(heights / step)
    low = int(np.nanmin(points))
    points = np.where(np.isnan(points), low - 2, points).astype(f"<i{bits // 8}")
    body, size = points.tobytes(), 0
    if packed:
        stream = zlib.compress(body)
        body = struct.pack("<3I", 1, len(body), len(stream)) + stream
        size = len(body)
    text = [part.encode("latin-1").ljust(16, b" ") for part in (*("XYZ"), *units, *units)]
    head = struct.pack(
        "<12s4h30s30s5hf4xh2i3i3f",
        b"DSCOMPRESSED" if packed else b"DIGITAL SURF",
        *(0, 1, 1, 2),
        b"by hand".ljust(30),
        b"nobody".ljust(30),
        *(0, 0, 0, int(np.isnan(heights).any()), 0),
        0.0,
        bits,
        *(low, int(points.max())),
        *(COLUMNS, ROWS, points.size),
        *(SIDE / per[units[0]], SIDE / per[units[1]], step / per[units[2]]),
    )
    head += b"".join(text) + struct.pack(
        "<3f3h12x7hfI6x2h", 1, 1, 1, *[0] * 3, *[1] * 7, 0, size, 0, 0
    )
    return head.ljust(512, b"\0") + body


def sdf(heights, kind=7, binary=True):
    """ISO 25178-71: metres."""
    scale = 1e-9
    types = {3: "<f4", 5: "<i2", 6: "<i4", 7: "<f8"}
    bad = {3: np.finfo("f4").min, 5: -(2**15), 6: -(2**31), 7: np.finfo("f8").min}[kind]
    values = heights / scale
    if not binary:
        names = ["ManufacID", "CreateDate", "ModDate", "NumPoints", "NumProfiles", "Xscale"]
        names += ["Yscale", "Zscale", "Zresolution", "Compression", "DataType", "CheckType"]
        given = ["hand", "270920261000", "270920261000", COLUMNS, ROWS, SIDE, SIDE, scale, -1, 0]
        lines = [f"{n} = {v}" for n, v in zip(names, [*given, 7, 0], strict=True)]
        text = " ".join("BAD" if np.isnan(value) else f"{value:.6f}" for value in values.ravel())
        return "\r\n".join(["aISO-1.0", *lines, "*", text, "*", "*", ""]).encode()
    head = struct.pack(
        "<8s10s12s12s2H4d3B",
        b"bISO-1.0",
        b"hand".ljust(10),
        b"270920261000",
        b"270920261000",
        *(COLUMNS, ROWS),
        *(SIDE, SIDE, scale, -1.0),
        *(0, kind, 0),
    )
    values = np.where(np.isnan(values), bad, values if kind in (3, 7) else np.rint(values))
    return head + values.astype(types[kind]).tobytes()


def keyence(heights, magic=b"VK4_"):
    """Keyence VK4: Gwyddion's keyence.c; pm."""
    step = 1e-9
    counts = np.rint((heights - heights.min()) / step).astype("<u4")
    conditions = struct.pack("<I", 304) + struct.pack("<6I", 2026, 11, 27, 10, 0, 0)
    conditions = bytearray(conditions.ljust(304, b"\0"))
    struct.pack_into("<3I", conditions, 168, *(round(SIDE * 1e12),) * 2, round(step * 1e12))
    offsets = [0] * 18
    start = 12 + 4 * len(offsets)
    offsets[0], offsets[6] = start, start + len(conditions)
    image = struct.pack("<7I", COLUMNS, ROWS, 32, 0, counts.nbytes, 0, 0) + bytes(768)
    image += counts.tobytes()
    offsets[16] = offsets[6] + len(image)
    text = b"".join(
        struct.pack("<I", len(word)) + word.encode("utf-16-le") for word in ("a", "10x")
    )
    return magic + bytes(8) + struct.pack("<18I", *offsets) + bytes(conditions) + image + text


def keyence_in_archive(heights):
    """Keyence VK6: VK4 in an archive behind a head."""
    file = io.BytesIO()
    file.write(b"VK6" + bytes(5))
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr("Vk4File", keyence(heights))
    return file.getvalue()


def alicona(heights):
    """Alicona AL3D 1.0: tags of 52 bytes, rows padded to 8 bytes, m."""
    at = 17 + 52 * 9 + 40
    tags = [("Version", 1), ("TagCount", 7), ("Cols", COLUMNS), ("Rows", ROWS)]
    tags += [("PixelSizeXMeter", SIDE), ("PixelSizeYMeter", SIDE), ("DepthImageOffset", at)]
    tags += [("InvalidPixelValue", 3e15), ("TextureImageOffset", 0)]
    data = b"AliconaImaging\0\r\n"
    for key, value in tags:
        data += padded(key, 20) + padded(str(value), 30) + b"\r\n"
    values = np.where(np.isnan(heights), 3e15, heights).astype("<f4")
    return data.ljust(at, b"\0") + values.tobytes()  # 24 columns fill 96 bytes


def plux(heights):
    """Sensofar PLUX: index.xml and LAYER_0.raw; um, FOV the side of a pixel."""
    file = io.BytesIO()
    general = f"<DATE>2026-11-27</DATE><IMAGE_SIZE_X>{COLUMNS}</IMAGE_SIZE_X>"
    general += f"<IMAGE_SIZE_Y>{ROWS}</IMAGE_SIZE_Y>"
    general += f"<FOV_X>{1e6 * SIDE}</FOV_X><FOV_Y>{1e6 * SIDE}</FOV_Y>"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("index.xml", f"<xml><GENERAL>{general}</GENERAL></xml>")
        archive.writestr("LAYER_0.raw", (1e6 * heights).astype("<f4").tobytes())
    return file.getvalue()


def omnisurf(heights):
    """OmniSurf3D: digitalmetrology.com/omnisurf3d-file-format; um."""
    words = [b"by hand", b"2026-11-27 10:00:00"]
    data = b"OmniSurf3D" + struct.pack("<2i", 1, 0)
    data += b"".join(struct.pack("<i", len(word)) + word for word in words)
    data += struct.pack("<2i4d", COLUMNS, ROWS, 1e6 * SIDE, 1e6 * SIDE, 0.0, 0.0)
    values = np.where(np.isnan(heights), np.finfo("f4").min, 1e6 * heights)
    return data + values.astype("<f4").tobytes() + b"\0"


def gwyddion(heights):
    """Gwyddion GWY: containers of typed components; m."""

    def part(name, kind, content):
        return name.encode() + b"\0" + kind + content

    def of(name, parts):
        content = b"".join(parts)
        return name.encode() + b"\0" + struct.pack("<I", len(content)) + content

    def unit():
        return of("GwySIUnit", [part("unitstr", b"s", b"m\0")])

    def field(values):
        return of(
            "GwyDataField",
            [
                part("xres", b"i", struct.pack("<i", COLUMNS)),
                part("yres", b"i", struct.pack("<i", ROWS)),
                part("xreal", b"d", struct.pack("<d", COLUMNS * SIDE)),
                part("yreal", b"d", struct.pack("<d", ROWS * SIDE)),
                part("si_unit_xy", b"o", unit()),
                part("si_unit_z", b"o", unit()),
                part("data", b"D", struct.pack("<I", values.size) + values.astype("<f8").tobytes()),
            ],
        )

    return b"GWYP" + of(
        "GwyContainer",
        [
            part("/0/data", b"o", field(np.nan_to_num(heights))),
            part("/0/data/title", b"s", b"Topography\0"),
            part("/0/mask", b"o", field(np.isnan(heights).astype(float))),
        ],
    )


BY_SURFALIZE = [
    ("a.opd", wyko, {}),
    ("a.opd", wyko, {"kind": "<i2"}),
    ("a.sur", surf, {}),
    ("a.sur", surf, {"bits": 16, "units": ("\N{MICRO SIGN}m",) * 3}),
    ("a.sur", surf, {"packed": True}),
    ("a.sdf", sdf, {}),
    ("a.sdf", sdf, {"kind": 3}),
    ("a.sdf", sdf, {"kind": 5}),
    ("a.sdf", sdf, {"kind": 6}),
    ("a.sdf", sdf, {"binary": False}),
    ("a.vk4", keyence, {}),
    ("a.vk3", keyence, {"magic": b"VK3_"}),
    ("a.vk6", keyence_in_archive, {}),
    ("a.vk7", keyence_in_archive, {}),
    ("a.al3d", alicona, {}),
    ("a.plux", plux, {}),
    ("a.os3d", omnisurf, {}),
    ("a.gwy", gwyddion, {}),
]
WITHOUT_HOLES = (keyence, keyence_in_archive)


def check(path, write, options, holes):
    heights = HEIGHTS.copy()
    if holes:
        for place in HOLES:
            heights[place] = np.nan
    path.write_bytes(write(heights, **options))
    found = read_surface(path, None, None)
    assert found.pixel == pytest.approx(SIDE, rel=1e-6)
    assert np.array_equal(np.isnan(found.heights), np.isnan(heights))
    given, read = (values - np.nanmean(values) for values in (heights, found.heights))
    assert read == pytest.approx(given, abs=2e-9, nan_ok=True)
    assert np.nanstd(read) == pytest.approx(np.nanstd(given), rel=1e-3)
    return found


@pytest.mark.parametrize("holes", [False, True])
@pytest.mark.parametrize(("name", "write", "options"), BY_SURFALIZE)
def test_formats_that_surfalize_reads(name, write, options, holes, tmp_path):
    pytest.importorskip("surfalize")
    if holes and write in WITHOUT_HOLES:
        pytest.skip("the format has no mark of missing heights")
    assert check(tmp_path / name, write, options, holes).notes == ()


def test_surf_files_that_gwyddion_has_written(tmp_path):
    """It calls surfaces profiles, by SCRATCH and csm."""
    pytest.importorskip("surfalize")

    def write(heights):
        data = bytearray(surf(heights))
        struct.pack_into("<h", data, 18, 1)
        data[20:80] = b"SCRATCH".ljust(30) + b"csm".ljust(30)
        return bytes(data)

    check(tmp_path / "a.sur", write, {}, False)


def test_rows_of_alicona_are_padded(tmp_path):
    """To eight bytes, which an odd number of columns does not fill."""
    pytest.importorskip("surfalize")
    whole = alicona(HEIGHTS)
    at = len(whole) - 4 * HEIGHTS.size
    head = whole[:at].replace(padded(str(COLUMNS), 30), padded(str(COLUMNS - 1), 30))
    (tmp_path / "a.al3d").write_bytes(head + whole[at:])
    found = read_surface(tmp_path / "a.al3d", None, None)
    assert found.heights == pytest.approx(HEIGHTS[:, :-1], abs=1e-11)


def test_every_verified_format_has_a_file_here():
    from iceslide_fem.surfaces.read import VERIFIED

    assert {name[1:] for name, _, _ in BY_SURFALIZE} == VERIFIED


def test_pixels_that_are_not_square_are_made_so(tmp_path):
    pytest.importorskip("surfalize")
    (tmp_path / "a.opd").write_bytes(wyko(HEIGHTS, aspect=1.5))
    found = read_surface(tmp_path / "a.opd", None, None)
    assert found.pixel == pytest.approx(SIDE)
    rows, columns = found.heights.shape
    assert (rows, columns) == (26, COLUMNS)
    y, x = np.indices(found.heights.shape) / [[[1.5]], [[1.0]]]  # from the top, as rows are
    expected = 3e-6 * np.sin(0.5 * x + 0.2) + 1e-6 * np.cos(0.9 * y) + 2e-8 * x * y
    assert found.heights[3:-3] == pytest.approx(expected[3:-3], abs=5e-9)
    assert "are made square, 2 um, by cubic splines along y" in found.notes[0]


def test_what_is_not_verified_is_said(tmp_path, capsys):
    """FITS as surfalize has it from one instrument: no published layout says so."""
    pytest.importorskip("surfalize")

    def block(cards):
        return "".join(card.ljust(80) for card in [*cards, "END"]).ljust(2880).encode()

    first = ["SIMPLE  =                    T", "UNITX = 'um'", "UNITZ = 'um'"]
    first += ["UnitMultiplicatorDeltas = 1", "UnitMultiplicatorHeights = 1"]
    first += [f"DELTAX = {1e6 * SIDE}", f"DELTAY = {1e6 * SIDE}"]
    second = ["XTENSION= 'IMAGE   '", "BITPIX = -64", "NAXIS = 2", f"NAXIS1 = {COLUMNS}"]
    second += [f"NAXIS2 = {ROWS}", "EXTNAME = 'HEIGHTS'"]
    heights = (1e6 * HEIGHTS).astype(">f8").tobytes()
    (tmp_path / "a.fits").write_bytes(block(first) + block(second) + heights.ljust(5760, b"\0"))
    found = read_surface(tmp_path / "a.fits", None, None)
    assert found.notes[0].startswith("unverified: no test holds what surfalize reads from .fits")
    words = ["--pressures", "1bar:2bar:2", "--definition", "thesis", "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as ended:
        main(["roughness", str(tmp_path / "a.fits"), *words])
    assert ended.value.code == 0
    assert "Note: a.fits: unverified: no test holds" in capsys.readouterr().out
    warnings = json.loads((tmp_path / "out" / "surface.json").read_text())["warnings"]
    assert any("unverified" in warning for warning in warnings)


@pytest.mark.parametrize("suffix", [".dat", ".nms", ".plu", ".tmd", ".zmg"])
def test_formats_that_surfalize_reads_wrongly_are_refused(suffix, tmp_path):
    (tmp_path / f"a{suffix}").write_bytes(b"whatever")
    with pytest.raises(SceneError, match=f"{suffix} files are not read.*export as X3P or text$"):
        read_surface(tmp_path / f"a{suffix}", None, None)


@pytest.mark.parametrize(
    "name", sorted({name for name, _, _ in BY_SURFALIZE}) + ["a.lext", "a.zon"]
)
@pytest.mark.parametrize("content", [b"", b"\1\2\3" * 400, b"1 2 3\n2 3 4\n3 4 5\n"])
def test_whatever_a_library_makes_of_damage_is_a_sentence(name, content, tmp_path):
    pytest.importorskip("surfalize")
    (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match="^[^\n]*cannot be read by surfalize as [^\n]*$"):
        read_surface(tmp_path / name, None, None)


def test_cut_files_are_a_sentence(tmp_path):
    pytest.importorskip("surfalize")
    for name, write, options in BY_SURFALIZE:
        whole = write(HEIGHTS, **options)
        for share in (0.02, 0.3, 0.7):
            (tmp_path / name).write_bytes(whole[: int(share * len(whole))])
            with pytest.raises(SceneError, match="^[^\n]*$"):
                read_surface(tmp_path / name, None, None)


def test_a_format_of_another_name_is_not_guessed(tmp_path):
    pytest.importorskip("surfalize")
    (tmp_path / "a.sur").write_bytes(sdf(HEIGHTS))
    with pytest.raises(SceneError, match="seems to actually be of type .sdf"):
        read_surface(tmp_path / "a.sur", None, None)
    (tmp_path / "a.abc").write_bytes(sdf(HEIGHTS))
    with pytest.raises(SceneError, match='maps of ".abc" are not read; surfalize reads .al3d'):
        read_surface(tmp_path / "a.abc", None, None)


def test_units_of_a_format_are_its_own(tmp_path):
    (tmp_path / "a.opd").write_bytes(wyko(HEIGHTS))
    with pytest.raises(SceneError, match="--height-unit has no meaning for .*a.opd"):
        read_surface(tmp_path / "a.opd", None, 1e-6)
