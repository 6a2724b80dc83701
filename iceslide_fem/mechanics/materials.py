"""Materials of the rubber's cells: fields of their constants, and cells that relax alike."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.fenics.compat import PETSc, fem
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.mesh.regions import field_by_region
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

    constants, density: of the forms; one material has form constants, which cost an assembly least,
    several have piecewise constant Functions. regions: of each cell of this rank, ghosts included,
    by its number from 0 on in the order of the materials.
    """

    def __init__(self, block: DistributedMesh, materials: Mapping[str, Material]) -> None:
        """materials: of each region of `block`. Collective."""
        dim = block.mesh.topology.dim
        cells = block.mesh.topology.index_map(dim)
        self.regions = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int32)
        self._regions = [
            (materials[name], block.cell_tags.find(number))
            for name, number in block.regions.items()
        ]
        for number, (_, here) in enumerate(self._regions):
            self.regions[here] = number
        self._values = np.array(
            [(each.C10, each.C01, each.D1, density) for (each, _, density), _ in self._regions]
        )
        fields = [
            _field(block, dict(zip(block.regions, column.tolist(), strict=True)))
            for column in self._values.T
        ]
        self.constants, self.density = MooneyRivlin(*fields[:3]), fields[3]

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
        C10, C01, D1, _ = self._values[self.regions[cells]].T[..., None]
        return MooneyRivlin(C10, C01, D1)


def _field(block: DistributedMesh, values: Mapping[str, float]) -> Any:
    """A form constant where all regions have one value, else a Function."""
    first, *others = set(values.values())
    if others:
        return field_by_region(block, values)
    return fem.Constant(block.mesh, PETSc.ScalarType(first))
