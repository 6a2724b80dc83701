"""Materials of the rubber's cells: fields of their constants, and cells that relax alike."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import fem
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.runtime.arrays import Index
from iceslide_fem.scene.materials import MooneyRivlin


class Material(NamedTuple):
    """A rubber: constants, instantaneous if it relaxes; relaxation; density, kg/m3, which is 0
    without inertia.
    """

    constants: MooneyRivlin
    relaxation: Relaxation | None = None
    density: float = 0.0


class Materials:
    """The materials of a mesh, cell by cell.

    constants, density: piecewise constant Functions; regions: of each cell of this rank, ghosts
    included, by its number from 0 on in the order of the materials.
    """

    def __init__(self, block: DistributedMesh, materials: Mapping[str, Material]) -> None:
        """materials: of each region of `block`. Collective."""
        space = compat.cellwise_space(block.mesh)
        self._dofs = compat.cell_dofs(space)[:, 0]
        self._regions = [
            (materials[name], block.cell_tags.find(number))
            for name, number in block.regions.items()
        ]
        fields: list[Any] = [fem.Function(space) for _ in range(4)]
        self.regions = np.zeros(len(self._dofs), dtype=np.int32)
        for number, ((constants, _, density), cells) in enumerate(self._regions):
            self.regions[cells] = number
            values = constants.C10, constants.C01, constants.D1, density
            for field, value in zip(fields, values, strict=True):
                field.x.array[self._dofs[cells]] = value
        for field in fields:
            field.x.scatter_forward()
        self._fields, self.density = fields[:3], fields[3]
        self.constants = MooneyRivlin(*self._fields)

    @property
    def several(self) -> bool:
        """Whether there is more than one."""
        return len(self._regions) > 1

    @property
    def have_mass(self) -> bool:
        """Whether any material has a density."""
        return any(material.density > 0.0 for material, _ in self._regions)

    @property
    def relaxing(self) -> list[tuple[Relaxation, Index]]:
        """Relaxations, each with its cells of this rank, ghosts included; empty if all is
        elastic.
        """
        return [
            (material.relaxation, cells)
            for material, cells in self._regions
            if material.relaxation is not None
        ]

    def at_cells(self, cells: Index) -> MooneyRivlin:
        """Constants of local `cells` (c,), as arrays (c, 1)."""
        dofs = self._dofs[cells, None]
        return MooneyRivlin(*(np.real(field.x.array)[dofs] for field in self._fields))
