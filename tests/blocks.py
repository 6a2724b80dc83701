"""Small blocks of any cell type for the tests of rubber and contact."""

from contextlib import contextmanager

import numpy as np
from dolfinx import mesh as dolfinx_mesh

from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.mechanics.materials import Material
from iceslide_fem.mesh.gmsh_model import DistributedMesh

CELLS = ["triangle", "quadrilateral", "tetrahedron", "hexahedron"]
SIZE = 1e-3  # m, of every edge


@contextmanager
def options_of_rubber(options):
    """PETSc's options for the linear solver of a block that is built, and first solved, meanwhile:
    some are read only then.
    """
    for name, value in options.items():
        PETSc.Options()[f"rubber_{name}"] = value
    try:
        yield
    finally:
        for name in options:
            PETSc.Options().delValue(f"rubber_{name}")


def a_block(cells, n=4, comm=MPI.COMM_WORLD):
    """Square or cube with its corner at the origin, tagged as the rubber's meshes are."""
    kind = getattr(dolfinx_mesh.CellType, cells)
    dim = 2 if cells in ("triangle", "quadrilateral") else 3
    if dim == 2:
        mesh = dolfinx_mesh.create_unit_square(comm, n, n, kind)
    else:
        mesh = dolfinx_mesh.create_unit_cube(comm, n, n, n, kind)

    def contact(x):
        z = x[dim - 1]
        sides = np.isclose(x[0], 0) | np.isclose(x[0], 1)
        if dim == 3:
            sides |= np.isclose(x[1], 1)
        return np.isclose(z, 0) | (sides & (z < 0.51))

    parts = {"contact": contact, "plate": lambda x: np.isclose(x[dim - 1], 1)}
    if dim == 3:
        parts["symmetry"] = lambda x: np.isclose(x[1], 0)
    # a facet is chosen by its vertices, so corners must not join two sides: centres decide
    facets = dolfinx_mesh.locate_entities_boundary(mesh, dim - 1, lambda x: x[0] < 2)
    centres = dolfinx_mesh.compute_midpoints(mesh, dim - 1, facets).T
    tags = np.zeros(len(facets), dtype=np.int32)
    for number, part in enumerate(parts.values(), 1):
        tags[part(centres)] = number
    chosen = np.flatnonzero(tags)
    chosen = chosen[np.argsort(facets[chosen])]
    facet_tags = dolfinx_mesh.meshtags(mesh, dim - 1, facets[chosen], tags[chosen])
    mesh.geometry.x[:] *= SIZE
    every = mesh.topology.index_map(dim)
    cells = np.arange(every.size_local + every.num_ghosts, dtype=np.int32)
    cell_tags = dolfinx_mesh.meshtags(mesh, dim, cells, np.ones_like(cells))
    tags = {name: tag for tag, name in enumerate(parts, 1)}
    return DistributedMesh(mesh, facet_tags, tags, cell_tags, {"rubber": 1})


def all_of(constants, relaxation=None, density=0.0):
    """Materials of a block that is one rubber."""
    return {"rubber": Material(constants, relaxation, density)}


def ripple(rubber):
    """Displace `rubber` by a small wave; its nodes, m."""
    x = rubber.space.tabulate_dof_coordinates()[:, : rubber.mesh.geometry.dim]
    rubber.displacements[:] = 2e-6 * np.sin(1e4 * x + 3.0)
    return x


def along(matrix, way):
    """What `matrix` makes of the changes `way`, in its shape."""
    by_matrix, direction = matrix.createVecLeft(), matrix.createVecRight()
    direction.array[:] = way.ravel()
    matrix.mult(direction, by_matrix)
    return by_matrix.array.reshape(way.shape)


def bend(rubber, size=0.1):
    """Give `rubber` a smooth displacement, the same on any number of ranks."""
    dim = rubber.mesh.geometry.dim

    def field(x):
        a = x[:dim] / SIZE
        waves = [np.sin(4.1 * a[0] + 1.3 * a[i] + 0.7 * a[-1] + i) for i in range(dim)]
        return size * SIZE * (np.array(waves) - 0.5)

    rubber.u.interpolate(field)
    rubber.u.x.scatter_forward()


def left_by(change, equations):
    """What `change` leaves of the present residual, to first order, over its size."""
    values, step = equations.values, 1e-6
    start, before = values.copy(), equations.residual()
    here, plate = equations.parts()
    found = []
    for sign in (1.0, -1.0):
        values[:] = start + sign * step * change
        equations.residual()
        found.append(np.append(*equations.parts()))
    values[:] = start
    left = np.append(here, plate) + (found[0] - found[1]) / (2 * step)
    squares = MPI.COMM_WORLD.allreduce(float(left[:-1] @ left[:-1]), op=MPI.SUM)
    return np.hypot(np.sqrt(squares), left[-1]) / before
