"""`iceslide report`: one page about a run, several runs, a sweep, a ladder or a footprint."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import IceslideError, SceneError
from iceslide_fem.runtime.launch import rank

NoReport = Annotated[
    bool,
    typer.Option("--no-report", help="Write no report.png and report.html beside the results."),
]


def report(
    folders: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIR...",
            help="What a run, sweep, ladder or footprint wrote; several runs are compared.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.html",
            help="Where to write; else DIR/report.html, of several results/A_against_B.html.",
            show_default=False,
        ),
    ] = None,
    title: Annotated[
        str | None, typer.Option(help="Heading of the page.", show_default=False)
    ] = None,
) -> dict[str, Any]:
    """Write one page, with all in it, about results: opens in a browser, without a network."""
    if out is not None and not str(out).strip():
        raise SceneError('a page has a name; given: --out ""')

    from iceslide_fem.workflow.report import report as write

    page = write(folders, out, title)
    typer.echo(str(page))
    return {"page": page}


def leave_report(folder: Path) -> None:
    """Write report.html in `folder`, on one rank. An error here does not fail the run."""
    if rank() > 0:
        return

    from iceslide_fem.workflow.report import report as write

    leave_page(lambda: write([folder]))


def leave_page(write: Callable[[], object]) -> None:
    """Call `write`, which writes a page. An error here does not fail the command."""
    try:
        write()
    except IceslideError as error:
        typer.echo(f"Note: no report.html: {error}.")
    except (ArithmeticError, LookupError, OSError, TypeError, ValueError) as error:
        typer.echo(
            "Note: no report.html: its page has a fault of the program "
            f"({type(error).__name__}: {error}); the results are whole."
        )
