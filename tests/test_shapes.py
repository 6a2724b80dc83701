"""Shapes of the built-in block: cut edges, sipes, grooves, outlines; what can't be meshed."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from iceslide_fem.cli import main  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.fenics.start import start_petsc  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.press import press  # noqa: E402
from iceslide_fem.mesh.profile import block_mesh  # noqa: E402
from iceslide_fem.mesh.rubber import (  # noqa: E402
    block_shape,
    divisions,
    nominal_area,
    rounded,
    tagged_rubber,  # noqa: E402
)
from iceslide_fem.mesh.shape import Wave, leaned, straightened  # noqa: E402
from iceslide_fem.mesh.soundness import Soundness, shape_gradients  # noqa: E402
from iceslide_fem.mesh.tagged import mesh_size, smallest_angle  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.workflow.planning.mesh_picture import draw_mesh  # noqa: E402

pytestmark = pytest.mark.fe

CASE = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
TREAD = ["rubber.length=20mm", "rubber.width=16mm", "rubber.height=8mm", "numerics.refinement=0.5"]


def sipe(position, depth, more=""):
    return f"{{position='{position}', width='0.4 mm', depth='{depth}'{more}}}"


LEANING = sipe("-5 mm", "6 mm", ", angle='15 deg'")
WAVING = sipe("0 mm", "5 mm", ", wave='zigzag', amplitude='0.6 mm', wavelength='4 mm'")
DEEP_WAVE = sipe(
    "5 mm", "4 mm", ", wave='wave', along='depth', amplitude='0.3mm', wavelength='2mm'"
)


def scene(*changes):
    return load_scene(CASE, [change.strip() for change in changes])


def volume(tagged):
    """By the divergence theorem over all outer facets (first-order: exact for plane facets)."""

    gradients = shape_gradients(tagged.cell_type)
    corners = tagged.points[tagged.cells].swapaxes(1, 2)
    det = np.abs(np.linalg.det(corners[:, None] @ gradients))
    simpson = np.array([1.0, 4.0, 1.0]) / 3.0
    weights = simpson
    for _ in range(tagged.points.shape[1] - 1):
        weights = np.multiply.outer(weights, simpson)
    return float((det @ weights.ravel()).sum())


@pytest.mark.parametrize("model", ["slice", "block"])
@pytest.mark.parametrize(
    ("changes", "left_out"),
    [
        ((), 0.0),
        (("rubber.edge_radius=1mm",), 2 * (1 - np.pi / 4) * 1.0),
        (("rubber.chamfer=1mm",), 1.0),
        ((f"rubber.sipes=[{LEANING},{WAVING},{DEEP_WAVE}]",), 0.4 * 15),
        (("rubber.draft_angle=5deg",), -8.0 * 8 * np.tan(np.radians(5))),
    ],
)
def test_a_shape_has_its_volume(model, changes, left_out):
    given = scene(f"model={model}", *TREAD, *changes)
    block = block_shape(given)
    tagged = tagged_rubber(given)
    assert Soundness(tagged).fault(tagged.facets["plate"]) is None
    profile = 20.0 * 8.0 - left_out
    width = 1.0 if model == "slice" else 8e-3
    if block.draft and model == "block":  # a pyramid's stump
        low, high = 20.0 * 16.0, (20 + 16 * block.draft) * (16 + 16 * block.draft)
        profile, width = 8.0 / 3.0 * (low + high + np.sqrt(low * high)) / 16.0, 8e-3
    if block.edge and model == "block":  # the edge along the side, too
        profile -= left_out / 2 * 20.0 / 8.0
    # Polygons of a few cells stand for arcs and waves.
    assert volume(tagged) == pytest.approx(profile * 1e-6 * width, rel=3e-3)
    assert nominal_area(given) == pytest.approx(20e-3 * width)
    assert smallest_angle(tagged) > 35.0
    assert ("walls" in tagged.facets) == bool(block.slots)


GROOVE = "rubber.grooves=[{position='4 mm', width='2 mm', depth='4 mm'}]"


def test_edges_are_cut_all_around_every_lug_of_a_block():
    tagged = tagged_rubber(scene("model=block", *TREAD, "rubber.chamfer=0.5mm", GROOVE))
    assert Soundness(tagged).fault(tagged.facets["plate"]) is None
    section, moment = 0.5**2 / 2, 0.5**3 / 6  # of what is cut off, about the side
    middle = section * (2 * 3.0 + 20.0) - 4 * moment  # half of the lug in the middle
    beside = section * 2 * (3.0 + 20.0) - 8 * moment
    assert volume(tagged) == pytest.approx((20 * 8 * 8 - 20 * 2 * 4 - middle - beside) * 1e-9)
    bottom = tagged.points[tagged.points[:, 2] == 0.0]
    assert sorted({*np.round(bottom[np.abs(bottom[:, 0]) < 9e-3, 1], 9)})[0] == 0.0
    at_sides = np.abs(bottom[:, 0]).max(), bottom[:, 1].max()
    assert at_sides == pytest.approx((9.5e-3, 7.5e-3))
    assert not ((bottom[:, 1] > 2.5001e-3) & (bottom[:, 1] < 5.4999e-3)).any()
    walls = tagged.points[tagged.facets["walls"]]
    assert set(np.round(walls[..., 1].ravel(), 9)) == {3e-3, 5e-3}


@pytest.mark.parametrize("model", ["slice", "block"])
@pytest.mark.parametrize(
    "changes", [("rubber.edge_radius=0.5mm",), ("rubber.chamfer=30um", f"rubber.sipes=[{LEANING}]")]
)
def test_cells_of_a_shape_are_counted_without_a_mesh(model, changes):
    given = scene(f"model={model}", *TREAD, *changes)
    found, built = divisions(given), mesh_size(tagged_rubber(given))
    for name in ("cells", "quadratic_nodes"):
        assert found[name] == built[name]


@pytest.mark.parametrize(
    "change",
    ["rubber.edge_radius=20um", f"rubber.sipes=[{WAVING}]", f"rubber.sipes=[{DEEP_WAVE}]", GROOVE],
)
def test_refinement_scales_the_cells_of_all_that_is_cut(change):
    """Waves and edges that are small had as many cells on any mesh."""
    block = ["model=block", *TREAD[:3], change]
    one, two = (divisions(scene(*block, f"numerics.refinement={n}"))["cells"] for n in (1, 2))
    assert two > 6 * one


def test_round_edges_leave_the_bottom_flat_between_them():
    tagged = tagged_rubber(scene("model=slice", "rubber.edge_radius=50um"))
    bottom = tagged.points[tagged.points[:, 1] == 0.0, 0]
    assert bottom.min() == pytest.approx(-0.45e-3) and bottom.max() == pytest.approx(0.45e-3)
    arc = tagged.points[tagged.facets["contact"]].reshape(-1, 2)
    arc = arc[(arc[:, 0] > 0.4501e-3) & (arc[:, 1] < 49.9e-6)]
    distance = np.hypot(arc[:, 0] - 0.45e-3, arc[:, 1] - 50e-6)
    assert len(arc) and distance == pytest.approx(50e-6)


def test_across_a_flat_bottom_lie_fewer_points_of_the_contact():
    """Below round edges the contact may end anywhere on a facet."""
    start_petsc()
    changes = ["model=block", "numerics.refinement=0.5"]
    sharp, round_ = (
        build_block(scene(*changes, f"rubber.edge_radius={radius}"), MPI.COMM_SELF).surface
        for radius in ("0um", "100um")
    )
    assert sharp.shape.shape[1] == 8 * 6 and round_.shape.shape[1] == 8 * 8


def test_a_block_with_round_edges_stands_on_what_is_flat():
    start_petsc()
    changes = ["model=block", "numerics.refinement=0.5", "rubber.edge_radius=100um"]
    block = build_block(scene(*changes, "load.pressure=0.02bar"), MPI.COMM_SELF)
    press(block, lambda _: None)
    contact = block.contact
    touching = (contact.pressure > 0.0).astype(float)
    assert block.total(touching, contact.area) == pytest.approx(0.8e-3**2, rel=0.05)
    assert block.normal_force(contact) == pytest.approx(0.02e5 * 1e-3**2, rel=1e-3)
    assert block.posture().sides == 0.0


@pytest.mark.parametrize("model", ["slice", "block"])
def test_contact_is_on_the_arc_between_corners_of_cells(model):
    """It was on the chords, 2 and 8 um inside, and their corners carried."""
    changes = [f"model={model}", "numerics.refinement=0.5", "rubber.edge_radius=100um"]
    block = build_block(scene(*changes), MPI.COMM_SELF)
    at = 1e6 * block.surface.positions(np.zeros_like(block.rubber.displacements))
    out = np.max(np.abs(at[..., :-1]) - 400.0, axis=-1)
    arc = (out > 0.0) & (at[..., -1] < 100.0)
    away = np.hypot(out[arc], 100.0 - at[..., -1][arc])
    assert away.size > 20 and np.abs(away - 100.0).max() < 0.5


def test_leaning_blocks_are_straightened_and_their_edges_stay_round():
    more = [f"rubber.sipes=[{LEANING}, {WAVING}]", "rubber.draft_angle=3deg"]
    more += ["rubber.edge_radius=0.2mm", "numerics.refinement=0.25"]
    case = scene("model=block", *TREAD[:3], *more)
    tagged, shape = tagged_rubber(case), block_shape(case)
    points = straightened(shape, tagged.points)
    np.testing.assert_allclose(leaned(shape, points), tagged.points, rtol=0, atol=1e-15)
    corners = tagged.points[tagged.facets["contact"]]
    np.testing.assert_allclose(rounded(case, corners), corners, rtol=0, atol=1e-15)
    middles = corners.mean(axis=1)
    assert 1e-6 < np.abs(rounded(case, middles) - middles).max() < 25e-6


def test_finer_meshes_have_rounder_edges():
    def chords(refinement, radius=50):
        changes = [f"rubber.edge_radius={radius}um", f"numerics.refinement={refinement}"]
        tagged = tagged_rubber(scene("model=slice", *changes))
        corners = tagged.points[tagged.facets["contact"]]
        way = np.abs(corners[:, 1] - corners[:, 0])
        return int(((way > 1e-9).all(axis=1)).sum())

    assert chords(2) == pytest.approx(2 * chords(1), abs=4) and chords(4) > 1.8 * chords(2)
    assert chords(2, radius=10) == 2 * chords(1, radius=10)


def test_a_groove_is_cut_along_the_block():
    plain, grooved = (
        tagged_rubber(scene("model=block", *TREAD, *more)) for more in ((), (GROOVE,))
    )
    assert volume(plain) - volume(grooved) == pytest.approx(20e-3 * 2e-3 * 4e-3)
    walls = grooved.points[grooved.facets["walls"]]
    assert set(np.round(walls[..., 1].ravel(), 9)) == {3e-3, 5e-3}


def test_waves_begin_at_a_crest_and_zigzags_are_straight():
    y = np.linspace(0.0, 4.0, 9)
    assert Wave(2.0, 4.0, False, True).at(y)[::2] == pytest.approx([2, 0, -2, 0, 2], abs=1e-12)
    assert Wave(2.0, 4.0, True, True).at(y) == pytest.approx([2, 1, 0, -1, -2, -1, 0, 1, 2])
    assert Wave(2.0, 4.0, True, False).at(y)[:4] == pytest.approx([0, 1, 2, 1], abs=1e-12)


@pytest.mark.parametrize("wave", ["wave", "zigzag"])
def test_walls_reach_the_crests_of_their_waves(wave):
    """Crests between two nodes were cut off, up to a quarter of them."""
    sipes = f"rubber.sipes=[{WAVING.replace('zigzag', wave)}]"
    walls = (tagged := tagged_rubber(scene("model=block", *TREAD, sipes))).facets["walls"]
    x = tagged.points[walls][..., 0]
    assert (x.min(), x.max()) == pytest.approx((-0.8e-3, 0.8e-3))


def outline(folder, rows):
    path = folder / "block.csv"
    path.write_text("x_m,y_m,ring\n" + "\n".join(rows))
    return f"rubber.outline={path}"


SQUARE = ["-5e-3,-4e-3,1", "5e-3,-4e-3,1", "5e-3,4e-3,1", "-5e-3,4e-3,1"]
HOLE = ["-1e-3,-1e-3,2", "1e-3,-1e-3,2", "1e-3,1e-3,2", "-1e-3,1e-3,2"]
ELLIPSE = [
    f"{3e-3 * np.cos(t)},{2.5e-3 * np.sin(t)},1" for t in np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
]  # area 1/2 n sin(2 pi / n) a b


@pytest.mark.parametrize(
    ("rows", "area", "half"),
    [
        (SQUARE, 80e-6, True),
        (SQUARE + HOLE, 76e-6, True),
        (SQUARE + HOLE[::-1], 76e-6, True),
        (SQUARE[::-1] + HOLE, 76e-6, True),
        (ELLIPSE, 12 * np.sin(np.pi / 12) * 7.5e-6, True),  # its sides are shorter than cells
        (["-5e-3,-4e-3,1", "5e-3,-4e-3,1", "3e-3,4e-3,1"], 40e-6, False),
    ],
)
def test_a_block_of_any_outline(tmp_path, rows, area, half):
    changes = ["rubber.height=3mm", "numerics.refinement=0.5", outline(tmp_path, rows)]
    tagged = tagged_rubber(scene("model=block", *changes))
    assert ("symmetry" in tagged.facets) == half
    assert volume(tagged) == pytest.approx(area * 3e-3 / (2 if half else 1))
    assert tagged.cell_type == "hexahedron" and smallest_angle(tagged) > 20.0


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (["0,0,1", "1e-3,1e-3,1", "1e-3,0,1", "0,0.7e-3,1"], "crosses or touches itself"),
        (["0,0,1", "1e-3,0,1"], "three corners"),
        (["0,0,1", "1,0,1", "1,1,1"], "is 1 m large"),
        (["0,0,1", "1e-3,x,1", "1e-3,0,1"], "row 2"),
        ([*SQUARE, "8e-3,0,2", "9e-3,0,2", "9e-3,1e-3,2"], "two separate parts"),
        (["0,0,1", "nan,0,1", "1e-3,1e-3,1"], "not all finite"),
    ],
)
def test_outlines_that_are_none(tmp_path, rows, words):
    with pytest.raises(SceneError, match=words):
        scene("model=block", outline(tmp_path, rows))


def test_an_outline_has_sharp_edges(tmp_path):
    with pytest.raises(SceneError, match="an outline has sharp edges and upright sides"):
        scene("model=block", outline(tmp_path, SQUARE), "rubber.edge_radius=50um")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["rubber.edge_radius=0.3mm"], "rubber.edge_radius = 0.3 mm is too large"),
        (["rubber.width=0.2mm", "rubber.edge_radius=50um"], "up to 0.04 mm, 0.2 of its width"),
        (["rubber.edge_radius=1nm"], "rubber.edge_radius = 0.001 um is too small"),
        (["rubber.edge_radius=50um", "rubber.chamfer=50um"], "contradict each other"),
        (["rubber.sipes=12"], "rubber.sipes = 12"),
        (["rubber.sipes=[{position='0 mm', width='0.1 mm'}]"], r"rubber.sipes.0.depth is missing"),
        (
            [f"rubber.sipes=[{sipe('0.2 mm', '0.5 mm')}, {sipe('-0.2 mm', '0.95 mm')}]"],
            "rubber.sipes.1.depth = 0.95 mm is too deep",
        ),
        (
            ["rubber.sipes=1", "rubber.sipe_width=0.1mm", "rubber.sipe_depth=0.95mm"],
            "rubber.sipe_depth = 0.95 mm is too deep",
        ),
        (
            ["rubber.grooves=[{position='0 m', width='0.2 mm', depth='0.95mm'}]"],
            "rubber.grooves.0.depth = 0.95 mm is too deep",
        ),
        ([f"rubber.sipes=[{sipe('0.4 mm', '0.5 mm')}]"], "overlap"),
        (
            ["rubber.grooves=[{position='0.1 mm', width='0.4 mm', depth='0.5mm'}]"],
            "grooves overlap",
        ),
    ],
)
def test_shapes_that_do_not_fit_are_refused(changes, words):
    with pytest.raises(SceneError, match=words):
        scene(*changes)


def test_sipes_that_lean_into_each_other_are_refused():
    crossing = [
        sipe("-5 mm", "6 mm", ", angle='35 deg'"),
        sipe("-2 mm", "6 mm", ", angle='-35 deg'"),
    ]
    given = scene("model=slice", *TREAD, f"rubber.sipes=[{','.join(crossing)}]")
    with pytest.raises(SceneError, match="overlap each other, or cells beside them do, near"):
        block_mesh(block_shape(given), 0.5)


@pytest.mark.parametrize("model", ["slice", "block"])
def test_info_draws_the_mesh(model, tmp_path, capsys):
    picture = tmp_path / "pictures" / "mesh.png"
    words = ["info", str(CASE), "--set", f"model={model}", "--set", "rubber.edge_radius=50um"]
    with pytest.raises(SystemExit) as caught:
        main([*words, "--picture", str(picture)])
    assert caught.value.code == 0 and picture.stat().st_size > 20_000
    printed = capsys.readouterr().out
    assert "smallest angle" in printed and str(picture) in printed.replace("\n", "")


def test_a_point_has_no_mesh_to_draw(tmp_path):
    with pytest.raises(SceneError, match="has none"):
        draw_mesh(scene("model=point"), tmp_path / "mesh.png")
