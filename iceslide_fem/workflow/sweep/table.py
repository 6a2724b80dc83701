"""Outcomes of cases; a sweep as files: `sweep.csv`, a row per case, and `sweep.nc`, arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr

from iceslide_fem.output.summary import untouched, word_of
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runs.verdict import of_cases
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import attributes_of
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.scene import Scene, as_toml, flat, put, unit_of
from iceslide_fem.scene.fingerprint import fingerprint, scene_hash, versions, versions_in_words
from iceslide_fem.workflow.sweep.plan import SCENE, Plan

# Number of evenly spaced samples of a curve, from t = 0 to the end of the case, or over its last
# pass.
SAMPLES = 201
CURVES = ("mu", "film_height_m")
SENTENCE = "iceslide: "  # start of the command's error message
DONE, FAILED, NOT_RUN = "done", "failed", "not run"
_TEXT = ("case", "fingerprint", "scene_hash", "status", "reason", "warnings")


class CaseResult(NamedTuple):
    """status: done, failed or not run; reason: a sentence unless done; summary: entries of
    summary.json; curves: by name, (SAMPLES,), SI."""

    status: str
    reason: str = ""
    summary: dict[str, Any] = {}
    curves: dict[str, Array] = {}


NOT_COMPUTED = CaseResult(NOT_RUN, "not computed yet")


def read_outcome(directory: Path, scene: Scene) -> CaseResult:
    """The outcome of the run of `scene` in `directory`, from its files.

    Files of another scene or of another program are ignored, and the case runs again.
    """
    complaint = word_of(directory) or _complaint(directory / "log.txt")
    try:
        run = read_run(directory)
    except SceneError:
        return CaseResult(FAILED, complaint) if complaint else NOT_COMPUTED
    of_this = run.summary.get("fingerprint") == fingerprint(scene)
    if not of_this or not untouched(directory, run.summary):
        return CaseResult(NOT_RUN, f"{directory} holds files that no run of this case wrote")
    stopped = run.summary.get("stopped")
    times = np.linspace(0.0, run.scene["load"]["duration"], SAMPLES)
    history = run.one_pass(-1).history  # the last one
    curves = {
        name: np.interp(times, history["time_s"], history[name], right=np.nan if stopped else None)
        for name in CURVES
    }
    return CaseResult(FAILED if stopped else DONE, stopped or "", run.summary, curves)


def _complaint(log: Path) -> str:
    """The command's error message, or the message about its end."""
    try:
        lines = log.read_text("utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    said = [line for line in lines if line.startswith(SENTENCE)]
    return said[0].removeprefix(SENTENCE) if said else ""


def write_sweep(folder: Path, plan: Plan, outcomes: Sequence[CaseResult]) -> xr.Dataset:
    """Write `sweep.csv` and `sweep.nc`; returns the Dataset of the latter."""
    inputs = [flat(case.scene.as_dict()) for case in plan.cases]
    rows = [
        {
            "case": case.name,
            "fingerprint": case.fingerprint,
            "scene_hash": scene_hash(case.scene),
            "status": outcome.status,
            "reason": outcome.reason,
            "warnings": "; ".join(outcome.summary.get("warnings") or []),
        }
        | given
        | _entries(outcome.summary)
        for case, given, outcome in zip(plan.cases, inputs, outcomes, strict=True)
    ]
    table = pd.DataFrame(rows)
    replace_file(folder / "sweep.csv", table.convert_dtypes().to_csv(index=False))
    dataset = to_dataset(plan, inputs, table, outcomes)
    replace_file(folder / "sweep.nc", bytes(dataset.to_netcdf(engine="scipy")))
    return dataset


def read_sweep(folder: Path | str) -> xr.Dataset:
    """The labelled arrays of a sweep: a dimension for each varied key, and `time_share`.

    Raises SceneError if there are none.
    """
    path = Path(folder) / "sweep.nc"
    try:
        return xr.load_dataset(path, engine="scipy")
    except (ArithmeticError, LookupError, MemoryError, OSError, TypeError, ValueError) as error:
        raise SceneError(f"{folder} holds no sweep (no readable sweep.nc: {error})") from None


def cases_in(folder: Path) -> list[dict[str, Any]]:
    """The rows of `sweep.csv` in `folder`, by column; None for an empty cell."""
    table = pd.read_csv(folder / "sweep.csv", dtype=dict.fromkeys(_TEXT, str))
    rows = table.to_json(orient="records", double_precision=15)
    return list(json.loads(rows))


def scenes_of_table(folder: Path) -> set[str]:
    """Hashes of the scenes with a result in `sweep.csv` of `folder`."""
    try:
        table = pd.read_csv(folder / "sweep.csv", usecols=["scene_hash", "status"], dtype=str)
    except (OSError, ValueError):
        return {"unknown"}
    return {str(scene) for scene in table["scene_hash"][table["status"] == DONE]}


def done_points(folder: Path) -> dict[str, CaseResult]:
    """Outcomes by fingerprint of points from an earlier sweep in `folder`.

    Raises SceneError if its arrays are damaged.
    """
    if not (folder / "sweep.nc").is_file():
        return {}
    dataset = read_sweep(folder)
    try:
        names = ("fingerprint", "status", "warnings")
        cases, status, warnings = (dataset[name].values.ravel() for name in names)
        curves = {name: dataset[name].values.reshape(-1, SAMPLES) for name in CURVES}
    except (KeyError, ValueError) as error:
        raise SceneError(f"{folder / 'sweep.nc'} is not what a sweep writes ({error})") from None
    entries = {
        str(name): dataset[name].values.ravel()
        for name in dataset.data_vars
        if name not in (*_TEXT, *CURVES, "duration_s") and dataset[name].dtype.kind in "if"
    }
    found = {}
    for number in np.flatnonzero(status == DONE):
        numbers = {name: float(values[number]) for name, values in entries.items()}
        summary: dict[str, Any] = {k: None if np.isnan(v) else v for k, v in numbers.items()}
        summary["warnings"] = [str(text) for text in warnings[number : number + 1] if text]
        own = {name: values[number] for name, values in curves.items()}
        found[cases[number]] = CaseResult(DONE, "", summary, own)
    return found


def to_dataset(
    plan: Plan,
    inputs: Sequence[dict[str, Any]],
    table: pd.DataFrame,
    outcomes: Sequence[CaseResult],
) -> xr.Dataset:
    """Dataset of texts, summary numbers and curves over the dimensions of the plan, in SI.

    Keys of rows are coordinates along their dimension. inputs: of every case, by dotted key.
    """
    keys = list(plan.axes)
    coordinates: dict[str, Any] = {}
    for name, values in plan.axes.items():
        coordinates[name] = _coordinate(name, name, values)
        for key, of_rows in plan.rows.get(name, {}).items():
            coordinates[key] = _coordinate(name, key, of_rows)
    coordinates["time_share"] = np.linspace(0.0, 1.0, SAMPLES)
    data: dict[str, Any] = {}
    for name in table:
        if name in _TEXT:
            data[name] = (keys, table[name].fillna("").to_numpy(dtype=str).reshape(plan.shape))
        elif name not in inputs[0] and name.split(".")[0] != "versions":
            numbers = table[name].to_numpy(dtype=float).reshape(plan.shape)
            data[name] = (keys, numbers, attributes_of(name))
    missing = np.full(SAMPLES, np.nan)
    for name in CURVES:
        curves = np.array([outcome.curves.get(name, missing) for outcome in outcomes])
        shape = *plan.shape, SAMPLES
        data[name] = ([*keys, "time_share"], curves.reshape(shape), attributes_of(name))
    durations = np.array([case.scene.load.duration for case in plan.cases])
    data["duration_s"] = (keys, durations.reshape(plan.shape), attributes_of("duration_s"))
    first, *others = inputs
    common = {
        key: value
        for key, value in first.items()
        if key not in plan.keys and all(other[key] == value for other in others)
    }
    scene: dict[str, Any] = {}
    for key, value in first.items():  # a scene file with the values of the first case
        if key in common or key in plan.keys or SCENE in plan.axes:
            put(scene, key, value)
    words = " ".join(f"{key}={value}" for key, value in common.items() if value is not None)
    attributes = {"iceslide_fem": "sweep", "inputs": words}
    attributes |= {key: str(common.get(key, "")) for key in ("name", "model")}
    attributes["versions"] = versions_in_words(versions())
    attributes["verdict"] = of_cases(
        [
            (case.scene, outcome.summary)
            for case, outcome in zip(plan.cases, outcomes, strict=True)
            if outcome.status == DONE
        ]
    )
    return xr.Dataset(data, coordinates, attributes | {"scene": as_toml(scene)})


def _coordinate(dimension: str, key: str, values: Sequence[Any]) -> tuple[str, Array, Any]:
    """The values of a key along a dimension, numbers with their unit, else texts."""
    if all(isinstance(value, int | float) for value in values):
        return dimension, np.array(values), {"units": unit_of(key) or "1"}
    return dimension, np.array(["" if value is None else str(value) for value in values]), {}


def _entries(summary: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers and versions of a summary; other columns have the rest."""
    numbers = {
        key: value
        for key, value in summary.items()
        if key not in ("stopped", "verdict") and (value is None or isinstance(value, int | float))
    }
    return numbers | flat({"versions": summary.get("versions", {})})
