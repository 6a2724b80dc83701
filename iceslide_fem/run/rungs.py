"""Rungs of the model ladder: how a scene is put on one, and which is the cheapest that will do."""

from __future__ import annotations

from typing import NamedTuple

from iceslide_fem.run.simplifications import simplifications
from iceslide_fem.scene import Scene, scene_from_dict

MODELS = "point", "slice", "block"
HEATS = "half-space", "column", "continuum", "mesh"
SIDEWAYS = "continuum", "mesh"  # heat conducts along the surface, too, which a point does not have


class Rung(NamedTuple):
    """Model of the rubber and of the ice's heat; refinement of the meshes (1 for a point)."""

    model: str
    heat: str
    refinement: float


def fineness(rung: Rung) -> tuple[int, int, float]:
    """By which rungs are put in order: the finest leaves out least."""
    return MODELS.index(rung.model), HEATS.index(rung.heat), rung.refinement


def rung_name(rung: Rung) -> str:
    """Model, heat and refinement in one word."""
    name = f"{rung.model}_{rung.heat}"
    return name if rung.model == "point" else f"{name}_x{rung.refinement:g}"


def cheapest(scene: Scene) -> Rung:
    """The cheapest rung whose simplifications are below the scene's tolerance, by the estimates.

    `ice.heat` is chosen, too, unless the scene gives it.
    """
    found, tolerance = simplifications(scene), scene.numerics.tolerance
    columns = found.sideways.effect <= tolerance
    sideways = "continuum" if scene.ice.is_half_space else "mesh"
    heat = "column" if columns else sideways
    if "heat" in scene.ice.model_fields_set:
        heat = scene.ice.heat
    rubber = scene.rubber
    if rubber.mesh is not None or rubber.outline is not None or rubber.grooves:
        return Rung("block", heat, scene.numerics.refinement)
    attached = scene.ice.motion == "attached"  # estimates of passing ice are rougher
    if attached and found.uniform_pressure <= tolerance and heat not in SIDEWAYS:
        return Rung("point", heat, 1.0)
    model = "slice" if found.plane_strain.effect <= tolerance else "block"
    return Rung(model, heat, scene.numerics.refinement)


def on_rung(scene: Scene, rung: Rung) -> Scene:
    """The scene on another rung. Raises SceneError where they contradict each other."""
    data = scene.as_dict()
    data["model"], data["ice"]["heat"] = rung.model, rung.heat
    data["numerics"]["refinement"] = rung.refinement
    return scene_from_dict(data)


def resolved(scene: Scene) -> Scene:
    """The scene itself, or with `model = "auto"` on the cheapest rung by the estimates."""
    if scene.model != "auto":
        return scene
    return on_rung(scene, cheapest(scene)._replace(refinement=scene.numerics.refinement))
