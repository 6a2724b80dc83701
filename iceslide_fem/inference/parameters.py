"""Numbers of a scene that are fitted or uncertain, as a user types them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, load_scene, put, scene_from_dict
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.variation import Parameter, number_at, parameter, quantity


def bounds_of(scene: Scene, key: str, text: str) -> tuple[Parameter, float, float, float]:
    """The key, its bounds (SI) from "low:high", and where a fit starts: at the scene's value.

    If the scene has none, it starts at the geometric mean of the bounds. Raises SceneError.
    """
    what, said = parameter(key), f'--fit {key}="{text}"'
    parts = text.split(":")
    if len(parts) != 2:
        raise SceneError(f"{said} is not of the form {key}=low:high")
    try:
        low, high = (quantity(key).in_range(as_number(part.strip())) for part in parts)
    except ValueError as error:
        raise SceneError(f"{said}: a bound {error}; allowed: {' to '.join(what.shown)}") from None
    if not low < high:
        raise SceneError(f"{said}: the lower bound must be below the upper one")
    start = number_at(scene, key)
    if start is None:
        start = math.sqrt(low * high) if low > 0.0 else 0.5 * (low + high)
    if not low <= start <= high:
        raise SceneError(
            f"{said} does not hold the scene's {key} = {start:g}, where the fit starts; "
            f"allowed: bounds around it, or --set {key}=... between them"
        )
    return what, low, high, start


def changed_scene(path: Path, changes: Mapping[str, str], *more: str) -> Scene:
    """The scene of a file with `changes` as typed, by keys, and `more` overrides.

    Raises SceneError.
    """
    return load_scene(path, [*(f"{key}={text}" for key, text in changes.items()), *more])


def checked(scene: Scene, values: dict[str, float]) -> Scene:
    """The scene with other `values` (SI), validated. Raises SceneError."""
    tables = scene.model_dump(mode="json", exclude_unset=True)
    for key, value in values.items():
        put(tables, key, value)
    return scene_from_dict(tables)
