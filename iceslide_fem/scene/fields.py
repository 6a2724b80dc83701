"""Fields of a scene's tables, as pages, notebooks and messages describe them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from iceslide_fem.runtime.units import ZERO_CELSIUS, celsius, readable, to_si
from iceslide_fem.scene.rows import RowsOf
from iceslide_fem.scene.units import Quantity

# Units that users type, with their number in one of SI.
TYPED = {
    "Pa": {"Pa": 1.0, "bar": 1e-5, "MPa": 1e-6},
    "m": {"m": 1.0, "mm": 1e3, "um": 1e6, "nm": 1e9},
    "s": {"s": 1.0, "ms": 1e3, "us": 1e6},
    "m/s": {"m/s": 1.0, "km/h": 3.6},
}


def leaves(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    """Dotted key and field of everything in `model` that is not a table of its own."""
    for name, field in model.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from leaves(inner, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def quantity_of(field: FieldInfo) -> Quantity | RowsOf | None:
    """The quantity that a field annotates, alone or beside None; None if it is not a number."""
    parts = [
        *field.metadata,
        *(part for arm in get_args(field.annotation) for part in get_args(arm)),
    ]
    return next((part for part in parts if isinstance(part, Quantity | RowsOf)), None)


def number_of(field: FieldInfo) -> Quantity | None:
    """The quantity of a field's numbers, also where it takes rows of them; None if it has none."""
    quantity = quantity_of(field)
    return quantity.value if isinstance(quantity, RowsOf) else quantity


def unit_of_field(field: FieldInfo) -> str | None:
    """SI unit of a field ("" for a pure number), None if it is not a number."""
    quantity = quantity_of(field)
    return None if quantity is None else quantity.unit


def number_text(value: float, quantity: Quantity | None, digits: int = 3) -> str:
    """`value` with its unit; a temperature in degrees Celsius, a difference of them in kelvin."""
    if quantity is None:
        return f"{value:.6g}"
    if quantity.low.endswith("degC"):
        return celsius(value)
    return with_unit(value, quantity.unit, digits)


def typed(value: Any, quantity: Quantity | None = None) -> str:
    """The shortest text that a user would type for `value`, and that reads back as the same."""
    if not isinstance(value, float):
        return str(value)
    short = f"{value:g}"
    plain = short if float(short) == value else repr(value)
    if quantity is None or not quantity.unit:
        return plain
    if quantity.low.endswith("degC"):
        texts = [f"{value - ZERO_CELSIUS:.10g}degC"]
    else:
        units = TYPED.get(quantity.unit, {quantity.unit: 1.0})
        texts = [f"{value * scale:.10g}{unit}" for unit, scale in units.items()]
    same = (text for text in texts if to_si(text, quantity.unit) == value)
    return min(same, key=len, default=plain)


def default_text(field: FieldInfo) -> str:
    """The default of a field as a user types it, temperatures in degrees Celsius; "" if it has none
    or the default is nothing.
    """
    if field.is_required() or field.default in (None, {}, ()):
        return ""
    value, quantity = field.default, number_of(field)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return json.dumps(value)
    if quantity is None or not isinstance(value, float):
        return str(value)
    if quantity.unit == "rad":
        return f"{math.degrees(value):g} deg"
    return number_text(value, quantity)


def with_unit(value: float, unit: str, digits: int = 3) -> str:
    """`value` with its SI `unit`: with a prefix and `digits` if it is one name, but for kelvin."""
    if unit in ("", "K") or any(mark in unit for mark in "/*^"):
        return f"{value:.6g} {unit}".rstrip()
    return readable(value, unit, digits)


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
