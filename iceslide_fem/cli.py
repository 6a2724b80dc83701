"""The command line: `iceslide run`, `sweep`, `ladder`, `info`, `view`, `report`, `footprint`,
`wheel`, `roughness`, `rubber`, `calibrate`, `compare`, `uncertainty`, `export`,
`serve`, `cases`, `doctor`, `app`.

Commands are in `commands`, and so is what they end with (`outcome`). This module combines them.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from iceslide_fem import __version__
from iceslide_fem.app.command import app as page
from iceslide_fem.commands.answer import answering
from iceslide_fem.commands.cases import cases
from iceslide_fem.commands.doctor import doctor
from iceslide_fem.commands.export import fmu, tir
from iceslide_fem.commands.info import info
from iceslide_fem.commands.ladder import ladder
from iceslide_fem.commands.outcome import exit_code
from iceslide_fem.commands.preprocessors import COMMANDS, placeholder, whole
from iceslide_fem.commands.report import report
from iceslide_fem.commands.run import run
from iceslide_fem.commands.serve import serve
from iceslide_fem.commands.sweep import sweep
from iceslide_fem.commands.view import view
from iceslide_fem.runtime.errors import OutputError, SceneError
from iceslide_fem.runtime.launch import on_one_process
from iceslide_fem.runtime.terminal import patient_screen

OPTIONS: dict[str, Any] = {
    "pretty_exceptions_enable": False,
    "rich_markup_mode": "rich",
    "context_settings": {"help_option_names": ["-h", "--help"]},
}


class Commands(TyperGroup):
    """The commands; those of preprocessors load their options when they are called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        """Name, command and its words."""
        name, found, words = super().resolve_command(ctx, args)
        if name in COMMANDS:
            alone = typer.Typer(**OPTIONS, add_completion=False)
            alone.command(name)(on_one_process(answering(whole(name))))
            found = typer.main.get_command(alone)
        return name, found, words


app = typer.Typer(
    cls=Commands,
    **OPTIONS,
    no_args_is_help=True,
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


for command in (run, sweep, info, ladder, view):
    app.command()(answering(command))
app.command()(on_one_process(answering(report)))
for name in COMMANDS:
    app.command(name)(placeholder(name))
exports = typer.Typer(**OPTIONS, no_args_is_help=True, help="A wheel for vehicle programs.")
exports.command()(on_one_process(answering(tir)))
exports.command()(on_one_process(answering(fmu)))
app.add_typer(exports, name="export")
app.command()(on_one_process(serve))
app.command()(on_one_process(answering(cases)))
app.command()(on_one_process(answering(doctor)))
app.command("app")(on_one_process(page))


def main(argv: Sequence[str] | None = None) -> NoReturn:
    """Run the command in `argv` (default: sys.argv) and exit.

    Exit codes: 0 done, 2 invalid input, 3 the simulation stopped, 4 stopped on request with a
    checkpoint, 1 a fault of the program. Under mpirun every rank runs this, and only rank 0 prints.
    """
    if argv is None and sys.getfilesystemencoding() == "ascii":  # file names are UTF-8
        os.environ["PYTHONUTF8"] = "1"
        os.execv(sys.executable, sys.orig_argv)

    def command() -> None:
        _check_working_folder()
        _check_text(sys.argv[1:] if argv is None else argv)
        app(args=argv, prog_name="iceslide")

    with patient_screen() as faults:
        code = exit_code(command)
    if faults and code == 0:
        print(f"iceslide: cannot print: {faults[0].strerror}", file=sys.stderr)
        code = OutputError.exit_code
    sys.exit(code)


def _check_working_folder() -> None:
    """Raise SceneError if the working folder has been removed."""
    try:
        os.getcwd()
    except OSError as error:
        raise SceneError(f"the working folder is gone ({error.strerror}): cd to another") from None


def _check_text(words: Sequence[str]) -> None:
    """Raise SceneError if one of the `words` is not UTF-8: Python holds its bytes as surrogates."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise SceneError(
                f'"{word}" is not in UTF-8: rename the file, or set the locale (LC_ALL=C.UTF-8)'
            ) from None


if __name__ == "__main__":
    main()
