"""Wheels, and stops of a car, under scenes with other inputs."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from iceslide_fem.preprocess.footprint.scene_keys import UNRELATED
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.command import WHEEL
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.runtime.launch import available_cores
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.sweep.processes import write_scene

# Outputs, and where they are in the figures of a wheel; its stops are of `--abs`.
OF_WHEELS = {
    "mu_peak": ("curves", 0, "peak_mu"),
    "mu_locked": ("curves", 0, "locked_mu"),
    "deceleration_locked": ("stops", "locked", "deceleration_m_s2"),
    "deceleration_threshold": ("stops", "threshold", "deceleration_m_s2"),
    "deceleration_ideal": ("stops", "ideal", "deceleration_m_s2"),
}


def wheel_options(text: str, output: str) -> dict[str, Any]:
    """Options of `iceslide wheel` from words, as for `WheelCase.of`, for an `output`.

    Raises SceneError if they are of no wheel under a scene.
    """
    if output not in OF_WHEELS:
        raise SceneError(f"--output {output} is none of a wheel; allowed: {', '.join(OF_WHEELS)}")
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise SceneError(f'--wheel "{text}" cannot be read: {error}') from None
    found: dict[str, Any] = {}
    for place, word in enumerate(words):
        if not word.startswith("--"):
            continue
        name, after = word[2:].replace("-", "_"), words[place + 1 : place + 2]
        found[name] = after[0] if after and not after[0].startswith("--") else True
    for name in ("scene", "vary", "temperature"):
        if name in found:
            raise SceneError(f"--wheel takes no --{name}: the scene and its inputs are varied here")
    if output.startswith("deceleration"):
        found["abs"] = True
    return found


def check_wheel(options: dict[str, Any], scene: Path, keys: Sequence[str]) -> None:
    """Raise SceneError if the wheel, or one of the uncertain `keys`, cannot be computed so."""
    WheelCase.of({**options, "scene": str(scene)})
    for reason, unrelated in UNRELATED.items():
        for key in keys:
            if key in unrelated:
                raise SceneError(f"{key} does not act on a wheel ({reason})")


def run_wheels(
    options: dict[str, Any], output: str, scenes: Sequence[Scene], folder: Path
) -> Array:
    """The `output` of a wheel under each of the `scenes`, NaN where it finds no step."""
    paths = [folder / f"{number}.toml" for number in range(len(scenes))]
    for path, scene in zip(paths, scenes, strict=True):
        write_scene(path, scene)
    with ProcessPoolExecutor(available_cores()) as pool:
        return np.array(list(pool.map(partial(_one, options, output), map(str, paths))))


def _one(options: dict[str, Any], output: str, scene: str) -> float:
    """The `output` of the wheel under one scene file."""
    case = WheelCase.of({**options, "scene": scene})
    try:
        value: Any = WHEEL.figures(case, WHEEL.compute(case))
    except SimulationStopped:
        return float("nan")
    for place in OF_WHEELS[output]:
        value = value[place]
    return float("nan") if value is None else float(value)
