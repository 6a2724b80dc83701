"""Solids of a CAD file that are layers of other rubber, by their names or by numbers upwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import gmsh
import numpy as np

from iceslide_fem.mesh.cad.solids import BadCad, Entity, box_of
from iceslide_fem.mesh.tagged import IntArray
from iceslide_fem.runtime.arrays import Array


def chosen(solids: Mapping[Entity, str], layers: Sequence[str]) -> list[int]:
    """For each of the placed solids the number of its layer from 1 on, 0 for the rubber at the ice.

    solids: with their names in the file. A layer has that name, in letters, digits and _; or it is
    solid_1, solid_2 and so on, by the heights of their centres. Raises BadCad for another name.
    """
    centres = [gmsh.model.occ.getCenterOfMass(*solid)[2] for solid in solids]
    numbers = [f"solid_{1 + rank}" for rank in np.argsort(np.argsort(centres)).tolist()]
    found = [0] * len(solids)
    for number, layer in enumerate(layers, start=1):
        names = zip(numbers, solids.values(), strict=True)
        mine = [n for n, both in enumerate(names) if _plain(layer) in map(_plain, both)]
        if not mine:
            raise BadCad(
                f'has no solid "{layer}" of rubber.layers; allowed: '
                f"{_listed(solids, numbers)}, or their names in the file"
            )
        for n in mine:
            found[n] = number
    return found


def _listed(solids: Mapping[Entity, str], numbers: Sequence[str]) -> str:
    """The solids with their names and heights."""
    said = []
    for (solid, name), number in zip(solids.items(), numbers, strict=True):
        low, high = box_of([solid])
        named = f'"{name}", ' if name else ""
        said.append(f"{number} ({named}{low[2]:.4g} to {high[2]:.4g} mm high)")
    return ", ".join(sorted(said))


def _plain(name: str) -> str:
    """A name as a scene can have it: in small letters, digits and _."""
    return "".join(letter if letter.isalnum() else "_" for letter in name.casefold())


def layers_at(saved: Path, numbers: Sequence[int], places: Array) -> IntArray:
    """The layer (n,) at `places` (n, 3), in a new model of the solids that are `saved` as BREP.

    numbers: of the layer of each solid, in their order.
    """
    gmsh.model.add("solids")
    solids = gmsh.model.occ.importShapes(str(saved), highestDimOnly=True)
    gmsh.model.occ.synchronize()
    found = np.zeros(len(places), dtype=np.int64)
    for solid, number in zip(solids, numbers, strict=True):
        if number:
            low, high = box_of([solid])
            near = ((low <= places) & (places <= high)).all(axis=1)
            for place in np.flatnonzero(near):
                if gmsh.model.isInside(*solid, places[place].tolist()):
                    found[place] = number
    gmsh.model.remove()
    return found
