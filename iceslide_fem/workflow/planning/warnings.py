"""What is known to go wrong, or not to be resolved, before a scene runs: beyond its own notes."""

from __future__ import annotations

from iceslide_fem.film.doubts import WITHOUT_MELTING
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.scene.notes import ENVELOPE, LARGEST_FRICTION
from iceslide_fem.workflow.planning.cost import point_rows


def warnings(scene: Scene) -> list[str]:
    """A sentence each, without its full stop. Raises SceneError if a user's mesh can't be used."""
    if scene.model == "point":
        return _film(scene)
    return _film(scene) + _memory(scene) + _sides(scene) + _passing(scene)


def _film(scene: Scene) -> list[str]:
    """Films and friction of a point at the nominal pressure, where they leave the envelope."""
    low, high, _ = ENVELOPE["film", "initial_height"]
    rows = point_rows(scene)
    heights = [row.film_height_m for row in rows]
    found = []
    dry = scene.film.dry_stress is not None
    if (min(heights) < low and not dry) or max(heights) > high:
        found.append(
            f"films of a point get {readable(min(heights), 'm')} to {readable(max(heights), 'm')} "
            f"high; {readable(low, 'm')} to {readable(high, 'm')} are known to work"
        )
    rides = scene.ice.is_wet  # on water that need not melt
    film = scene.friction.law == "film" and not dry and not rides
    if film and not any(row.melted_fraction for row in rows):
        found.append(f"the ice below a point does not melt: {WITHOUT_MELTING}")
    largest = max(rows, key=lambda row: row.mu)
    if largest.mu > LARGEST_FRICTION and largest.time_s > 0.0:
        found.append(f"friction of a point rises to {largest.mu:.3g}")
    return found


def _memory(scene: Scene) -> list[str]:
    """A run that will be refused."""
    from iceslide_fem.mesh.size import shortage  # loads gmsh

    short = shortage(scene)
    return [f"a run is refused, because it {short}"] if short else []


def _sides(scene: Scene) -> list[str]:
    """A mesh whose sides pass through the ice when they lean onto it."""
    if scene.rubber.mesh is None:
        return []
    from iceslide_fem.mesh.completeness import only_lowest
    from iceslide_fem.mesh.rubber import tagged_rubber

    if not only_lowest(tagged_rubber(scene)):
        return []
    return [
        'the lowest facets of rubber.mesh alone are tagged "contact": its sides pass through the '
        "ice where they lean onto it"
    ]


def _passing(scene: Scene) -> list[str]:
    """A run that ends before ice has passed."""
    if scene.ice.motion != "sliding":
        return []
    from iceslide_fem.mesh.rubber import block_size

    transit = block_size(scene)[0] / scene.load.speeds.mean
    if scene.load.duration >= transit:
        return []
    after = readable(transit, "s")
    return [f"the run ends before an ice point has passed the block, after {after}"]
