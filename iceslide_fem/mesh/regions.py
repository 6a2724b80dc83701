"""Fields with one value in each region of a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import fem
from iceslide_fem.mesh.gmsh_model import DistributedMesh


def field_by_region(body: DistributedMesh, values: Mapping[str, float]) -> Any:
    """A piecewise constant Function with the value of each region of `body`, ghosts included."""
    space = compat.cellwise_space(body.mesh)
    dofs, field = compat.cell_dofs(space)[:, 0], fem.Function(space)
    for name, number in body.regions.items():
        field.x.array[dofs[body.cell_tags.find(number)]] = values[name]
    field.x.scatter_forward()
    return field
