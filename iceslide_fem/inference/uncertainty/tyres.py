"""Wheels, stops of a car, and footprints under scenes with other inputs."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.command import FOOTPRINT
from iceslide_fem.preprocess.footprint.film_options import FilmOptions
from iceslide_fem.preprocess.footprint.scene_keys import UNRELATED
from iceslide_fem.preprocess.wheel.command import WHEEL
from iceslide_fem.preprocess.work import Preprocessor
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.runtime.launch import available_cores
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.command_options import scene_keys
from iceslide_fem.workflow.sweep.processes import write_scene

# Options of film and ice that are keys of a scene, with these keys.
OF_SCENE = {
    name: scene_keys(field) for name, field in FilmOptions.model_fields.items() if scene_keys(field)
}


class Kind(NamedTuple):
    """What is computed under scenes: its command, and where its outputs are in its figures."""

    command: Preprocessor
    outputs: Mapping[str, tuple[str | int, ...]]


# Stops are those of `--abs`; the first output is the default.
KINDS = {
    "wheel": Kind(
        WHEEL,
        {
            "mu_peak": ("curves", 0, "peak_mu"),
            "mu_locked": ("curves", 0, "locked_mu"),
            "deceleration_locked": ("stops", "locked", "measured_deceleration_m_s2"),
            "deceleration_threshold": ("stops", "threshold", "measured_deceleration_m_s2"),
            "deceleration_ideal": ("stops", "ideal", "measured_deceleration_m_s2"),
        },
    ),
    "footprint": Kind(FOOTPRINT, {"mu_mean": ("film", "mu_mean")}),
}


class Tyre(NamedTuple):
    """A wheel or a footprint: its kind, its options by the names of fields, and its output."""

    kind: str
    options: dict[str, Any]
    output: str

    def under(self, scene: Path) -> dict[str, Any]:
        """Its options under a scene file."""
        if self.kind == "wheel":
            return {**self.options, "scene": str(scene)}
        return {**_options_of(load_scene(scene)), **self.options}

    def value(self, scene: str) -> float:
        """Its output under a scene file; NaN if the law finds no step there."""
        command, outputs = KINDS[self.kind]
        case: Any = command.case.of(self.under(Path(scene)))
        try:
            value: Any = command.figures(case, command.compute(case))
        except SimulationStopped:
            return float("nan")
        for place in outputs[self.output]:
            value = value[place]
        return float("nan") if value is None else float(value)


def tyre(kind: str, text: str, output: str, scene: Path, keys: Sequence[str]) -> Tyre:
    """The tyre of a `kind` with options as typed; keys: of uncertain inputs.

    Raises SceneError if it cannot be computed under the scene, or a key does not act on it.
    """
    known = KINDS[kind].outputs
    if output not in known:
        raise SceneError(f"--output {output} is none of a {kind}; allowed: {', '.join(known)}")
    found = Tyre(kind, _options(kind, text), output)
    if output.startswith("deceleration"):
        found.options["abs"] = True
    KINDS[kind].command.case.of(found.under(scene))
    for key in keys:
        why = _without_effect(kind, key)
        if why:
            raise SceneError(f"{key} does not act on a {kind} ({why})")
    return found


def run_tyres(found: Tyre, scenes: Sequence[Scene], folder: Path) -> Array:
    """The output of a tyre under each of the `scenes`, NaN where the law finds no step."""
    paths = [folder / f"{number}.toml" for number in range(len(scenes))]
    for path, scene in zip(paths, scenes, strict=True):
        write_scene(path, scene)
    with ProcessPoolExecutor(available_cores()) as pool:
        return np.array(list(pool.map(partial(Tyre.value, found), map(str, paths))))


def _options(kind: str, text: str) -> dict[str, Any]:
    """Options from words, as a command line has them. Raises SceneError."""
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise SceneError(f'--{kind} "{text}" cannot be read: {error}') from None
    found = KINDS[kind].command.case.from_words(words)
    for name in ("scene", "vary", *OF_SCENE):
        if name in found:
            raise SceneError(f"--{kind} takes no --{name}: the scene says it, and is varied here")
    return found


def _options_of(scene: Scene) -> dict[str, Any]:
    """Options of film and ice with the values of a scene, where they are single."""
    found = {}
    for name, keys in OF_SCENE.items():
        tables = (key.split(".") for key in keys)
        values = [getattr(getattr(scene, table), key) for table, key in tables]
        if all(isinstance(value, float | str | Path) for value in values):
            found[name] = ",".join(map(str, values))
    return found


def _without_effect(kind: str, key: str) -> str:
    """Why a key does not act on a tyre; "" if it does."""
    if kind == "footprint":
        acts = any(key in keys for keys in OF_SCENE.values())
        return "" if acts else "none of its options is this key"
    return next((reason for reason, keys in UNRELATED.items() if key in keys), "")
