"""Input of `iceslide uncertainty`, validated like a scene, by the names of its options."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from iceslide_fem.inference.parameters import changed_scene, checked
from iceslide_fem.inference.uncertainty.sampling import Inputs, read_calibration
from iceslide_fem.inference.uncertainty.tyres import KINDS, Tyre, tyre
from iceslide_fem.preprocess.option_values import pairs
from iceslide_fem.runs.many_points import OUTPUTS
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.command_options import CommandOptions, Number, option, option_names
from iceslide_fem.scene.distribution import read_distribution
from iceslide_fem.scene.variation import number_at

Output = Literal[
    "mu_mean", "mu_peak", "mu_end", "mu_locked", "deceleration_locked", "deceleration_threshold",
    "deceleration_ideal",
]  # fmt: skip


class UncertaintyCase(CommandOptions):
    """A scene and how its inputs are spread; SI units."""

    model_config = ConfigDict(
        alias_generator=option_names(source="SCENE.toml", change="--set", calibration="--from")
    )

    source: Path = option(..., "The scene, with a table \\[uncertainty] or --input.", "SCENE.toml")
    input: Annotated[dict[str, str], pairs("--input", "film.k_scale=~10%")] = option(
        {},
        "A key and its spread: ice.temperature=-4degC+-0.5K, film.k_scale=~10%, "
        "load.pressure=1bar..2bar. May be repeated.",
        "KEY=SPREAD",
    )
    calibration: Path | None = option(
        None, "Parameters of iceslide calibrate, with their covariance.", "CALIBRATION.json"
    )
    change: Annotated[dict[str, str], pairs("--set", "load.pressure=3bar")] = option(
        {}, "Another value of the scene: load.pressure=3bar. May be repeated.", "KEY=VALUE"
    )
    wheel: str | None = option(
        None,
        "Of a wheel with these options of iceslide wheel: '--gaussian 120mm,2bar,60mm'.",
        "OPTIONS",
    )
    footprint: str | None = option(
        None, "Of a footprint, in the same way: '--image tyre.png --frame 0.2,0.1'.", "OPTIONS"
    )
    output: Output | None = option(None, "Whose spread.", shown="mu_mean; of a wheel mu_peak")
    samples: Annotated[int, Field(ge=64, le=65536), Number] = option(1024, "Points.", "N", "1024")
    runs: Annotated[int, Field(ge=4, le=1000), Number] = option(
        8, "Runs of a slice or block; points do the rest.", "N", "8"
    )

    @property
    def files(self) -> list[Path]:
        """Scene and calibration."""
        return [path for path in (self.source, self.calibration) if path is not None]

    @property
    def kind(self) -> str:
        """Of which a tyre is, "" for the scene itself. Raises SceneError if both are given."""
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) > 1:
            raise SceneError("--wheel and --footprint contradict each other; give one")
        return given[0] if given else ""

    @property
    def quantity(self) -> str:
        """Whose spread. Raises SceneError if only a wheel has it."""
        if self.kind:
            return self.output or next(iter(KINDS[self.kind].outputs))
        found = self.output or OUTPUTS[0]
        if found not in OUTPUTS:
            raise SceneError(f"--output {found} is that of a wheel; give --wheel, too")
        return found

    @cached_property
    def scene(self) -> Scene:
        """The scene on its model level, for a tyre that of a point. Raises SceneError."""
        point = ["model=point"] if self.kind else []
        return resolved(changed_scene(self.source, self.change, *point))

    @cached_property
    def tyre(self) -> Tyre | None:
        """The wheel or footprint, or None. Raises SceneError if it cannot be computed."""
        if not self.kind:
            return None
        return tyre(
            self.kind, getattr(self, self.kind), self.quantity, self.source, self.inputs.keys
        )

    @cached_property
    def inputs(self) -> Inputs:
        """All uncertain inputs, those of --input before those of the scene. Raises SceneError."""
        texts = {**self.scene.uncertainty, **self.input}
        joint = None if self.calibration is None else read_calibration(self.calibration)
        if not texts and joint is None:
            raise SceneError(
                f"nothing in {self.source} is uncertain; give --input with a key and its spread, "
                "--from with a calibration, or a table [uncertainty] in the scene"
            )
        single = [read_distribution(self.scene, key, text) for key, text in texts.items()]
        found = Inputs(single, joint)
        for key in found.keys:
            if found.keys.count(key) > 1:
                raise SceneError(f"{key} is uncertain twice, by --input and by the calibration")
            if number_at(self.scene, key) is None and key not in (joint.keys if joint else ()):
                raise SceneError(f"{key} is no number in this scene")
        for one in single:
            for end in (one.low, one.high):
                checked(self.scene, {one.parameter.key: end})
        return found
