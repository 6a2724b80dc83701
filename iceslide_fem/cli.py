"""The command line: `iceslide run`, `sweep`, `ladder`, `info`, `view`, `footprint`, `roughness`."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from iceslide_fem import __version__
from iceslide_fem.errors import (
    IceslideError,
    Interrupted,
    OutputError,
    SceneError,
    SimulationStopped,
)
from iceslide_fem.files import check_writable, writing
from iceslide_fem.footprint.options import footprint
from iceslide_fem.launch import (
    on_one_process,
    rank,
    started_by_mpirun,
    stop_all_ranks,
    termination_as_interrupt,
)
from iceslide_fem.options import Force, Overrides, SceneFile, folder_option
from iceslide_fem.roughness.options import roughness
from iceslide_fem.screen import patient_screen

if TYPE_CHECKING:
    from iceslide_fem.run.checkpoint import Checkpoint
    from iceslide_fem.scene import Scene

# Everything heavy is imported where it is used, so that `iceslide --help` is quick.

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="In parallel: mpirun -n 2 iceslide run cases/thesis_1bar.toml",
)


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"iceslide_fem {__version__}")
        raise typer.Exit


@app.callback()
def iceslide(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    """A rubber tread block sliding on ice, with a melting water film."""


@app.command()
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
) -> None:
    """Run a scene and write mu(t), fields and a report."""
    words = petsc_options or []
    if restart is not None and scene_file is not None and str(scene_file).startswith("-"):
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
        scene, resumed, out = *_resumed(restart, scene_file, overrides or []), restart
    elif scene_file is None:
        raise typer.BadParameter("give a scene file, or --restart DIR")
    else:
        scene, resumed = _load(scene_file, overrides), None
        out = out or Path("results") / scene.name
    times = tuple(_time(text, scene.load.duration) for text in checkpoint_at or [])
    check_writable(out)
    said = _print_notes(scene)

    from iceslide_fem.simulate import run as simulate

    if scene.model == "point":
        summary = simulate(scene, out, words, force=force)
    else:
        from iceslide_fem.run.schedule import Schedule

        schedule = Schedule(checkpoint_every, times)
        summary = simulate(scene, out, words, schedule, resumed, force)
    _print_summary(summary, out, said)


@app.command()
def sweep(
    scene_file: SceneFile,
    varied: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=VALUES",
            help="load.pressure=1bar:5bar:5 (first:last:count) or load.speed=1,2,3. May be "
            "repeated: every combination is a case.",
            show_default=False,
        ),
    ] = None,
    overrides: Overrides = None,
    out: Annotated[Path | None, folder_option("Where to write; else results/<name>-sweep.")] = None,
    force: Force = False,
    cores_per_case: Annotated[
        int, typer.Option(min=1, help="Processes of each slice or block.")
    ] = 1,
    cases_at_a_time: Annotated[
        int | None,
        typer.Option(min=1, help="Else as many as there are cores for.", show_default=False),
    ] = None,
    no_run: Annotated[
        bool,
        typer.Option(
            "--no-run",
            help="Run no slice or block: write their scenes, collect those that others have run.",
        ),
    ] = False,
) -> None:
    """Run a scene for all combinations of some of its values; again: only what is missing."""
    if started_by_mpirun():
        raise SceneError(
            "iceslide sweep starts its own processes: run it without mpirun, with --cores-per-case"
        )
    from iceslide_fem.sweep import failures, make_plan, run_sweep, share_cores
    from iceslide_fem.sweep.plots import plot_sweep

    plan = make_plan(scene_file, overrides or [], varied or [])
    cores = None if no_run else share_cores(cores_per_case, cases_at_a_time)
    out = out or Path("results") / f"{plan.cases[0].scene.name}-sweep"
    check_writable(out)
    try:
        with termination_as_interrupt():
            dataset = run_sweep(plan, out, cores, typer.echo, force)
    except KeyboardInterrupt:
        raise Interrupted(
            f"the sweep was stopped; {out / 'sweep.csv'} says what is done, and the same command "
            "goes on"
        ) from None
    with writing(out):
        pictures = plot_sweep(dataset, out)
    for path in (out / "sweep.csv", out / "sweep.nc", *pictures):
        typer.echo(str(path))
    lines = failures(dataset)
    for line in lines:
        typer.echo(line)
    if lines and not no_run:
        raise SimulationStopped(
            f"{int((dataset.status != 'done').sum())} of {len(plan.cases)} cases are not done; "
            "the same command tries them again"
        )


@app.command()
def info(scene_file: SceneFile, overrides: Overrides = None) -> None:
    """Show what a scene means: dimensionless numbers, time scales, mesh and expected cost."""
    scene = _load(scene_file, overrides)

    from rich.console import Console
    from rich.table import Table

    from iceslide_fem.planning.info import describe
    from iceslide_fem.planning.warnings import warnings

    table = Table(title=f"{scene.name} ({scene.model})", title_justify="left")
    for heading in ("", "quantity", "value", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    group = ""
    for row in describe(scene):
        if group and row.group != group:
            table.add_section()
        table.add_row(row.group if row.group != group else "", row.quantity, row.value, row.meaning)
        group = row.group
    Console().print(table)
    _print_notes(scene)
    for warning in warnings(scene):
        typer.echo(f"Note: {warning}.")


@app.command()
def ladder(
    scene_file: SceneFile,
    overrides: Overrides = None,
    out: Annotated[
        Path | None, folder_option("Where to write; else results/<name>_ladder.")
    ] = None,
    force: Force = False,
    refine: Annotated[
        list[float] | None,
        typer.Option(
            min=0.1,
            max=4.0,
            metavar="FACTOR",
            help="Mesh refinement relative to the scene's; may be repeated. Else 0.5 and 1.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Run a scene on every rung that matters: error, time, memory, and which is enough."""
    from iceslide_fem.scene import load_scene

    scene = load_scene(scene_file, overrides or [])
    out = out or Path("results") / f"{scene.name}_ladder"
    check_writable(out)
    from iceslide_fem.fenics.start import start_petsc

    start_petsc()
    from rich.console import Console

    from iceslide_fem.ladder.chart import ladder_chart
    from iceslide_fem.ladder.runs import cheapest_of, climb, finest_of, write_scene
    from iceslide_fem.ladder.table import ladder_table, not_run, simplification_table

    outcomes, found = climb(scene, out, refine or [0.5, 1.0], typer.echo, force)
    console, tolerance = Console(), scene.numerics.tolerance
    console.print(simplification_table(found, tolerance))
    console.print(ladder_table(outcomes))
    for sentence in not_run(outcomes):
        typer.echo(sentence)
    best, finest = cheapest_of(outcomes, tolerance), finest_of(outcomes)
    if best is None or finest is None:
        raise SimulationStopped("no rung of the ladder ran to its end")
    typer.echo(
        f"Within {tolerance:g} of {finest.name} at every time: {best.name} is the cheapest."
        if best is not finest
        else f"No cheaper rung is within {tolerance:g} of {finest.name} at every time."
    )
    if rank() == 0:
        ladder_chart(f"{scene.name}: every rung", outcomes, tolerance, best, out / "ladder.png")
        write_scene(scene_file, overrides or [], best.rung, out / f"{scene.name}.toml")
    for name in ("ladder.png", f"{scene.name}.toml"):
        typer.echo(str(out / name))


@app.command()
def view(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="What `iceslide run` wrote.", show_default=False)
    ],
    animate: Annotated[bool, typer.Option("--animate", help="Make a film, too.")] = False,
) -> None:
    """Make pictures of a finished run and print their paths."""
    if not (directory / "summary.json").is_file():
        stopped = (directory / "checkpoint").is_file()
        hint = f"iceslide run --restart {directory} goes on" if stopped else "no summary.json in it"
        raise SceneError(f"{directory} holds no finished run ({hint})")
    if rank() > 0:  # one process is enough to make pictures
        return

    from iceslide_fem.results.view import view as make_pictures

    for picture in make_pictures(directory, animate):
        typer.echo(str(picture))


app.command()(on_one_process(footprint))
app.command()(on_one_process(roughness))


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run the command in `argv` (default: sys.argv) and exit.

    Exit codes: 0 done, 2 wrong input, 3 the simulation could not go on, 4 it was asked to stop and
    has left a checkpoint, 1 a fault of the program.
    Under mpirun every rank does the same and rank 0 alone prints.
    """
    with patient_screen() as faults:
        code = _exit_code(argv)
    if faults and code == 0:
        print(f"iceslide: cannot print: {faults[0].strerror}", file=sys.stderr)
        code = OutputError.exit_code
    sys.exit(code)


def _exit_code(argv: Sequence[str] | None) -> int:
    with contextlib.ExitStack() as stack:
        if rank() > 0:
            silence = stack.enter_context(open(os.devnull, "w"))
            stack.enter_context(contextlib.redirect_stdout(silence))
            stack.enter_context(contextlib.redirect_stderr(silence))
        try:
            app(args=argv, prog_name="iceslide")
        except SystemExit as end:  # typer's own: 0 done, 2 wrong usage
            return int(end.code or 0)
        except IceslideError as error:
            print(f"iceslide: {error}", file=sys.stderr)
            if rank() > 0:  # mpirun ends rank 0, perhaps before it has printed, when another fails
                time.sleep(1.0)
            return error.exit_code
        except Exception:
            traceback.print_exc(file=sys.__stderr__)  # also of the ranks that are silent
            stop_all_ranks(1)
            return 1
    return 0


def _load(scene_file: Path, overrides: Sequence[str] | None) -> Scene:
    """The scene, with `model = "auto"` resolved."""
    from iceslide_fem.scene import load_scene

    scene = load_scene(scene_file, overrides or [])
    if scene.model == "auto":
        from iceslide_fem.planning.rungs import resolved

        scene = resolved(scene)
        typer.echo(f'model = "auto": {scene.model}, ice.heat = "{scene.ice.heat}".')
    return scene


def _print_notes(scene: Scene) -> list[str]:
    """Print what the scene says in vain, and where it leaves what is known to work; return it."""
    from iceslide_fem.scene.notes import notes

    found = notes(scene)
    for note in found:
        typer.echo(f"Note: {note}.")
    return found


def _resumed(
    folder: Path, scene_file: Path | None, overrides: Sequence[str]
) -> tuple[Scene, Checkpoint]:
    """Scene and checkpoint of the run in `folder`; a scene file must be of that scene."""
    from iceslide_fem.run.checkpoint import read_changed, read_checkpoint, same_scene

    checkpoint = read_changed(folder, overrides) if overrides else read_checkpoint(folder)
    if scene_file is not None:
        same_scene(_load(scene_file, overrides), checkpoint, folder)
    return checkpoint.scene, checkpoint


def _time(text: str, duration: float) -> float:
    """Seconds of "2 ms", a time within a run's `duration` (s)."""
    from iceslide_fem.scene.units import to_si

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


def _print_summary(summary: dict[str, Any], out: Path, said: list[str]) -> None:
    """The run in a few numbers, and its warnings that have not been `said` before it began."""
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    for key, value in summary.items():
        if isinstance(value, float):
            table.add_row(key, f"{value:.4g}")
        elif isinstance(value, int):
            table.add_row(key, str(value))
        elif value is None and key in _MOMENTS:
            table.add_row(key, "did not happen")
        # versions, the scene and its hashes: in summary.json
    Console().print(table)
    for warning in summary.get("warnings", []):
        if warning not in said:
            typer.echo(f"Note: {warning}.")
    for name in ("summary.json", "history.csv", "report.png", "fields"):
        if (out / name).exists():
            typer.echo(str(out / name))


_MOMENTS = ("melt_onset_s", "saturation_s")  # of the summary: null if they did not come


if __name__ == "__main__":
    main()
