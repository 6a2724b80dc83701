"""Options on viscoelastic rubber, shared by `iceslide rubber` and `iceslide roughness`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BeforeValidator, ConfigDict, ValidationError
from pydantic_core import PydanticCustomError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.relaxation import read_arms
from iceslide_fem.scene.rubber import Rubber
from iceslide_fem.scene.toml import read_scene
from iceslide_fem.scene.units import Quantity, Table

TEMPERATURE = Quantity("K", "-150 degC", "200 degC")
MOST_VALUES = 6
STRAIN = Quantity("", "0.0001 %", "200 %")
_WLF = (Quantity("", "1e-6", "1000"), Quantity("K", "0.1 K", "10000 K"), TEMPERATURE)


def several(name: str, quantity: Quantity, example: str) -> BeforeValidator:
    """Validator of up to six comma-separated quantities, in SI as a tuple."""
    return BeforeValidator(lambda value: read_several(value, name, quantity, example))


def read_several(value: Any, name: str, quantity: Quantity, example: str) -> Any:
    """Up to six comma-separated quantities of a text, in SI as a tuple.

    name, example: for messages. Raises ValueError.
    """
    if not isinstance(value, str):
        return value
    try:
        found = tuple(quantity.in_range(as_number(part.strip())) for part in value.split(","))
    except ValueError as error:
        raise ValueError(
            f'{name} "{value}" is not of the form {example}: a value {error}; allowed: '
            f"{quantity.low} to {quantity.high}"
        ) from None
    if len(found) > MOST_VALUES:
        raise ValueError(f'{name} "{value}" has {len(found)} values; allowed: up to {MOST_VALUES}')
    return found


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
