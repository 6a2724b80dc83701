"""Meshes of the ice and what lies below it: regions, lines, users' own, pictures."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

import ufl  # noqa: E402
from dolfinx import fem  # noqa: E402
from mpi4py import MPI  # noqa: E402

from iceslide_fem.fenics import compat  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.grid import tensor_grid  # noqa: E402

pytestmark = pytest.mark.fe
ROOT = Path(__file__).parent.parent
WORLD = MPI.COMM_WORLD


def two_regions(dim):
    """6 x (2 x) 4 cells of 1 (by 1) by 1 mm; what is below 2 mm of ice is steel."""
    lines = [np.linspace(0, 6e-3, 7), np.linspace(0, 2e-3, 3), np.linspace(-4e-3, 0, 5)]
    chosen = lines if dim == 3 else [lines[0], lines[2]]
    grid = tensor_grid(chosen, "ice", {"surface": lambda centre: centre[:, -1] == 0.0})
    deep = grid.points[grid.cells, -1].mean(axis=1) < -2e-3
    return grid._replace(regions={"ice": np.flatnonzero(~deep), "steel": np.flatnonzero(deep)})


def volumes(meshed):
    """Of the regions by their names."""
    one = fem.Constant(meshed.mesh, 1.0)
    inside = ufl.Measure("dx", meshed.mesh, subdomain_data=meshed.cell_tags)
    return {
        name: compat.assemble_scalar(compat.form(one * inside(number)), WORLD)
        for name, number in meshed.regions.items()
    }


# --- regions in DOLFINx


@pytest.mark.three
@pytest.mark.mpi
@pytest.mark.parametrize("dim", [2, 3])
def test_regions_and_facets_have_their_tags_on_every_rank(dim):
    meshed = gmsh_model.distribute(two_regions(dim), WORLD)
    width = 2e-3 if dim == 3 else 1.0
    assert volumes(meshed) == pytest.approx({"ice": 12e-6 * width, "steel": 12e-6 * width})
    outer = ufl.Measure("ds", meshed.mesh, subdomain_data=meshed.facet_tags)
    surface = fem.Constant(meshed.mesh, 1.0) * outer(meshed.tags["surface"])
    assert compat.assemble_scalar(compat.form(surface), WORLD) == pytest.approx(6e-3 * width)
    cells = meshed.mesh.topology.index_map(dim)
    assert len(meshed.cell_tags.indices) == cells.size_local + cells.num_ghosts


@pytest.mark.three
@pytest.mark.mpi
def test_columns_of_cells_stay_on_one_rank():
    meshed = gmsh_model.distribute(two_regions(3), WORLD)
    places = np.round(1e3 * compat.cell_midpoints(meshed.mesh)[:, :2], 6)
    columns, counts = np.unique(places, axis=0, return_counts=True)
    assert (counts == 4).all()
    assert sum(WORLD.allgather(len(columns))) == 12


def test_one_body_is_one_region():
    grid = two_regions(2)._replace(regions={})
    assert gmsh_model.distribute(grid, MPI.COMM_SELF).regions == {"ice": 1}
    assert grid.named_cells["ice"].tolist() == list(range(24))
