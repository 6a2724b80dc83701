"""Mesh a CAD file in this process: `python -m iceslide_fem.mesh.cad.worker OPTIONS RESULT`.

OPTIONS is JSON (`tread.Options`). RESULT becomes a .npz with points (m), cells, names of facets,
middles of facets that are not on the CAD, and what was found; or, with exit code 2, a text file
with one sentence.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

import gmsh
import numpy as np

from iceslide_fem.mesh.cad.cells import hexahedra, is_swept, section, tetrahedra
from iceslide_fem.mesh.cad.collected import Meshed
from iceslide_fem.mesh.cad.compounds import chosen, layers_at
from iceslide_fem.mesh.cad.naming import NEAR, named
from iceslide_fem.mesh.cad.solids import BadCad, found_up, placed, read_solids
from iceslide_fem.mesh.cad.stacked import heights, stacked
from iceslide_fem.mesh.cad.tread import MILLIMETRE, Options
from iceslide_fem.mesh.gmsh_model import empty_model
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array


class Tread(NamedTuple):
    """A mesh in file units; the axis of the file that is up, and why; the layer of each cell, 0
    for the rubber at the ice.
    """

    mesh: Meshed
    up: str
    why: str
    layer: IntArray


def meshed(options: Options, saved: Path) -> Tread:
    """The mesh of a file; saved: a file for its placed solids. Raises BadCad."""
    heal = options.heal / MILLIMETRE
    solids = read_solids(Path(options.path), heal)
    up, why = found_up(heal) if options.up == "auto" else (options.up, "as given")
    low, high = placed([*solids], up, options.along, heal)
    layers = chosen(solids, options.layers)
    if any(layers):
        gmsh.write(str(saved))
    at = 0.5 * float(low[1] + high[1]) if options.plane is None else options.plane / options.unit
    mesh = (
        section(low, high, at, options.refinement)
        if options.dim == 2
        else _block(options, low, high)
    )
    middles = mesh.body.points[mesh.body.cells].mean(axis=1)
    if options.dim == 2:
        middles = np.insert(middles, 1, at, axis=1)
    owner = layers_at(saved, layers, middles) if any(layers) else np.zeros(len(middles), dtype=int)
    return Tread(mesh, up, why, owner)


def _block(options: Options, low: Array, high: Array) -> Meshed:
    """Cells of a block: hexahedra if they fill it, else tetrahedra. Raises BadCad."""
    if options.cells != "tetrahedra":
        if levels := heights(low, high):
            return stacked(low, high, levels, options.refinement)
        if is_swept(low, high):
            return hexahedra(low, high, options.refinement)
    if options.cells == "hexahedra":
        raise BadCad(
            "is no sweep along y and has faces that are neither flat nor upright, so it cannot "
            'have hexahedra; allowed: rubber.step_cells = "tetrahedra"'
        )
    return tetrahedra(low, high, options.refinement)


def main() -> None:
    """Write the mesh, or why there is none."""
    options, result = Options(**json.loads(sys.argv[1])), Path(sys.argv[2])
    try:
        with empty_model():
            found, up, why, layer = meshed(options, result.with_suffix(".brep"))
    except BadCad as error:
        result.write_text(str(error), encoding="utf-8")
        sys.exit(2)
    except Exception as error:  # gmsh raises nothing more specific
        result.write_text(f"cannot be meshed: {' '.join(str(error).split())}", encoding="utf-8")
        sys.exit(2)
    points = _snapped(found.body.points, found.symmetric)
    body = found.body._replace(points=points)
    gap = 0.5 * float(points[:, -1].max()) if options.gap is None else options.gap / options.unit
    facets = named(body, found.facets, found.owner, gap, found.symmetric)
    arrays: dict[str, Any] = {f"facets_{name}": nodes for name, nodes in facets.items()}
    arrays |= {"points": points * options.unit, "cells": body.cells, "layer": layer}
    curved = np.linalg.norm(found.bulges, axis=1) > NEAR * np.ptp(points[:, -1])
    for name, part in (("middles", found.middles), ("bulges", found.bulges)):
        arrays[name] = part[curved] * options.unit
    np.savez(result, **arrays, words=[body.cell_type, up, why])


def _snapped(points: Array, symmetric: bool) -> Array:
    """Points with heights 0 and H, and y = 0, without rounding."""
    points = points.copy()
    points[:, -1] -= points[:, -1].min()
    height = float(points[:, -1].max())
    for axis, value in ((-1, 0.0), (-1, height), *(((1, 0.0),) if symmetric else ())):
        points[np.abs(points[:, axis] - value) < NEAR * height, axis] = value
    return points


if __name__ == "__main__":
    main()
