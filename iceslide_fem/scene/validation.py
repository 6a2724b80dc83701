"""From a dictionary to a scene, and information about keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args, get_origin

from pydantic import AliasChoices, BaseModel, StrictInt, ValidationError
from pydantic.fields import FieldInfo

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.fields import unit_of_field
from iceslide_fem.scene.messages import first_sentence, unknown_key
from iceslide_fem.scene.model import Scene


def scene_from_dict(data: Mapping[str, Any]) -> Scene:
    """Validate a nested dictionary; raises SceneError with one sentence on the first fault."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        raise SceneError(first_sentence(error, list(_dotted_keys(Scene)))) from None


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
            raise SceneError(unknown_key(key, list(_dotted_keys(Scene))))
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


def _dotted_keys(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    for name, field in model.model_fields.items():
        yield prefix + name
        for table in _tables(field.annotation):
            yield from _dotted_keys(table, f"{prefix}{name}.")


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    """Tables that a field may hold: itself, or a list of them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is not dict:  # whose keys are the user's own
        for part in get_args(annotation):
            yield from _tables(part)
