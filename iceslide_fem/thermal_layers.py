"""How solids that are heated from their surface are meshed below it: in thermal layers.

Heat that enters at a surface reaches some thermal layers sqrt(alpha t) deep, and its temperature
falls most steeply there: layers start thin and grow. Each is a quadratic element.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.arrays import Array, Index
from iceslide_fem.materials import Layer

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


class StackedLayers(NamedTuple):
    """Elements below a surface, downwards.

    Their thickness (m), the number of the layer of the stack that each lies in, and whether they
    end on the `base` of the stack: else they end where heat does not reach.
    """

    thickness: Array
    layer: Index
    base: bool


def stacked_layers(
    stack: Sequence[Layer],
    duration: ArrayLike,
    first_layer: float = FIRST_LAYER,
    ratio: float = LAYER_RATIO,
    depth: float = HEATED_LAYERS,
    to_base: bool = False,
) -> StackedLayers:
    """Elements through a `stack` of solids below a surface that is heated, as `layers` grades one.

    Depth counts in thermal layers, of each solid its own: below the thermal depth z (s^0.5) an
    element is up to first + (ratio - 1) z thick, times sqrt(alpha). Interfaces lie between
    elements: a layer of the stack has as few as that allows, which grow in one ratio. The stack
    is cut where heat does not reach; `to_base` keeps it whole, for heat that comes from its base.
    A half-space, one layer of infinite thickness, has the elements of `layers`.
    """
    sizes: list[Array] = []
    counts: list[int] = []
    passed = 0.0  # thermal depth of the layer's upper face, s^0.5
    base = True
    for _, thickness, solid in stack:
        alpha, above = solid.diffusivity, np.sqrt(solid.diffusivity) * passed
        rest = np.inf if to_base else depth * np.sqrt(alpha * np.max(duration)) - above
        if rest <= 0.0:
            base = False
            break
        first = first_layer * np.sqrt(alpha * np.min(duration)) + (ratio - 1.0) * above
        ends = np.array([thickness, rest])  # of the layer, and of what is heated
        needed, heated = np.log1p(ends / first * (ratio - 1.0)) / np.log(ratio)
        count = math.ceil(min(needed, heated))
        base = needed <= count
        growth = ratio ** (needed / count) if base else ratio
        sizes.append(first * ((growth - 1.0) / (ratio - 1.0)) * growth ** np.arange(count))
        counts.append(count)
        passed += thickness / np.sqrt(alpha)
    return StackedLayers(np.concatenate(sizes), np.repeat(np.arange(len(counts)), counts), base)


def node_depths(thickness: Array) -> Array:
    """Depths (m, from 0 downwards) of the nodes of layers of that `thickness` (m)."""
    edges = np.append(0.0, np.cumsum(thickness))
    return np.sort(np.concatenate([edges, edges[:-1] + 0.5 * thickness]))
