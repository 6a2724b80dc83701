"""Nested tables, as of a scene file, and the dotted keys that lead into them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from iceslide_fem.runtime.arrays import plain
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.messages import shortened


def put(data: dict[str, Any], key: str, value: Any) -> None:
    """Set the dotted `key` in the tables `data`. Raises SceneError if it goes through a value."""
    *tables, name = key.split(".")
    for table in tables:
        data = data.setdefault(table, {})
        if not isinstance(data, dict):
            raise SceneError(f"{shortened(key)} goes through {table}, which is not a table")
    data[name] = value


def change(data: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Set values by dotted keys in the tables `data`; a table is merged, key by key.

    Values may be NumPy's. Raises SceneError, as `put`.
    """
    for key, value in changes.items():
        if isinstance(value, Mapping):
            tables: dict[str, Any] = {}
            put(tables, key, value)
            merge(data, tables)
        else:
            put(data, key, plain(value))


def merge(data: dict[str, Any], over: Mapping[str, Any]) -> None:
    """Set the values of the tables `over` in the tables `data`, at any depth."""
    for key, value in over.items():
        if isinstance(value, Mapping):
            here = data.get(key)
            data[key] = dict(here) if isinstance(here, Mapping) else {}
            merge(data[key], value)
        else:
            data[key] = plain(value)


def flat(tables: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested tables as one, with dotted keys."""
    result: dict[str, Any] = {}
    for key, value in tables.items():
        if isinstance(value, Mapping):
            result |= flat(value, f"{prefix}{key}.")
        else:
            result[prefix + key] = value
    return result


def beside(tables: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Values of all keys of flat tables, one of each table, None where it has none."""
    keys = dict.fromkeys(key for table in tables for key in table)
    return {key: [table.get(key) for table in tables] for key in keys}


def different(tables: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Those of `beside` whose values are not the same in all tables."""
    return {
        key: values
        for key, values in beside(tables).items()
        if any(value != values[0] for value in values)
    }
