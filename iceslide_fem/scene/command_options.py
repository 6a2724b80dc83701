"""Options of a command, validated like a scene, with the names that a user types."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

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


def option(default: Any, text: str, metavar: str = "", shown: str = "", **more: Any) -> Any:
    """A field of `CommandOptions` with its `text` of help.

    metavar: what is given, by default after the field's type; shown: the default in words, by
    default its value; more: as for pydantic's `Field`.
    """
    about: Any = {"metavar": metavar, "shown": shown}
    return Field(default, description=text, json_schema_extra=about, **more)


class CommandOptions(BaseModel):
    """Base class of the options of commands; errors use the names that a user types.

    Fields are made by `option`. group: heading of a class's own fields in the help.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", alias_generator=option_name)
    group: ClassVar[str] = "Options"

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

    def as_command(self, name: str) -> str:
        """The command `name` with these options, where they are not the defaults."""
        words, first = [], f"iceslide {name}"
        for key, field in type(self).model_fields.items():
            value = getattr(self, key)
            if value == field.default or value is None:
                continue
            label = str(field.alias)
            if not label.startswith("--"):
                first += f" {shlex.quote(str(value))}"
            elif value is True:
                words.append(label)
            else:
                words += [f"{label} {shlex.quote(text)}" for text in _as_typed(value)]
        return " \\\n    ".join([first, *words])


def _as_typed(value: Any) -> list[str]:
    """A value as the texts of an option, numbers in SI; of a dictionary one for each key."""
    if isinstance(value, Mapping):
        return [f"{key}={_as_typed(each)[0]}" for key, each in value.items()]
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        nested = value and isinstance(value[0], tuple)
        parts = (":".join(map(_number, part)) for part in value) if nested else map(_number, value)
        return [",".join(parts)]
    return [_number(value)]


def _number(value: Any) -> str:
    """A value as a text that reads back as the same value."""
    short = f"{value:g}" if isinstance(value, float) else str(value)
    return short if not isinstance(value, float) or float(short) == value else repr(value)
