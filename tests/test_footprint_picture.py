"""From a picture to a pressure map: round trips through colours, and what may be wrong with it."""

import numpy as np
import pytest
from PIL import Image

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.picture import (
    Box,
    cut,
    legend_bar,
    named_bar,
    read_colours,
    read_grey,
    read_picture,
    rotate,
)
from iceslide_fem.preprocess.footprint.pressure_map import (
    PressureMap,
    gaussian_centre_line,
    pressure_from_values,
)
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.synthetic import Tread, coloured_picture, grey_picture, save
from iceslide_fem.runtime.errors import SceneError

SHAPE, HIGH = (420, 540), 4e5
SIZE = {"length": 0.18, "width": 0.14, "max_pressure": HIGH}
TRUTH = Tread().footprint(SHAPE)
COLORMAPS = ("viridis", "jet", "inferno")


def read(path, **options):
    return read_footprint(FootprintCase.of({"image": path, **SIZE, **options}))


def pixel_error(found):
    """Mean error of the pressure in the true contact, relative to its mean."""
    difference = np.abs(found.pressure - TRUTH.pressure)[TRUTH.contact]
    return difference.mean() / TRUTH.mean_pressure


def check_round_trip(found, pixel):
    assert found.mean_pressure == pytest.approx(TRUTH.mean_pressure, rel=0.01)
    assert found.contact_area == pytest.approx(TRUTH.contact_area, rel=0.01)
    assert pixel_error(found) < pixel


@pytest.mark.parametrize(("suffix", "pixel"), [("png", 0.003), ("tif", 0.003), ("jpg", 0.01)])
def test_grey_round_trip(tmp_path, suffix, pixel):
    path = save(grey_picture(TRUTH, HIGH), tmp_path / f"grey.{suffix}", quality=85)
    check_round_trip(read(path).pressure_map, pixel)


@pytest.mark.parametrize("colormap", COLORMAPS)
@pytest.mark.parametrize(("suffix", "pixel"), [("png", 0.005), ("jpg", 0.015)])
def test_colour_round_trip_by_name_and_by_legend(tmp_path, colormap, suffix, pixel):
    picture, legend = coloured_picture(TRUTH, HIGH, colormap)
    path = save(picture, tmp_path / f"coloured.{suffix}", quality=85)
    crop = f"0,0,{SHAPE[1]},{SHAPE[0]}"
    named = read(path, colormap=colormap, crop=crop)
    cut_out = read(path, legend=",".join(map(str, legend)), crop=crop)
    for found in (named, cut_out):
        check_round_trip(found.pressure_map, pixel)
        assert np.median(found.distance[TRUTH.contact]) < 0.02


@pytest.mark.parametrize("colormap", COLORMAPS)
def test_smoothed_edges_keep_area_and_pressure(tmp_path, colormap):
    fine = Tread().footprint((4 * SHAPE[0], 4 * SHAPE[1]))
    picture, _ = coloured_picture(fine, HIGH, colormap)
    body = Image.fromarray(picture[:, : fine.pressure.shape[1]])
    body.resize(SHAPE[::-1], Image.Resampling.BOX).save(tmp_path / "smooth.png")
    found = read(tmp_path / "smooth.png", colormap=colormap).pressure_map
    assert found.contact_area == pytest.approx(fine.contact_area, rel=0.01)
    assert found.mean_pressure == pytest.approx(fine.mean_pressure, rel=0.01)


def test_pressure_is_pmin_plus_grey_share_of_the_range():
    value = np.array([[0.0, 51.0, 255.0]]) / 255.0
    found = pressure_from_values(value, 1e5, 6e5, 1e5, (0.3, 0.1))
    assert found.pressure == pytest.approx(np.array([[0.0, 2e5, 6e5]]))
    assert (found.dx, found.dy) == pytest.approx((0.1, 0.1))


def test_area_load_and_net_to_gross_by_hand():
    pressure = np.array([[0, 1, 0, 1, 0], [0, 2, 0, 2, 0], [0, 0, 0, 0, 0]]) * 1e5
    footprint = PressureMap(pressure, 2e-3, 1e-3)
    assert footprint.contact_area == pytest.approx(4 * 2e-6)
    assert footprint.gross_area == pytest.approx(6 * 2e-6)
    assert footprint.mean_pressure == pytest.approx(1.5e5)
    assert footprint.load == pytest.approx(6e5 * 2e-6)
    loaded, factor = footprint.carrying(2.4)
    assert (loaded.load, factor) == pytest.approx((2.4, 2.0))


def test_gaussian_line_keeps_load_centre_and_spread():
    x = (np.arange(400) + 0.5) * 5e-4
    line = 3e5 * np.exp(-((x - 0.09) ** 2) / (2 * 0.02**2))
    found = gaussian_centre_line(PressureMap(np.tile(line, (4, 1)), 5e-4, 1e-3))
    assert (found.peak, found.centre, found.sigma) == pytest.approx((3e5, 0.09, 0.02), rel=1e-3)
    assert found(x).sum() == pytest.approx(line.sum(), rel=1e-3)


def test_rotation_turns_travel_to_the_right(tmp_path):
    upwards = np.rot90(grey_picture(TRUTH, HIGH))  # x of the footprint points up in the picture
    path = save(np.ascontiguousarray(upwards), tmp_path / "up.png")
    found = read(path, rotation=-90).pressure_map
    assert found.pressure.shape == SHAPE
    assert pixel_error(found) < 0.003


def test_rotation_by_a_few_degrees_keeps_area_and_load():
    picture = rotate(rotate(grey_picture(TRUTH, HIGH), 7.0, (0, 0, 0)), -7.0, (0, 0, 0))
    grey = read_grey(picture).value
    true = read_grey(grey_picture(TRUTH, HIGH)).value
    assert grey.sum() == pytest.approx(true.sum(), rel=0.01)
    assert (grey > 0.05).sum() == pytest.approx((true > 0.05).sum(), rel=0.01)


def test_rows_of_the_map_go_up():
    picture = np.zeros((4, 3, 3), dtype=np.uint8)
    picture[0, 2] = 255  # top right
    found = pressure_from_values(read_grey(picture).value, 0.0, 1e5, 0.0, (3e-3, 4e-3))
    assert np.argwhere(found.contact).tolist() == [[3, 2]]


def test_a_horizontal_legend_has_its_high_end_at_the_right():
    bar = (255 * named_bar("viridis")).astype(np.uint8)
    lying = np.repeat(bar[None], 20, axis=0)
    standing = np.repeat(bar[::-1, None], 20, axis=1)
    assert np.array_equal(legend_bar(lying), bar / 255.0)
    assert np.array_equal(legend_bar(standing), bar / 255.0)


def test_without_background_its_colour_is_a_value():
    picture = (255 * named_bar("viridis")[None, [0, 128, 255]]).round().astype(np.uint8)
    assert read_colours(picture, named_bar("viridis"), None).value == pytest.approx(
        np.array([[0.0, 128 / 255, 1.0]]), abs=0.01
    )


def test_sixteen_bit_grey_is_scaled(tmp_path):
    Image.fromarray(np.array([[0, 32768, 65535]], dtype=np.uint16)).save(tmp_path / "deep.png")
    assert read_picture(tmp_path / "deep.png")[0, :, 0].tolist() == [0, 128, 255]


def test_transparent_surroundings_of_a_grey_picture_are_no_contact(tmp_path):
    made = grey_picture(TRUTH, HIGH)
    seen = np.zeros((made.shape[0] + 40, made.shape[1] + 40, 4), dtype=np.uint8)
    seen[20:-20, 20:-20, :3], seen[20:-20, 20:-20, 3] = made, 255
    Image.fromarray(seen).save(tmp_path / "cut_out.png")
    share = SHAPE[1] / seen.shape[1], SHAPE[0] / seen.shape[0]
    size = {"length": SIZE["length"] / share[0], "width": SIZE["width"] / share[1]}
    found = read(tmp_path / "cut_out.png", **size).pressure_map
    assert found.contact_area == pytest.approx(TRUTH.contact_area, rel=0.01)


def test_corners_that_a_rotation_adds_are_no_contact(tmp_path):
    full = np.full((60, 80), 0.7)
    picture = (255 * named_bar("hot")[(255 * full).astype(int)]).round().astype(np.uint8)
    save(picture, tmp_path / "full.png")
    turned = rotate(picture, 10.0, (0, 0, 0))
    found = read(
        tmp_path / "full.png", colormap="hot", background="none", rotation=10.0
    ).pressure_map
    assert found.contact.mean() == pytest.approx(60 * 80 / turned[..., 0].size, rel=0.02)


def test_transparent_pixels_are_white(tmp_path):
    Image.fromarray(np.array([[[9, 9, 9, 0], [9, 9, 9, 255]]], dtype=np.uint8)).save(
        tmp_path / "seen.png"
    )
    assert read_picture(tmp_path / "seen.png")[0, :, 0].tolist() == [255, 9]


def test_a_picture_that_a_camera_calls_turned_stands_as_programs_show_it(tmp_path):
    seen = np.zeros((40, 60), dtype=np.uint8)
    seen[:10] = 200
    image = Image.fromarray(np.rot90(seen))  # as the sensor lay
    exif = image.getexif()
    exif[274] = 6  # to be turned clockwise
    image.save(tmp_path / "photo.png", exif=exif)
    assert np.array_equal(read_picture(tmp_path / "photo.png")[:, :, 0], seen)


@pytest.mark.parametrize("kind", ["float32", "int32"])
def test_numbers_that_are_no_colours_are_refused(tmp_path, kind):
    Image.fromarray(np.array([[0, 200_000]], dtype=kind)).save(tmp_path / "pressures.tif")
    with pytest.raises(SceneError, match="0 to 200000, are no grey of 8 or 16 bits"):
        read_picture(tmp_path / "pressures.tif")


def test_unreadable_pictures_are_said_in_a_sentence(tmp_path):
    path = save(grey_picture(TRUTH, HIGH), tmp_path / "whole.png")
    (tmp_path / "half.png").write_bytes(path.read_bytes()[:2000])
    (tmp_path / "text.png").write_text("no picture")
    for name, words in (
        ("half.png", "cannot read the picture"),
        ("text.png", "is not a picture; allowed: PNG, JPEG, TIFF"),
        ("nowhere.png", "No such file"),
    ):
        with pytest.raises(SceneError, match=words):
            read_picture(tmp_path / name)


def test_damaged_pictures_never_end_in_another_error(tmp_path):
    rng = np.random.default_rng(0)
    for suffix in ("png", "jpg", "tif"):
        whole = save(grey_picture(TRUTH, HIGH), tmp_path / f"whole.{suffix}").read_bytes()
        for _ in range(40):
            data = bytearray(whole)
            for place in rng.integers(0, min(len(data), 600), 5):
                data[place] = rng.integers(256)
            (tmp_path / "damaged").write_bytes(data)
            try:
                read_picture(tmp_path / "damaged")
            except SceneError as error:
                assert "\n" not in str(error)


@pytest.mark.parametrize(
    ("box", "words"),
    [((0, 0, 9, 5), "outside the picture, which has 4 x 3 pixels"), ((2, 2, 2, 3), "is empty")],
)
def test_a_box_must_lie_in_the_picture(box, words):
    with pytest.raises(SceneError, match=words):
        cut(np.zeros((3, 4, 3), dtype=np.uint8), Box(*box), "legend")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "the picture is coloured"),
        ({"colormap": "gray"}, "not those of the bar"),
        ({"colormap": "virids"}, "did you mean viridis?"),
        ({"colormap": "cool"}, "not those of the bar"),
        ({"legend": "0,0,30,10"}, "shows a single colour"),
        ({"legend": "560,0,900,100"}, "is outside the picture"),
        ({"colormap": "viridis", "background": "whit"}, "is not a colour"),
        (
            {"colormap": "viridis", "threshold": "3.9bar", "crop": "0,0,540,420"},
            "no pixel is in contact",
        ),
    ],
)
def test_wrong_readings_are_refused(tmp_path, options, words):
    picture, _ = coloured_picture(TRUTH, HIGH, "viridis")
    path = save(picture, tmp_path / "coloured.png")
    with pytest.raises(SceneError, match=words) as caught:
        read(path, **options)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "^--length, --width and --max-pressure are missing$"),
        ({"length": "0.18", "max_pressure": 4e5}, "^--width is missing$"),
        ({**SIZE, "width": "14 kg"}, '--width = "14 kg" has the wrong unit'),
        ({**SIZE, "length": -1}, "--length = .* is out of range"),
        ({**SIZE, "min_pressure": "5bar"}, r"--max-pressure \(4 bar\) is not above"),
        ({**SIZE, "threshold": "7bar"}, r"--threshold \(7 bar\) is not between"),
        ({**SIZE, "legend": "1,2,3"}, "is not LEFT,TOP,RIGHT,BOTTOM"),
        ({**SIZE, "crop": "1,2,3,--5"}, "is not LEFT,TOP,RIGHT,BOTTOM"),
        ({**SIZE, "legend": "1,2,3,4", "colormap": "jet"}, "contradict each other"),
        ({**SIZE, "compound": "A"}, "no published contact parameters"),
        ({**SIZE, "load": float("nan")}, "--load = NaN is out of range"),
        ({**SIZE, "lenght": 1.0}, "did you mean"),
    ],
)
def test_wrong_options_are_refused(values, words):
    with pytest.raises(SceneError, match=words) as caught:
        FootprintCase.of({"image": "any.png", **values})
    assert "\n" not in str(caught.value)


def test_a_print_in_ink_is_high_where_it_is_dark(tmp_path):
    path = save(255 - grey_picture(TRUTH, HIGH), tmp_path / "ink.png")
    with pytest.raises(SceneError, match="bright along its sides.*give --dark-is high for a print"):
        read(path)
    other = read(save(grey_picture(TRUTH, HIGH), tmp_path / "bright.png")).pressure_map
    found = read(path, dark_is="high").pressure_map
    assert found.pressure == pytest.approx(other.pressure, abs=1.0)
    turned = read(path, dark_is="high", rotation=7.0).pressure_map
    share = turned.pixel_area * turned.contact.mean() / turned.pixel_area
    assert share < other.contact.mean()  # what a rotation adds is paper
    with pytest.raises(
        SceneError, match="--dark-is and --(colormap|legend) contradict each other: only a grey"
    ):
        read(path, dark_is="high", colormap="jet")
