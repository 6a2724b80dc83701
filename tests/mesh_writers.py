"""Tagged meshes as files of all formats that a user's mesh may have."""

import meshio
import numpy as np
import pytest

from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.ice import ice_lines, tagged_ice
from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import tagged_rubber


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


def write_sets(path, cells, tags, points):
    """An Abaqus file of cells with sets of elements: tags are name -> a list per block, not 0."""
    sets = {name: [np.flatnonzero(part) for part in parts] for name, parts in tags.items()}
    meshio.Mesh(points, cells, cell_sets=sets).write(path, "abaqus")


def write_inp(tagged, path):
    """The names as sets of elements."""
    plain = as_meshio(tagged)
    write_sets(path, plain.cells, plain.cell_data, plain.points)


KINDS = {"line": "PolyLine", "quad": "Quadrilateral", "hexahedron": "Hexahedron"}  # of XDMF


def xdmf(points, grids):
    """The text of an XDMF file with numbers in it: grids are (name, kind, nodes, numbers)."""

    def item(values):
        values = np.asarray(values)
        shape, text = " ".join(map(str, values.shape)), " ".join(map(str, values.ravel()))
        kind = "Float" if values.dtype == float else "Int"
        return f'<DataItem Format="XML" NumberType="{kind}" Dimensions="{shape}">{text}</DataItem>'

    text = ""
    for name, kind, nodes, numbers in grids:
        nodes = np.asarray(nodes)
        text += f'<Grid Name="{name}"><Topology TopologyType="{KINDS[kind]}" '
        text += f'NumberOfElements="{len(nodes)}" NodesPerElement="{nodes.shape[1]}">'
        text += f"{item(nodes)}</Topology>"
        if numbers is None:
            letters = "XY" if points.shape[1] == 2 else "XYZ"
            text += f'<Geometry GeometryType="{letters}">{item(points)}</Geometry>'
        else:
            text += f'<Attribute Name="{name}" Center="Cell">{item(numbers)}</Attribute>'
        text += "</Grid>"
    return f'<Xdmf Version="3.0"><Domain>{text}</Domain></Xdmf>'


def write_xdmf(tagged, path):
    """A grid of all cells, and one of tags for each name, as DOLFINx writes them."""
    plain = as_meshio(tagged)
    names = [*tagged.named_cells, *tagged.facets]
    cell = plain.cells[0].type
    grids = [("mesh", cell, tagged.cells, None)]
    grids += [
        (name, block.type, block.data, np.ones(len(block.data), dtype=int))
        for name, block in zip(names, plain.cells, strict=True)
    ]
    path.write_text(xdmf(np.asarray(tagged.points, dtype=float), grids))


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
}


def write_mesh(scene, folder):
    """Write the scene's rubber and ice meshes as gmsh files; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    on_mesh = scene.ice.heat == "mesh"
    ice = ice_body(scene) if on_mesh else tagged_ice(ice_lines(scene), scene.ice.stack)
    meshes = {"rubber": tagged_rubber(scene), "ice": ice}
    paths = []
    for kind, tagged in meshes.items():
        paths.append(folder / f"{scene.name}_{kind}.msh")
        gmsh_model.save(tagged, paths[-1])
    return paths
