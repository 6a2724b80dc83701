"""A scene in a notebook: the keys that differ from their defaults, with units."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from iceslide_fem.scene.fields import unit_of_field, with_unit


def changed_values(table: BaseModel, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Dotted keys whose values differ from the default, each with its value and unit as text."""
    for name, field in type(table).model_fields.items():
        value = getattr(table, name)
        if isinstance(value, BaseModel):
            yield from changed_values(value, f"{prefix}{name}.")
        elif field.is_required() or value != field.default:
            yield prefix + name, _text(value, unit_of_field(field) or "")


def html_table(name: str, table: BaseModel) -> str:
    """The changed values of `table` below a title, as HTML."""
    rows = "".join(
        f'<tr><td style="text-align:left"><code>{escape(key)}</code></td>'
        f'<td style="text-align:left">{escape(text)}</td></tr>'
        for key, text in changed_values(table)
        if key != "name"
    )
    return f"<table><caption>Scene <b>{escape(name)}</b></caption>{rows}</table>"


def _text(value: Any, unit: str) -> str:
    """A value with its unit; for rows their number."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return f"{len(value)} rows, {unit}" if unit else f"{len(value)} rows"
    if isinstance(value, float):
        return with_unit(value, unit)
    if isinstance(value, tuple | list):
        return (
            f"{len(value)} entries"
            if any(isinstance(v, BaseModel) for v in value)
            else ", ".join(map(str, value))
        )
    return value.name if isinstance(value, Path) else str(value)
