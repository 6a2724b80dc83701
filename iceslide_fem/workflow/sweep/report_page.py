"""The page of a sweep: table of cases, friction over the varied quantities, mu(t)."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from iceslide_fem.postprocess.report import of_run
from iceslide_fem.postprocess.report.page import (
    Cell,
    Page,
    Section,
    Table,
    Text,
)
from iceslide_fem.runs.doubts import NUMBER, by_kind
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.fields import typed
from iceslide_fem.scene.variation import quantity_or_none
from iceslide_fem.workflow.sweep.plan import SCENE
from iceslide_fem.workflow.sweep.plots import (
    charts_of_sweep,
    keys_of,
    over_time,
    places,
    quantity_of,
    value_of,
)
from iceslide_fem.workflow.sweep.table import DONE, read_sweep

MORE = (
    "In Python: iceslide_fem.read_sweep(folder) gives these numbers as labelled arrays. "
    "The page of a case: iceslide report FOLDER/cases/CASE; several folders after it are compared, "
    "with their fields side by side. Of a point: run its scene by itself."
)
MOST_ROWS = 400
RESULTS = {key: of_run.RESULTS[key][0] for key in ("mu_mean", "mu_peak", "mu_end")}


def page_of_sweep(folder: Path) -> Page:
    """The page of the sweep in `folder`. Raises SceneError if it holds none."""
    data = read_sweep(folder)
    try:
        table = pd.read_csv(folder / "sweep.csv", dtype=str, keep_default_na=False)
    except (OSError, ValueError) as error:
        raise SceneError(
            f"{folder} holds no whole sweep (no readable sweep.csv: {error})"
        ) from None
    keys = keys_of(data)
    done, count = int((data["status"] == DONE).sum()), int(data["status"].size)
    drawn = charts_of_sweep(data)
    charts = [part for parts in drawn.values() for part in parts]
    charts += over_time(data) if drawn else []
    over = ", ".join(f"{key} ({data.sizes[key]} values)" for key in keys) or "nothing"
    command = Text(_command(data, keys), "code")
    return Page(
        title=f"{data.attrs.get('name') or folder.name}: sweep of {count} cases",
        summary=f"{data.attrs.get('verdict', '')} {count} cases over {over}, {done} of them done, "
        f"model {data.attrs.get('model')}.".strip(),
        stopped="" if done == count else f"{count - done} of {count} cases are not done.",
        sections=[
            *([Section("curves", "Curves", charts)] if charts else []),
            Section("results", "Every case", [*_cases(data, keys), *_error(table)]),
            Section("warnings", "Warnings", warnings_of(data, table)),
            Section("scene", "What the cases share", _scene(data, keys)),
            Section("again", "Run it again", [command, Text(MORE), *_versions(table)]),
        ],
    )


def _cases(data: xr.Dataset, keys: list[str]) -> list[Table | Text]:
    rows = []
    for number, at in enumerate(itertools.islice(places(data, keys), MOST_ROWS), start=1):
        row = [Cell(str(number)), *(Cell(value_of(data, key, at[key])) for key in keys)]
        for key in RESULTS:
            value = float(data[key].isel(at)) if key in data else np.nan
            row.append(Cell(f"{value:.4f}", key, value) if np.isfinite(value) else Cell("–"))
        status, reason = (str(data[name].isel(at).values) for name in ("status", "reason"))
        row.append(Cell(status if status == DONE else f"{status}: {reason}"))
        rows.append(row)
    head = ["case", *(quantity_of(key).label for key in keys), *RESULTS.values(), "status"]
    found: list[Table | Text] = [Table("Cases in the order of the table sweep.csv", head, rows)]
    if (count := data["status"].size) > MOST_ROWS:
        found.append(Text(f"The first {MOST_ROWS} of {count} cases; sweep.csv has all."))
    return found


def _error(table: pd.DataFrame) -> list[Text]:
    """Text on the target error of the cases."""
    known = list(dict.fromkeys(table.get("numerics.tolerance", [])))
    if len(known) != 1:  # it is varied, so it is in the table
        return []
    return [
        Text(
            f"Steps and layers of every case are chosen for a relative error of mu(t) of "
            f"{float(known[0]):g} (numerics.tolerance); that of the mesh is not in it."
        )
    ]


def warnings_of(data: xr.Dataset, table: pd.DataFrame) -> list[Text]:
    """Reasons of unfinished cases, and warnings of finished ones, each kind once."""
    reasons, counts = np.unique(data["reason"].values.astype(str), return_counts=True)
    found = [
        Text(f"{count} not done: {reason}", "warning")
        for reason, count in zip(reasons, counts, strict=True)
        if reason
    ]
    said = [
        (number, sentence)
        for number, sentences in enumerate(table.get("warnings", []), start=1)
        for sentence in filter(None, sentences.split("; "))
    ]
    for cases in by_kind(said):
        (number, sentence), *others = sorted(cases, key=lambda case: _numbers(case[1]))
        if not others:
            found.append(Text(f"Case {number}: {sentence}.", "warning"))
            continue
        last, worst = others[-1]
        together = f"{len(cases)} of {len(table)} cases: {worst} (case {last})"
        if worst != sentence:
            together += f"; least in case {number}: {sentence.split(':')[0]}"
        found.append(Text(f"{together}.", "warning"))
    return found or [Text("Every case is done, and none gave a warning.")]


def _numbers(sentence: str) -> list[float]:
    """The numbers in a warning, by which the cases that give it are sorted."""
    return [float(each) for each in NUMBER.findall(sentence)]


def _scene(data: xr.Dataset, keys: list[str]) -> list[Text]:
    """The scene of the first case as a file, or the entries of older sweeps."""
    if "scene" not in data.attrs:
        return [Text(str(data.attrs.get("inputs", "")).replace(" ", "\n"), "code")]
    name = data.attrs.get("name") or "SCENE"
    varied = f" ({', '.join(keys)} as in the first case)" if keys else ""
    return [Text(f"As a file, {name}.toml{varied}:"), Text(str(data.attrs["scene"]), "code")]


def _versions(table: pd.DataFrame) -> list[Table]:
    """Versions that computed the cases; several if a sweep was continued."""
    rows = []
    for column in table:
        if str(column).startswith("versions."):
            known = [version for version in dict.fromkeys(table[column]) if version]
            rows.append([Cell(str(column).removeprefix("versions.")), Cell(", ".join(known))])
    return [Table("What computed it", ["", ""], rows)] if rows else []


def _command(data: xr.Dataset, keys: list[str]) -> str:
    files = [data.attrs.get("name") or "SCENE"]
    words = []
    for key in keys:
        values = [typed(value, quantity_or_none(key)) for value in data[key].values.tolist()]
        if key == SCENE:
            files = values
        elif any(data[other].dims == (key,) for other in data.coords if other != key):
            words.append(f"    --rows {key}.csv")
        else:
            words.append(f"    --vary {key}={','.join(values)}")
    return " \\\n".join([" ".join(["iceslide sweep", *(f"{file}.toml" for file in files)]), *words])
