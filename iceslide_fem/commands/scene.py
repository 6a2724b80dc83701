"""The scene that a command is given, and what is to be said about it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from iceslide_fem.runtime.terminal import show_notes

if TYPE_CHECKING:
    from iceslide_fem.scene import Scene


def load(scene_file: Path, overrides: Sequence[str] | None) -> Scene:
    """The scene, with `model = "auto"` resolved."""
    from iceslide_fem.scene import load_scene

    scene = load_scene(scene_file, overrides or [])
    if scene.model == "auto":
        from iceslide_fem.runs.model_levels import resolved

        scene = resolved(scene)
        typer.echo(f'model = "auto": {scene.model}, ice.heat = "{scene.ice.heat}".')
    return scene


def print_notes(scene: Scene) -> list[str]:
    """Print what the scene says in vain, and where it leaves what is known to work; return it."""
    from iceslide_fem.scene.notes import notes

    found = notes(scene)
    show_notes(found)
    return found
