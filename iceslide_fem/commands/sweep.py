"""`iceslide sweep`: scenes for all combinations of some of their values."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.commands.report import NoReport, leave_report
from iceslide_fem.runtime.errors import Interrupted, SceneError, SimulationStopped
from iceslide_fem.runtime.files import check_writable, writing
from iceslide_fem.runtime.launch import started_by_mpirun, termination_as_interrupt
from iceslide_fem.runtime.options import CaseName, Force, Overrides, folder_option
from iceslide_fem.runtime.terminal import say


def sweep(
    scene_files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SCENE.toml...",
            help="The scene file; several are a dimension of the sweep.",
            show_default=False,
        ),
    ] = None,
    case: CaseName = None,
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
    rows: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE.csv",
            help="Keys that go together: a column for each key, rubber.C10 (MPa), each row a case; "
            "a column name labels them. May be repeated.",
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
    no_report: NoReport = False,
) -> dict[str, Any]:
    """Run scenes for all combinations of some of their values; again: only what is missing."""
    if started_by_mpirun():
        raise SceneError(
            "iceslide sweep starts its own processes: run it without mpirun, with --cores-per-case"
        )
    from iceslide_fem.scene.cases import scene_path
    from iceslide_fem.workflow.sweep import cases_in, failures, make_plan, run_sweep, share_cores
    from iceslide_fem.workflow.sweep.plots import plot_sweep

    files = scene_files or []
    if case is not None or len(files) < 2:
        files = [scene_path(files[0] if files else None, case)]
    plan = make_plan(files, overrides or [], varied or [], rows or [])
    cores = None if no_run else share_cores(cores_per_case, cases_at_a_time)
    name = "scenes" if len(files) > 1 else plan.cases[0].scene.name
    out = out or Path("results") / f"{name}-sweep"
    check_writable(out)
    try:
        with termination_as_interrupt():
            dataset = run_sweep(plan, out, cores, say, force)
    except KeyboardInterrupt:
        raise Interrupted(
            f"the sweep was stopped; {out / 'sweep.csv'} says what is done, and the same command "
            "goes on"
        ) from None
    with writing(out):
        pictures = plot_sweep(dataset, out)
    if not no_report:
        leave_report(out)
    if dataset.attrs["verdict"]:
        typer.echo(dataset.attrs["verdict"])
    for path in (out / "sweep.csv", out / "sweep.nc", *pictures, *out.glob("report.html")):
        typer.echo(str(path))
    found = {"folder": out, "verdict": dataset.attrs["verdict"], "cases": cases_in(out)}
    lines = failures(dataset)
    for line in lines:
        typer.echo(line)
    if lines and not no_run:
        raise SimulationStopped(
            f"{int((dataset.status != 'done').sum())} of {len(plan.cases)} cases are not done; "
            "the same command tries them again",
            found,
        )
    return found
