"""A tread of blocks and grooves that slides over the ice while both pass the patch.

A piece of ice is below a block for at most l / w, then below a groove for g / w, then below the
next block. Each block meets the ice as the block before left it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array

PHASES = 6  # within 0.4 % of the result with 48 (docs/explanation/wheel.md)
FINEST = 4.0  # least number of pixels per groove


class Pattern(NamedTuple):
    """Blocks along the wheel, `pitch` (m) from edge to edge, with a `groove` (m) between two.

    phases: representative positions of the pattern relative to the entering ice.
    """

    pitch: float
    groove: float
    phases: int = PHASES

    def over(self, pressure: Array, slid: float) -> Array:
        """Pressures (phases n, nx), Pa, on the ice from pressures (n, nx) of a smooth tread.

        slid: sliding distance of the tread over the ice per pixel, m. Blocks carry the same load on
        their fraction of the area.
        """
        columns = pressure.shape[1]
        way = (np.arange(columns) + 0.5) * slid
        phases = (np.arange(self.phases) + 0.5) / self.phases * self.pitch
        block = self.pitch - self.groove
        below = (way + phases[:, None]) % self.pitch < block  # (phases, nx)
        seen = below[:, None] * pressure * (self.pitch / block)
        return np.asarray(seen.reshape(-1, columns))

    def refinement(self, slid: float) -> int:
        """Number of parts into which a pixel is split to resolve the grooves."""
        return max(1, int(np.ceil(FINEST * slid / self.groove)))
