"""Single numbers of a scene: what a key is, and scenes with other values of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, get_args, get_origin

from pydantic import AliasChoices, StrictInt
from pydantic.fields import FieldInfo

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene.fields import leaves, number_of, unit_of_field, with_unit
from iceslide_fem.scene.messages import dotted_keys, unknown_key
from iceslide_fem.scene.model import Scene
from iceslide_fem.scene.units import Quantity

FIELDS = dict(leaves(Scene))  # by dotted key


class Parameter(NamedTuple):
    """A key of a scene with a number: its SI unit and its range (SI, both included)."""

    key: str
    unit: str
    low: float
    high: float

    @property
    def shown(self) -> tuple[str, str]:
        """The ends of the range with their unit."""
        return with_unit(self.low, self.unit), with_unit(self.high, self.unit)


def parameter(key: str) -> Parameter:
    """What the dotted `key` is. Raises SceneError if a scene has no such number."""
    of_key = quantity(key)
    low, high = (to_si(end, of_key.unit) for end in (of_key.low, of_key.high))
    return Parameter(key, of_key.unit, low, high)


def quantity(key: str) -> Quantity:
    """Unit and range of the dotted `key` as a user types them. Raises SceneError without any."""
    if key not in FIELDS:
        raise SceneError(unknown_key(key, list(FIELDS)))
    found = quantity_or_none(key)
    if found is None:
        raise SceneError(f"{key} is not a number")
    return found


def quantity_or_none(key: str) -> Quantity | None:
    """The same, None without any."""
    field = FIELDS.get(key)
    return None if field is None else number_of(field)


def unit_of(key: str) -> str | None:
    """SI unit of the dotted `key` ("" for a pure number), None if it is not a number.

    Raises SceneError if a scene has no such key.
    """
    model: Any = Scene
    for part in key.split("."):
        if get_origin(model) is dict:  # whose keys are the user's own
            _, value = get_args(model)
            return "" if StrictInt in get_args(value) else None
        fields = getattr(model, "model_fields", {})
        part = _by_alias(fields).get(part, part)
        if part not in fields:
            raise SceneError(unknown_key(key, list(dotted_keys(Scene))))
        model = fields[part].annotation
    return unit_of_field(fields[part])


def _by_alias(fields: Mapping[str, FieldInfo]) -> dict[str, str]:
    """Field names by alias."""
    return {
        str(alias): name
        for name, field in fields.items()
        if isinstance(field.validation_alias, AliasChoices)
        for alias in field.validation_alias.choices
    }


def number_at(scene: Scene, key: str) -> float | None:
    """The number (SI) of the dotted `key`; None if the scene has none, or rows, there."""
    value: Any = scene
    for part in key.split("."):
        value = getattr(value, part)
    return float(value) if isinstance(value, int | float) else None


def with_values(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene with other numbers (SI) by dotted keys.

    They are not validated: the caller keeps them within the ranges of their keys. Thousands of
    scenes are made so.
    """
    return _with(scene, values)


def _with(table: Any, values: Mapping[str, float]) -> Any:
    """The table with other numbers, by keys within it."""
    update: dict[str, Any] = {}
    inner: dict[str, dict[str, float]] = {}
    for key, value in values.items():
        name, _, rest = key.partition(".")
        if rest:
            inner.setdefault(name, {})[rest] = value
        else:
            update[name] = value
    update |= {name: _with(getattr(table, name), new) for name, new in inner.items()}
    return table.model_copy(update=update)
