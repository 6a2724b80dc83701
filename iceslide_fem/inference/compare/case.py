"""Input of `iceslide compare`, validated like a scene, by the names of its options."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, model_validator

from iceslide_fem.inference.compare.candidates import Candidate, Condition, read_candidates
from iceslide_fem.inference.compare.inputs import Inputs, read_inputs
from iceslide_fem.preprocess.option_values import Several, pairs
from iceslide_fem.preprocess.wheel.option_values import SPEED, TEMPERATURE
from iceslide_fem.preprocess.wheel.stop_options import Measured
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import CommandOptions, Number, option, option_names
from iceslide_fem.scene.variation import quantity

MOST = 12  # values of a condition
OUTPUTS = {
    "scenes": ("mu_mean", "mu_peak", "mu_end"),
    "wheels": ("mu_peak", "mu_locked"),
    "stops": ("deceleration_threshold", "deceleration_ideal", "deceleration_locked"),
}
Output = Literal[
    "mu_mean", "mu_peak", "mu_end", "mu_locked", "deceleration_threshold", "deceleration_ideal",
    "deceleration_locked",
]  # fmt: skip
_temperatures = Several("--temperature", TEMPERATURE, "-12degC,-4degC", 1, MOST)
_waters = Several("--water", quantity("ice.water"), "0um,20um,50um", 1, MOST)


def _keys(value: Any) -> Any:
    """Keys from a text with commas."""
    return tuple(part.strip() for part in value.split(",")) if isinstance(value, str) else value


class CompareCase(CommandOptions):
    """Candidates and the conditions under which they are compared; SI units."""

    model_config = ConfigDict(alias_generator=option_names(source="REF.toml", others="OTHER.toml"))

    source: Path = option(
        ..., "The reference: a scene, or a file with a table \\[wheel] of its options.", "REF.toml"
    )
    others: tuple[Path, ...] = option(
        ..., "The others, or files with \\[variations.NAME] of the reference.", "OTHER.toml..."
    )
    temperature: Annotated[tuple[float, ...], BeforeValidator(_temperatures)] = option(
        (), "Of the ice: -12degC,-8degC,-4degC.", "T,T", "each one's own"
    )
    water: Annotated[tuple[float, ...], BeforeValidator(_waters)] = option(
        (), "That the ice brings: 0um,20um,50um.", "M,M", "each one's own"
    )
    stop: Annotated[float, SPEED, Number] | None = option(
        None, "Of wheels: brake from this speed: 25km/h.", "V"
    )
    measure: Measured | None = option(
        None, "Speeds between which the deceleration of a stop is measured: 20km/h:5km/h.", "V:V"
    )
    output: Output | None = option(
        None, "What is compared.",
        shown="mu_mean; of wheels mu_peak; of stops deceleration_threshold",
    )  # fmt: skip
    input: Annotated[dict[str, str], pairs("--input", "film.k_scale=~10%")] = option(
        {},
        "An uncertain key of all candidates: ice.temperature=+-0.5K, film.dry_stress=~10%, "
        "wheel.stiffness=~5%. May be repeated.",
        "KEY=SPREAD",
    )
    own: Annotated[tuple[str, ...], BeforeValidator(_keys)] = option(
        (), "Uncertain keys that vary apart for each candidate; others vary together.", "KEY,KEY"
    )

    @model_validator(mode="after")
    def _measures_a_stop(self) -> Self:
        if self.measure is not None and self.stop is None:
            raise ValueError("--measure is of a stop; give --stop, too")
        if self.stop is not None and self.measure is not None and self.measure[0] > self.stop:
            raise ValueError(
                f"--measure begins at {3.6 * self.measure[0]:.4g} km/h, above --stop, "
                f"{3.6 * self.stop:.4g} km/h"
            )
        return self

    @property
    def files(self) -> list[Path]:
        """All files of candidates."""
        return [self.source, *self.others]

    @cached_property
    def candidates(self) -> Sequence[Candidate]:
        """The reference first. Raises SceneError."""
        stop: dict[str, Any] = {}
        if self.stop is not None:
            stop = {"abs": True, "speed": self.stop}
            if self.measure is not None:
                stop |= {"measure": self.measure, "end_speed": self.measure[1]}
        return read_candidates(self.source, self.others, stop)

    @property
    def kind(self) -> str:
        """Of what the candidates are."""
        return self.candidates[0].kind

    @property
    def quantity(self) -> str:
        """What is compared. Raises SceneError if the candidates have none."""
        known = OUTPUTS[self.kind]
        found = self.output or known[0]
        if found not in known:
            raise SceneError(
                f"--output {found} is none of {self.kind}; allowed: {', '.join(known)}"
            )
        return found

    @cached_property
    def conditions(self) -> Sequence[Condition]:
        """All combinations of temperature and water."""
        temperatures: Sequence[float | None] = self.temperature or (None,)
        waters: Sequence[float | None] = self.water or (None,)
        return [Condition(*pair) for pair in product(temperatures, waters)]

    @cached_property
    def all_of(self) -> Sequence[Sequence[Candidate]]:
        """Each candidate under all conditions. Raises SceneError."""
        return [[here.of(one) for here in self.conditions] for one in self.candidates]

    @cached_property
    def inputs(self) -> Inputs:
        """Uncertain inputs of all candidates. Raises SceneError."""
        return read_inputs(self.candidates, self.input, self.own)

    @property
    def run_names(self) -> list[list[str]]:
        """Names of runs: each candidate under all conditions."""
        return [
            [f"{one.name}_{here.file_name}" for here in self.conditions] for one in self.candidates
        ]
