"""Checks of the layers of other compounds above the rubber that touches the ice."""

from __future__ import annotations

from itertools import pairwise

from iceslide_fem.runtime.units import readable
from iceslide_fem.scene.rubber import BODY, Rubber

PARTS = ("contact", "plate", "symmetry", "walls")  # names of facets in `rubber.mesh`
UNCUT = 2.0  # of the lower edges' cut: height of the cells that it takes


def check_layers(rubber: Rubber) -> None:
    """Raise ValueError if the layers, or names of parts of a mesh, are not possible."""
    names = [layer.name for layer in rubber.layers]
    for number, name in enumerate(names):
        if name in (BODY, *PARTS, *names[:number]):
            raise ValueError(
                f'rubber.layers has the name "{name}" twice (the rubber at the ice is "{BODY}", '
                f"and {', '.join(PARTS)} are faces); allowed: a different name for each layer"
            )
    known = (BODY, *PARTS, *names)
    for name in rubber.mesh_tags:
        if name not in known:
            raise ValueError(
                f"rubber.mesh_tags.{name} is not a known name; allowed: {', '.join(known)}"
            )
    for layer in rubber.layers:
        if layer.above is None and not rubber.is_drawn:
            raise ValueError(
                f'layer "{layer.name}" of rubber.layers has no `above`, the height above the ice '
                "where it begins"
            )
        if layer.above is not None and rubber.step is not None:
            raise ValueError(
                f'rubber.step and `above` of layer "{layer.name}" contradict each other; allowed: '
                "the name of a solid of the file"
            )
    heights = rubber.heights
    if any(high <= low for low, high in pairwise(heights)):
        raise ValueError("rubber.layers are not in order; allowed: `above` that grows")
    if heights and not rubber.is_drawn:
        _check_heights(rubber, heights[0], heights[-1])


def _check_heights(rubber: Rubber, lowest: float, highest: float) -> None:
    """Raise ValueError unless the layers begin inside the built-in block, above its edges' cut."""
    least, most = UNCUT * max(rubber.edge_radius, rubber.chamfer), rubber.height
    if not (least < lowest and highest < most):
        where = f"less than rubber.height = {readable(most, 'm')}"
        if least:
            where = f"more than {readable(least, 'm')}, twice the cut of the edges, and {where}"
        wrong = lowest if lowest <= least else highest
        raise ValueError(
            f"a layer of rubber.layers begins {readable(wrong, 'm')} above the ice; allowed: "
            f"{where}"
        )
