"""How solids that are heated from their surface are meshed below it: in thermal layers.

Heat that enters at a surface reaches some thermal layers sqrt(alpha t) deep, and its temperature
falls most steeply there: layers start thin and grow. Each is a quadratic element.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.arrays import Array

# First layer relative to the thermal layer of the whole run, growth of the layers below, and how
# deep they go: erfc(2) = 0.5 % of the rise is left there. The surface temperature under constant
# flux is then within 4e-5 from a hundredth of the run on, within 8e-5 from a thousandth on.
FIRST_LAYER = 0.025
LAYER_RATIO = 1.4
HEATED_LAYERS = 4.0


def layers(
    diffusivity: float,
    duration: ArrayLike,
    first_layer: float = FIRST_LAYER,
    ratio: float = LAYER_RATIO,
    depth: float = HEATED_LAYERS,
) -> Array:
    """Thickness (m) of the layers below a surface that is heated for `duration` (s), downwards.

    `first_layer` and `depth` are in thermal layers sqrt(alpha t) of the shortest and of the longest
    of the durations: what is made for two has the layers of one for the shorter, and more below
    them. diffusivity: alpha, m2/s.
    """
    first = first_layer * np.sqrt(diffusivity * np.min(duration))
    total = depth * np.sqrt(diffusivity * np.max(duration))
    count = math.ceil(np.log1p(total / first * (ratio - 1.0)) / np.log(ratio))
    return np.asarray(first * ratio ** np.arange(count))


def node_depths(thickness: Array) -> Array:
    """Depths (m, from 0 downwards) of the nodes of layers of that `thickness` (m)."""
    edges = np.append(0.0, np.cumsum(thickness))
    return np.sort(np.concatenate([edges, edges[:-1] + 0.5 * thickness]))
