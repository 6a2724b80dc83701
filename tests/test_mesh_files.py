"""Formats of users' meshes: all suffixes of docs/how-to/meshes.md open what a test has written."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from dolfinx import io, mesh  # noqa: E402
from inp_files import SLICE  # noqa: E402
from mesh_writers import WRITERS, needs_med, write_sets, xdmf  # noqa: E402
from mpi4py import MPI  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import tensor_grid  # noqa: E402
from iceslide_fem.mesh.readers import READERS  # noqa: E402
from iceslide_fem.mesh.user_mesh import load_user_mesh  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402
from iceslide_fem.scene.fingerprint import scene_hash  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.versions]
ROOT = Path(__file__).parent.parent


def low(centre):
    return centre[:, -1] < 0.6e-3


def top(centre):
    return centre[:, -1] > 0.999e-3


def box(dim):
    """A block of 2 x (1 x) 1 mm of 4 x (2 x) 4 cells with contact up to half of its height."""
    lines = [np.linspace(-1e-3, 1e-3, 5), np.linspace(-5e-4, 5e-4, 3)]
    lines.append(np.linspace(0, 1e-3, 5))
    chosen = lines if dim == 3 else [lines[0], lines[2]]
    return tensor_grid(chosen, "rubber", {"contact": low, "plate": top})


def same(found, wanted):
    assert (len(found.cells), found.cell_type) == (len(wanted.cells), wanted.cell_type)
    assert set(found.facets) == set(wanted.facets)
    for name, facets in wanted.facets.items():
        places = [
            np.unique(np.round(1e9 * one.points[nodes].mean(axis=1)), axis=0)
            for one, nodes in ((wanted, facets), (found, found.facets[name]))
        ]
        np.testing.assert_array_equal(*places)


def test_every_suffix_has_its_test_and_its_line_in_the_docs():
    assert set(WRITERS) == set(READERS)
    text = (ROOT / "docs" / "how-to" / "meshes.md").read_text(encoding="utf-8")
    assert all(f"`{suffix}`" in text for suffix in READERS)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("suffix", WRITERS)
def test_every_suffix_is_read_in_small_letters_and_capitals(suffix, dim, tmp_path):
    WRITERS[suffix](box(dim), tmp_path / f"own{suffix}")
    same(load_user_mesh(tmp_path / f"own{suffix}", dim), box(dim))
    (tmp_path / f"own{suffix}").rename(tmp_path / f"OWN{suffix.upper()}")
    same(load_user_mesh(tmp_path / f"OWN{suffix.upper()}", dim), box(dim))


def written_by_dolfinx(path, cell="quadrilateral", height=1e-3, numbers=None):
    """Counts of cells and of facets by names, of a block whose mesh and tags are in a file.

    numbers: of the names, in one array of tags for cells and one for facets; else an array a name.
    """
    kind = getattr(mesh.CellType, cell)
    flat = cell == "quadrilateral"
    ends = ([-1e-3, 0.0], [1e-3, height]) if flat else ([-1e-3, -1e-3, 0.0], [1e-3, 1e-3, height])
    create = mesh.create_rectangle if flat else mesh.create_box
    block = create(MPI.COMM_SELF, [np.array(end) for end in ends], [4] * len(ends[0]), kind)
    dim = block.topology.dim
    block.topology.create_connectivity(dim - 1, dim)
    cells = np.arange(block.topology.index_map(dim).size_local, dtype=np.int32)

    def at(level):
        return mesh.locate_entities_boundary(
            block, dim - 1, lambda x: np.isclose(x[dim - 1], level, atol=1e-9)
        )

    tags = {"rubber": (dim, cells), "contact": (dim - 1, at(0.0)), "plate": (dim - 1, at(height))}
    groups = {name: [name] for name in tags}
    if numbers:
        groups = {f"tags_{dim}": ["rubber"], f"tags_{dim - 1}": ["contact", "plate"]}
    numbers = numbers or dict.fromkeys(tags, 7)
    with io.XDMFFile(MPI.COMM_SELF, str(path), "w") as file:
        file.write_mesh(block)
        for title, names in groups.items():
            of, _ = tags[names[0]]
            entities = np.concatenate([tags[name][1] for name in names])
            values = np.concatenate(
                [np.full(len(tags[name][1]), numbers[name], np.int32) for name in names]
            )
            order = np.argsort(entities)
            tag = mesh.meshtags(block, of, entities[order], values[order])
            tag.name = title
            geometry = () if compat.VERSION.startswith("0.5") else (block.geometry,)
            file.write_meshtags(tag, *geometry)
    return {name: len(entities) for name, (_, entities) in tags.items()}


@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_a_mesh_and_tags_that_dolfinx_has_written(cell, tmp_path):
    """A grid for the mesh and one for each of the tags, which share its points."""
    wanted = written_by_dolfinx(tmp_path / "own.xdmf", cell)
    dim = 2 if cell == "quadrilateral" else 3
    found = load_user_mesh(tmp_path / "own.xdmf", dim)
    assert found.cell_type == cell
    counts = {name: len(part) for name, part in found.facets.items()}
    assert {"rubber": len(found.cells), **counts} == wanted
    (tmp_path / "own.h5").rename(tmp_path / "other.h5")
    with pytest.raises(SceneError, match="keeps its data in own.h5, which is not beside it"):
        load_user_mesh(tmp_path / "own.xdmf", dim)


def test_numbers_that_dolfinx_has_written_get_names(tmp_path):
    """The same number may be of cells and of facets; numbers without a name are shown."""
    tags = {"rubber": 1, "contact": 1, "plate": 3}
    wanted = written_by_dolfinx(tmp_path / "own.xdmf", numbers=tags)
    found = load_user_mesh(tmp_path / "own.xdmf", 2, tags=tags.items())
    counts = {name: len(part) for name, part in found.facets.items()}
    assert {"rubber": len(found.cells), **counts} == wanted
    with pytest.raises(SceneError, match='"plate"; tags found: contact, tags_1 3'):
        load_user_mesh(tmp_path / "own.xdmf", 2, tags={**tags, "plate": 2}.items())
    gmsh_model.save(box(2), tmp_path / "own.msh")
    with pytest.raises(SceneError, match='"[*].msh" have names; rubber.mesh_tags are of .xdmf'):
        load_user_mesh(tmp_path / "own.msh", 2, tags=tags.items())


@pytest.mark.parametrize("above", [True, False])
def test_cells_that_are_not_simulated_are_refused_above_the_ice(above, tmp_path):
    """A steel insert would be a hole; ice below the rubber may be in the same file."""
    lines = [np.linspace(-1e-3, 1e-3, 5), np.linspace(-1e-3, 1e-3, 9)]
    whole = tensor_grid(lines, "rubber", {"contact": low, "plate": top})
    middle = whole.points[whole.cells].mean(axis=1)
    inside = (middle[:, 1] > 7e-4) & (np.abs(middle[:, 0]) < 5e-4)
    other = {"ice": np.flatnonzero(middle[:, 1] < 0.0)}
    if above:
        other["steel"] = np.flatnonzero(inside)
    rubber = np.setdiff1d(np.arange(len(middle)), np.concatenate([*other.values()]))
    mesh_of_both = whole._replace(facets={}, regions={"rubber": rubber, **other})
    gmsh_model.save(mesh_of_both, tmp_path / "own.msh")
    said = (
        '"steel" above the ice, which are not simulated' if above else 'no facets tagged "contact"'
    )
    with pytest.raises(SceneError, match=said):
        load_user_mesh(tmp_path / "own.msh", 2)


@pytest.mark.parametrize("suffix", [".inp", ".xdmf"])
def test_what_a_mesh_keeps_in_other_files_counts(suffix, tmp_path):
    """When they change, the mesh is read again, and results are no longer those of the scene."""
    own = tmp_path / f"own{suffix}"
    if suffix == ".inp":
        nodes, card, rest = SLICE.partition("*ELEMENT")
        data, changed = tmp_path / "nodes.txt", tmp_path / "changed.txt"
        data.write_text(nodes)
        changed.write_text(nodes.replace(", 1\n", ", 1.2\n"))
        own.write_text(f"*Include, Input = nodes.txt\n{card}{rest}")
    else:
        data, changed = tmp_path / "own.h5", tmp_path / "changed.h5"
        written_by_dolfinx(own)
        written_by_dolfinx(tmp_path / "changed.xdmf", height=1.2e-3)
    scene = load_scene(ROOT / "cases" / "thesis_1bar.toml", ["model=slice", f"rubber.mesh={own}"])
    found = []
    for file in (data, changed):
        file.replace(data)
        unit = "mm" if suffix == ".inp" else "m"
        found.append((scene_hash(scene), load_user_mesh(own, 2, unit).points[:, 1].max()))
    hashes, heights = zip(*found, strict=True)
    assert hashes[0] != hashes[1]
    assert heights == pytest.approx([1.0e-3, 1.2e-3])


SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * 1e-3
LINES = [[0, 1], [2, 3]]


def test_facets_inside_are_refused(tmp_path):
    points = np.concatenate([SQUARE, SQUARE[3:] + [0, 1e-3, 0], SQUARE[2:3] + [0, 1e-3, 0]])
    cells = [("quad", [[0, 1, 2, 3], [3, 2, 5, 4]]), ("line", [[2, 3], [4, 5]])]
    tags = {"rubber": [[1, 1], [0, 0]], "contact": [[0, 0], [1, 0]], "plate": [[0, 0], [0, 1]]}
    write_sets(tmp_path / "inside.inp", cells, tags, points)
    with pytest.raises(SceneError, match='"contact" are not on the outside'):
        load_user_mesh(tmp_path / "inside.inp", 2)


def test_mixed_cells_are_refused(tmp_path):
    cells = [("quad", [[0, 1, 2, 3]]), ("triangle", [[0, 1, 2]]), ("line", LINES)]
    tags = {
        "rubber": [[1], [1], [0, 0]],
        "contact": [[0], [0], [1, 0]],
        "plate": [[0], [0], [0, 1]],
    }
    write_sets(tmp_path / "mixed.inp", cells, tags, SQUARE)
    with pytest.raises(SceneError, match=r"mixes cell types \(quadrilateral, triangle\)"):
        load_user_mesh(tmp_path / "mixed.inp", 2)


@pytest.mark.parametrize("suffix", [".msh", ".med", ".inp"])
def test_second_order_cells_are_refused(suffix, tmp_path):
    """Written by gmsh: one square of two second-order triangles."""
    gmsh = pytest.importorskip("gmsh")
    if suffix == ".med":
        needs_med()
    with gmsh_model.empty_model() as model:
        model.occ.addRectangle(0, 0, 0, 1e-3, 1e-3)
        model.occ.synchronize()
        for dim, entities, name in (
            (2, [1], "rubber"),
            (1, [1, 2, 4], "contact"),
            (1, [3], "plate"),
        ):
            model.addPhysicalGroup(dim, entities, name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1e-3)
        model.mesh.generate(2)
        gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
        gmsh.write(str(tmp_path / f"first{suffix}"))
        model.mesh.setOrder(2)
        gmsh.write(str(tmp_path / f"second{suffix}"))
    found = load_user_mesh(tmp_path / f"first{suffix}", 2)
    assert {name: len(part) for name, part in found.facets.items()} == {"contact": 3, "plate": 1}
    kind = "CPS6" if suffix == ".inp" else "Triangle 6"
    with pytest.raises(SceneError, match=f'"rubber" is made of {kind} cells; allowed are first-or'):
        load_user_mesh(tmp_path / f"second{suffix}", 2)


NAMELESS = xdmf(
    np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
    [("mesh", "quad", [[0, 1, 2, 3]], None)],
)
BAD = {
    ("bad.msh", "this is no mesh"): 'its first line is not "$MeshFormat"',
    ("bad.MSH", "this is no mesh"): 'its first line is not "$MeshFormat"',
    ("bad.msh", "$MeshFormat\n9.9 0 8\n$EndMeshFormat\n"): "can't be read by gmsh",
    ("bad.med", "this is no mesh"): "is no MED file: it does not begin as HDF5 does",
    ("bad.med", b"\x89HDF\r\n\x1a\n" + bytes(500)): "can't be read by gmsh",
    ("bad.inp", "this is no mesh"): "has no *ELEMENT",
    ("bad.xdmf", "this is no mesh"): "is no XDMF file: syntax error: line 1",
    ("bad.xdmf", "<html></html>"): "is no XDMF file: it begins with <html>",
    ("bad.xdmf", '<Xdmf Version="3.0"><Domain/></Xdmf>'): "holds no grid of cells",
    ("bad.xdmf", NAMELESS): 'no cells tagged "rubber"; tags found: none',
    ("bad.vtu", "this is no mesh"): "files of VTK (.vtu) are not read: meshio convert makes .msh",
    ("bad.bdf", "GRID,1"): "files of Nastran (.bdf) have no names for sets of facets",
    ("bad.nas", "GRID,1"): "files of Nastran (.nas) have no names for sets of facets",
    ("bad.unknown", "this is no mesh"): 'files "*.unknown" are not read; allowed are .msh, .med',
    ("bad", "this is no mesh"): "its name has no suffix; allowed are .msh, .med, .inp",
}


@pytest.mark.parametrize("file", BAD, ids=lambda file: f"{file[0]}: {str(file[1])[:30]!r}")
def test_a_file_that_is_no_mesh_gets_a_sentence(file, tmp_path, capfd):
    name, content = file
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(SceneError) as refusal:
        load_user_mesh(path, 2)
    message = str(refusal.value)
    assert message.startswith(f"rubber.mesh {path}") and BAD[file] in message
    assert message.isprintable() and len(message) < len(str(path)) + 250
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_file_that_is_cut_off_gets_a_sentence(suffix, tmp_path, capfd):
    WRITERS[suffix](box(3), tmp_path / f"own{suffix}")
    whole = (tmp_path / f"own{suffix}").read_bytes()
    for part in (0.02, 0.3, 0.6, 0.9):
        path = tmp_path / f"cut{part}{suffix}"
        path.write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(SceneError) as refusal:
            load_user_mesh(path, 3)
        assert str(refusal.value).isprintable()
    assert capfd.readouterr() == ("", "")


def test_a_bad_mesh_ends_a_command_with_a_sentence_and_2(tmp_path):
    (tmp_path / "own.inp").write_text(SLICE.replace("21, 5, 6", "21, 5, 600"))
    words = ["info", str(ROOT / "cases" / "thesis_1bar.toml"), "--set", "model=slice"]
    words += ["--set", f"rubber.mesh={tmp_path / 'own.inp'}", "--set", "rubber.mesh_unit=mm"]
    program = "from iceslide_fem.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", program, *words], capture_output=True, text=True)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.splitlines()[-1].endswith('facets tagged "plate" are not part of "rubber"')
    assert "Traceback" not in done.stderr
