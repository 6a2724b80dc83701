"""`iceslide footprint`, `wheel`, `roughness` and `rubber`: their options and printed words."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import typer

from iceslide_fem.commands.report import leave_page
from iceslide_fem.runtime.launch import imports_that_stay
from iceslide_fem.runtime.terminal import show_figures, show_notes


class Entry(NamedTuple):
    """A command without its options, which are loaded only where they are asked for."""

    module: str
    help: str


COMMANDS = {
    "footprint": Entry(
        "iceslide_fem.preprocess.footprint.command",
        "Temperature, water film and friction under a tyre, from its footprint or a line along it.",
    ),
    "wheel": Entry(
        "iceslide_fem.preprocess.wheel.command",
        "Friction over slip of a wheel that rolls and slips on ice, from its footprint or a line.",
    ),
    "roughness": Entry(
        "iceslide_fem.preprocess.roughness.command",
        "k, D and H_V over pressure, from a height map of the rubber: contact.csv for "
        "film.contact.",
    ),
    "hysteresis": Entry(
        "iceslide_fem.preprocess.hysteresis.command",
        "What rubber loses on the waves of rough ice: mu over speed, temperature and pressure.",
    ),
    "calibrate": Entry(
        "iceslide_fem.inference.calibrate.command",
        "Parameters of a scene from measured friction, with intervals, and what is not determined.",
    ),
    "compare": Entry(
        "iceslide_fem.inference.compare.command",
        "Which compound, pattern or tyre is better, by how much, and how sure: ratios to one.",
    ),
    "uncertainty": Entry(
        "iceslide_fem.inference.uncertainty.command",
        "What uncertain inputs mean for mu: its spread, and which input it comes from.",
    ),
    "rubber": Entry(
        "iceslide_fem.preprocess.rubber.command",
        "Rubber that relaxes, from a DMA table: shifts, Prony series, a \\[rubber] for scenes.",
    ),
}


def placeholder(name: str) -> Callable[[], None]:
    """The command `name` for a list of commands: with its help, without its options."""

    def listed() -> None: ...

    listed.__doc__ = COMMANDS[name].help
    return listed


def whole(name: str) -> Callable[..., Mapping[str, Any]]:
    """The command `name` with its options."""
    from iceslide_fem.commands.from_model import command

    entry = COMMANDS[name]
    kind = getattr(import_module(entry.module), name.upper())

    def work(
        values: dict[str, Any], out: Path | None, force: bool, no_report: bool
    ) -> Mapping[str, Any]:
        with imports_that_stay():
            from iceslide_fem.postprocess.report.page import write_page
            from iceslide_fem.preprocess.work import run
        done = run(kind, values, out, force)
        words = done.words
        if words.verdict:
            typer.echo(words.verdict)
        show_figures(words.lines)
        for table in words.tables:
            _show_table(table)
        show_notes(done.figures["warnings"])
        for remark in words.remarks:
            typer.echo(remark)
        if not no_report:
            leave_page(lambda: write_page(done.folder / "report.html", done.page))
        for path in sorted(path for path in done.folder.iterdir() if path.is_file()):
            typer.echo(str(path))
        return {"folder": done.folder, **done.figures}

    return command(kind.case, work, entry.help, kind.folder.format("<name of the source>"))


def _show_table(table: Any) -> None:
    from rich.console import Console
    from rich.table import Table

    shown = Table(*table.head, title=table.caption, title_justify="left")
    for row in table.rows:
        shown.add_row(*(cell.text for cell in row))
    Console().print(shown)
