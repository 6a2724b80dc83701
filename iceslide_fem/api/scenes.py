"""Scenes for scripts: read, made from a dictionary, and what is known of them before a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.api.errors import in_python
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.scene import Scene, override, read_scene, scene_from_dict
from iceslide_fem.scene.cases import scene_path
from iceslide_fem.scene.nested import change
from iceslide_fem.workflow.planning.about import About
from iceslide_fem.workflow.planning.about import about as known_of

AnyScene = Scene | Path | str | Mapping[str, Any]  # a scene, its file, or its tables


@in_python()
def load_scene(
    path: Path | str | Mapping[str, Any] | None = None,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    *,
    case: str | None = None,
) -> Scene:
    """Read and validate a scene: the file `path`, or the `case` of that name.

    In place of a file `path` may be the tables themselves, as a dictionary. `overrides` replace
    values by their dotted keys or in tables: `{"load.pressure": "3 bar"}`, `{"load": {"pressure":
    "3 bar"}}`, or texts, `["load.pressure=3bar"]`. Values may be NumPy's. Numbers without a unit
    are SI, and files are relative to the working folder.

    `iceslide cases` lists the cases. The scene is frozen; `scene.replace(overrides)` gives another
    one. A notebook shows what differs from the defaults.

    Raises `SceneError` with one sentence where the file cannot be read or a value is not possible.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    scene.load.pressure  # 100000.0, in Pa
    scene.replace({"load.pressure": "3 bar"}).load.pressure  # 300000.0
    ```
    """
    if isinstance(path, Mapping) and case is None:
        data: dict[str, Any] = {}
        change(data, path)
    else:
        data = read_scene(scene_path(None if path is None else Path(str(path)), case))
    if isinstance(overrides, Mapping):
        change(data, overrides)
    else:
        for text in overrides:
            override(data, text)
    return scene_from_dict(data)


def as_scene(given: AnyScene) -> Scene:
    """The scene that is `given`, as a file's path or by its tables, too. Raises SceneError."""
    return given if isinstance(given, Scene) else load_scene(given)


@in_python()
def info(scene: AnyScene) -> About:
    """What is known of a scene before a run, as `iceslide info`: numbers, time scales, mesh, cost.

    `scene` is a scene, a file or tables, as for `run`. The answer has `rows` (group, quantity,
    value with unit, meaning) and `notes` of what is in doubt; `["steps"]` is the value of a
    quantity, and `to_dataframe()` a pandas table. It prints as a table.

    Raises `SceneError` with one sentence where the scene or the user's mesh is not possible.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    iceslide_fem.info(scene)["transit time"]
    ```
    """
    return known_of(resolved(as_scene(scene)))
