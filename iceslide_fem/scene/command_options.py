"""Options of a command, validated like a scene, with the names that a user types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.messages import first_sentence


def option_name(key: str) -> str:
    """Name of the option for `key`."""
    return "--" + key.replace("_", "-")


def option_names(positional: str) -> Callable[[str], str]:
    """`option_name`, except for the positional argument of a command."""
    return lambda key: positional.upper() if key == positional else option_name(key)


def as_number(value: Any) -> Any:
    """A number typed without a unit, in SI; any other value unchanged."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return value


Number = BeforeValidator(as_number)


class CommandOptions(BaseModel):
    """Base class of the options of commands; errors use the names that a user types."""

    model_config = ConfigDict(frozen=True, extra="forbid", alias_generator=option_name)

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Validate values by the names of the fields; raises SceneError with one sentence."""
        names = {key: str(field.alias) for key, field in cls.model_fields.items()}
        try:
            return cls.model_validate({names.get(key, key): v for key, v in values.items()})
        except ValidationError as error:
            raise SceneError(first_sentence(error, list(names.values()))) from None

    @property
    def files(self) -> list[Path]:
        """All files named in the options."""
        return [value for _, value in self if isinstance(value, Path)]
