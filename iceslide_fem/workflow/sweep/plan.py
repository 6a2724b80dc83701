"""The cases of a sweep: scenes with every combination of varied values, each valid."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, put, read_scene, scene_from_dict, unit_of
from iceslide_fem.scene.fields import with_unit
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.workflow.sweep.axes import (
    MOST_CASES,
    Axis,
    check_names,
    read_axis,
    read_rows,
)

LONGEST_NAME = 150  # characters of a folder
SCENE = "scene"  # dimension of a sweep over several scenes
# Names of a sweep's table and curves, which no dimension of rows may have.
TAKEN = [
    *(SCENE, "case", "fingerprint", "scene_hash", "status", "reason", "warnings"),
    *("mu", "film_height_m", "duration_s", "time_share"),
]

Value = float | str | bool


class Case(NamedTuple):
    """A case: its name, which says what differs, its scene, and the fingerprint of the scene.

    at: the values of the sweep's dimensions there.
    """

    name: str
    scene: Scene
    fingerprint: str
    at: Mapping[str, Value] = {}


class Plan(NamedTuple):
    """A sweep: values (SI) or labels along every dimension, and the cases, the last one fastest.

    rows: name of a dimension of rows -> values (SI) of its keys.
    """

    axes: dict[str, tuple[Value, ...]]
    cases: list[Case]
    rows: dict[str, dict[str, tuple[Any, ...]]] = {}

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of places along every dimension."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def keys(self) -> set[str]:
        """All varied keys."""
        return {*self.axes, *(key for keys in self.rows.values() for key in keys)}


def make_plan(
    scene_files: Sequence[Path],
    overrides: Sequence[str],
    varied: Sequence[str],
    tables: Sequence[Path] = (),
) -> Plan:
    """All combinations of `varied`, each "key=first:last:count" or "key=value,value,...".

    Several scenes are a dimension, named by their files, and so are the rows of each of the
    `tables`. Raises SceneError if a value or a combination is not allowed, a user's law can't be
    loaded, or there are more than `MOST_CASES`.
    """
    scenes = [(path.stem, read_scene(path, overrides)) for path in scene_files]
    return plan_of(scenes, [*map(read_axis, varied), *map(read_rows, tables)])


def plan_of(scenes: Sequence[tuple[str, Mapping[str, Any]]], axes: Sequence[Axis]) -> Plan:
    """All combinations of `scenes`, by names and tables, and of places along the `axes`.

    Raises SceneError, as `make_plan`.
    """
    check_names(axes, TAKEN)
    names = [name for name, _ in scenes]
    if twice := [name for name in names if names.count(name) > 1]:
        raise SceneError(f"two scenes are named {twice[0]}; a sweep tells them apart by names")
    if not axes and len(scenes) < 2:
        raise SceneError("a sweep varies something: give --vary load.pressure=1bar:5bar:5, say")
    count = len(scenes) * math.prod(len(axis.changes) for axis in axes)
    if count > MOST_CASES:
        raise SceneError(f"the sweep has {count} cases; allowed: up to {MOST_CASES}")
    found = []
    for (_, tables), *changes in itertools.product(scenes, *(axis.changes for axis in axes)):
        data = deepcopy(dict(tables))
        for change in changes:
            for key, value in change.items():
                put(data, key, value)
        found.append(scene_from_dict(data))
    values, rows = _in_si(axes, found)
    if len(scenes) > 1:
        values = {SCENE: tuple(names), **values}
    found = [resolved(scene) for scene in found]  # cases are resolved scenes
    for scene in found:
        law_of(scene)  # checked before the first run
    places = (dict(zip(values, at, strict=True)) for at in itertools.product(*values.values()))
    named = zip(_names(values, axes), found, places, strict=True)
    cases = [Case(name, scene, fingerprint(scene), at) for name, scene, at in named]
    return Plan(values, cases, rows)


def _names(values: Mapping[str, tuple[Value, ...]], axes: Sequence[Axis]) -> list[str]:
    """Names of all cases, as folders have them: speed=3__temperature=-10degC.

    Snakemake takes no comma in them. Values are exact where six digits do not tell them apart.
    """
    short = {name: ",".join(p.rpartition(".")[2] for p in name.split(",")) for name in values}
    last = list(short.values())
    of_keys = {axis.name for axis in axes if not axis.labels}
    words = []
    for name, along in values.items():
        title = short[name] if last.count(short[name]) == 1 else name
        shown = [_shown(name, value) if name in of_keys else str(value) for value in along]
        if len(set(shown)) < len(shown):
            shown = [str(value) for value in along]
        words.append([re.sub(r"[^\w.+=-]+", "-", f"{title}={text}") for text in shown])
    names = ["__".join(parts) for parts in itertools.product(*words)]
    if len(set(names)) == len(names) and max(map(len, names)) <= LONGEST_NAME:
        return names
    return [f"case{number}" for number in range(1, len(names) + 1)]


def _shown(key: str, value: Value) -> str:
    """A value in a name: lengths and pressures with a prefix, temperatures in degC."""
    unit = unit_of(key)
    if isinstance(value, bool | str) or unit is None:
        text = str(value)
        return Path(text).stem if Path(text).is_absolute() else text
    if unit == "K":
        return f"{value - 273.15:.6g}degC"
    return f"{value:.6g}" if "/" in unit else with_unit(value, unit).replace(" ", "")


def value_of(scene: Scene, key: str) -> Any:
    """Value (SI) of the dotted `key`."""
    value: Any = scene
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else getattr(value, part)
    return value


def _in_si(
    axes: Sequence[Axis], scenes: Sequence[Scene]
) -> tuple[dict[str, tuple[Value, ...]], dict[str, dict[str, tuple[Any, ...]]]]:
    """Values along the axes, of keys in SI as in the scenes, and those of keys of rows.

    Raises SceneError if a value is given twice.
    """
    values: dict[str, tuple[Value, ...]] = {}
    rows: dict[str, dict[str, tuple[Any, ...]]] = {}
    stride = math.prod(len(axis.changes) for axis in axes)
    for axis in axes:
        stride //= len(axis.changes)
        there = [scenes[number * stride] for number in range(len(axis.changes))]
        in_si = {key: tuple(_plain(value_of(scene, key)) for scene in there) for key in axis.keys}
        if axis.labels:
            values[axis.name], rows[axis.name] = axis.labels, in_si
            continue
        values[axis.name] = own = in_si[axis.name]
        if twice := [value for value in own if own.count(value) > 1]:
            raise SceneError(f"{axis.name} = {twice[0]} is given twice")
    return values, rows


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, Path) else value
