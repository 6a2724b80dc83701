"""Model levels: a scene on another level, and the cheapest sufficient level."""

from __future__ import annotations

from typing import NamedTuple

from iceslide_fem.runs.simplifications import simplifications
from iceslide_fem.scene import Scene, scene_from_dict

MODELS = "point", "slice", "block"
HEATS = "half-space", "column", "continuum", "mesh"
SIDEWAYS = "continuum", "mesh"  # with lateral conduction, which a point does not have


class ModelLevel(NamedTuple):
    """Model of the rubber and of the ice's heat; refinement of the meshes (1 for a point)."""

    model: str
    heat: str
    refinement: float


def fineness(level: ModelLevel) -> tuple[int, int, float]:
    """Sort key of levels: the finest one neglects least."""
    return MODELS.index(level.model), HEATS.index(level.heat), level.refinement


def level_name(level: ModelLevel) -> str:
    """Model, heat and refinement in one word."""
    name = f"{level.model}_{level.heat}"
    return name if level.model == "point" else f"{name}_x{level.refinement:g}"


def cheapest(scene: Scene) -> ModelLevel:
    """The cheapest level whose estimated errors are below the scene's tolerance.

    It also chooses `ice.heat`, unless the scene gives it.
    """
    found, tolerance = simplifications(scene), scene.numerics.tolerance
    columns = found.sideways.effect <= tolerance
    sideways = "continuum" if scene.ice.is_half_space else "mesh"
    heat = "column" if columns else sideways
    if "heat" in scene.ice.model_fields_set:
        heat = scene.ice.heat
    rubber = scene.rubber
    if rubber.is_drawn or rubber.outline is not None or rubber.grooves:
        return ModelLevel("block", heat, scene.numerics.refinement)
    attached = scene.ice.motion == "attached"  # estimates for sliding ice are rougher
    has_point = attached and not scene.ages_in_warm_rubber
    if has_point and found.uniform_pressure <= tolerance and heat not in SIDEWAYS:
        return ModelLevel("point", heat, 1.0)
    model = "slice" if found.plane_strain.effect <= tolerance else "block"
    return ModelLevel(model, heat, scene.numerics.refinement)


def on_level(scene: Scene, level: ModelLevel) -> Scene:
    """The scene on another level. Raises SceneError if they contradict each other."""
    data = scene.as_dict()
    data["model"], data["ice"]["heat"] = level.model, level.heat
    data["numerics"]["refinement"] = level.refinement
    return scene_from_dict(data)


def resolved(scene: Scene) -> Scene:
    """The scene; with `model = "auto"` on the cheapest level by the estimates."""
    if scene.model != "auto":
        return scene
    return on_level(scene, cheapest(scene)._replace(refinement=scene.numerics.refinement))
