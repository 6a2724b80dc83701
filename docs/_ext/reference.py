"""Sphinx extension: the reference pages that follow from the program itself.

Directives: `scene-keys`, `scene-rules`, `run-columns TABLE`, `commands`, `validation-table NAME`,
`studies`. Each raises an error where what the program has and what `docs/reference/*.toml`
describes differ.
"""

from __future__ import annotations

import ast
import csv
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import typer
from docutils import nodes
from docutils.statemachine import StringList
from pydantic.fields import FieldInfo
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from iceslide_fem.cli import app
from iceslide_fem.scene import Scene
from iceslide_fem.scene.fields import default_text, leaves, quantity_of
from iceslide_fem.scene.rows import RowsOf
from iceslide_fem.scene.rules import RULES
from iceslide_fem.scene.units import Quantity

HERE = Path(__file__).parent.parent
REFERENCE = HERE / "reference"
DATA = HERE / "validation" / "data"
Row = tuple[str, ...]


PLAIN = os.environ | {"TYPER_USE_RICH": "0", "COLUMNS": "100", "NO_COLOR": "1"}  # of help texts


class Faulty(Exception):
    """The program and its description differ."""


def _parts(field: FieldInfo) -> Iterator[Any]:
    """All that annotates the field, however deep."""
    waiting = [*field.metadata, field.annotation]
    while waiting:
        part = waiting.pop(0)
        yield part
        waiting += [*getattr(part, "__metadata__", ()), *get_args(part)]


def _quantity(field: FieldInfo) -> Quantity | None:
    found = quantity_of(field)
    return found.value if isinstance(found, RowsOf) else found


def allowed(field: FieldInfo) -> str:
    """What a key may be."""
    parts = list(_parts(field))
    quantity, rows = _quantity(field), any(isinstance(part, RowsOf) for part in parts)
    choices = [v for part in parts if get_origin(part) is Literal for v in get_args(part)]
    if any(part is dict for part in map(get_origin, parts)):
        return "a table"
    if quantity is not None and not any(get_origin(part) is tuple for part in parts):
        return f"{quantity.low} to {quantity.high}" + (", or rows" if rows else "")
    found = [f"`{choice}`" for choice in choices if isinstance(choice, str)]
    numbers = [choice for choice in choices if isinstance(choice, int)]
    found += [f"{min(numbers)} to {max(numbers)}"] if numbers else []
    found += ["`true`, `false`"] if bool in parts else []
    low, high = (
        next((getattr(p, end) for p in parts if hasattr(p, end)), None) for end in ("ge", "le")
    )
    found += [f"{low} to {high}"] if high is not None else []
    if any(get_origin(part) is tuple for part in parts) and (numbers or not found):
        found += ["a list"]
    found += ["a file"] if Path in parts else []
    return ", ".join(found) or ("a name" if str in parts else "a table")


def default(field: FieldInfo) -> str:
    """What a key is if it is not given."""
    if field.is_required():
        return "needed"
    text = default_text(field)
    is_word = isinstance(field.default, bool | str | tuple)
    return (f"`{text}`" if is_word else text) or "–"


def scene_keys() -> Iterator[tuple[str, list[Row]]]:
    """Table of a scene and its keys: key, default, allowed, meaning."""
    tables: dict[str, list[Row]] = {}
    for key, field in leaves(Scene):
        if not field.description:
            raise Faulty(f"{key} has no meaning: give it one by `scene.units.key`")
        table = key.rpartition(".")[0] or "scene"
        row = f"`{key}`", default(field), allowed(field), field.description
        tables.setdefault(table, []).append(row)
    yield from tables.items()


def run_columns(table: str) -> list[Row]:
    """Column, meaning of a table that a run writes."""
    from iceslide_fem.output.probes import ProbeRow
    from iceslide_fem.output.table import HistoryRow, PassRow, PreloadRow, columns_of

    described = tomllib.loads((REFERENCE / "columns.toml").read_text(encoding="utf-8"))[table]
    kinds = {"history": HistoryRow, "preload": PreloadRow, "passes": PassRow, "probes": ProbeRow}
    if table in kinds:
        _same(f"docs/reference/columns.toml, {table}", described, columns_of(kinds[table]))
    return [(f"`{name}`", meaning) for name, meaning in described.items()]


def _same(where: str, described: Any, there: Any) -> None:
    if list(described) != list(there):
        missing = [name for name in there if name not in described]
        unknown = [name for name in described if name not in there]
        raise Faulty(f"{where}: not described: {missing}; unknown: {unknown}; or another order")


def _markdown(heads: Row, rows: list[Row]) -> list[str]:
    cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return [
        "| " + " | ".join(heads) + " |", "|" + len(heads) * "---|",
        *("| " + " | ".join(row) + " |" for row in cells), "",
    ]  # fmt: skip


class Generated(SphinxDirective):
    """A directive whose content is Markdown that a function writes."""

    def lines(self) -> list[str]:
        """Lines of Markdown."""
        raise NotImplementedError

    def run(self) -> list[nodes.Node]:
        """The parsed lines."""
        try:
            lines = self.lines()
        except (Faulty, OSError, KeyError, subprocess.CalledProcessError) as fault:
            raise self.error(str(fault)) from None
        found = nodes.Element()
        self.state.nested_parse(StringList(lines, "generated"), self.content_offset, found)
        return list(found.children)


class SceneKeys(Generated):
    """All keys of a scene, a table for each of its tables."""

    def lines(self) -> list[str]:
        found: list[str] = []
        for table, rows in scene_keys():
            title = "The scene itself" if table == "scene" else f"`[{table}]`"
            found += [
                f"**{title}**",
                "",
                *_markdown(("key", "default", "allowed", "meaning"), rows),
            ]
        return found


class SceneRules(Generated):
    """What excludes each other in a scene, with the reason and what is allowed."""

    def lines(self) -> list[str]:
        rows = []
        for rule in RULES:
            named, where = ([f"`{one.words}`" for one in part] for part in (rule.named, rule.where))
            here = f" (with {', '.join(where)})" if where else ""
            rows.append((" and ".join(named) + here, rule.reason or "–", rule.allowed))
        return _markdown(("not together", "because", "allowed"), rows)


class RunColumns(Generated):
    """The columns of one table."""

    required_arguments = 1

    def lines(self) -> list[str]:
        return _markdown(("column", "meaning"), run_columns(self.arguments[0]))


class Commands(Generated):
    """Every command with its options, by typer's own documentation of itself."""

    def lines(self) -> list[str]:
        commands = typer.main.get_command(app).commands
        names = [
            f"{name} {part}" if part else name
            for name, command in commands.items()
            for part in getattr(command, "commands", {"": None})
        ]
        found: list[str] = []
        for name in names:
            help_of = [sys.executable, "-m", "iceslide_fem.cli", *name.split(), "--help"]
            shown = subprocess.run(help_of, capture_output=True, text=True, check=True, env=PLAIN)
            found += [
                f"**`iceslide {name}`**",
                "",
                "```text",
                *shown.stdout.rstrip().splitlines(),
                "```",
                "",
            ]
        return found


class ValidationTable(Generated):
    """A table that a study has written, with where and when it was measured."""

    required_arguments = 1

    def lines(self) -> list[str]:
        path = DATA / f"{self.arguments[0]}.csv"
        with open(path, encoding="utf-8", newline="") as file:
            about = [
                line[1:].strip() for line in iter(file.readline, "#\n") if line.startswith("#")
            ]
            head, *rows = csv.reader(file)
        self.env.note_dependency(str(path))
        names = (line.partition(": ") for line in about)
        said = "; ".join(f"{name} `{value}`" for name, _, value in names)
        return [
            *_markdown(tuple(head), [tuple(row) for row in rows]),
            said[:1].upper() + said[1:],
            "",
        ]


class Studies(Generated):
    """Every study, by the first sentence of its docstring."""

    def lines(self) -> list[str]:
        rows = []
        for path in sorted((HERE.parent / "scripts" / "studies").glob("*.py")):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            about = (ast.get_docstring(tree) or "").partition("\n\n")[0].replace("\n", " ")
            if any(isinstance(part, ast.FunctionDef) and part.name == "main" for part in tree.body):
                rows.append((f"`{path.stem}`", about))
        return _markdown(("study", "what it prints"), rows)


def _fences(app: Sphinx, kind: str, name: str, what: Any, options: Any, lines: list[str]) -> None:
    """Docstrings write examples between Markdown's fences: they become code blocks."""
    found, inside = [], False
    for line in lines:
        if line.strip().startswith("```"):
            inside = not inside
            found += [".. code-block:: python", ""] if inside else [""]
        else:
            found.append(f"    {line}" if inside else line)
    lines[:] = found


def setup(sphinx: Sphinx) -> dict[str, bool]:
    """Register the directives."""
    for name, kind in (
        ("scene-keys", SceneKeys), ("scene-rules", SceneRules), ("run-columns", RunColumns),
        ("commands", Commands), ("validation-table", ValidationTable), ("studies", Studies),
    ):  # fmt: skip
        sphinx.add_directive(name, kind)
    sphinx.connect("autodoc-process-docstring", _fences)
    return {"parallel_read_safe": True}
