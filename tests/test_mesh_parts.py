"""Parts of users' meshes that have lost facets: plate, symmetry plane, contact."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from mesh_writers import write_mesh  # noqa: E402

from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import (  # noqa: E402
    mesh_patches,
    rectangle,
    with_parts,  # noqa: E402
)
from iceslide_fem.mesh.user_mesh import load_user_mesh  # noqa: E402
from iceslide_fem.runs.doubts import before_run  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.quick]
MM = 1e-3
ROOT = Path(__file__).parent.parent


def siped(dim, **parts):
    """A block of 4 x 4 x 2 mm with a sipe at the middle, 0.4 mm wide and 1 mm deep, whose parts are
    chosen by the middles of facets, in mm.
    """
    left, right = np.linspace(-2, -0.2, 7), np.linspace(0.2, 2, 7)
    above, below = np.linspace(1, 2, 4), np.linspace(0, 1, 4)
    spans = [(left, below), (right, below), (left, above), (right, above)]
    spans.append((np.array([-0.2, 0.2]), above))
    y = np.linspace(-2, 2, 5) if dim == 3 else None
    points, cells = mesh_patches([rectangle(MM * x, MM * z) for x, z in spans], _mm(y))
    chosen = {
        "plate": lambda m: m[:, -1] > 1.99,
        "contact": lambda m: (m[:, -1] < 0.01) | ((m[:, -1] < 1) & (abs(m[:, 0]) > 1.99)),
        **parts,
    }
    choosers = {
        name: lambda corners, choose=choose: choose(corners.mean(axis=1) / MM)
        for name, choose in chosen.items()
    }
    return with_parts(points, cells, "rubber", choosers)


def _mm(y):
    return None if y is None else MM * y


def read(tagged, folder):
    gmsh_model.save(tagged, folder / "block.msh")
    return load_user_mesh(folder / "block.msh", tagged.points.shape[1])


def contact(m):
    return (m[:, -1] < 0.01) | ((m[:, -1] < 1) & (abs(m[:, 0]) > 1.99))


def walls(m):
    return (abs(m[:, 0]) < 0.21) & (m[:, -1] < 0.99) & (m[:, -1] > 0.01)


def ceiling(m):
    return (abs(m[:, 0]) < 0.1) & (m[:, -1] < 1.01)


def across(m):
    return m[:, 1] if m.shape[1] == 3 else np.zeros(len(m))


def sides_in_y(m):
    return (abs(across(m)) > 1.99) & (m[:, -1] < 1) & (m[:, -1] > 0.01)


TAKEN = {
    "nameless walls of the sipe": {},
    "named walls, nameless end of the sipe": {"walls": walls},
    "walls in contact, nameless end": {"contact": lambda m: contact(m) | walls(m)},
    "half of one wall nameless": {
        "contact": lambda m: contact(m) | (walls(m) & ((m[:, 0] < 0) | (m[:, -1] < 0.5)))
    },
    "the whole sipe in contact": {"contact": lambda m: contact(m) | walls(m) | ceiling(m)},
    "no side in contact": {"contact": lambda m: m[:, -1] < 0.01},
    "one end higher than the other": {
        "contact": lambda m: contact(m) | ((m[:, 0] > 1.99) & (m[:, -1] < 1.99))
    },
}


@pytest.mark.parametrize("case", TAKEN)
@pytest.mark.parametrize("dim", [2, 3])
def test_whole_parts_are_taken(dim, case, tmp_path):
    wanted = siped(dim, **TAKEN[case])
    found = read(wanted, tmp_path)
    assert {name: len(part) for name, part in found.facets.items()} == {
        name: len(part) for name, part in wanted.facets.items()
    }


LOST = {  # what is lost, and a place in x and z (mm) near which it is
    'is part of the top and not tagged "plate"': (
        {"plate": lambda m: (m[:, -1] > 1.99) & ((m[:, 0] < 1.7) | (m[:, 0] > 2))},
        (1.85, 2.0),
    ),
    'lies on the ice and is not tagged "contact"': (
        {"contact": lambda m: contact(m) & ~((m[:, -1] < 0.01) & (abs(m[:, 0] - 0.35) < 0.05))},
        (0.35, 0.0),
    ),
    "begins at the ice and has no name": (
        {"contact": lambda m: contact(m) & (m[:, 0] < 1.99)},
        (2.0, 1 / 6),
    ),
    "begins at the ice and has no name, ": (
        {"contact": lambda m: contact(m) & ((m[:, 0] < 1.99) | (m[:, -1] > 0.2))},
        (2.0, 1 / 6),
    ),
}


@pytest.mark.parametrize("said", LOST)
@pytest.mark.parametrize("dim", [2, 3])
def test_parts_that_have_lost_facets_are_refused(dim, said, tmp_path):
    parts, place = LOST[said]
    with pytest.raises(SceneError) as refusal:
        read(siped(dim, **parts), tmp_path)
    message = str(refusal.value)
    assert said.strip(", ") in message and message.isprintable()
    x, *_, z = (float(word) for word in message.split("near (")[1].split(")")[0].split(","))
    np.testing.assert_allclose((x, z), np.array(place) * MM, atol=1e-9)


def test_sides_across_the_slide_may_be_free_but_not_one_of_them(tmp_path):
    assert read(siped(3, contact=lambda m: contact(m) | sides_in_y(m)), tmp_path)
    with pytest.raises(SceneError, match="begins at the ice and has no name"):
        read(siped(3, contact=lambda m: contact(m) | (sides_in_y(m) & (m[:, 1] > 0))), tmp_path)


@pytest.mark.parametrize("shape", ["bore", "round corners"])
def test_nameless_bores_and_sides_beside_round_corners_are_taken(shape, tmp_path):
    """Contact is the lower face and all sides (bore), or the ends with their round corners."""
    with gmsh_model.empty_model() as model:
        block = model.occ.addBox(-2 * MM, -2 * MM, 0, 4 * MM, 4 * MM, 2 * MM)
        if shape == "bore":
            bore = model.occ.addCylinder(0, -3 * MM, MM, 0, 6 * MM, 0, 0.5 * MM)
            model.occ.cut([(3, block)], [(3, bore)])
            model.occ.synchronize()
        else:
            model.occ.synchronize()
            boxes = {edge: model.getBoundingBox(*edge) for edge in model.getEntities(1)}
            upright = [tag for (_, tag), span in boxes.items() if span[5] - span[2] > MM]
            model.occ.fillet([block], upright, [0.5 * MM])
            model.occ.synchronize()
        parts = {"plate": [], "contact": []}
        for dim, face in model.getBoundary(model.getEntities(3), oriented=False):
            x, y, low, to_x, to_y, high = (value / MM for value in model.getBoundingBox(dim, face))
            if low > 1.9:
                parts["plate"].append(face)
            elif high < 0.1 or (to_x - x < 0.6 if shape != "bore" else abs(x + to_x) > 0.1):
                parts["contact"].append(face)
            elif shape == "bore" and to_y - y < 0.1:
                parts["contact"].append(face)
        for name, faces in parts.items():
            model.addPhysicalGroup(2, faces, name=name)
        model.addPhysicalGroup(3, [tag for _, tag in model.getEntities(3)], name="rubber")
        gmsh = pytest.importorskip("gmsh")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5 * MM)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 12)
        model.mesh.generate(3)
        gmsh.write(str(tmp_path / "own.msh"))
    assert len(parts["plate"]) == 1
    assert len(parts["contact"]) == {"bore": 1 + 4, "round corners": 1 + 2 + 4}[shape]
    assert set(load_user_mesh(tmp_path / "own.msh", 3).facets) == {"contact", "plate"}


def test_all_of_the_symmetry_plane_is_named(tmp_path):
    whole = siped(3, symmetry=lambda m: m[:, 1] < -1.99)
    half = whole._replace(points=whole.points + [0, 2 * MM, 0])
    assert len(read(half, tmp_path).facets["symmetry"]) == 12 * 6 + 3
    part = half._replace(facets={**half.facets, "symmetry": half.facets["symmetry"][1:]})
    with pytest.raises(SceneError, match='is at y = 0 and not tagged "symmetry"'):
        read(part, tmp_path)


@pytest.mark.parametrize("model", ["slice", "block"])
@pytest.mark.parametrize(
    "shape", ["", "edge_radius=0.5mm", "chamfer=0.5mm", "draft_angle=5deg", "sipes=2"]
)
def test_built_in_shapes_are_whole(shape, model, tmp_path):
    sizes = ["rubber.length=20mm", "rubber.width=10mm", "rubber.height=6mm"]
    if shape.startswith("sipes"):
        sizes += ["rubber.sipe_width=0.6mm", "rubber.sipe_depth=4mm"]
    changes = [f"model={model}", "numerics.refinement=0.5", *sizes]
    changes += [f"rubber.{shape}"] if shape else []
    path = write_mesh(load_scene(ROOT / "cases" / "tread_block.toml", changes), tmp_path)[0]
    assert "contact" in load_user_mesh(path, 2 if model == "slice" else 3).facets


def test_info_says_that_no_side_can_touch_the_ice(tmp_path):
    said = []
    for name, parts in (("all", {}), ("lowest", {"contact": lambda m: m[:, -1] < 0.01})):
        gmsh_model.save(siped(2, **parts), tmp_path / f"{name}.msh")
        changes = ["model=slice", f"rubber.mesh={tmp_path / f'{name}.msh'}"]
        scene = load_scene(ROOT / "cases" / "thesis_1bar.toml", changes)
        said.append(any("its sides pass through the ice" in note for note in before_run(scene)))
    assert said == [False, True]
