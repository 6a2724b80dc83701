"""A tread of blocks and grooves that moves over the ice while both pass the patch.

A piece of ice is below one block for l / w at most, then below a groove for g / w, and below the
next block. What a row of blocks leaves behind on the ice the next one finds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array

PHASES = 6  # within 0.4 % of 48 of them (docs/explanation/wheel.md)
FINEST = 4.0  # pixels in which a groove passes, at least


class Pattern(NamedTuple):
    """Blocks along the wheel, `pitch` (m) from edge to edge, with a `groove` (m) between two.

    phases: places of the pattern above the ice that enters, which stand for all.
    """

    pitch: float
    groove: float
    phases: int = PHASES

    def over(self, pressure: Array, slid: float) -> Array:
        """Pressures (phases n, nx), Pa, that ice sees below pressures (n, nx) of a smooth tread.

        slid: by how far (m) the tread slides over the ice while that passes a pixel. Blocks carry
        the same load on their part of the area.
        """
        columns = pressure.shape[1]
        way = (np.arange(columns) + 0.5) * slid
        phases = (np.arange(self.phases) + 0.5) / self.phases * self.pitch
        block = self.pitch - self.groove
        below = (way + phases[:, None]) % self.pitch < block  # (phases, nx)
        seen = below[:, None] * pressure * (self.pitch / block)
        return np.asarray(seen.reshape(-1, columns))

    def refinement(self, slid: float) -> int:
        """Into how many parts a pixel is split so that no groove is overlooked."""
        return max(1, int(np.ceil(FINEST * slid / self.groove)))
