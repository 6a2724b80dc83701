"""Linear response of the ice's surface in an implicit stage.

The surface temperature is an offset plus a symmetric response to the heat of its nodes. The
response is diagonal in the lateral modes (`ice_modes`), or in the columns without lateral
conduction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.interface.ice_modes import SurfaceModes
from iceslide_fem.runtime.arrays import Array


class StageSurface(NamedTuple):
    """The surface in a stage.

    offset: nodal temperatures without heat, K; resistance: of the lateral modes, or of the columns,
    K m2/W. Both have the grid's shape, or are flattened.
    """

    offset: Array
    resistance: Array


class SurfaceConduction:
    """Conduction below the surface in a `stage`; arrays are of all nodes, (n,)."""

    def __init__(
        self,
        stage: StageSurface,
        cell_area: Array,
        shape: tuple[int, ...],
        modes: SurfaceModes | None,
    ) -> None:
        """cell_area: of the nodes, m2; shape: of the grid; modes: None without lateral
        conduction.
        """
        self.stage, self.cell_area, self._modes, self._shape = stage, cell_area, modes, shape
        self.offset = stage.offset.ravel()
        self.resistance = stage.resistance.reshape(shape)
        ends = float(self.resistance.min()), float(self.resistance.max())
        self.middle, self.most = float(np.sqrt(ends[0] * ends[1])), ends[1]  # resistances, K m2/W

    def taken(self, rise: Array) -> Array:
        """Heat (W) that the ice takes at a surface `rise` (K) above the offset."""
        if self._modes is None:
            return self.cell_area / self.resistance.ravel() * rise
        amplitudes = self._modes.amplitudes(rise.reshape(self._shape))
        return self._modes.loads(amplitudes / self.resistance).ravel()

    def warmed(self, heat: Array) -> Array:
        """Rise (K) of the surface above the offset at a `heat` (W) into the ice."""
        if self._modes is None:
            return self.resistance.ravel() / self.cell_area * heat
        amplitudes = self._modes.load_amplitudes(heat.reshape(self._shape))
        return self._modes.values(amplitudes * self.resistance).ravel()
