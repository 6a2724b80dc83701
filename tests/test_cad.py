"""Treads of CAD files: volumes, names, sections, turns, and files that are bad."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from iceslide_fem.mesh.rubber import rounded, tagged_rubber
from iceslide_fem.mesh.soundness import Soundness
from iceslide_fem.runs.notes import notes
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.workflow.planning.mesh_picture import COLOURS
from tests.program import exit_code

ROOT = Path(__file__).parent.parent
L, W, H = 20.0, 10.0, 8.0
# mm3 of the solids, and mm2 of their middle sections
VOLUMES = {
    "slick": 1596.829, "sipes4": 1504.0, "zigzag": 1552.0, "tapered": 1697.785, "compound": 1440.0,
    "profile": 1548.781,
}  # fmt: skip
SECTIONS = {
    "slick": 159.893, "sipes4": 150.4, "zigzag": 155.2, "tapered": 163.194, "profile": 154.878,
}  # fmt: skip
# Draws bad files. gmsh's state is its process's, so it runs in one of its own.
BAD = """
import sys
import gmsh
folder = sys.argv[1]
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ

def save(name):
    occ.synchronize()
    gmsh.write(f"{folder}/{name}.step")
    gmsh.model.remove()
    gmsh.model.add("next")

def faces(gap):
    box = occ.addBox(-10, -5, 0, 20, 10, 8)
    occ.synchronize()
    sides = gmsh.model.getBoundary([(3, box)], oriented=False)
    occ.remove([(3, box)])
    if gap is None:
        occ.remove(sides[:1])
    else:
        occ.translate(sides[:1], -gap, 0, 0)

def sweep(*corners):
    points = [occ.addPoint(x, -5, z) for x, z in corners]
    pairs = zip(points, points[1:] + points[:1], strict=True)
    face = occ.addPlaneSurface([occ.addCurveLoop([occ.addLine(*pair) for pair in pairs])])
    occ.extrude([(2, face)], 0, 10, 0)

def spike(tip):
    # a box whose top is the sides of a pyramid
    box = [(x, y, z) for z in (0, 8) for x, y in ((-10, -5), (10, -5), (10, 5), (-10, 5))]
    points = [occ.addPoint(*place) for place in (*box, tip)]
    shell = [(0, 3, 2, 1), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    shell += [(4, 5, 8), (5, 6, 8), (6, 7, 8), (7, 4, 8)]
    lines, faces = {}, []
    for corners in shell:
        loop = []
        for a, b in zip(corners, corners[1:] + corners[:1]):
            if (b, a) in lines:
                loop.append(-lines[b, a])
            else:
                loop.append(lines.setdefault((a, b), occ.addLine(points[a], points[b])))
        faces.append(occ.addPlaneSurface([occ.addCurveLoop(loop)]))
    occ.addVolume([occ.addSurfaceLoop(faces)])

box, groove = occ.addBox(-10, -5, 0, 20, 10, 8), occ.addBox(4, -6, -1, 2, 12, 4)
holes = [(3, occ.addCylinder(-4, y, -1, 0, 0, 6, 1)) for y in (-2.5, 2.5)]
occ.cut([(3, box)], [(3, groove), *holes]); save("holes")
box, pocket = occ.addBox(-10, -5, 0, 20, 10, 8), occ.addBox(-2, -1, -1, 5, 3, 4)
occ.cut([(3, box)], [(3, pocket)]); save("pocket")
spike((1, 1, -3)); save("spike")
sweep((-10, 0), (10, 0), (10, 8), (-10, 8), (-10, 5), (12, 4), (-10, 3)); save("notch")
sweep((-10, 0), (10, 0), (-10, 8), (10, 8)); save("crossed")
sweep((-10, 0), (10 - 1e-6, 0), (10, 1e-6), (10, 8), (-10, 8)); save("short")
box, cone = occ.addBox(-10, -5, 0, 20, 10, 8), occ.addCone(0, 0, 0, 0, 0, 4, 2, 0)
occ.cut([(3, box)], [(3, cone)]); save("cone")
faces(None); save("open")
faces(2e-3); save("gap")
occ.addBox(0, 0, 0, 9, 9, 4); occ.addBox(0, 0, 3, 9, 9, 4); save("overlap")
occ.addBox(0, 0, 0, 9, 9, 4); occ.addBox(0, 0, 5, 9, 9, 4); save("apart")
box = occ.addBox(-10, -5, 0, 20, 10, 8)
occ.rotate([(3, box)], 0, 0, 0, 0, 1, 0, 0.1); save("tilted")
box = occ.addBox(-10, -5, 0, 20, 10, 8)
occ.rotate([(3, box)], 0, 0, 0, 1, 0, 0, 3.141592653589793)
occ.rotate([(3, box)], 0, 0, 0, 0, 0, 1, 1.5707963267948966)
occ.translate([(3, box)], 100, 50, -30); save("turned")
"""

OTHERS = """
import sys
sys.path.insert(0, sys.argv[1])
import gmsh
import make_step
gmsh.initialize(readConfigFiles=False, interruptible=False)
make_step.write("sipes4", *sys.argv[2:])
"""


@pytest.fixture(scope="module")
def treads(tmp_path_factory):
    folder = tmp_path_factory.mktemp("treads")
    words = [sys.executable, str(ROOT / "meshes" / "make_step.py"), str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    lines = [line.split() for line in done.stdout.splitlines() if line.endswith(" mm3")]
    for name, volume, _ in lines:
        assert float(volume) == pytest.approx(VOLUMES.get(name, L * W * H), abs=2e-3)
    subprocess.run([sys.executable, "-c", BAD, str(folder)], capture_output=True, check=True)
    for suffix in (".iges", ".brep"):
        subprocess.run(
            [sys.executable, "-c", OTHERS, str(ROOT / "meshes"), str(folder), suffix],
            capture_output=True, check=True,
        )  # fmt: skip
    whole = (folder / "plain.step").read_text()
    (folder / "cut_off.step").write_text(whole[: len(whole) // 2])
    (folder / "empty.step").write_text("")
    return folder


def scene(folder, name, model="block", refinement=1.0, **more):
    return scene_from_dict(
        {
            "name": "cad", "model": model,
            "rubber": {"compound": "B", "step": str(folder / f"{name}.step"), **more},
            "load": {"pressure": 1e5, "speed": 3.0, "duration": 1e-4},
            "ice": {"temperature": "-4 degC", "motion": "attached"},
            "numerics": {"refinement": refinement},
        }
    )  # fmt: skip


def measure(corners):
    """Lengths of edges, or areas of faces, by corners (n, corners, d)."""
    if corners.shape[-1] == 2:
        return np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1).sum()
    halves = [corners[:, [0, 1, 2]]]
    if corners.shape[1] == 4:
        halves.append(corners[:, [0, 2, 3]])
    sides = [(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]) for one in halves]
    return sum(0.5 * np.linalg.norm(np.cross(*pair), axis=1).sum() for pair in sides)


def volume(tagged):
    """Volume (area of a slice) by Gauss's theorem, mm3 or mm2."""
    points = 1e3 * tagged.points
    if points.shape[1] == 2:
        a, b = points[tagged.cells], np.roll(points[tagged.cells], -1, axis=1)
        return 0.5 * np.abs((a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(axis=1)).sum()
    corners = points[tagged.cells]
    split = [(0, 1, 2, 3)]
    if tagged.cell_type == "hexahedron":
        split = [(0, 1, 3, 4), (1, 2, 3, 6), (1, 3, 4, 6), (1, 4, 5, 6), (3, 4, 6, 7)]
    whole = 0.0
    for a, b, c, d in split:
        sides = [corners[:, i] - corners[:, a] for i in (b, c, d)]
        whole += np.abs(np.einsum("ij,ij->i", np.cross(sides[0], sides[1]), sides[2])).sum() / 6.0
    return whole


def areas(tagged):
    return {name: measure(1e3 * tagged.points[nodes]) for name, nodes in tagged.facets.items()}


@pytest.mark.parametrize("name", VOLUMES)
def test_a_block_has_the_volume_and_the_names_of_its_solid(treads, name):
    tagged = tagged_rubber(scene(treads, name))
    kind = "tetrahedron" if name in ("slick", "tapered") else "hexahedron"
    assert tagged.cell_type == kind
    round_edges = name in ("slick", "profile")
    # All are symmetric, and half of them is meshed; chords of round edges cut corners.
    assert 2.0 * volume(tagged) == pytest.approx(VOLUMES[name], rel=1e-3 if round_edges else 1e-6)
    assert Soundness(tagged).fault(tagged.facets["plate"]) is None
    found = areas(tagged)
    assert found["plate"] == pytest.approx(112.93 if name == "tapered" else 0.5 * L * W, rel=1e-4)
    walls = {"sipes4": 4, "profile": 2}
    if name in walls:
        less = 0.5 if name == "profile" else 0.0  # round edges are no walls
        expected = walls[name] * 2 * 0.5 * W * (6.0 - less)
        assert found["walls"] == pytest.approx(expected, rel=1e-6)
    assert ("walls" in found) == (name in (*walls, "zigzag"))
    heights = 1e3 * tagged.points[tagged.facets["contact"], -1]
    assert heights.min() == 0.0 and heights.mean(axis=1).max() < 0.5 * H


@pytest.mark.parametrize("name", SECTIONS)
def test_a_slice_has_the_area_of_its_section(treads, name):
    tagged = tagged_rubber(scene(treads, name, "slice"))
    assert tagged.cell_type == "quadrilateral"
    assert volume(tagged) == pytest.approx(SECTIONS[name], abs=4e-2)
    assert ("walls" in tagged.facets) == (name in ("sipes4", "zigzag", "profile"))


def middles(corners):
    pairs = np.stack([corners, np.roll(corners, 1, axis=1)])
    return pairs.mean(axis=0).reshape(-1, corners.shape[-1])


@pytest.mark.parametrize(("name", "model"), [("slick", "block"), ("profile", "block"),
                                             ("slick", "slice")])  # fmt: skip
def test_contact_points_at_round_edges_lie_on_the_cad(treads, name, model):
    """Chords of the arcs at the ends miss them, their moved middles do not."""
    case, radius = scene(treads, name, model), 0.5
    tagged = tagged_rubber(case)
    chords = middles(tagged.points[tagged.facets["contact"]])
    moved = rounded(case, chords)

    def depth(points):
        """How far points of the arc at the trailing end are within it, mm."""
        x, z = 1e3 * points[:, 0] + 0.5 * L - radius, 1e3 * points[:, -1] - radius
        here = (x < -1e-3) & (z < -1e-3)
        if model == "block":  # away from the arcs along x
            here &= 1e3 * points[:, 1] < 0.5 * W - 2 * radius
        return radius - np.hypot(x, z)[here]

    assert depth(chords).max() > (2e-3 if model == "block" else 1.5e-3)
    assert np.abs(depth(moved)).max() < 1e-4
    flat = 1e3 * chords[:, -1] < 1e-3
    np.testing.assert_array_equal(moved[flat], chords[flat])


def test_a_slice_is_cut_where_it_is_asked_for(treads):
    here = tagged_rubber(scene(treads, "zigzag", "slice", step_plane=1.3e-3))
    assert volume(here) == pytest.approx(155.2, abs=1e-3)
    beside = tagged_rubber(scene(treads, "compound", "slice", step_plane=2e-3))
    assert volume(beside) == pytest.approx(160.0, abs=1e-3)
    with pytest.raises(SceneError, match="4 mm above .* = 0 mm.* from -5 to -1 mm or from 1 to 5"):
        tagged_rubber(scene(treads, "compound", "slice"))
    with pytest.raises(SceneError, match="= 9 mm; allowed: -5 to 5 mm"):
        tagged_rubber(scene(treads, "zigzag", "slice", step_plane=9e-3))


def test_solids_are_layers_by_their_numbers_or_names(treads):
    base = {"name": "solid_2", "compound": "B"}
    for more, kind in (({}, "hexahedron"), ({"step_cells": "tetrahedra"}, "tetrahedron")):
        tagged = tagged_rubber(scene(treads, "compound", layers=[base], **more))
        assert tagged.cell_type == kind
        half = 2.0 if "symmetry" in tagged.facets else 1.0
        for name, expected in (("rubber", 1440.0 - 400.0), ("solid_2", 400.0)):
            part = tagged._replace(cells=tagged.cells[tagged.regions[name]])
            assert half * volume(part) == pytest.approx(expected, rel=1e-6)
    tagged = tagged_rubber(scene(treads, "compound", "slice", step_plane=2e-3, layers=[base]))
    z = 1e3 * tagged.points[tagged.cells][..., -1]
    assert (z[tagged.regions["solid_2"]].min(), z[tagged.regions["rubber"]].max()) == (
        pytest.approx(6.0), pytest.approx(6.0),
    )  # fmt: skip
    with pytest.raises(SceneError, match='no solid "cord" .* solid_1 .*0 to 6 mm high.*solid_2'):
        tagged_rubber(scene(treads, "compound", layers=[{**base, "name": "cord"}]))
    with pytest.raises(SceneError, match="touches the ice"):
        tagged_rubber(scene(treads, "compound", layers=[{**base, "name": "solid_1"}]))
    text = (treads / "compound.step").read_text()
    product = re.findall(r"PRODUCT\('([^']*)'", text)[-1]  # the upper solid
    (treads / "named.step").write_text(text.replace(f"'{product}'", "'Tread base'"))
    tagged = tagged_rubber(scene(treads, "named", layers=[{**base, "name": "tread_base"}]))
    assert set(tagged.regions) == {"rubber", "tread_base"}


def test_a_turned_file_is_the_same_tread(treads):
    tagged = tagged_rubber(scene(treads, "turned", step_up="-z", step_along="y"))
    plain = tagged_rubber(scene(treads, "plain"))
    assert volume(tagged) == pytest.approx(volume(plain))
    np.testing.assert_allclose(np.ptp(tagged.points, axis=0), np.ptp(plain.points, axis=0))
    across = tagged_rubber(scene(treads, "plain", step_along="y"))
    assert 1e3 * np.ptp(across.points[:, 0]) == pytest.approx(W)


@pytest.mark.parametrize(("suffix", "unit"), [(".iges", 1e-3), (".brep", 1e-2)])
def test_other_formats_are_the_same_tread(treads, suffix, unit):
    """BREP says no unit."""
    step = str(treads / f"sipes4{suffix}")
    tagged = tagged_rubber(scene(treads, "plain", step=step, step_unit=unit))
    scale = 1.0 if suffix == ".iges" else 1e3
    assert 2.0 * volume(tagged) == pytest.approx(scale * VOLUMES["sipes4"], rel=1e-6)


def test_the_end_with_more_flat_area_is_up(treads):
    """Of `compound` the base, and the round edges of `slick` are at the ice."""
    for name in ("compound", "slick"):
        tagged = tagged_rubber(scene(treads, name))
        assert areas(tagged)["plate"] == pytest.approx(0.5 * L * W)


def test_finer_cells_and_other_ones(treads):
    coarse, fine = (len(tagged_rubber(scene(treads, "plain", refinement=r)).cells) for r in (1, 2))
    assert fine > 4 * coarse
    other = tagged_rubber(scene(treads, "plain", step_cells="tetrahedra"))
    assert other.cell_type == "tetrahedron" and volume(other) == pytest.approx(0.5 * L * W * H)
    with pytest.raises(SceneError, match="no sweep along y and has faces that are neither flat"):
        tagged_rubber(scene(treads, "tapered", step_cells="hexahedra"))


def test_a_pocket_is_left_out_of_a_grid(treads):
    tagged = tagged_rubber(scene(treads, "pocket"))
    assert tagged.cell_type == "hexahedron" and "symmetry" not in tagged.facets
    assert volume(tagged) == pytest.approx(L * W * H - 5.0 * 3.0 * 3.0)
    found = areas(tagged)
    assert found["plate"] == pytest.approx(L * W)
    assert found["walls"] == pytest.approx(2.0 * 5.0 * 3.0)  # those across 3 mm, not 5 mm
    assert len(np.unique(tagged.points[:, 0])) * len(np.unique(tagged.points[:, 1])) < 400


@pytest.mark.parametrize(("name", "sipes"), [("plain", ()), ("sipes4", (-6, -2, 2, 6))])
def test_straight_treads_have_the_cells_of_built_in_ones(treads, name, sipes):
    drawn = tagged_rubber(scene(treads, name))
    size = {"length": 1e-3 * L, "width": 1e-3 * W, "height": 1e-3 * H}
    cuts = [{"position": 1e-3 * x, "width": 0.4e-3, "depth": 6e-3} for x in sipes]
    same = scene(treads, name).model_dump(exclude_unset=True)
    same["rubber"] = {"compound": "B", **size, "sipes": cuts}
    built_in = tagged_rubber(scene_from_dict(same))

    def middles(facets, tagged):
        found = np.round(1e6 * tagged.points[facets].mean(axis=1))
        return found[np.lexsort(found.T)]

    np.testing.assert_array_equal(middles(drawn.cells, drawn), middles(built_in.cells, built_in))
    assert drawn.facets.keys() == built_in.facets.keys()
    for part, facets in drawn.facets.items():
        of_other = middles(built_in.facets[part], built_in)
        np.testing.assert_array_equal(middles(facets, drawn), of_other)


def test_layers_follow_sections_of_any_outline(treads):
    """Round blind holes and a groove across of another depth: cells end at each of their ends."""
    tagged = tagged_rubber(scene(treads, "holes"))
    assert tagged.cell_type == "hexahedron"
    left = L * W * H - 2.0 * np.pi * 5.0 - 2.0 * W * 3.0
    assert 2.0 * volume(tagged) == pytest.approx(left, rel=1e-3)
    found = areas(tagged)
    assert found["plate"] == pytest.approx(0.5 * L * W)
    assert found["walls"] == pytest.approx(W * 3.0 + 2.0 * np.pi * 5.0, rel=2e-2)
    depths = 1e3 * np.unique(tagged.points[:, 2])
    assert all(np.abs(depths - depth).min() < 1e-6 for depth in (3.0, 5.0))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("open", "has no solid: its faces do not close, one may be missing"),
        ("gap", 'rubber.step_heal = "10 um" closes its gaps'),
        ("overlap", "has solids that overlap"),
        ("apart", "has 2 solids that do not touch"),
        ("tilted", "has no flat top"),
        ("spike", "has faces that cut each other"),
        ("notch", "has faces that cut each other"),
        ("crossed", "has faces that cut each other"),
        ("short", r"has an edge of 1.4e-06 mm at \(10, .*\) mm, too short for cells"),
        ("cut_off", "cut off"),
        ("empty", "cut off"),
    ],
)
def test_a_bad_file_gets_a_sentence(treads, name, said):
    with pytest.raises(SceneError, match=said) as caught:
        tagged_rubber(scene(treads, name))
    assert str(treads / f"{name}.step") in str(caught.value)


def test_what_is_healed_or_only_pointed_is_meshed(treads):
    healed = tagged_rubber(scene(treads, "short", step_heal=1e-6))
    assert 2.0 * volume(healed) == pytest.approx(L * W * H)
    pointed = tagged_rubber(scene(treads, "cone"))
    assert 2.0 * volume(pointed) == pytest.approx(L * W * H - np.pi * 16.0 / 3.0, rel=1e-3)


def test_gaps_are_closed_if_it_is_asked_for(treads):
    tagged = tagged_rubber(scene(treads, "gap", step_heal=1e-5))
    whole = volume(tagged) * (2.0 if "symmetry" in tagged.facets else 1.0)
    assert whole == pytest.approx(L * W * H, rel=1e-3)


def test_other_suffixes_and_keys_are_refused(treads, tmp_path):
    (tmp_path / "tread.stl").write_text("solid")
    with pytest.raises(SceneError, match="another suffix"):
        scene(treads, "plain", step=str(tmp_path / "tread.stl"))
    with pytest.raises(SceneError, match="contradict"):
        scene(treads, "plain", mesh=str(ROOT / "meshes" / "siped_block.msh"))
    said = notes(scene(treads, "plain", length=5e-3, step_plane=1e-3))
    assert any("rubber.length" in one and "rubber.step" in one for one in said)
    assert any("rubber.step_plane" in one for one in said)


def scene_file(folder, step):
    text = (
        'name = "cad"\nmodel = "block"\n[rubber]\ncompound = "B"\n'
        f'step = "{step}"\n[load]\npressure = "1 bar"\nspeed = "3 m/s"\n'
        'duration = "1 ms"\n[ice]\ntemperature = "-4 degC"\nmotion = "attached"\n'
    )
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def test_info_draws_a_tread(treads, tmp_path, capsys):
    picture = tmp_path / "tread.png"
    path = scene_file(tmp_path, treads / "zigzag.step")
    assert exit_code("info", path, "--picture", picture) == 0
    said = capsys.readouterr().out
    assert "from CAD" in said and "z of the file" in said and "larger flat end" in said
    pixels = imread(picture)[100:, :, :3]  # below the legend
    walls = np.abs(pixels - to_rgb(COLOURS["walls"])).max(axis=2) < 0.02
    assert walls.sum() > 2000  # those of both sipes, over what is behind them


@pytest.mark.parametrize("name", ["spike", "short"])
def test_a_run_of_a_bad_file_ends_with_a_sentence_and_writes_nothing(
    treads, tmp_path, capsys, name
):
    path = scene_file(tmp_path, treads / f"{name}.step")
    assert exit_code("run", path, "--out", tmp_path / "run") == 2
    assert f"rubber.step {treads / name}.step has " in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
