"""Which rank gets which cells: the mesh is cut vertically, so that all get a share of the contact.

Graph partitioners cut where the fewest facets are: through a cube as readily between plate and ice,
which leaves films and contact to one rank.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.runtime.arrays import Array


def owners(middles: Array, ranks: int) -> NDArray[np.int32]:
    """Rank of each cell, of as many each: recursive bisection across the longer side.

    `middles` (n, d-1): horizontal positions of the cells' middles, m.
    """
    found = np.zeros(len(middles), dtype=np.int32)
    size = np.ptp(middles, axis=0).max(initial=0.0) if len(middles) else 0.0
    places = np.round(middles / (size or 1.0), 9)  # cells above one another are at one place

    def share(cells: NDArray[np.intp], first: int, count: int) -> None:
        if count == 1 or not cells.size:
            found[cells] = first
            return
        axis = int(np.ptp(places[cells], axis=0).argmax())
        keys = [places[cells, other] for other in range(places.shape[1]) if other != axis]
        cells = cells[np.lexsort([*keys, places[cells, axis]])]
        low = count // 2
        cut = round(cells.size * low / count)
        share(cells[:cut], first, low)
        share(cells[cut:], first + low, count - low)

    share(np.arange(len(middles)), 0, ranks)
    return found
