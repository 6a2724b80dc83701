"""Users' meshes in input files of Abaqus and CalculiX, as their programs write them."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from inp_files import (  # noqa: E402
    BLOCK_CELLS,
    BLOCK_NODES,
    BOTTOM,
    ENDS,
    FACETS,
    SLICE,
    SLICE_CELLS,
    SLICE_NODES,
    TOP,
)

from iceslide_fem.mesh.user_mesh import load_user_mesh  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402

pytestmark = [pytest.mark.fe, pytest.mark.quick]

NODES = SLICE_NODES
CELLS = f"*ELEMENT, TYPE=CPE4H, ELSET=rubber\n{SLICE_CELLS}"
PLAIN = f"*ELEMENT, TYPE=CPE4H\n{SLICE_CELLS}"
SIDES = (
    "*SURFACE, NAME=contact\n1, S1\n2, S1\n3, S1\n1, S4\n3, S2\n*SURFACE, NAME=plate\nrubber, S3\n"
)
PART = f"*Part, name=Block\n{NODES}{PLAIN}*Elset, elset=rubber, generate\n 1, 3, 1\n"
RAISED = PART.replace(", 0\n", ", 3\n").replace("5, 1\n", "5, 4\n")
INSTANCE = "*Instance, name=Block-1, part=Block\n"


def read(text, folder, dim=2, name="own.inp"):
    (folder / name).write_text(text, encoding="utf-8")
    return load_user_mesh(folder / name, dim, "mm")


def sizes(tagged):
    """Length (slice) or area (block) of every part, in mm or mm2, and the centre of the mesh."""
    found = {}
    for name, facets in tagged.facets.items():
        corners = 1e3 * tagged.points[facets]
        if corners.shape[1] == 2:
            measure = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        elif corners.shape[1] == 3:
            edges = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            measure = 0.5 * np.linalg.norm(np.cross(*edges), axis=1)
        else:
            diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
            measure = 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)
        found[name] = pytest.approx(measure.sum())
    return found


WHOLE = {"contact": 5.0, "plate": 3.0}  # mm, of the slice of `inp_files`
SLICES = {
    "as it is": SLICE,
    "a set on several cards": NODES
    + "*ELEMENT, TYPE=CPE4, ELSET=rubber\n1, 1, 2, 6, 5\n"
    + "*ELEMENT, TYPE=CPE4, ELSET=rubber\n2, 2, 3, 7, 6\n3, 3, 4, 8, 7\n"
    + f"*ELEMENT, TYPE=T2D2, ELSET=contact\n{BOTTOM}*ELEMENT, TYPE=T2D2, ELSET=plate\n21, 5, 6\n"
    + f"*ELEMENT, TYPE=T2D2, ELSET=contact\n{ENDS}"
    + "*ELEMENT, TYPE=T2D2, ELSET=plate\n22, 6, 7\n23, 7, 8\n",
    "a set by its elements and by *ELSET": NODES
    + "*ELEMENT, TYPE=CPE4, ELSET=rubber\n1, 1, 2, 6, 5\n*ELEMENT, TYPE=CPE4\n2, 2, 3, 7, 6\n"
    + f"3, 3, 4, 8, 7\n*ELSET, ELSET=RUBBER\n2\n*Elset, elset=Rubber\n1, 3\n{FACETS}",
    "sets of sets, before what they name": NODES
    + "*ELSET, ELSET=contact\nlow, ends\n*ELSET, ELSET=rubber, GENERATE\n1, 3\n"
    + "*ELSET, ELSET=plate\n21, upper\n"
    + f"{PLAIN}*ELEMENT, TYPE=T3D2, ELSET=low\n{BOTTOM}*ELEMENT, TYPE=B21, ELSET=ends\n{ENDS}"
    + f"*ELEMENT, TYPE=R2D2\n{TOP}*ELSET, ELSET=upper, GENERATE\n22, 23, 1\n",
    "mixed case, blanks, quotes, comments, continued lines": "** a comment\n\n* heading\ntext\n"
    + NODES.replace("*NODE", "*node, nset = ALL")
    + '** in between\n*Element ,type = cpe4rh,\n   elset = "Rubber"\n'
    + "1, 1, 2,\n** here, too\n6, 5\n\n2, 2, 3, 7, 6,\n 3 , 3,4 , 8,7\n"
    + FACETS.replace("ELSET=contact", 'ELSET="Contact"').replace("=plate", " = PLATE "),
    "Windows' ends of lines": SLICE.replace("\n", "\r\n"),
    "sides of elements": NODES + CELLS + SIDES,
    "sides of sets, surfaces united": NODES
    + CELLS
    + "*ELSET, ELSET=first\n1\n*ELSET, ELSET=last\n3,\n"
    + "*SURFACE, NAME=low, TYPE=ELEMENT\nrubber, S1\n*SURFACE, NAME=ends\nfirst, S4\nlast, S2\n"
    + "*SURFACE, NAME=contact, COMBINE=UNION\nlow, ends\n*SURFACE, NAME=plate\nrubber, S3\n",
    "surfaces of line elements": NODES
    + CELLS
    + FACETS.replace("=contact", "=c_elements").replace("=plate", "=p_elements")
    + "*SURFACE, NAME=contact\nc_elements, SPOS\n*SURFACE, NAME=plate\np_elements, SNEG\n",
    "sets of nodes": NODES
    + CELLS
    + "*NSET, NSET=contact\n1, 2, 3, 4\n*NSET, NSET=plate, GENERATE\n5, 8, 1\n",
    "surfaces of nodes, sets of nodes of elements": NODES
    + CELLS
    + "*NSET, NSET=low\n1, 2, 3, 4\n*SURFACE, TYPE=NODE, NAME=contact\nlow, 1.\n"
    + f"*ELEMENT, TYPE=T2D2, ELSET=upper\n{TOP}*NSET, NSET=plate, ELSET=upper\n",
    "facets rather than nodes of one name": SLICE + "*NSET, NSET=contact\n1, 2\n",
    "other elements and cards": SLICE
    + "*ELEMENT, TYPE=MASS, ELSET=point\n90, 1\n*ELEMENT, TYPE=CONN2D2, ELSET=wire\n91, , 2\n"
    + "*ELSET, ELSET=broken\nnowhere\n*SURFACE, NAME=strange, TYPE=CYLINDER\n1, 2, 3\n"
    + "*SOLID SECTION, ELSET=rubber, MATERIAL=m\n*MATERIAL, NAME=m\n*HYPERELASTIC\n1., 2.\n"
    + "*STEP\n*STATIC\n0.1, 1.\n*END STEP\n",
    "Fortran's numbers": SLICE.replace("-0.5, 0", "-5.0D-1, 0.d0").replace("1.5, 1", "1.5E+00, 1."),
    "as FreeCAD writes": SLICE.replace("*NODE", "** Nodes\n*Node, NSET=Nall").replace(
        "ELSET=rubber", "ELSET=Evolumes"
    )
    + "*ELSET, ELSET=Eall\nEvolumes\n*ELSET, ELSET=rubber\nEvolumes,\n",
    "commas at the ends of lines": SLICE.replace("\n", ",\n")
    .replace("H,", "H, ")
    .replace("*HEADING,\na slice,\n*NODE,", "*NODE")
    .replace("rubber,", "rubber")
    .replace("contact,", "contact")
    .replace("plate,", "plate"),
    "GENERATE first, without and with negative increments": SLICE.replace(", ELSET=rubber", "")
    + "*ELSET, GENERATE, INTERNAL, ELSET=rubber, UNSORTED\n1, 2\n3, 3, -1\n3, 1, -2\n",
    "an end that Abaqus does not know": SLICE + "*end",
    "bytes in front, tabs": "\ufeff" + SLICE.replace(", ", "\t,\t"),
    "a part": PART + SIDES + "*End Part\n",
    "a part and its instance": PART
    + SIDES
    + f"*End Part\n*Assembly, name=Assembly\n{INSTANCE}*End Instance\n*End Assembly\n",
    "an instance that is moved": RAISED
    + SIDES
    + f"*End Part\n*Assembly, name=A\n{INSTANCE} 0., -3., 0.\n*End Instance\n*End Assembly\n",
    "an instance that is moved, then turned upside down": RAISED
    + SIDES.replace("S1", "S0").replace("S3", "S1").replace("S0", "S3")
    + f"*End Part\n{INSTANCE}0, -3, 0\n0, .5, 0, 0, .5, 1, 180\n*End Instance\n",
    "sets of the assembly": PART
    + f"*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n*Node\n1, 0, 5\n"
    + "*Elset, elset=_c1, internal, instance=Block-1, generate\n1, 3, 1\n"
    + "*Elset, elset=_c4, internal, instance=Block-1\n 1,\n"
    + "*Surface, type=ELEMENT, name=contact\n_c1, S1\n_c4, S4\nBlock-1.3, S2\n"
    + "*Nset, nset=plate, instance=BLOCK-1, generate\n 5, 8, 1\n*End Assembly\n",
    "a surface of the assembly from surfaces of parts": PART
    + SIDES.replace("=contact", "=low")
    + f"*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n"
    + "*Surface, name=contact, combine=union\nBlock-1.low\n*End Assembly\n",
    "a mesh in the instance": "*Part, name=Block\n*End Part\n*Assembly, name=A\n"
    + f"{INSTANCE}{NODES}{CELLS}{SIDES}*End Instance\n*End Assembly\n",
    "two parts with the same numbers": PART
    + SIDES
    + f"*End Part\n*Part, name=Ice\n{NODES}{PLAIN}*Elset, elset=ice\n1, 2\n*End Part\n"
    + f"*Assembly, name=A\n*Instance, name=I, part=Ice\n0., -1.\n*End Instance\n{INSTANCE}"
    + "*End Instance\n*End Assembly\n",
    "a set of the assembly by one of the same name in a part": PART
    + SIDES
    + f"*Elset, elset=low\n1, 2, 3\n*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n"
    + "*Elset, elset=low\nBlock-1.low\n*Elset, elset=rubber, instance=Block-1\nlow\n",
    "one set in part and assembly": PART
    + SIDES
    + f"*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n"
    + "*Elset, elset=rubber, instance=Block-1\n1, 2, 3\n*End Assembly\n",
}


@pytest.mark.parametrize("case", SLICES)
def test_a_slice_is_read(case, tmp_path):
    found = read(SLICES[case], tmp_path)
    wanted = dict(WHOLE)
    if case in ("sets of nodes", "surfaces of nodes, sets of nodes of elements"):
        wanted["contact"] = 3.0  # sides have a node on the top
    assert sizes(found) == wanted
    assert len(found.cells) == 3 and found.cell_type == "quadrilateral"
    low, high = 1e3 * found.points.min(axis=0), 1e3 * found.points.max(axis=0)
    np.testing.assert_allclose([low, high], [[-1.5, 0], [1.5, 1]], atol=1e-12)


def block(kind, cells, facets, nodes=""):
    return f"{BLOCK_NODES}{nodes}*ELEMENT, TYPE={kind}, ELSET=RUBBER\n{cells}{facets}"


BLOCK_SIDES = (
    "*SURFACE, NAME=CONTACT\nRUBBER, S1\n1, S6\n2, S4\n*SURFACE, NAME=PLATE\nRUBBER, S2\n"
    "*SURFACE, NAME=SYMMETRY\nRUBBER, S3\n"
)
BLOCKS = {  # sizes of contact, plate and symmetry plane, mm2
    "S1 to S6": block("C3D8RH", BLOCK_CELLS, BLOCK_SIDES),
    "surface elements": block("C3D8I", BLOCK_CELLS, "")
    + "*ELEMENT, TYPE=SFM3D4, ELSET=CONTACT\n11, 1, 2, 5, 4\n12, 2, 3, 6, 5\n"
    + "*ELEMENT, TYPE=S4R, ELSET=CONTACT\n13, 1, 4, 10, 7\n14, 3, 6, 12, 9\n"
    + "*ELEMENT, TYPE=R3D4, ELSET=PLATE\n15, 7, 8, 11, 10\n*ELEMENT, TYPE=M3D4, ELSET=top\n"
    + "16, 8, 9, 12, 11\n*ELSET, ELSET=PLATE\n16\n*ELEMENT, TYPE=S4, ELSET=shells\n"
    + "17, 1, 2, 8, 7\n18, 2, 3, 9, 8\n*SURFACE, NAME=SYMMETRY\nshells, SPOS\n",
    "nodes": block("C3D8H", BLOCK_CELLS, "")
    + "*NSET, NSET=CONTACT\n1, 2, 3, 4, 5, 6\n*NSET, NSET=PLATE\n7, 8, 9, 10, 11, 12\n"
    + "*NSET, NSET=SYMMETRY\n1, 2, 3, 7, 8, 9\n",
}


@pytest.mark.parametrize("case", BLOCKS)
def test_a_block_is_read(case, tmp_path):
    found = read(BLOCKS[case], tmp_path, 3)
    assert sizes(found) == {
        "contact": 2.0 if case == "nodes" else 4.0,
        "plate": 2.0,
        "symmetry": 2.0,
    }
    assert len(found.cells) == 2 and found.cell_type == "hexahedron"


def test_the_outer_facets_of_a_set_are_a_surface_without_sides(tmp_path):
    layers = "".join(f"{n}, {(n - 1) % 3 - 1}, {(n - 1) // 3 / 2}\n" for n in range(1, 10))
    cells = "1, 1, 2, 5, 4\n2, 2, 3, 6, 5\n3, 4, 5, 8, 7\n4, 5, 6, 9, 8\n"
    found = read(
        f"*NODE\n{layers}*ELEMENT, TYPE=CPE4, ELSET=rubber\n{cells}*ELSET, ELSET=low\n1, 2\n"
        "*SURFACE, NAME=contact\nlow,\n*SURFACE, NAME=plate\n3, S3\n4, S3\n",
        tmp_path,
    )
    assert sizes(found) == {"contact": 3.0, "plate": 2.0}


TETRAHEDRA = "".join(
    f"{number}, {nodes}\n"
    for number, nodes in enumerate(
        ["1, 2, 4, 6", "2, 3, 4, 7", "2, 7, 6, 5", "4, 6, 7, 8", "2, 4, 7, 6"], 1
    )
)


def test_sides_of_tetrahedra(tmp_path):
    """A cube of five tetrahedra, nodes 1 to 4 below and 5 to 8 above, each side in both ways."""
    nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n6,0,0,1\n5,1,0,1\n7,1,1,1\n8,0,1,1\n"
    text = f"{nodes}*ELEMENT, TYPE=C3D4H, ELSET=RUBBER\n{TETRAHEDRA}"
    sides = "*SURFACE, NAME=CONTACT\n1, S1\n2, S1\n*SURFACE, NAME=PLATE\n3, S3\n4, S3\n"
    found = read(text + sides, tmp_path, 3)
    assert sizes(found) == {"contact": 1.0, "plate": 1.0} and len(found.cells) == 5


def test_numbers_of_sides_are_those_of_abaqus():
    """Every side of the hexahedron and the tetrahedron, by the nodes that Abaqus' guide gives."""
    from iceslide_fem.mesh.tagged import FACETS

    guide = {
        "hexahedron": "1-2-3-4 5-8-7-6 1-5-6-2 2-6-7-3 3-7-8-4 4-8-5-1",
        "tetrahedron": "1-2-3 1-4-2 2-4-3 3-4-1",
        "quadrilateral": "1-2 2-3 3-4 4-1",
        "triangle": "1-2 2-3 3-1",
    }
    for kind, sides in guide.items():
        wanted = [{int(node) - 1 for node in side.split("-")} for side in sides.split()]
        assert [set(side) for side in FACETS[kind]] == wanted


@pytest.mark.parametrize("break_after", [10, 16, 21])
def test_second_order_cells_are_refused(break_after, tmp_path):
    """Also where surfaces are of their sides, on one line or several."""
    numbers = [1, 1, 2, 5, 4, 7, 8, 11, 10, *range(1, 13)]
    lines = [", ".join(map(str, numbers[i : i + break_after])) for i in range(0, 21, break_after)]
    cells = ",\n".join(lines) + "\n"
    for sides in ("", "*SURFACE, NAME=CONTACT\nRUBBER, S1\n"):
        with pytest.raises(SceneError, match="C3D20RH cells; allowed are first-order .*setOrder"):
            read(block("C3D20RH", cells, sides, ""), tmp_path, 3)


def test_a_mesh_in_several_files(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "nodes.inp").write_text(NODES)
    (tmp_path / "parts" / "cells.txt").write_text(SLICE_CELLS)
    (tmp_path / "top.txt").write_text(TOP)
    found = read(
        "*Include, input=parts/nodes.inp\n*ELEMENT, TYPE=CPE4, ELSET=rubber, "
        "INPUT=parts\\cells.txt\n"
        f"*ELEMENT, TYPE=T2D2, ELSET=contact\n{BOTTOM}{ENDS}"
        "*ELEMENT, TYPE=T2D2, ELSET=plate\n*INCLUDE,INPUT=top.txt\n",
        tmp_path,
    )
    assert sizes(found) == WHOLE


def test_blocks_that_are_instances_of_one_part(tmp_path):
    instances = "".join(
        f"*Instance, name=I{n}, part=Block\n{4 * n}., 0., 0.\n*End Instance\n" for n in range(3)
    )
    found = read(f"{PART}{SIDES}*End Part\n*Assembly, name=A\n{instances}*End Assembly", tmp_path)
    assert len(found.cells) == 9 and sizes(found) == {"contact": 15.0, "plate": 9.0}


BAD = {
    "is no input file of Abaqus with a mesh: it has no \\*ELEMENT": "$MeshFormat\n2.2 0 8\n",
    'can\'t be read as an input file of Abaqus: "abc" is no number': SLICE.replace("-1.5", "abc"),
    '"x" is no number of a node or element': SLICE.replace("2, 2, 3, 7", "2, x, 3, 7"),
    "element 2 of type CPE4H has 5 nodes, not 4": SLICE.replace(
        "2, 2, 3, 7, 6", "2, 2, 3, 7, 6, 5"
    ),
    "element 3 of type CPE4H has 3 nodes, not 4": SLICE.replace("3, 3, 4, 8, 7\n", "3, 3, 4, 8\n"),
    '"rubber" have nodes that are not in the file': SLICE.replace("3, 0.5, 0\n", ""),
    "node 3 is there twice, at different places": SLICE.replace(
        "3, 0.5, 0\n", "3, 0, 0\n3, 1, 0\n"
    ),
    "can't be read as an input file of Abaqus: element 3 is there twice": SLICE.replace(
        "21, 5", "3, 5"
    ),
    'the set "rubber" can\'t be read: element 4 is not in the file': NODES
    + PLAIN
    + FACETS
    + "*ELSET, ELSET=rubber, GENERATE\n1, 4\n",
    'GENERATE takes first, last and increment, not "1, 3, 0"': NODES
    + PLAIN
    + FACETS
    + "*ELSET, ELSET=rubber, GENERATE\n1, 3, 0\n",
    'the set "contact" can\'t be read: there is no \\*ELSET "lower"': SLICE
    + "*ELSET, ELSET=contact\nlower\n",
    'the set "contact" can\'t be read: the set "contact" holds itself': SLICE
    + "*ELSET, ELSET=contact\ncontact\n",
    'the set "rubber" can\'t be read: the set "rubber" holds itself': PART
    + SIDES
    + f"*Elset, elset=rubber\nBlock-1.rubber\n*End Part\n{INSTANCE}*End Instance\n",
    "TYPE=CUTTING SURFACE: allowed are": SLICE + "*SURFACE, TYPE=CUTTING SURFACE, NAME=plate\n1,\n",
    'elements of type CPE4H have no side "S5"': NODES + CELLS + SIDES.replace("S3", "S5"),
    '"SPOS" is no side of elements of type CPE4H': NODES + CELLS + SIDES.replace("S3", "SPOS"),
    '"S1" is no side of elements of type S4R': NODES + CELLS.replace("CPE4H", "S4R") + SIDES,
    'no cells tagged "rubber"; tags found: contact, gum, plate': SLICE.replace("=rubber", "=gum"),
    '"rubber" is made of pyramid cells; allowed are first-order triangle': NODES
    + "*ELEMENT, TYPE=C3D5, ELSET=rubber\n1, 1, 2, 6, 5, 7\n",
    '"rubber" is made of CIN3D8 cells': NODES
    + "*ELEMENT, TYPE=CIN3D8, ELSET=rubber\n1, 1, 2, 6, 5\n",
    "it makes or moves nodes or elements by \\*NGEN": SLICE.replace(
        "*HEADING", "*NGEN\n1, 4\n*HEADING"
    ),
    "SYSTEM=C: allowed are Cartesian coordinates": SLICE.replace("*NODE", "*NODE, SYSTEM=C"),
    'is of the part "Gum", which is not in the file': SLICE + "*INSTANCE, NAME=a, PART=Gum\n",
    "includes .*missing.inp, which can't be read": SLICE + "*INCLUDE, INPUT=missing.inp",
    "goes round in a circle": SLICE + "*INCLUDE, INPUT=own.inp",
    "needs two points and an angle": PART
    + SIDES
    + f"*End Part\n{INSTANCE}0, 0, 0\n0, 0, 0, 0, 0, 0, 90\n*End Instance\n",
    'the set "rubber" can\'t be read: it is one thing in a part and another one outside': PART
    + SIDES
    + f"*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n"
    + "*Elset, elset=rubber, instance=Block-1\n1, 2\n",
    'there is no instance "block-2"': PART
    + f"*End Part\n*Assembly, name=A\n{INSTANCE}*End Instance\n"
    + "*Elset, elset=contact, instance=Block-2\n1, 2\n",
}


@pytest.mark.parametrize("said", BAD)
def test_what_is_wrong_is_said_in_a_sentence(said, tmp_path):
    with pytest.raises(SceneError, match=said) as refusal:
        read(BAD[said], tmp_path, 3 if "pyramid" in said or "CIN3D8" in said else 2)
    message = str(refusal.value)
    assert message.startswith(f"rubber.mesh {tmp_path / 'own.inp'}") and message.isprintable()


SECTIONS = "*ELSET, ELSET=low\n1, 2\n*ELSET, ELSET=high\n3\n*SOLID SECTION, ELSET=low, MATERIAL="
SECTIONS += "soft\n*SOLID SECTION, ELSET=high, MATERIAL="


def test_several_materials_of_the_rubber_are_refused(tmp_path):
    assert len(read(f"{SLICE}{SECTIONS}Soft\n", tmp_path).cells) == 3
    with pytest.raises(SceneError, match='"rubber" has sections of several materials .soft, hard'):
        read(f"{SLICE}{SECTIONS}hard\n", tmp_path)


def test_a_tie_within_the_rubber_is_refused(tmp_path):
    ends = "*SURFACE, NAME=one\n1, S3\n*SURFACE, NAME=other\n3, S3\n"
    with pytest.raises(SceneError, match=r"joined by a \*TIE .one, other., which is not read"):
        read(f"{SLICE}{ends}*TIE, NAME=joint\none, other\n", tmp_path)


def test_bytes_that_are_no_text(tmp_path):
    (tmp_path / "own.inp").write_bytes(bytes(range(256)) * 20)
    with pytest.raises(SceneError, match="own.inp"):
        load_user_mesh(tmp_path / "own.inp", 2)
