"""What is known to go wrong, or not to be resolved, before a scene runs: beyond its own notes."""

from __future__ import annotations

from math import sqrt

from iceslide_fem.materials import ICE_DIFFUSIVITY
from iceslide_fem.planning.cost import estimate, point_rows
from iceslide_fem.scene import Scene
from iceslide_fem.scene.notes import ENVELOPE, LARGEST_FRICTION
from iceslide_fem.scene.units import readable

LAYERS = 5.0  # of the ice's mesh, at the least, in the depth that is warmed


def warnings(scene: Scene) -> list[str]:
    """A sentence each, without its full stop. Raises SceneError if a user's mesh can't be used."""
    return _film(scene) + ([] if scene.model == "point" else _memory(scene) + _passing(scene))


def _film(scene: Scene) -> list[str]:
    """Films and friction of a point at the nominal pressure, where they leave the envelope."""
    low, high, _ = ENVELOPE["film", "initial_height"]
    rows = point_rows(scene)
    heights = [row.film_height_m for row in rows]
    found = []
    if min(heights) < low or max(heights) > high:
        found.append(
            f"films of a point get {readable(min(heights), 'm')} to {readable(max(heights), 'm')} "
            f"high; {readable(low, 'm')} to {readable(high, 'm')} are known to work"
        )
    largest = max(rows, key=lambda row: row.mu)
    if largest.mu > LARGEST_FRICTION and largest.time_s > 0.0:
        found.append(f"friction of a point rises to {largest.mu:.3g}")
    return found


def _memory(scene: Scene) -> list[str]:
    """A run that will be refused."""
    from iceslide_fem.mesh.size import memory_of_machine  # loads gmsh

    needed, present = estimate(scene).memory, memory_of_machine()
    if needed <= present:
        return []
    return [
        f"a run needs about {needed / 1e9:.3g} GB and is refused: there are {present / 1e9:.3g}"
    ]


def _passing(scene: Scene) -> list[str]:
    """Ice that passes faster than the run lasts long, or than its mesh resolves."""
    if scene.ice.motion != "sliding":
        return []
    from iceslide_fem.mesh.ice import SURFACE_LAYER
    from iceslide_fem.mesh.rubber import block_size

    transit = block_size(scene)[0] / scene.load.speed
    found = []
    if scene.load.duration < transit:
        found.append(
            f"the run ends before an ice point has passed the block, after {readable(transit, 's')}"
        )
    warm = sqrt(ICE_DIFFUSIVITY * min(transit, scene.load.duration))
    layer = SURFACE_LAYER / scene.numerics.refinement
    if scene.ice.heat == "continuum" and warm < LAYERS * layer:
        found.append(
            f"ice passes so fast that heat gets {readable(warm, 'm')} deep, and the first layer of "
            f"its mesh is {readable(layer, 'm')}: columns resolve it"
        )
    return found
