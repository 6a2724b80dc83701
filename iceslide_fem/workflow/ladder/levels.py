"""The levels of the model hierarchy that are worth running for a scene.

A level is skipped if its estimated difference from another level is below the tolerance
(`runs.simplifications`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from iceslide_fem.runs.model_levels import SIDEWAYS, ModelLevel
from iceslide_fem.runs.simplifications import Simplifications
from iceslide_fem.scene import REFINEMENTS, Scene


def levels(
    scene: Scene, found: Simplifications, factors: Sequence[float]
) -> tuple[list[ModelLevel], dict[ModelLevel, str]]:
    """Levels worth running, sorted by cost, and the skipped ones with the reason.

    `factors` multiply the scene's refinement, within the allowed range.
    """
    numerics = scene.numerics
    refinements = sorted({float(np.clip(f * numerics.refinement, *REFINEMENTS)) for f in factors})
    if scene.rubber.mesh is not None:
        refinements = [numerics.refinement]
    models, heats = _models(scene), _heats(scene)
    chosen: list[ModelLevel] = []
    skipped: dict[ModelLevel, str] = {}
    for model, heat in itertools.product(models, heats):
        if model == "point" and heat in SIDEWAYS:
            continue
        for refinement in [1.0] if model == "point" else refinements:
            level = ModelLevel(model, heat, refinement)
            reason = _needless(level, models, found, numerics.tolerance) if len(heats) > 1 else ""
            if reason:
                skipped[level] = reason
            else:
                chosen.append(level)
    return chosen, skipped


def of_mesh(scene: Scene) -> str:
    """The model whose mesh `rubber.mesh` is."""
    return "slice" if scene.model == "slice" else "block"


def _models(scene: Scene) -> tuple[str, ...]:
    """Models of the rubber that the scene allows, the finest last."""
    own_mesh = scene.rubber.is_drawn
    # on sliding ice a point represents the ice by its time below the block
    on_ice = scene.film.carrier == "ice" and scene.friction.law == "film"
    has_point = scene.ice.motion == "attached" or (
        on_ice and not scene.rubber.heat and not own_mesh
    )
    point = ("point",) if has_point and not scene.ages_in_warm_rubber else ()
    return (*point, of_mesh(scene)) if own_mesh else (*point, "slice", "block")


def _heats(scene: Scene) -> tuple[str, ...]:
    """Heat models of the ice that the scene allows, the finest last."""
    ice = scene.ice
    if ice.mesh is not None or ice.has_rows:
        return ("mesh",)
    if not ice.is_half_space:
        return ("column", "mesh")
    closed_form = ("half-space",) if ice.motion == "attached" and not scene.rubber.heat else ()
    meshed = ("mesh",) if ice.heat == "mesh" else ()  # equal to continuum ice, but slower
    return (*closed_form, "column", "continuum", *meshed)


def _needless(
    level: ModelLevel, models: Sequence[str], found: Simplifications, tolerance: float
) -> str:
    """Reason to skip a level that equals one of other `models` by the estimates, or ""."""

    def same(other: str, what: str, effect: float) -> str:
        small = effect <= tolerance
        return f"not run, same as {other}: {what} moves mu by {effect:.1g}" if small else ""

    if "point" in models and level.model != "point" and found.sideways.effect <= tolerance:
        if reason := same("the point", "uneven pressure", found.uniform_pressure):
            return reason
    if "slice" in models and level.model == "block":
        if reason := same("the slice", "the third dimension", found.plane_strain.effect):
            return reason
    if level.heat == "half-space":
        return same("columns", "the closed form", found.closed_form.effect)
    if level.heat in SIDEWAYS:
        return same("columns", "heat that goes sideways", found.sideways.effect)
    return ""
