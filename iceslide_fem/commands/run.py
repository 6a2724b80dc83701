"""`iceslide run`: one scene, from its beginning or from a checkpoint."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.commands.scene import load, print_notes
from iceslide_fem.runtime.errors import Interrupted, SceneError, SimulationStopped
from iceslide_fem.runtime.files import check_writable
from iceslide_fem.runtime.options import CaseName, Force, Overrides, folder_option
from iceslide_fem.runtime.terminal import show_figures, show_notes

if TYPE_CHECKING:
    from iceslide_fem.runs.checkpoint import Checkpoint
    from iceslide_fem.scene import Scene


def run(
    scene_file: Annotated[
        Path | None,
        typer.Argument(
            metavar="SCENE.toml", help="The scene file; not with --restart.", show_default=False
        ),
    ] = None,
    petsc_options: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="-- PETSC_OPTIONS",
            help="Options for PETSc, after a double dash: -- -log_view",
            show_default=False,
        ),
    ] = None,
    case: CaseName = None,
    overrides: Overrides = None,
    out: Annotated[Path | None, folder_option("Where to write; else results/<name>.")] = None,
    force: Force = False,
    restart: Annotated[
        Path | None, folder_option("Go on with the run in DIR from its last checkpoint.")
    ] = None,
    checkpoint_every: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.0, help="Checkpoints by the clock.")
    ] = 60.0,
    checkpoint_at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TIME",
            help="A checkpoint after this time of the run, e.g. 2ms. May be repeated.",
            show_default=False,
        ),
    ] = None,
    no_report: NoReport = False,
) -> dict[str, Any]:
    """Run a scene and write mu(t), fields and a report."""
    words = petsc_options or []
    other = restart is not None or case is not None
    if other and scene_file is not None and str(scene_file).startswith("-"):
        scene_file, words = None, [str(scene_file), *words]
    if words and not words[0].startswith("-"):
        raise SceneError(
            f'one scene file at a time: "{words[0]}" is one too many '
            "(options for PETSc follow after --)"
        )
    if not math.isfinite(checkpoint_every):
        raise SceneError(f"--checkpoint-every {checkpoint_every} is no number of seconds")
    if restart is not None:
        if out is not None or force:
            raise SceneError("--restart goes on with a run as it is: --out and --force do not fit")
        scene, resumed, out = *_resumed(restart, scene_file, overrides or [], case), restart
    elif scene_file is None and case is None:
        raise typer.BadParameter("give a scene file, --case NAME or --restart DIR")
    else:
        scene, resumed = load(scene_file, overrides, case), None
        out = out or Path("results") / scene.name
    times = tuple(_time(text, scene.load.duration) for text in checkpoint_at or [])
    check_writable(out)
    said = print_notes(scene)

    from iceslide_fem.simulate import run as simulate

    try:
        if scene.model == "point":
            summary = simulate(scene, out, words, force=force, pictures=not no_report)
        else:
            from iceslide_fem.runs.schedule import Schedule

            schedule = Schedule(checkpoint_every, times)
            summary = simulate(scene, out, words, schedule, resumed, force, not no_report)
    except (Interrupted, SimulationStopped) as error:
        if not no_report:
            leave_report(out)
        if (out / "summary.json").is_file():
            error.found = {"folder": out, **json.loads((out / "summary.json").read_bytes())}
        raise
    if not no_report:
        leave_report(out)
    print_summary(summary, out, said)
    return {"folder": out, **summary}


def _resumed(
    folder: Path, scene_file: Path | None, overrides: Sequence[str], case: str | None
) -> tuple[Scene, Checkpoint]:
    """Scene and checkpoint of the run in `folder`; a given scene file or case must equal it."""
    from iceslide_fem.runs.checkpoint import read_changed, read_checkpoint, same_scene

    checkpoint = read_changed(folder, overrides) if overrides else read_checkpoint(folder)
    if scene_file is not None or case is not None:
        same_scene(load(scene_file, overrides, case), checkpoint, folder)
    return checkpoint.scene, checkpoint


def _time(text: str, duration: float) -> float:
    """Time (s) from a text such as "2 ms", within a run's `duration` (s)."""
    from iceslide_fem.runtime.units import to_si

    try:
        time = to_si(text, "s")
    except ValueError as error:
        raise SceneError(f'--checkpoint-at "{text}" {error}') from None
    if not 0.0 <= time <= duration:
        raise SceneError(
            f'--checkpoint-at "{text}" is out of range; allowed: 0 to the duration of the run, '
            f"{1e3 * duration:g} ms"
        )
    return time


def print_summary(summary: dict[str, Any], out: Path, said: list[str]) -> None:
    """Print the main numbers of the run, and its warnings that were not `said` before."""
    if verdict := summary.get("verdict"):
        typer.echo(verdict["sentence"])
    figures = []
    for key, value in summary.items():
        if isinstance(value, float):
            figures.append((key, f"{value:.4g}"))
        elif isinstance(value, int):
            figures.append((key, str(value)))
        elif value is None and key in _MOMENTS:
            figures.append((key, "did not happen"))
        # versions, scene and hashes are in summary.json
    show_figures(figures)
    show_notes(each for each in summary.get("warnings", []) if each not in said)
    for name in ("summary.json", "history.csv", "report.png", "report.html", "fields"):
        if (out / name).exists():
            typer.echo(str(out / name))


_MOMENTS = ("melt_onset_s", "saturation_s")  # entries of the summary: null if they do not occur
