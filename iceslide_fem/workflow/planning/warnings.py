"""Warnings before a run, in addition to the notes of the scene."""

from __future__ import annotations

from iceslide_fem.film.doubts import WITHOUT_MELTING
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.scene.notes import ENVELOPE, LARGEST_FRICTION
from iceslide_fem.workflow.planning.cost import point_rows


def warnings(scene: Scene) -> list[str]:
    """Warnings without full stop. Raises SceneError if a user's mesh is unsuitable."""
    if scene.model == "point":
        return _film(scene)
    return _film(scene) + _memory(scene) + _sides(scene) + _passing(scene)


def _film(scene: Scene) -> list[str]:
    """Films and friction of a point at the nominal pressure outside the validated range."""
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
    rides = scene.ice.is_wet  # water exists without melting
    film = scene.friction.law == "film" and not dry and not rides
    if film and not any(row.melted_fraction for row in rows):
        found.append(f"the ice below a point does not melt: {WITHOUT_MELTING}")
    largest = max(rows, key=lambda row: row.mu)
    if largest.mu > LARGEST_FRICTION and largest.time_s > 0.0:
        found.append(f"friction of a point rises to {largest.mu:.3g}")
    return found


def _memory(scene: Scene) -> list[str]:
    """Warning of a run that is refused for memory."""
    from iceslide_fem.mesh.size import shortage  # loads gmsh

    short = shortage(scene)
    return [f"a run is refused, because it {short}"] if short else []


def _sides(scene: Scene) -> list[str]:
    """Warning of a mesh whose sides have no contact and may pass through the ice."""
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
    """Warning of a run shorter than the transit time of the ice."""
    if scene.ice.motion != "sliding":
        return []
    from iceslide_fem.mesh.rubber import block_size

    transit = block_size(scene)[0] / scene.load.speeds.mean
    if scene.load.duration >= transit:
        return []
    after = readable(transit, "s")
    return [f"the run ends before an ice point has passed the block, after {after}"]
