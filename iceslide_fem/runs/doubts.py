"""What is in doubt about a scene before it runs."""

from __future__ import annotations

from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.simplifications import model_doubts
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene


def before_run(scene: Scene) -> list[str]:
    """Everything that is in doubt about a scene before it runs, without full stop.

    Notes on its keys and values; of blocks also on their mesh, duration, and model. A run prints
    them and keeps them in its summary. Raises SceneError if a user's mesh is unsuitable.
    """
    if scene.model == "point":
        return notes(scene)
    return notes(scene) + _sides(scene) + _passing(scene) + model_doubts(scene)


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
