"""How every preprocessor runs: options in; tables, pictures, a page and a summary out."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.postprocess.report.page import (
    OPTIONS,
    Cell,
    Chart,
    HeatMap,
    Page,
    Section,
    Table,
    Text,
)
from iceslide_fem.postprocess.report.png import save_png
from iceslide_fem.postprocess.report.saved import save_page
from iceslide_fem.postprocess.report.words import as_warning, versions_of
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.folders import claimed, clear_results, other_case
from iceslide_fem.scene.command_options import CommandOptions
from iceslide_fem.scene.fingerprint import versions

Charts = Mapping[str, Sequence[Chart | HeatMap]]  # by names of pictures without .png


class Words(NamedTuple):
    """What terminal and page say of results.

    lines: names and readable values of the main figures; remarks: sentences below the tables;
    left_out: what the model leaves out; more: of the page alone; verdict: what the main figure is
    worth (`runs.verdict`), before everything else.
    """

    title: str
    summary: str
    lines: Sequence[tuple[str, str]]
    left_out: str
    tables: Sequence[Table] = ()
    remarks: Sequence[str] = ()
    more: Sequence[Section] = ()
    verdict: str = ""


class Preprocessor(NamedTuple):
    """A preprocessor.

    name: of its command; case: its options, with the `source` that results are named after;
    compute: the results of a case; figures: of case and results, for the file `summary`; write:
    tables of case and results, into a folder; charts: of case and results; words: of the figures;
    ending: of the default folder's name.
    """

    name: str
    case: type[CommandOptions]
    compute: Callable[[Any], Any]
    figures: Callable[[Any, Any], dict[str, Any]]
    write: Callable[[Any, Any, Path], None]
    charts: Callable[[Any, Any], Charts]
    words: Callable[[Mapping[str, Any]], Words]
    summary: str = "summary.json"
    ending: str = ""

    @property
    def folder(self) -> str:
        """The default folder, with {} for the name of the source."""
        return f"results/{{}}{self.ending}"


class Done(NamedTuple):
    """What a preprocessor has computed and written: case, results, summary, page, and where."""

    case: Any
    found: Any
    figures: dict[str, Any]
    words: Words
    page: Page
    folder: Path


def run(
    kind: Preprocessor, values: Mapping[str, Any], out: Path | None = None, force: bool = False
) -> Done:
    """Compute what `values` describe (see `kind.case`) and write to `out`, or `kind.folder`.

    Writes the tables, a picture for each entry of the charts, the page, and the summary. Earlier
    results of the same input are replaced, with `force` any results. Raises SceneError, before
    anything is written, if the input is invalid or `out` must not be used, SimulationStopped if a
    step of the law fails, and OutputError if a file cannot be written.
    """
    begun = time.perf_counter()
    case: Any = kind.case.of(values)
    out = out or Path(kind.folder.format(case.source.stem))
    here = case.model_dump(mode="json")
    with claimed(out, partial(other_case, kind.summary, here), force, case.files):
        found = kind.compute(case)
        figures = kind.figures(case, found) | {"command": case.as_command(kind.name), "case": here}
        with writing(out):
            clear_results(out)
            kind.write(case, found, out)
            charts = kind.charts(case, found)
            for name, parts in charts.items():
                save_png(parts, out / f"{name}.png")
        figures |= {"wall_s": time.perf_counter() - begun, "versions": versions()}
        words = kind.words(figures)
        page = page_of(words, charts, figures, case.readable)
        save_page(page, out)
        replace_file(out / kind.summary, json.dumps(figures, indent=2) + "\n")
        return Done(case, found, figures, words, page, out)


def page_of(
    words: Words, charts: Charts, figures: Mapping[str, Any], options: Sequence[tuple[str, str]]
) -> Page:
    """The page of a preprocessor's results; options: with their values."""
    lines = [[Cell(name), Cell(value)] for name, value in words.lines]
    notes = [as_warning(note) for note in figures["warnings"]]
    case = [[Cell(name), Cell(text)] for name, text in options]
    drawn = [part for parts in charts.values() for part in parts]
    return Page(
        title=words.title,
        summary=f"{words.verdict} {words.summary}".strip(),
        sections=[
            Section("results", "Results", [
                *words.tables,
                Table("Main figures", ["", ""], lines),
                *map(Text, words.remarks),
            ]),
            Section("warnings", "Warnings", notes or [Text("There was no warning.")]),
            Section("curves", "Curves and maps", drawn),
            *words.more,
            Section("neglected", "What the model leaves out", [Text(words.left_out)]),
            Section("again", "Run it again", [
                Text(str(figures.get("command", "")), "code"),
                Table(OPTIONS, ["option", "value"], case),
                versions_of({"": figures}),
            ]),
        ],
    )  # fmt: skip


def csv_text(columns: Mapping[str, Any], digits: int = 9, missing: str = "nan") -> str:
    """A table as CSV: names with units -> values, with so many `digits`; missing: for NaN."""

    def text(value: Any) -> str:
        if isinstance(value, str):
            return value
        return missing if np.isnan(value) else f"{value + 0.0:.{digits}g}"

    rows = (",".join(map(text, row)) for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows]) + "\n"
