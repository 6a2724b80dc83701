"""Layers of other compounds in the mesh of the rubber: its regions."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.rubber import Layer

ON_LINE = 1e-6  # of the height: tolerance of a node at the begin of a layer


def with_layers(tagged: TaggedMesh, layers: Sequence[Layer]) -> TaggedMesh:
    """The rubber with each of the `layers` as a region.

    A layer that begins at a height (`above`) takes the cells from there to the next one. Others are
    regions of the mesh already. Raises SceneError if cells cross that height, if a layer has no
    cells, or if one touches the ice.
    """
    if not layers:
        return tagged
    owner = np.zeros(len(tagged.cells), dtype=np.int64)
    names = [tagged.body, *(layer.name for layer in layers)]
    for name, cells in tagged.named_cells.items():
        owner[cells] = names.index(name)
    z = tagged.points[tagged.cells][..., -1]
    height = float(tagged.points[:, -1].max())
    ends = [(n, layer.above) for n, layer in enumerate(layers, 1) if layer.above is not None]
    for (number, low), (_, high) in pairwise([*ends, (0, np.inf)]):
        near = ON_LINE * height
        crossing = (z.min(axis=1) < low - near) & (z.max(axis=1) > low + near)
        if crossing.any():
            raise SceneError(
                f'layer "{names[number]}" of rubber.layers begins {1e3 * low:.6g} mm above the '
                "ice, inside cells of rubber.mesh; allowed: a height at which only faces of cells "
                "are, or cells with the layer's name instead of `above`"
            )
        middle = z.mean(axis=1)
        owner[(owner == 0) & (low < middle) & (middle < high)] = number
    for number, name in enumerate(names):
        mine = owner == number
        if not mine.any():
            raise SceneError(
                f'rubber.layers leaves nothing to "{name}": the block is {1e3 * height:.6g} mm '
                "high; allowed: layers that begin inside it"
            )
        if number and z[mine].min() <= ON_LINE * height:
            raise SceneError(
                f'layer "{name}" of rubber.layers touches the ice, where k, D, H_V, heat and '
                "friction are those of [rubber]; allowed: layers above it"
            )
    regions = {name: np.flatnonzero(owner == number) for number, name in enumerate(names)}
    return tagged._replace(regions=regions)
