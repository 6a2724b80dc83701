"""Values of options of several commands: their forms, and rubber that relaxes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import BeforeValidator, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.relaxation import read_arms
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.toml import read_scene
from iceslide_fem.scene.units import Quantity, Table, read_range

TEMPERATURE = Quantity("K", "-150 degC", "200 degC")
STRAIN = Quantity("", "0.0001 %", "200 %")
_WLF = (Quantity("", "1e-6", "1000"), Quantity("K", "0.1 K", "10000 K"), TEMPERATURE)


class Several(NamedTuple):
    """How an option takes several values: with commas, and where `spaced` as first:last:count.

    name, example: of the option and its form, for messages; least, most: numbers of values; spaced:
    the values of a range. Called with a text it returns values in SI, or raises ValueError.
    """

    name: str
    quantity: Quantity
    example: str
    least: int = 1
    most: int = 6
    spaced: Callable[[float, float, int], Iterable[float]] | None = None

    def __call__(self, value: Any) -> Any:
        """The values of a text; anything else unchanged."""
        if not isinstance(value, str):
            return value
        said, parts, count = f'{self.name} "{value}"', value.split(","), None
        if self.spaced is not None and ":" in value:
            try:
                *parts, count = read_range(value)
            except ValueError as error:
                raise ValueError(f"{said} {error}; allowed: as in {self.example}") from None
        try:
            found = tuple(self.quantity.in_range(as_number(part.strip())) for part in parts)
        except ValueError as error:
            raise ValueError(
                f"{said} is not of the form {self.example}: a value {error}; allowed: "
                f"{self.quantity.low} to {self.quantity.high}"
            ) from None
        number = len(found) if count is None else count
        if not self.least <= number <= self.most:
            raise ValueError(
                f"{said} has {number} value{'s' * (number != 1)}; allowed: {self.least} to "
                f"{self.most}, as in {self.example}"
            )
        if self.spaced is None or count is None:
            return found
        first, last = found
        return tuple(self.spaced(first, last, count))


def in_equal_ratios(first: float, last: float, count: int) -> list[float]:
    """Values from the first to the last one, of six digits."""
    return [float(f"{value:.6g}") for value in np.geomspace(first, last, count)]


def in_equal_steps(first: float, last: float, count: int) -> list[float]:
    """Values from the first to the last one, without the noise of their last digits."""
    steps: list[float] = np.linspace(first, last, count).round(12).tolist()
    return steps


def read_wlf(value: Any) -> Any:
    """C1, C2 (K) and the reference temperature (K), from "7.4,121.6,20degC"."""
    if not isinstance(value, str):
        return value
    form = f'--wlf "{value}" is not of the form 7.4,121.6,20degC'
    parts = [part.strip() for part in value.split(",")]
    if len(parts) != 3:
        raise ValueError(f"{form} (C1 of log10, C2 in K, reference temperature)")
    try:
        return tuple(each.in_range(as_number(part)) for each, part in zip(_WLF, parts, strict=True))
    except ValueError as error:
        raise ValueError(f"{form}: a value {error}") from None


def read_prony(value: Any) -> Any:
    """Arms (g, tau in s) from "0.3:5ms,0.2:1ms", or the path of a scene or rubber.toml."""
    if not isinstance(value, str):
        return value
    if value.strip().lower().endswith(".toml"):
        return Path(value)
    pairs = [[as_number(part.strip()) for part in arm.split(":")] for arm in value.split(",")]
    try:
        return read_arms(pairs)
    except PydanticCustomError as error:
        raise ValueError(
            f'--prony "{value}" is not of the form 0.3:5ms,0.2:1ms, or the path of a scene or '
            f"rubber.toml: {error.message()}"
        ) from None


class _Fragment(Table):
    model_config = ConfigDict(extra="ignore")

    rubber: Rubber


def rubber_in(path: Path) -> Rubber:
    """The `[rubber]` of a scene, or of a file with this table only. Raises SceneError."""
    try:
        return _Fragment.model_validate(read_scene(path)).rubber
    except ValidationError as error:
        keys = [f"rubber.{name}" for name in Rubber.model_fields]
        raise SceneError(f"{path}: {first_sentence(error, keys)}") from None


def pairs(name: str, form: str) -> BeforeValidator:
    """Reads "key=text" of a repeated option `name` of a `form`; anything else unchanged."""

    def read(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            return value
        found: dict[str, str] = {}
        for text in value:
            key, equals, rest = text.partition("=")
            if not equals or not rest.strip():
                raise ValueError(f'{name} "{text}" is not of the form {form}')
            if key.strip() in found:
                raise ValueError(f"{name} has {key.strip()} twice; give it once")
            found[key.strip()] = rest.strip()
        return found

    return BeforeValidator(read)
