"""Input of `iceslide calibrate`, validated like a scene, by the names of its options."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from iceslide_fem.inference.calibrate.measured import Measured, read_measured
from iceslide_fem.inference.calibrate.problem import Fitted, fitted
from iceslide_fem.inference.parameters import changed_scene, checked
from iceslide_fem.preprocess.option_values import pairs
from iceslide_fem.runs.many_points import KEYS
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.command_options import CommandOptions, Number, option, option_names
from iceslide_fem.scene.units import Quantity

MOST = 6  # parameters
LENGTH = Quantity("m", "1 um", "10 m")
NOISE = Quantity("", "0.01 %", "100 %")


class CalibrateCase(CommandOptions):
    """Measured friction, a scene, and what of the scene is fitted; SI units."""

    model_config = ConfigDict(
        alias_generator=option_names(source="DATA.csv", scene="SCENE.toml", change="--set")
    )

    source: Path = option(
        ...,
        "Table of speed, pressure, temperature, and mu or friction_force; sigma_mu, duration, or "
        "series (files of mu over time).",
        "DATA.csv",
    )
    scene: Path = option(..., "The scene of the test; its point level is fitted.", "SCENE.toml")
    fit: Annotated[dict[str, str], pairs("--fit", "film.dry_stress=10kPa:10MPa")] = option(
        {}, "A key and its bounds: film.dry_stress=10kPa:10MPa. May be repeated.", "KEY=LOW:HIGH"
    )
    change: Annotated[dict[str, str], pairs("--set", "load.pressure=3bar")] = option(
        {}, "Another value of the scene: load.pressure=3bar. May be repeated.", "KEY=VALUE"
    )
    over: Annotated[float, LENGTH, Number] | None = option(
        None, "Sliding distance of every row, instead of a duration: 20mm.", "LENGTH"
    )
    output: Literal["mu_mean", "mu_peak", "mu_end"] = option("mu_mean", "What was measured.")
    noise: Annotated[float, NOISE, Number] | None = option(
        None, "Standard deviation of mu: 5%.", "PART", "sigma_mu of the table, else estimated"
    )
    level: Annotated[float, Field(gt=0.5, lt=1.0), Number] = option(
        0.95, "Probability of the intervals.", "P", "0.95"
    )

    @model_validator(mode="after")
    def _fits_something(self) -> Self:
        if not self.fit:
            raise ValueError(
                "there is nothing to fit; give --fit with a key and its bounds, as in "
                "--fit film.dry_stress=10kPa:10MPa"
            )
        if len(self.fit) > MOST:
            raise ValueError(f"--fit is given {len(self.fit)} times; allowed: up to {MOST}")
        return self

    @property
    def files(self) -> list[Path]:
        """Data and scene."""
        return [self.source, self.scene]

    @cached_property
    def point(self) -> Scene:
        """The scene at the point level. Raises SceneError."""
        scene = changed_scene(self.scene, self.change, "model=point")
        if scene.friction.law != "film":
            raise SceneError("calibrate fits the film law; this scene has another friction.law")
        return scene

    @cached_property
    def parameters(self) -> Sequence[Fitted]:
        """What is fitted. Raises SceneError, also if the scene does not take the values."""
        found = fitted(self.point, self.fit)
        for ends in ("low", "start", "high"):
            checked(self.point, {one.key: getattr(one, ends) for one in found})
        return found

    @cached_property
    def measured(self) -> Measured:
        """The data. Raises SceneError, also if they are too few or have a fitted key."""
        found = read_measured(self.source, self.point, self.over, self.noise)
        for name in found.varied:
            if KEYS[name] in self.fit:
                raise SceneError(f"{found.said} has {name}, and --fit {KEYS[name]} fits it, too")
        least = len(self.fit) + 2
        if found.number < least:
            raise SceneError(
                f"{found.said} has {found.number} rows, and {len(self.fit)} parameters need at "
                f"least {least}"
            )
        return found
