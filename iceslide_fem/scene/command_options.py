"""Options of a command, validated like a scene, with the names that a user types."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.fields import number_of, number_text, quantity_of, typed
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.model import Scene, scene_from_dict
from iceslide_fem.scene.nested import put
from iceslide_fem.scene.rows import RowsOf, names_a_file
from iceslide_fem.scene.rules import Is, Rule
from iceslide_fem.scene.units import Quantity
from iceslide_fem.scene.variation import FIELDS, quantity_or_none

DIGITS = 5  # of values that are shown
_OPTION = re.compile(r"(?<![\w/-])--[a-z]+(?:-[a-z]+)*")
# Keys of options, what they are of, and the key of the option that asks for it.
Part = tuple[Sequence[str], str, str]


def option_name(key: str) -> str:
    """Name of the option for `key`."""
    return "--" + key.replace("_", "-")


def option_names(*positional: str, **others: str) -> Callable[[str], str]:
    """`option_name`, except for positional arguments of a command, and `others` by their keys."""
    names = {key: key.upper() for key in positional} | others
    return lambda key: names.get(key, option_name(key))


def renamed(sentence: str, name_of: Callable[[str], str]) -> str:
    """The sentence with the name that `name_of` gives to each option in it."""
    return _OPTION.sub(lambda found: name_of(found[0]), sentence)


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


def scene_option(*keys: str, text: str = "", metavar: str = "", **more: Any) -> Any:
    """A field of `CommandOptions` that is a key of a scene, with its range and its default.

    A number, or the path of a CSV file where the scene takes rows and the field a path. Of several
    keys it is their values, separated by commas. text: of help, by default the first sentence of
    the key's meaning; metavar, more: as for `option`.
    """
    of_scene = FIELDS[keys[0]]
    meaning = re.sub(r"`\w+\.(\w+)`", lambda name: option_name(name[1]), of_scene.description or "")
    text = text or f"{meaning.removesuffix('.').partition('. ')[0]}.{_or_file(keys[0])}"
    field = option(more.pop("default", of_scene.default), text, metavar, **more)
    field.json_schema_extra["keys"] = keys
    read = _read_one(keys[0]) if len(keys) == 1 else _read_several(keys)
    field.metadata.append(BeforeValidator(read))
    return field


def _or_file(key: str) -> str:
    """Words of help on the rows of a `key`, if it takes them."""
    quantity = quantity_of(FIELDS[key])
    return f" Or a CSV file over the {quantity.what}." if isinstance(quantity, RowsOf) else ""


def _read_one(key: str) -> Callable[[Any], Any]:
    """A function that reads what is typed for a `key`; the rows of a file are left to the scene."""
    quantity, number = quantity_of(FIELDS[key]), quantity_or_none(key)

    def read(value: Any) -> Any:
        if isinstance(quantity, RowsOf) and names_a_file(value):
            return Path(value)
        return value if number is None else number.validate(as_number(value))

    return read


def _read_several(keys: Sequence[str]) -> Callable[[Any], Any]:
    """A function that reads values of all `keys`, separated by commas."""
    names = [key.rpartition(".")[2] for key in keys]

    def read(value: Any) -> Any:
        parts = value.split(",") if isinstance(value, str) else value
        if len(parts) != len(keys):
            raise PydanticCustomError("form", f"is not {','.join(names).upper()}")
        found = []
        for key, name, part in zip(keys, names, parts, strict=True):
            try:
                found.append(_read_one(key)(part.strip() if isinstance(part, str) else part))
            except PydanticCustomError as error:
                said = f"has a {name.replace('_', ' ')} that {error.message()}"
                raise PydanticCustomError("form", "{said}", {"said": said}) from None
        return tuple(found)

    return read


def given(key: str, value: Any = None, nothing: Any = None) -> Is:
    """The condition, for `Rule`, that the option of `key` is given, or has a `value`.

    nothing: its value if it is not given.
    """
    if value is None:
        return Is(key, besides=(nothing,), shown=option_name(key))
    return Is(key, (value,), shown=f"{option_name(key)} {value}")


def scene_keys(field: FieldInfo) -> Sequence[str]:
    """The keys of a scene that a field of `CommandOptions` is."""
    about: Any = field.json_schema_extra
    return about.get("keys", ())


class CommandOptions(BaseModel):
    """Base class of the options of commands; errors use the names that a user types.

    Fields are made by `option` and `scene_option`. group: heading of a class's own fields in the
    help; rules: what excludes each other (conditions by `given`); parts: options that have a
    meaning only with another one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", alias_generator=option_name)
    group: ClassVar[str] = "Options"
    rules: ClassVar[Sequence[Rule]] = ()
    parts: ClassVar[Sequence[Part]] = ()

    @model_validator(mode="after")
    def _keeps_its_rules(self) -> Self:
        fields, kinds = type(self).model_fields, type(self).__mro__
        for kind in kinds:
            for keys, whole, asking in vars(kind).get("parts", ()):
                alone = [key for key in keys if key in self.model_fields_set]
                if alone and getattr(self, asking) == fields[asking].default:
                    name, needed = (fields[key].alias for key in (alone[0], asking))
                    raise ValueError(f"{name} is of {whole}; give {needed}, too")
            for rule in vars(kind).get("rules", ()):
                if fault := rule.fault(self):
                    raise ValueError(fault)
        return self

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Validate values by the names of the fields; raises SceneError with one sentence."""
        names = {key: str(field.alias) for key, field in cls.model_fields.items()}
        given = {names.get(key, key): value for key, value in values.items() if value is not None}
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise SceneError(first_sentence(error, list(names.values()))) from None

    @classmethod
    def of_command(cls, text: str) -> Self:
        """The options of a command as `as_command` writes it. Raises SceneError."""
        return cls.of(cls.from_words(shlex.split(text.replace("\\\n", " "))[2:]))

    @classmethod
    def from_words(cls, words: Sequence[str]) -> dict[str, Any]:
        """Values by the names of fields from words as a command line has them."""
        labels = {str(field.alias): key for key, field in cls.model_fields.items()}
        files = [key for label, key in labels.items() if not label.startswith("--")]
        found: dict[str, Any] = {}
        rest = iter(words)
        for word in rest:
            key = labels.get(word, word.removeprefix("--").replace("-", "_"))
            field = cls.model_fields.get(key)
            if not word.startswith("--"):
                found[files[0] if files else word] = word
            elif field is not None and field.annotation is bool:
                found[key] = True
            elif field is not None and field.default == {}:
                found.setdefault(key, []).append(next(rest, ""))
            else:
                found[key] = next(rest, "")
        return found

    def as_scene(self, more: Mapping[str, Any], words: Mapping[str, str]) -> Scene:
        """The scene of the options that are keys of one, and of `more` values by dotted keys.

        words: of its messages -> those of a user. Raises SceneError with the names of options.
        """
        tables: dict[str, Any] = {}
        names = dict(words)
        for name, field in type(self).model_fields.items():
            keys, value = scene_keys(field), getattr(self, name)
            several = value if len(keys) > 1 and value is not None else [value] * len(keys)
            for key, part in zip(keys, several, strict=True):
                names[key] = str(field.alias)
                if part is not None:
                    put(tables, key, str(part) if isinstance(part, Path) else part)
        for key, value in more.items():
            put(tables, key, value)
        try:
            return scene_from_dict(tables)
        except SceneError as error:
            known = re.compile("|".join(map(re.escape, names)))
            raise SceneError(known.sub(lambda found: names[found[0]], str(error))) from None

    @property
    def files(self) -> list[Path]:
        """All files named in the options."""
        return [value for _, value in self if isinstance(value, Path)]

    @property
    def readable(self) -> list[tuple[str, str]]:
        """Options and their values with units, without those that are not given."""
        found = []
        for key, field in type(self).model_fields.items():
            value, quantity = getattr(self, key), _quantity(field)
            if value is None:
                continue
            text = ", ".join(_as_typed(value))
            if isinstance(value, float) and quantity is not None:
                text = number_text(value, quantity, DIGITS)
            found.append((str(field.alias), text))
        return found

    def as_command(self, name: str) -> str:
        """The command `name` with these options, where they are not the defaults."""
        words, first = [], f"iceslide {name}"
        for key, field in type(self).model_fields.items():
            value = getattr(self, key)
            if value == field.default or value is None:
                continue
            label = str(field.alias)
            if not label.startswith("--"):
                paths = value if isinstance(value, tuple) else (value,)
                first += "".join(f" {shlex.quote(str(path))}" for path in paths)
            elif value is True:
                words.append(label)
            else:
                one = isinstance(value, float)
                texts = [typed(value, _quantity(field))] if one else _as_typed(value)
                words += [f"{label} {shlex.quote(text)}" for text in texts]
        return " \\\n    ".join([first, *words])


def _as_typed(value: Any) -> list[str]:
    """A value as the texts of an option, numbers in SI; of a dictionary one for each key."""
    if isinstance(value, Mapping):
        return [f"{key}={_as_typed(each)[0]}" for key, each in value.items()]
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        nested = value and isinstance(value[0], tuple)
        parts = (":".join(map(typed, part)) for part in value) if nested else map(typed, value)
        return [",".join(parts)]
    return [typed(value)]


def _quantity(field: FieldInfo) -> Quantity | None:
    """The quantity of an option that is one number of a scene, or a length of its own."""
    extra: Any = field.json_schema_extra or {}
    keys = extra.get("keys", ())
    return quantity_or_none(keys[0]) if len(keys) == 1 else number_of(field)
