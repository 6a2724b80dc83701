"""Meshed ice that passes keeps nothing of the contacts that have passed."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx

from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.heat.elements import LayeredElements  # noqa: E402
from iceslide_fem.heat.equation import HeatEquation, of_regions  # noqa: E402
from iceslide_fem.interface.ice_mesh import Settings  # noqa: E402
from iceslide_fem.interface.passing_mesh import PassingMeshedIce  # noqa: E402
from iceslide_fem.interface.surface_grid import Contacts, SurfaceGrid  # noqa: E402
from iceslide_fem.mesh import gmsh_model  # noqa: E402
from iceslide_fem.mesh.ice import tagged_ice  # noqa: E402
from iceslide_fem.mesh.ice_body import upright  # noqa: E402
from iceslide_fem.scene.materials import ICE, Layer  # noqa: E402

pytestmark = pytest.mark.fe
RESIDENT = Path("/proc/self/statm")


@pytest.mark.skipif(not RESIDENT.exists(), reason="this system does not tell a process's memory")
def test_contacts_that_have_passed_take_no_memory():
    along, down = np.linspace(0.0, 1e-3, 21), np.linspace(-1e-4, 0.0, 4)
    body = gmsh_model.distribute(
        upright(tagged_ice([along, down], (Layer("ice", np.inf, ICE),))), MPI.COMM_WORLD
    )
    equation = HeatEquation(body, LayeredElements(body.mesh), of_regions(body, {"ice": ICE}))
    grid = SurfaceGrid.shared([along], MPI.COMM_WORLD)
    ice = PassingMeshedIce(equation, grid, Settings(ICE, 269.15, 1e-8, 1e-4))
    points = np.linspace(0.0, 1e-3, 2000)[:, None]
    area = np.full(len(points), 5e-7)

    def megabytes_of(contacts):
        before = int(RESIDENT.read_text().split()[1])
        for _ in range(contacts):
            ice.under(Contacts(grid.place(points), area))
        return 4096e-6 * (int(RESIDENT.read_text().split()[1]) - before)

    megabytes_of(20)
    assert megabytes_of(200) < 5.0  # they have 40 MB
