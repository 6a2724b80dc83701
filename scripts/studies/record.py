"""Write tables that studies print as data of the documentation (docs/validation/data).

`docs/validation/tables.toml` says which study prints which table: its options, what the table's
head begins with, and where only a part of it is wanted, its columns or a pattern of its rows.
Without names all tables are made anew. Every file says who printed it, of which commit, when, and
on what machine; pages show that below the table.
"""

from __future__ import annotations

import argparse
import csv
import os
import platform
import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

from scripts.studies.common import ROOT, options

PAGES = ROOT / "docs" / "validation"
LIST, DATA = PAGES / "tables.toml", PAGES / "data"
MEASURED = ("iceslide_fem", "scripts", "cases", "meshes")


class Printer(NamedTuple):
    """A study and its options, in words."""

    study: str
    options: tuple[str, ...]

    def __str__(self) -> str:
        return " ".join((f"scripts.studies.{self.study}", *self.options))


def tables_in(text: str) -> list[list[list[str]]]:
    """The Markdown tables of a text: rows of cells, the head first."""
    found: list[list[list[str]]] = [[]]
    for line in text.splitlines():
        if not line.startswith("|"):
            found += [[]] if found[-1] else []
        elif set(line) - set("|-: "):
            found[-1].append([cell.strip() for cell in line.strip().strip("|").split("|")])
    return [table for table in found if table]


def machine() -> str:
    """Cores and processor of this machine."""
    return f"{os.cpu_count()} cores, {platform.machine()}"


def commit() -> str:
    """The checked-out commit, with a mark where what is measured differs from it."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True)
        return done.stdout.strip()

    changed = git("status", "--porcelain", "--", *MEASURED)
    return git("rev-parse", "--short", "HEAD") + (", changed" if changed else "")


def write(path: Path, printer: Printer, rows: list[list[str]]) -> None:
    """Write the `rows` of a table as data."""
    about = {
        "printed by": str(printer), "commit": commit(), "date": date.today().isoformat(),
        "machine": machine(),
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {name}: {value}\n" for name, value in about.items())
        file.write("#\n")
        csv.writer(file, lineterminator="\n").writerows(rows)
    print(f"written: {path.relative_to(ROOT)}")


def chosen(rows: list[list[str]], entry: dict[str, Any]) -> list[list[str]]:
    """Those columns and rows of a table that its entry wants. Raises ValueError: no such column."""
    head, *body = rows
    places = [head.index(name) for name in entry.get("columns", head)]
    pattern = re.compile(entry.get("rows", ""))
    kept = [row for row in body if pattern.search(", ".join(row))]
    return [[row[place] for place in places] for row in (head, *kept)]


def record(wanted: dict[str, dict[str, Any]], python: str, more: Sequence[str]) -> None:
    """Run every study that prints a wanted table, with `more` options, and write the tables."""
    by_printer: dict[Printer, dict[str, dict[str, Any]]] = {}
    for name, entry in wanted.items():
        printer = Printer(entry["study"], tuple(entry.get("options", ())))
        by_printer.setdefault(printer, {})[name] = entry
    for printer, tables in by_printer.items():
        module = f"scripts.studies.{printer.study}"
        command = [python, "-m", module, *printer.options, *more]
        print(f"runs: {printer}", flush=True)
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        if done.returncode:
            raise SystemExit(f"{printer} has ended with {done.returncode}: nothing is written")
        found = tables_in(done.stdout)
        for name, entry in tables.items():
            head = entry["head"]
            fitting = [rows for rows in found if ", ".join(rows[0]).startswith(head)]
            if not fitting:
                heads = "; ".join(", ".join(rows[0][:3]) for rows in found)
                raise SystemExit(f"{printer} prints no table that begins with {head}, but {heads}")
            write(DATA / f"{name}.csv", printer, chosen(fitting[0], entry))


def main() -> None:
    """Make tables anew."""
    parser = options(__doc__)
    parser.add_argument("names", nargs="*", help="of tables; all without any")
    with_others = "that runs the studies, with packages of other programs"
    parser.add_argument("--python", default=sys.executable, help=with_others)
    where = "options of the studies that say where other programs are, last"
    parser.add_argument("--more", nargs=argparse.REMAINDER, default=[], help=where)
    given = parser.parse_args()
    known = tomllib.loads(LIST.read_text(encoding="utf-8"))
    for name in given.names:
        if name not in known:
            parser.error(f"{name} is not in {LIST.relative_to(ROOT)}; it has {', '.join(known)}")
    wanted = {name: entry for name, entry in known.items() if name in (given.names or known)}
    record(wanted, given.python, given.more)


if __name__ == "__main__":
    main()
