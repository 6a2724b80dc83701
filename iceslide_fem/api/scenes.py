"""Scenes for scripts: from a file, or a case that comes with the program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.runtime.arrays import plain
from iceslide_fem.scene import Scene, override, put, read_scene, scene_from_dict
from iceslide_fem.scene.cases import scene_path


def load_scene(
    path: Path | str | None = None,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    *,
    case: str | None = None,
) -> Scene:
    """Read and validate a scene: the file `path`, or the `case` of that name.

    `overrides` replace values by their dotted keys: `{"load.pressure": "3 bar"}`, or texts as for
    `--set`, `["load.pressure=3bar"]`. Values may be NumPy's. Numbers without a unit are SI.
    `iceslide cases` lists the cases. The scene is frozen; a notebook shows what differs from the
    defaults.

    Raises `SceneError` with one sentence where the file cannot be read or a value is not possible.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    scene.load.pressure  # 100000.0, in Pa
    ```
    """
    data = read_scene(scene_path(path, case))
    if isinstance(overrides, Mapping):
        for key, value in overrides.items():
            put(data, key, plain(value))
    else:
        for change in overrides:
            override(data, change)
    return scene_from_dict(data)
