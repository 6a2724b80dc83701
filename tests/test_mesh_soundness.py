"""Users' meshes whose cells do not fill a body once, and files that are no meshes but scripts."""

from pathlib import Path
from typing import get_args

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from mesh_writers import write_sets  # noqa: E402

from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import tensor_grid  # noqa: E402
from iceslide_fem.mesh.readers import UNITS  # noqa: E402
from iceslide_fem.mesh.soundness import Soundness  # noqa: E402
from iceslide_fem.mesh.tagged import TaggedMesh  # noqa: E402
from iceslide_fem.mesh.user_mesh import load_user_mesh  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import Rubber, load_scene  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.quick]
ROOT = Path(__file__).parent.parent
KINDS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]
TETRAHEDRA = [(0, 1, 2, 6), (0, 1, 5, 6), (0, 3, 2, 6), (0, 3, 7, 6), (0, 4, 5, 6), (0, 4, 7, 6)]


def cut(box):
    """The simplices of a grid of quadrilaterals or hexahedra."""
    if box.cell_type == "quadrilateral":
        corners, kind = [(0, 1, 2), (0, 2, 3)], "triangle"
        facets = box.facets
    else:
        corners, kind = TETRAHEDRA, "tetrahedron"
        facets = {}
    cells = box.cells[:, corners].reshape(-1, len(corners[0]))
    simplices = box._replace(cell_type=kind, cells=cells, facets=facets)
    if facets:
        return simplices
    outer = Soundness(simplices).outer
    centre = box.points[outer].mean(axis=1)
    return simplices._replace(
        facets={
            "contact": outer[centre[:, -1] < 0.6e-3],
            "plate": outer[np.isclose(centre[:, -1], 1e-3)],
        }
    )


def box(kind, x=(-1e-3, 1e-3), cells=4, z=(0.0, 1e-3), y=(-1e-3, 1e-3)):
    """A block of 2 x (2 x) 1 mm of cells of a kind, as it should be."""
    lines = [np.linspace(*x, cells + 1), np.linspace(*y, 4), np.linspace(*z, 4)]
    flat = kind in ("triangle", "quadrilateral")
    parts = {
        "contact": lambda centre: centre[:, -1] < 0.6e-3,
        "plate": lambda centre: np.isclose(centre[:, -1], 1e-3),
    }
    grid = tensor_grid([lines[0], lines[2]] if flat else lines, "rubber", parts)
    return cut(grid) if kind in ("triangle", "tetrahedron") else grid


def joined(one, other, shared=()):
    """Two meshes as one; `shared`, pairs of nodes (of one, of the other) that become one node."""
    number = np.arange(len(other.points)) + len(one.points)
    for node, same in shared:
        number[same] = node
    facets = {
        name: np.concatenate([one.facets[name], number[other.facets[name]]]) for name in one.facets
    }
    return one._replace(
        points=np.concatenate([one.points, other.points]),
        cells=np.concatenate([one.cells, number[other.cells]]),
        facets=facets,
    )


def moved(mesh, by, which=slice(None)):
    points = mesh.points.copy()
    points[which] += by
    return mesh._replace(points=points)


def along(mesh, x):
    """A shift in x, as long as the mesh's dimension."""
    return np.array([x] + [0.0] * (mesh.points.shape[1] - 1))


def inner_node(mesh):
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    inside = ((mesh.points > low + 1e-6) & (mesh.points < high - 1e-6)).all(axis=1)
    return int(np.flatnonzero(inside)[0])


def refusal(mesh, folder, unit="m"):
    path = folder / "bad.msh"
    gmsh_model.save(mesh, path)
    with pytest.raises(SceneError) as caught:
        load_user_mesh(path, mesh.points.shape[1], unit)
    message = str(caught.value)
    assert str(path) in message and message.isprintable()
    return message


def place(message):
    return np.array([float(x) for x in message.split("near (")[1].split(")")[0].split(",")])


@pytest.mark.parametrize("kind", KINDS)
def test_a_sound_mesh_is_taken(kind, tmp_path):
    good = box(kind)
    apart = joined(box(kind, (-1e-3, -0.1e-3)), box(kind, (0.1e-3, 1e-3)))
    wavy = good.points + 0.02e-3 * np.sin(3e3 * good.points[:, ::-1] * (good.points[:, -1:] > 0))
    wavy[:, -1] = good.points[:, -1]
    mirrored = good._replace(cells=np.roll(good.cells[:, ::-1], 1, axis=1))
    if kind == "hexahedron":
        mirrored = good._replace(cells=good.cells[:, [0, 3, 2, 1, 4, 7, 6, 5]])
    for number, mesh in enumerate((good, apart, good._replace(points=wavy), mirrored)):
        path = tmp_path / f"{number}.msh"
        gmsh_model.save(mesh, path)
        assert len(load_user_mesh(path, mesh.points.shape[1]).cells) == len(mesh.cells)


@pytest.mark.parametrize("kind", ["quadrilateral", "hexahedron"])
def test_twisted_cells_are_refused(kind, tmp_path):
    mesh = box(kind)
    cells = mesh.cells.copy()
    cells[5, [2, 3]] = cells[5, [3, 2]]
    message = refusal(mesh._replace(cells=cells), tmp_path)
    assert "inside out in a corner" in message
    np.testing.assert_allclose(place(message), mesh.points[cells[5]].mean(axis=0), rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_a_node_moved_across_its_neighbours_is_refused(kind, tmp_path):
    mesh = box(kind)
    message = refusal(moved(mesh, along(mesh, 0.8e-3), inner_node(mesh)), tmp_path)
    assert "inside out" in message or "folded" in message


@pytest.mark.parametrize("kind", KINDS)
def test_empty_cells_are_refused(kind, tmp_path):
    mesh = box(kind)
    points = mesh.points.copy()
    below = np.isclose(points[:, -1], 1e-3 / 3)
    points[below, -1] = 0.0  # the lowest layer has no height
    flat = mesh._replace(points=points)
    contact = flat.points[flat.facets["contact"], -1].max(axis=1) >= 0.0
    flat = flat._replace(facets={**flat.facets, "contact": flat.facets["contact"][contact]})
    message = refusal(flat, tmp_path)
    assert "is empty or flat" in message


@pytest.mark.parametrize("kind", KINDS)
def test_loose_parts_are_refused(kind, tmp_path):
    mesh, loose = box(kind, (-1e-3, 0.0)), box(kind, (0.2e-3, 1e-3), z=(0.0, 0.4e-3))
    loose = loose._replace(facets={**loose.facets, "plate": mesh.facets["plate"][:0]})
    message = refusal(joined(mesh, loose), tmp_path)
    assert "is loose" in message and place(message)[0] > 0.2e-3


@pytest.mark.parametrize("kind", KINDS)
def test_overlapping_parts_are_refused(kind, tmp_path):
    message = refusal(joined(box(kind, (-1e-3, 0.1e-3)), box(kind, (0.0, 1e-3))), tmp_path)
    assert "parts overlap there" in message or "not its own" in message
    inside = joined(box(kind), box(kind, (-0.9e-3, 0.85e-3), 3, y=(-0.71e-3, 0.77e-3)))
    if kind in ("triangle", "quadrilateral"):
        inside = moved(inside, along(inside, 1e-5), slice(0, len(box(kind).points)))
    assert "overlap" in (message := refusal(inside, tmp_path)) or "not its own" in message


@pytest.mark.parametrize("kind", KINDS)
def test_a_part_that_leans_into_another_is_refused(kind, tmp_path):
    one, other = box(kind, (-1e-3, 0.0)), box(kind, (0.1e-3, 1e-3), z=(0.2e-3, 1e-3))
    if one.points.shape[1] == 3:
        other = moved(other, np.array([0.0, 0.01e-3, 0.0]))
    leaning = moved(other, -0.5 * (1e-3 - other.points[:, -1:]) * along(other, 1.0))
    message = refusal(joined(one, leaning), tmp_path)
    assert "parts overlap there" in message and -0.31e-3 < place(message)[0] < 0.0


def test_a_part_inside_one_large_cell_is_refused(tmp_path):
    fine = box("hexahedron", (-0.4e-3, 0.3e-3), z=(0.1e-3, 1e-3), y=(-0.2e-3, 0.3e-3))
    assert "not its own" in refusal(joined(box("hexahedron", cells=1), fine), tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_crack_is_refused(kind, tmp_path):
    """Two halves side by side whose nodes are not joined: nothing would hold them together."""
    message = refusal(joined(box(kind, (-1e-3, 0.0)), box(kind, (0.0, 1e-3))), tmp_path)
    assert "two nodes lie at one place" in message
    assert place(message)[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_hanging_nodes_are_refused(kind, tmp_path):
    coarse, fine = box(kind, (-1e-3, 0.0)), box(kind, (0.0, 1e-3))
    lines = np.linspace(0.0, 1e-3, 7)
    flat = kind in ("triangle", "quadrilateral")
    parts = {
        "contact": lambda centre: centre[:, -1] < 0.55e-3,
        "plate": lambda centre: np.isclose(centre[:, -1], 1e-3),
    }
    grid = [lines, lines] if flat else [lines, np.linspace(-1e-3, 1e-3, 4), lines]
    fine = tensor_grid(grid, "rubber", parts)
    fine = cut(fine) if kind in ("triangle", "tetrahedron") else fine
    shared = [
        (int(node), int(same))
        for node in np.flatnonzero(np.isclose(coarse.points[:, 0], 0.0))
        for same in np.flatnonzero(np.isclose(fine.points, coarse.points[node]).all(axis=1))
    ]
    mesh = joined(coarse, fine, shared)
    used, cells = np.unique(mesh.cells, return_inverse=True)
    renumbered = np.full(len(mesh.points), -1)
    renumbered[used] = np.arange(len(used))
    mesh = TaggedMesh(
        mesh.points[used],
        kind,
        cells.reshape(mesh.cells.shape),
        {name: renumbered[facets] for name, facets in mesh.facets.items()},
        "rubber",
    )
    message = refusal(mesh, tmp_path)
    assert "not its own: it hangs" in message or "hang together" in message, message


@pytest.mark.parametrize("kind", KINDS)
def test_parts_joined_at_a_node_are_refused(kind, tmp_path):
    one, other = box(kind, (-1e-3, 0.0)), box(kind, (0.0, 1e-3))
    tilted = other.points.copy()
    tilted[:, 0] += 0.3 * (1e-3 - tilted[:, -1])  # touches at the top only
    if one.points.shape[1] == 3:
        tilted[:, 0] += 0.1 * (1e-3 - tilted[:, 1])
    other = other._replace(points=tilted)
    shared = [
        (int(node), int(same))
        for node in range(len(one.points))
        for same in np.flatnonzero(np.isclose(tilted, one.points[node], atol=1e-9).all(axis=1))
    ]
    mesh = joined(one, other, shared)
    assert len(shared) == 1 and "by a node or an edge only" in refusal(mesh, tmp_path)


def test_a_facet_of_three_cells_is_refused(tmp_path):
    mesh = box("triangle")
    edge, far = mesh.cells[10, :2], mesh.cells[3, 2]
    cells = np.concatenate([mesh.cells, [[*edge, far]]])
    message = refusal(mesh._replace(cells=cells), tmp_path)
    assert "belongs to 3 cells" in message or "flat" in message or "folded" in message


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_coordinates_are_numbers(value, tmp_path):
    mesh = box("quadrilateral")
    points = mesh.points.copy()
    points[inner_node(mesh)] = value
    cells = [("quad", mesh.cells), *(("line", facets) for facets in mesh.facets.values())]
    data = {
        name: [np.full(len(part), float(number == place)) for number, (_, part) in enumerate(cells)]
        for place, name in enumerate(["rubber", *mesh.facets])
    }
    write_sets(tmp_path / "bad.inp", cells, data, points)
    with pytest.raises(SceneError, match="the coordinates of 1 of 20 nodes are not finite"):
        load_user_mesh(tmp_path / "bad.inp", 2)


def test_the_unit_of_a_mesh_is_asked_for(tmp_path):
    mesh = box("quadrilateral")
    drawn = mesh._replace(points=1e3 * mesh.points)  # in mm
    assert 'rubber.mesh_unit = "m"' in refusal(drawn, tmp_path)
    path = tmp_path / "bad.msh"
    np.testing.assert_allclose(load_user_mesh(path, 2, "mm").points, mesh.points, rtol=1e-12)
    assert "2e-06 m large" in refusal(drawn, tmp_path, "um")
    assert set(UNITS) == set(get_args(Rubber.model_fields["mesh_unit"].annotation))
    scene = load_scene(
        ROOT / "cases" / "thesis_1bar.toml",
        ["model=slice", f"rubber.mesh={path}", "rubber.mesh_unit=mm"],
    )
    from iceslide_fem.mesh.rubber import block_size

    assert block_size(scene) == pytest.approx((2e-3, 1e-3))


SCRIPT = 'SystemCall "touch {}";\nPoint(1) = {{0, 0, 0}};\n'


@pytest.mark.parametrize("before", ["", "\n", "// $MeshFormat\n", " $MeshFormat\n", "$MeshFormat;"])
@pytest.mark.parametrize("name", ["mesh.msh", "mesh.geo", "mesh.brep", "mesh.stl", "mesh.MSH"])
def test_a_script_is_not_run(name, before, tmp_path):
    """gmsh runs the shell commands of a script, whatever the file is called."""
    (tmp_path / name).write_text(before + SCRIPT.format(tmp_path / "executed"))
    with pytest.raises(SceneError, match=name):
        load_user_mesh(tmp_path / name, 2)
    assert not (tmp_path / "executed").exists()


def test_options_beside_a_mesh_are_not_read(tmp_path):
    gmsh_model.save(box("triangle"), tmp_path / "good.msh")
    for suffix in (".opt", ".msh.opt", ".geo.opt"):
        (tmp_path / f"good{suffix}").write_text("this is wrong;\n")
    assert len(load_user_mesh(tmp_path / "good.msh", 2).cells) == 24


def test_cells_need_their_nodes(tmp_path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-3
    for wrong in (7, -1):
        cells = [("quad", [[0, 1, 2, wrong]]), ("line", [[0, 1]])]
        tags = {"rubber": [[1], [0]], "contact": [[0], [1]], "plate": [[0], [0]]}
        write_sets(tmp_path / f"bad{wrong}.inp", cells, tags, points)
        with pytest.raises(SceneError):
            load_user_mesh(tmp_path / f"bad{wrong}.inp", 2)
