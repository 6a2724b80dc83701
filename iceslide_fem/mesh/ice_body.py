"""The mesh of the ice."""

import numpy as np

from iceslide_fem.mesh.grid import tensor_grid
from iceslide_fem.mesh.upright import upright
from iceslide_fem.thermal_layers import stacked_layers


def ice_body(scene, lines, heated=None):
    th = stacked_layers(scene.ice.stack, scene.load.duration if heated is None else heated)
    z = -np.append(0, np.cumsum(th.thickness))[::-1]
    return upright(
        tensor_grid(
            [*lines, z],
            "ice",
            {"surface": lambda c: c[:, -1] == 0.0, "base": lambda c: c[:, -1] == z[0]},
        )
    )
