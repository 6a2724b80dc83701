"""The scene of a command, and its notes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from iceslide_fem.runtime.terminal import show_notes

if TYPE_CHECKING:
    from iceslide_fem.scene import Scene


def load(scene_file: Path | None, overrides: Sequence[str] | None, case: str | None) -> Scene:
    """The scene in the file, or the `case` of that name, with `model = "auto"` resolved."""
    from iceslide_fem.scene import load_scene
    from iceslide_fem.scene.cases import scene_path

    scene = load_scene(scene_path(scene_file, case), overrides or [])
    if scene.model == "auto":
        from iceslide_fem.runs.model_levels import resolved

        scene = resolved(scene)
        typer.echo(f'model = "auto": {scene.model}, ice.heat = "{scene.ice.heat}".')
    return scene


def print_notes(scene: Scene) -> list[str]:
    """Print and return what is in doubt before a run."""
    from iceslide_fem.runs.doubts import before_run

    found = before_run(scene)
    show_notes(found)
    return found
