"""The cases of a sweep: every combination of varied values, each a valid scene."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import (
    Scene,
    key_and_text,
    parsed,
    put,
    read_scene,
    scene_from_dict,
    unit_of,
)
from iceslide_fem.scene.fields import with_unit
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.scene.messages import shortened
from iceslide_fem.scene.units import read_range

MOST_CASES = 100_000  # of a sweep
LONGEST_NAME = 150  # characters of a folder

Value = float | str | bool
_RANGE = re.compile(r"[^:,]+:[^:,]+:\s*[0-9]+\s*")


class Case(NamedTuple):
    """A case: its name, which says what differs, its scene, and the fingerprint of the scene."""

    name: str
    scene: Scene
    fingerprint: str


class Plan(NamedTuple):
    """A sweep: values of every varied key (SI) and the cases, the last key varying fastest."""

    axes: dict[str, tuple[Value, ...]]
    cases: list[Case]

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each varied key."""
        return tuple(len(values) for values in self.axes.values())


def make_plan(scene_file: Path, overrides: Sequence[str], varied: Sequence[str]) -> Plan:
    """All combinations of `varied`, each "key=first:last:count" or "key=value,value,...".

    Raises SceneError if a value or a combination is not allowed, a user's law can't be loaded, or
    there are more than `MOST_CASES`.
    """
    base = read_scene(scene_file, overrides)
    given = dict(_axis(text) for text in varied)
    if len(given) < len(varied):
        keys = [key_and_text(text)[0] for text in varied]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise SceneError(f"{twice} is varied twice; give all its values in one --vary")
    return plan_of(base, given)


def plan_of(base: Mapping[str, Any], given: Mapping[str, Sequence[Any]]) -> Plan:
    """All combinations of the values `given` for dotted keys, in the tables `base` of a scene.

    Raises SceneError, as `make_plan`.
    """
    if not given:
        raise SceneError("a sweep varies something: give --vary load.pressure=1bar:5bar:5, say")
    if "name" in given:
        raise SceneError("name cannot be varied: it names the sweep, not a case")
    count = math.prod(len(values) for values in given.values())
    if count > MOST_CASES:
        raise SceneError(f"the sweep has {count} cases; allowed: up to {MOST_CASES}")
    scenes = []
    for values in itertools.product(*given.values()):
        data = deepcopy(dict(base))
        for key, value in zip(given, values, strict=True):
            put(data, key, value)
        scenes.append(scene_from_dict(data))
    axes = _axes_in_si(given, scenes)
    scenes = [resolved(scene) for scene in scenes]  # cases are resolved scenes
    for scene in scenes:
        law_of(scene)  # checked before the first run
    named = zip(_names(axes), scenes, strict=True)
    return Plan(axes, [Case(name, scene, fingerprint(scene)) for name, scene in named])


def _names(axes: Mapping[str, tuple[Value, ...]]) -> list[str]:
    """Names of all cases, as folders have them: speed=3__temperature=-10degC.

    Snakemake takes no comma in them. Values are exact where six digits do not tell them apart.
    """
    last = [key.rpartition(".")[2] for key in axes]
    words = []
    for key, values in axes.items():
        short = key.rpartition(".")[2]
        title = short if last.count(short) == 1 else key
        shown = [_shown(key, value) for value in values]
        if len(set(shown)) < len(shown):
            shown = [str(value) for value in values]
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


def _axis(text: str) -> tuple[str, tuple[Any, ...]]:
    """Key and values, as given, of "load.pressure=1bar:5bar:5" or "load.speed=1,2,3"."""
    key, values = key_and_text(text)
    unit = unit_of(key)
    if ":" not in values or (unit is None and not _RANGE.fullmatch(values)):
        return key, tuple(parsed(value.strip()) for value in values.split(","))
    if unit is None:
        raise SceneError(f"{key} is not a number: list its values, as in {key}=one,other")
    try:
        first, last, number = read_range(values)
    except ValueError as error:
        raise SceneError(f'--vary {key}="{values}" {error}') from None
    if not 2 <= number <= MOST_CASES:
        raise SceneError(f'--vary "{text}": a range has a count of 2 to {MOST_CASES}')
    even = np.linspace(_end(key, first, unit), _end(key, last, unit), number)
    return key, tuple(float(f"{value:.12g}") for value in even)


def _end(key: str, text: str, unit: str) -> float:
    """The end of a range in SI."""
    value = parsed(text)
    reason: object = "is not a number"
    try:
        if isinstance(value, str):
            return to_si(value, unit)
    except ValueError as error:
        reason = error
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300:
        return float(value)
    raise SceneError(f'{key} = "{shortened(text)}" {reason}')


def _axes_in_si(
    given: Mapping[str, Sequence[Any]], scenes: Sequence[Scene]
) -> dict[str, tuple[Value, ...]]:
    """Values of the varied keys in SI, as in the scenes; duplicates are refused."""
    axes: dict[str, tuple[Value, ...]] = {}
    stride = len(scenes)
    for key, values in given.items():
        stride //= len(values)
        in_si = [value_of(scenes[number * stride], key) for number in range(len(values))]
        if len(set(in_si)) < len(in_si):
            twice = next(value for value in in_si if in_si.count(value) > 1)
            raise SceneError(f"{key} = {twice} is given twice")
        axes[key] = tuple(str(v) if isinstance(v, Path) else v for v in in_si)
    return axes
