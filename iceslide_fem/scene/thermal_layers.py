"""Graded meshes below a heated surface, in thermal layers.

Heat from a surface penetrates some thermal layers sqrt(alpha t). The temperature falls most steeply
at the surface, so elements start thin and grow. Each layer is a quadratic element.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.materials import HEATED_LAYERS, Layer

# First layer over the thermal layer of the whole run, and growth of layers. The error of the
# surface temperature under constant flux is then 4e-5 after a hundredth of the run, and 8e-5 after
# a thousandth.
FIRST_LAYER = 0.025
LAYER_RATIO = 1.4
# Allowed excess thickness of the last element of a layer, over that of one more element. Without it
# an element of a fifth of the thickness could remain.
LAST_STRETCH = 0.25


class StackedLayers(NamedTuple):
    """Elements below a surface, downwards.

    Thickness (m) and stack layer of each element, and whether they end on the `base` of the stack.
    Otherwise they end where heat does not reach.
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
    """Graded elements through a `stack` of solids below a heated surface.

    Depth is measured in thermal layers of each solid. At the thermal depth z (s^0.5) an element has
    the thickness first + (ratio - 1) z, times sqrt(alpha). Interfaces of solids are element
    boundaries: the last element of a layer is thinner, or up to a quarter thicker. The stack is cut
    where heat does not reach. With heat from its base (`to_base`, finite stack) it is meshed whole,
    and graded from both faces to the middle. Elements for two durations are those for the shorter
    one, and more below.
    """
    if to_base:
        upper, lower = (
            stacked_layers(half, duration, first_layer, ratio, np.inf) for half in _halves(stack)
        )
        elements = np.append(upper.thickness, lower.thickness[::-1])
        layer = np.append(upper.layer, len(stack) - 1 - lower.layer[::-1])
        return StackedLayers(elements, layer, True)
    sizes: list[Array] = []
    passed, base = 0.0, True  # thermal depth of the layer's upper face, s^0.5
    for _, thickness, solid in stack:
        alpha, above = solid.diffusivity, np.sqrt(solid.diffusivity) * passed
        heated = depth * np.sqrt(alpha * np.max(duration)) - above
        if heated <= 0.0:
            base = False
            break
        first = first_layer * np.sqrt(alpha * np.min(duration)) + (ratio - 1.0) * above
        ends = np.array([thickness, heated])
        needed = np.log1p(ends / first * (ratio - 1.0)) / np.log(ratio)
        whole, reached = np.maximum(np.ceil(needed - [LAST_STRETCH, 0.0]), 1.0).tolist()
        base = whole <= reached
        grown = np.asarray(first * ratio ** np.arange(min(whole, reached)))
        if base:
            grown[-1] = thickness - grown[:-1].sum()
        sizes.append(grown)
        passed += float(thickness / np.sqrt(alpha))
    layer = np.repeat(np.arange(len(sizes)), [part.size for part in sizes])
    return StackedLayers(np.concatenate(sizes), layer, base)


def _halves(stack: Sequence[Layer]) -> tuple[list[Layer], list[Layer]]:
    """The stack down to its thermal middle, and up to it (within 1 % of the layer there)."""
    thermal = np.array([thickness / solid.diffusivity**0.5 for _, thickness, solid in stack])
    ends = np.cumsum(thermal)
    above = np.round(np.clip((0.5 * ends[-1] - ends) / thermal + 1.0, 0.0, 1.0), 2)
    upper, lower = (
        [
            layer._replace(thickness=part * layer.thickness)
            for layer, part in zip(stack, parts, strict=True)
            if part
        ]
        for parts in (above, 1.0 - above)
    )
    return upper, lower[::-1]


def node_depths(thickness: Array) -> Array:
    """Depths (m, from 0 downwards) of the nodes of layers of that `thickness` (m)."""
    edges = np.append(0.0, np.cumsum(thickness))
    return np.sort(np.concatenate([edges, edges[:-1] + 0.5 * thickness]))
