"""Input of `iceslide hysteresis`, validated like a scene, by the names of its options."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, model_validator

from iceslide_fem.preprocess.option_values import Several, in_equal_ratios, in_equal_steps, pairs
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.command_options import CommandOptions, option, option_names
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.units import Quantity

MOST = 200  # values of an option


SPEEDS = "1mm/s:10m/s:25"
SPEED = Several("--speed", Quantity("m/s", "1e-6 m/s", "100 m/s"), SPEEDS, 1, MOST, in_equal_ratios)
TEMPERATURE = Several(
    "--temperature",
    Quantity("K", "-80 degC", "80 degC"),
    "-30degC:0degC:7",
    1,
    MOST,
    in_equal_steps,
)
PRESSURE = Several(
    "--pressure", Quantity("Pa", "0.01 bar", "100 bar"), "0.5bar:5bar:5", 1, MOST, in_equal_ratios
)
Values = tuple[float, ...]


class HysteresisCase(CommandOptions):
    """A scene with rough ice, and the conditions that are computed beside its own; SI units."""

    model_config = ConfigDict(alias_generator=option_names("scene"))

    scene: InputFile = option(..., "Scene with ice.roughness and rubber that relaxes.", "SCENE")
    set: Annotated[dict[str, str], pairs("--set", "ice.roughness.rms=3um")] = option(
        {}, "A key of the scene: ice.roughness.rms=3um. May be repeated.", "KEY=VALUE"
    )
    speed: Annotated[Values, BeforeValidator(SPEED)] = option(
        SPEED(SPEEDS), "First, last, count, in equal ratios; or V,V,...", "V:V:N", SPEEDS
    )
    temperature: Annotated[Values | None, BeforeValidator(TEMPERATURE)] = option(
        None, "Of the rubber: -30degC:0degC:7, or T,T,...", "T:T:N", "the scene's"
    )
    pressure: Annotated[Values | None, BeforeValidator(PRESSURE)] = option(
        None, "0.5bar:5bar:5, in equal ratios, or P,P,...", "P:P:N", "the scene's"
    )

    @model_validator(mode="after")
    def _is_rough(self) -> Self:
        try:
            scene = self.read
        except SceneError as error:
            raise ValueError(str(error)) from None
        if not scene.ice.roughness.is_rough:
            raise ValueError(
                f"{self.scene} has smooth ice: give [ice.roughness] rms, longest and shortest, or "
                "map"
            )
        return self

    @cached_property
    def read(self) -> Scene:
        """The scene. Raises SceneError."""
        return load_scene(self.scene, [f"{key}={value}" for key, value in self.set.items()])

    @property
    def source(self) -> Path:
        """The scene's file."""
        return self.scene

    @property
    def files(self) -> list[Path]:
        """All input files."""
        return [*super().files, *self.read.files.values()]

    @property
    def conditions(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Rows of speed (m/s), temperature (K) and pressure (Pa): the scene's, then all others."""
        scene = self.read
        own = (
            scene.load.speeds.largest, scene.rubber_temperature, scene.load.pressures.mean
        )  # fmt: skip
        temperatures, pressures = self.temperature or own[1:2], self.pressure or own[2:]
        grid = np.meshgrid(temperatures, pressures, self.speed, indexing="ij")
        T, p, v = (axis.ravel() for axis in grid)
        return np.vstack([own, np.column_stack([v, T, p])])
