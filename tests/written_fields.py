"""Fields of an invented run, for the tests of what reads them. Needs DOLFINx."""

import meshio
import numpy as np
from blocks import SIZE, a_block, all_of
from runs import DURATION, a_scene

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.contact_surface import contact_surface
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.output.fields import Fields, write_vtu
from iceslide_fem.output.grids import FacetGrid, Grid, RubberGrid, tensor_grid

TIMES = [0.0, 3.1e-3, DURATION]


def write_fields(directory, cells, with_ice):
    """A sheared block in contact at its bottom, above warm ice."""
    rubber = HyperelasticBody(
        a_block(cells, comm=MPI.COMM_SELF), all_of(a_scene("slice").mooney_rivlin)
    )
    surface = contact_surface(rubber.space, rubber.facets("contact"), 4)
    height = rubber.space.tabulate_dof_coordinates()[:, rubber.mesh.geometry.dim - 1]
    lines = [np.linspace(0.0, SIZE, 5)] * (rubber.mesh.geometry.dim - 1)
    lines.append(np.linspace(-SIZE, 0.0, 5))
    ice = np.broadcast_to(4.0 * lines[-1] / SIZE, [5] * len(lines))
    nodes, facets = RubberGrid(rubber), FacetGrid(rubber, surface)
    fields = Fields(directory / "fields", MPI.COMM_SELF)
    for time in TIMES:
        rubber.displacements[:, 0] = -0.2 * time / DURATION * (SIZE - height)
        x = surface.positions(rubber.displacements)
        bottom = surface.nodes[..., -1].max(axis=1, keepdims=True) < 1e-9 * SIZE
        pressure = np.where(bottom, 1e5 * (1.5 + x[..., 0] / SIZE), 0.0)
        values = {
            "contact pressure (Pa)": pressure,
            "film height (m)": 5e-8 + 1e-5 * x[..., 0],
            "surface temperature (degC)": -1.0 - x[..., 0] / SIZE,
        }
        grids = {
            "rubber": nodes.grid(rubber.displacements, None, with_ice),
            "interface": facets.grid(rubber.displacements, values),
        }
        if with_ice:
            grids["ice"] = tensor_grid(lines, {"temperature (degC)": ice})
        fields.write(time, grids)


def in_parts(directory):
    """Let the ice be in two files at each time, as two ranks write it."""
    folder = directory / "fields"
    lines = []
    for number, time in enumerate(TIMES):
        whole = meshio.read(folder / f"ice_{number:06d}.vtu")
        (block,) = whole.cells
        half = len(block.data) // 2
        for part, cells in enumerate((block.data[:half], block.data[half:])):
            used, inner = np.unique(cells, return_inverse=True)
            values = {name: data[used] for name, data in whole.point_data.items()}
            grid = Grid(whole.points[used], block.type, inner.reshape(cells.shape), values, {})
            name = f"ice_{number:06d}{'_1' * part}.vtu"
            write_vtu(folder / name, grid)
            lines.append(f'<DataSet timestep="{time:.12g}" part="{part}" file="{name}" />')
    inside = f"<Collection>{''.join(lines)}</Collection>"
    (folder / "ice.pvd").write_text(f'<VTKFile type="Collection" version="1.0">{inside}</VTKFile>')
