"""Checks that the cuts of the built-in block fit into it."""

from __future__ import annotations

from itertools import pairwise
from math import inf, tan

from iceslide_fem.scene.rubber import Rubber

DEEPEST = 0.9  # of the height: the rest holds the lugs
LARGEST_EDGE = 0.2  # largest cut of an edge, of a lug, of the height and of a depth
SMALLEST_EDGE = 1e-6  # m


def check_shape(rubber: Rubber) -> None:
    """Raise ValueError if the cuts do not fit into the block."""
    _check_depths(rubber)
    _check_lugs(rubber)
    _check_grooves(rubber)


def _check_depths(rubber: Rubber) -> None:
    depths = [(f"grooves.{n}.depth", groove.depth) for n, groove in enumerate(rubber.grooves)]
    if isinstance(rubber.sipes, int):
        depths += [("sipe_depth", sipe.depth) for sipe in rubber.cuts]
    else:
        depths += [(f"sipes.{n}.depth", sipe.depth) for n, sipe in enumerate(rubber.sipes)]
    for key, depth in depths:
        if depth > DEEPEST * rubber.height:
            raise ValueError(
                f"rubber.{key} = {1e3 * depth:.3g} mm is too deep; allowed: up to "
                f"{DEEPEST:g} rubber.height = {DEEPEST * 1e3 * rubber.height:.3g} mm"
            )


def _check_lugs(rubber: Rubber) -> None:
    """Raise ValueError if sipes overlap or leave no room for edge cuts."""
    half = rubber.length / 2
    walls = [(-half, -half)]
    walls += [*(cut.walls for cut in rubber.cuts), (half, half)]
    thinnest = inf
    for (_, begin), (end, _) in pairwise(walls):
        thinnest = min(thinnest, end - begin)
    if thinnest < 1e-5:
        raise ValueError(
            f"rubber.sipes overlap each other or an end of the block ({1e3 * rubber.length:.3g} mm "
            "long); allowed: at least 0.01 mm of rubber between them"
        )
    edge, name = _edge(rubber)
    if 0.0 < edge < SMALLEST_EDGE:
        raise ValueError(
            f"rubber.{name} = {1e6 * edge:.3g} um is too small to be meshed; allowed: 0, or at "
            f"least {1e6 * SMALLEST_EDGE:g} um"
        )
    depths = [cut.depth for cut in rubber.cuts] + [cut.depth for cut in rubber.grooves]
    most = LARGEST_EDGE * min(thinnest, rubber.height, *depths)
    if edge > most * (1.0 + 1e-9):
        raise ValueError(
            f"rubber.{name} = {1e3 * edge:.3g} mm is too large; allowed: up to "
            f"{1e3 * most:.3g} mm, {LARGEST_EDGE:g} of the shortest lug, of the height, and of the "
            "depth of sipes and grooves"
        )
    most = DEEPEST * half / rubber.height
    if tan(rubber.draft_angle) > most:
        raise ValueError("rubber.draft_angle is too large for a block as tall as this")


def check_room_across(rubber: Rubber) -> None:
    """Raise ValueError if grooves and sides leave no room for edge cuts along x (block only)."""
    begin, narrowest = 0.0, rubber.width
    for groove in sorted(rubber.grooves, key=lambda groove: groove.position):
        low, high = groove.position - groove.width / 2, groove.position + groove.width / 2
        if groove.position > 0.0:  # the middle lug is halved at y = 0
            narrowest = min(narrowest, (low - begin) * (1 if begin else 2))
        begin = high
    narrowest = min(narrowest, (rubber.width / 2 - begin) * (1 if begin else 2))
    edge, name = _edge(rubber)
    most = LARGEST_EDGE * narrowest
    if edge > most * (1.0 + 1e-9):
        raise ValueError(
            f"rubber.{name} = {1e3 * edge:.3g} mm is too large; allowed in a block: up to "
            f"{1e3 * most:.3g} mm, {LARGEST_EDGE:g} of its width, or of a lug's between grooves"
        )


def _edge(rubber: Rubber) -> tuple[float, str]:
    """Size of the edge cut, m, and its key."""
    return max((rubber.edge_radius, "edge_radius"), (rubber.chamfer, "chamfer"))


def _check_grooves(rubber: Rubber) -> None:
    edge = rubber.width / 2
    reached = 0.0
    for groove in sorted(rubber.grooves, key=lambda groove: groove.position):
        low, high = groove.position - groove.width / 2, groove.position + groove.width / 2
        centred = groove.position == 0.0
        if (low < reached + 1e-5 and not centred) or (centred and reached) or high > edge - 1e-5:
            raise ValueError(
                "rubber.grooves overlap each other, the middle plane or a side of the block; "
                "allowed: at least 0.01 mm of rubber between them, on y = 0 only position = 0"
            )
        reached = high
