"""Files that others write: lines of points, lists of points, and exports of pressure mats."""

import numpy as np
import pytest
from PIL import Image

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.command import FOOTPRINT
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.survey import summary, survey
from iceslide_fem.runtime.errors import SceneError

pytestmark = pytest.mark.quick

DX, DY = 12e-3, 8e-3  # of sensors
Y, X = np.indices((7, 9))
MAT = np.round(np.maximum(0.0, 250.0 - 9.0 * (X - 4) ** 2 - 15.0 * (Y - 3.2) ** 2), 3)  # kPa


def read(folder, text, name="file.csv", source="pressure_map", encoding="utf-8", **values):
    (folder / name).write_text(text, encoding=encoding)
    return read_footprint(FootprintCase.of({source: str(folder / name), **values}))


def check(found):
    """The map is MAT, its first row on top."""
    footprint = found.pressure_map
    assert footprint.pressure == pytest.approx(1e3 * MAT[::-1], rel=1e-3)
    assert (footprint.dx, footprint.dy) == pytest.approx((DX, DY))
    return found


def rows(values, separator=",", form=".6g"):
    return "".join(separator.join(format(value, form) for value in row) + "\n" for row in values)


# --- a line


@pytest.mark.parametrize("x", [(0, 60, 120), (0, 30, 60, 90, 120), (0, 30, 60, 120)])
def test_a_line_is_straight_between_its_points_and_ends_at_them(x, tmp_path):
    """A triangle of 120 mm and 3 bar, however many points it has, carries half of their product."""
    points = "".join(f"{each},{3.0 - abs(each - 60) / 20.0}\n" for each in x)
    footprint = read(tmp_path, "x_mm,pressure_bar\n" + points, source="line").pressure_map
    assert footprint.contact_length == pytest.approx(0.12, rel=1e-6)
    assert footprint.load == pytest.approx(0.5 * 3e5 * 0.12, rel=1e-9)
    assert footprint.pressure.max() == pytest.approx(3e5, rel=5e-3)
    middle = np.interp(footprint.x, [0.0, 0.06, 0.12], [0.0, 3e5, 0.0])
    assert footprint.pressure[0] == pytest.approx(middle, abs=1e3)


def test_two_points_are_an_even_pressure_between_them(tmp_path):
    footprint = read(tmp_path, "x_mm,p_bar\n0,2\n180,2\n".replace("p_", "pressure_"),
                     source="line").pressure_map  # fmt: skip
    assert footprint.contact_length == pytest.approx(0.18)
    assert np.ptp(footprint.pressure) == pytest.approx(0.0, abs=1e-6)


def test_cells_reach_half_a_cell_beyond_their_middles(tmp_path):
    text = "cell_mm,pressure_bar\n30,1\n90,3\n150,1\n"
    footprint = read(tmp_path, text, source="line").pressure_map
    assert footprint.contact_length == pytest.approx(0.18)
    assert footprint.pressure[0].tolist() == [1e5, 3e5, 1e5]


def test_states_and_temperatures_lie_on_the_same_points(tmp_path):
    text = "x_mm,pressure_bar,temperature_C,state\n0,0,-5,0\n60,2,-3,1\n120,2,-1,3\n180,0,0,0\n"
    found = read(tmp_path, text, source="line", thesis_balance=True)
    x = found.pressure_map.x
    assert found.temperature[0] - 273.15 == pytest.approx(np.interp(x, [0, 0.06, 0.12, 0.18],
                                                                    [-5, -3, -1, 0]))  # fmt: skip
    assert set(found.state[0, x < 0.089]) == {1} and set(found.state[0, x > 0.091]) == {3}


def test_the_contact_length_is_in_the_first_row(tmp_path):
    (tmp_path / "line.csv").write_text("x_mm,pressure_bar\n0,0\n60,3\n120,0\n")
    case = FootprintCase.of({"line": str(tmp_path / "line.csv")})
    figures = summary(survey(case, read_footprint(case)))
    figures |= {"wall_s": 0.0, "case": case.model_dump(mode="json")}
    assert figures["footprint"]["contact_length_m"] == pytest.approx(0.12)
    assert FOOTPRINT.words(figures).lines[0] == ("contact length", "120 mm")


# --- lists of points

POINTS = np.column_stack([1e3 * DX * X.ravel(), 1e3 * DY * Y[::-1].ravel(), MAT.ravel()])


@pytest.mark.parametrize(
    ("heading", "columns"),
    [
        ("x_mm,y_mm,pressure_kPa", [0, 1, 2]),
        ("X [mm],Y [mm],p [kPa]", [0, 1, 2]),
        ("y (mm),CPRESS (kPa),x (mm)", [1, 2, 0]),
    ],
)
def test_a_list_of_points_is_the_map_of_its_pixels(heading, columns, tmp_path):
    found = check(read(tmp_path, heading + "\n" + rows(POINTS[::-1, columns])))
    assert any("a list of points on a regular grid" in note for note in found.notes)


def test_nodes_have_numbers_and_may_lack_where_nothing_touches(tmp_path):
    there = POINTS[POINTS[:, 2] > 0.0]
    numbered = np.column_stack([np.arange(len(there)) + 1, there])
    found = read(tmp_path, "Node;COORD1 (mm);COORD2 (mm);CPRESS (kPa)\n" + rows(numbered, ";"))
    assert found.pressure_map.load == pytest.approx(1e3 * MAT.sum() * DX * DY, rel=1e-3)


def test_a_table_of_columns_is_no_map(tmp_path):
    """Of ParaView it is a list of points; single sensors over time are no footprint."""
    view = np.column_stack([1e3 * POINTS[:, 2], 1e-3 * POINTS[:, :2], np.zeros(len(POINTS))])
    names = '"CPRESS (Pa)","Points:0","Points:1","Points:2"\n'
    size = {"length": 9 * DX, "width": 7 * DY}
    check(read(tmp_path, names + rows(view, form=".9g"), **size))
    for other in ("depth (m),p (Pa),q,r\n", "a_m,b_m,pressure_Pa,c\n"):
        with pytest.raises(SceneError, match="a map, whose columns have no names of their"):
            read(tmp_path, other + rows(view), **size)
    times = np.column_stack([0.02 * np.arange(9), np.full((9, 12), 2e5)])
    text = "time[secs]\t" + "\t".join(map(str, range(1, 13))) + "\n" + rows(times, "\t")
    with pytest.raises(SceneError, match="has the columns time.secs., 1, 2"):
        read(tmp_path, text, **size)


def test_names_of_rows_and_columns_are_no_pressures(tmp_path):
    text = "," + ",".join(f"C{n}" for n in range(9)) + "\n"
    text += "".join(f"R{n}," + line + "\n" for n, line in enumerate(rows(MAT).splitlines()))
    found = read(tmp_path, "Pressure (kPa)\n" + text, length=9 * DX, width=7 * DY)
    assert "names the rows and is left out" in check(found).notes[0]


def test_points_without_units_of_length_need_the_size(tmp_path):
    text = rows(POINTS, " ")
    size = {"length": 9 * DX, "width": 7 * DY, "pressure_unit": "kPa"}
    check(read(tmp_path, text, **size))
    with pytest.raises(SceneError, match="--length and --width are missing"):
        read(tmp_path, text, pressure_unit="kPa")
    with pytest.raises(SceneError, match="points x and y with a .kPa., b .kPa.; allowed: one"):
        read(tmp_path, "x_mm,y_mm,a (kPa),b (kPa)\n" + rows(np.c_[POINTS, POINTS[:, 2]]))
    with pytest.raises(SceneError, match="has several points at one place"):
        read(tmp_path, "x_mm,y_mm,p_kPa\n" + rows(POINTS[[*range(20), 3]]))


def test_scattered_nodes_carry_the_load_of_their_pressure(tmp_path):
    """A paraboloid of 2.5 bar over an ellipse of half axes 100 and 70 mm: half of peak and area."""
    x, y = np.random.default_rng(3).uniform(-1.2, 1.2, (2, 4000))
    p = 250.0 * np.maximum(0.0, 1.0 - x**2 - y**2)
    nodes = np.column_stack([100.0 * x, 70.0 * y, p])
    found = read(tmp_path, "x (mm),y (mm),CPRESS (kPa)\n" + rows(nodes, form=".9g"))
    assert found.pressure_map.load == pytest.approx(0.5 * 250e3 * np.pi * 0.1 * 0.07, rel=5e-3)
    assert "4000 scattered points" in found.notes[0] and "grooves narrower than" in found.notes[0]


def test_a_wide_groove_between_scattered_nodes_stays_open(tmp_path):
    x, y = np.random.default_rng(3).uniform(0.0, 100.0, (2, 4000))
    nodes = np.column_stack([x, y, np.full_like(x, 200.0)])[np.abs(x - 50.0) > 8.0]
    found = read(tmp_path, "x (mm),y (mm),p (kPa)\n" + rows(nodes, form=".9g"))
    open_columns = ~found.pressure_map.contact.any(axis=0)
    assert open_columns.sum() * found.pressure_map.dx == pytest.approx(0.016, abs=4e-3)


# --- pixels at the end of the scale


def test_saturated_sensors_are_said_and_refused_where_they_are_all_there_is(tmp_path):
    head = f"DATA_TYPE MOVIE\nROW_SPACING {DY} m\nCOL_SPACING {DX} m\nUNITS kPa\n"
    head += "SATURATION_PRESSURE {} KPa\nASCII_DATA @@\n\nFrame 1\n"

    def cut(limit, **values):
        text = head.format(limit) + rows(np.minimum(MAT, limit))
        return read(tmp_path, text, **values).notes[1:]

    part = np.mean(MAT[MAT > 0.0] >= 120.0)
    (note,) = cut(120)
    assert f"has {part:.0%} of the pixels in contact at the pressure at which its sensors" in note
    assert "mu too high by the same factor, 1.1 to 1.9" in note and "1.2 bar" in note
    (note,) = cut(120, load="900N")
    assert "mu is off by up to 5%" in note
    assert cut(300) == ()
    with pytest.raises(SceneError, match="not how hard; --load says what it carries"):
        cut(10)


def test_a_largest_value_that_many_pixels_have_is_said_wherever_it_comes_from(tmp_path):
    size = {"length": 9 * DX, "width": 7 * DY}
    for values, said in (
        (MAT, False),
        (np.minimum(MAT, 150.0), True),
        (np.full((7, 9), 200.0), False),
    ):
        notes = read(tmp_path, "p (kPa)\n" + rows(values), **size).notes
        assert any("at its largest pressure" in note for note in notes) == said
    for high, said in ((260.0, False), (150.0, True)):
        grey = np.rint(255.0 * np.minimum(MAT / high, 1.0)).astype(np.uint8)
        Image.fromarray(np.kron(grey, np.ones((8, 8), np.uint8))).save(tmp_path / "a.png")
        picture = {
            "image": str(tmp_path / "a.png"),
            "max_pressure": f"{high} kPa",
            "dark_is": "low",
        }
        notes = read_footprint(FootprintCase.of(picture | size)).notes
        assert any("at the end of its colour scale, 1.5 bar" in note for note in notes) == said


def test_mu_of_a_cut_footprint_is_too_high_by_the_load_that_is_missing(tmp_path):
    """And nearly right at the true load."""
    size = {"length": "200mm", "width": "100mm"}
    x = np.linspace(-1.0, 1.0, 40)
    whole = np.tile(2.5e5 * np.exp(-3.0 * x**2), (2, 1))
    np.save(tmp_path / "whole.npy", whole)
    np.save(tmp_path / "cut.npy", np.minimum(whole, np.median(whole)))

    def found(name, **values):
        case = FootprintCase.of({"pressure_map": str(tmp_path / f"{name}.npy"), **size, **values})
        result = survey(case, read_footprint(case))
        return result.mu_mean, result.read.pressure_map.load

    (mu, load), (cut, left) = found("whole"), found("cut")
    assert cut / mu == pytest.approx(load / left, rel=0.05) and cut > 1.2 * mu
    assert found("cut", load=load)[0] == pytest.approx(mu, rel=0.05)


# --- sensors

XSENSOR = """\
File:,tyre.xsn
Frame:,{0}
Date:,2020-03-0{0}
Time:,10:01:01.003
Sensor:,IX500:256.256.16
Rows:,7
Columns:,9
Sensel Width (cm):,1.2
Sensel Height (cm):,0.8
Average Pressure ({1}):,3.82
Peak Pressure ({1}):,12.50
COP Row:,7.50
{2}
"""


UNITS = {"N/cm2": 10.0, "kgf/cm²": 98.0665, "mmHg": 0.133322, "psi": 6.894757}


@pytest.mark.parametrize("unit", UNITS)
def test_several_frames_with_heads_of_their_own(unit, tmp_path):
    frames = [rows(part * MAT / UNITS[unit]) for part in (0.3, 1.0, 0.5)]
    text = "".join(XSENSOR.format(n, unit, frame) for n, frame in enumerate(frames, start=1))
    found = check(read(tmp_path, text))
    assert "frame 2 of 3 is read, that of the largest force" in found.notes[0]
    first = read(tmp_path, text, frame="1").pressure_map
    assert first.pressure.max() == pytest.approx(0.3e3 * MAT.max(), rel=1e-3)
    with pytest.raises(SceneError, match="frame 3 has 6 rows of 9; its head says 7 of 9"):
        read(tmp_path, text.rstrip().rpartition("\n")[0])
