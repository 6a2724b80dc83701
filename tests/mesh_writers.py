"""Tagged meshes as files of all formats that a user's mesh may have."""

import meshio
import numpy as np
import pytest

from iceslide_fem.mesh import gmsh_model


def as_meshio(tagged):
    """With cell data of one number, not zero where the name holds."""
    cell = tagged.cell_type.replace("quadrilateral", "quad")
    facet = {2: "line", 4: "quad"}[next(iter(tagged.facets.values())).shape[1]]
    blocks = [(cell, tagged.cells[some]) for some in tagged.named_cells.values()]
    blocks += [(facet, facets) for facets in tagged.facets.values()]
    names = [*tagged.named_cells, *tagged.facets]
    named = list(zip(names, blocks, strict=True))
    data = {
        name: [np.full(len(nodes), int(name == other)) for other, (_, nodes) in named]
        for name in names
    }
    points = np.zeros((len(tagged.points), 3))
    points[:, : tagged.points.shape[1]] = tagged.points
    return meshio.Mesh(points, blocks, cell_data=data)


def write_inp(tagged, path):
    """The names as sets of elements."""
    plain = as_meshio(tagged)
    plain.cell_data = {}
    names = [*tagged.named_cells, *tagged.facets]
    named = list(zip(names, plain.cells, strict=True))
    plain.cell_sets = {
        name: [np.arange(len(block) if name == other else 0) for other, block in named]
        for name in names
    }
    plain.write(path, "abaqus")


XDMF = """<Xdmf Version="3.0"><Domain><Grid Name="g">
<Topology TopologyType="Mixed" NumberOfElements="{count}">{cells}</Topology>
<Geometry GeometryType="XYZ">{points}</Geometry>{data}</Grid></Domain></Xdmf>"""
KINDS = {"line": (2, 2), "quad": (5,), "hexahedron": (9,)}  # of XDMF; lines with their length


def write_xdmf(tagged, path):
    """One grid of mixed cells with its numbers in the file itself."""

    def item(values):
        values = np.asarray(values)
        shape, text = " ".join(map(str, values.shape)), " ".join(map(str, values.ravel()))
        kind = "Float" if values.dtype == float else "Int"
        return f'<DataItem Format="XML" DataType="{kind}" Dimensions="{shape}">{text}</DataItem>'

    plain = as_meshio(tagged)
    cells = [[*KINDS[block.type], *nodes] for block in plain.cells for nodes in block.data]
    data = "".join(
        f'<Attribute Name="{name}" Center="Cell">{item(np.concatenate(values))}</Attribute>'
        for name, values in plain.cell_data.items()
    )
    numbers = item([number for cell in cells for number in cell])
    points = item(np.asarray(plain.points, dtype=float))
    path.write_text(XDMF.format(count=len(cells), cells=numbers, points=points, data=data))


def needs_med():
    """Debian 13's gmsh is built without MED; that of PyPI has it."""
    with gmsh_model.empty_model():
        if "Med" not in gmsh_model.gmsh.option.getString("General.BuildOptions"):
            pytest.skip("this gmsh is built without MED")


def write_med(tagged, path):
    needs_med()
    gmsh_model.save(tagged, path)


WRITERS = {
    ".msh": gmsh_model.save,
    ".med": write_med,
    ".inp": write_inp,
    ".xdmf": write_xdmf,
    ".xmf": write_xdmf,
    ".vtu": lambda tagged, path: as_meshio(tagged).write(path, "vtu"),
    ".vtk": lambda tagged, path: as_meshio(tagged).write(path, "vtk"),
}
