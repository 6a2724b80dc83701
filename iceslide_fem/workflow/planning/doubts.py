"""What a run of a scene will warn of, as far as a point tells."""

from __future__ import annotations

from iceslide_fem.film.doubts import WITHOUT_MELTING
from iceslide_fem.runs.notes import ENVELOPE, LARGEST_FRICTION
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.cost import point_rows


def expected(scene: Scene) -> list[str]:
    """What a run of the scene will warn of besides `runs.doubts`, without full stop.

    Raises SceneError if a user's mesh is unsuitable.
    """
    return _film(scene) + ([] if scene.model == "point" else _memory(scene))


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
