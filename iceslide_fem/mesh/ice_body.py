"""The mesh of the ice."""

import numpy as np

from iceslide_fem.mesh.grid import tensor_grid
from iceslide_fem.mesh.ice import patch_lines
from iceslide_fem.thermal_layers import stacked_layers


def ice_body(scene, footprint, heated=None):
    lines = [l[::int(__import__("os").environ.get("STEP","2"))] for l in patch_lines(scene, footprint)]
    th = stacked_layers(scene.ice.stack, scene.load.duration if heated is None else heated)
    z = -np.append(0, np.cumsum(th.thickness))[::-1]
    return tensor_grid([*lines, z], "ice", {"surface": lambda c: c[:, -1] == 0.0})
