"""Scene files in TOML, and overrides of single values."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.fields import leaves, quantity_of
from iceslide_fem.scene.input_file import read_text
from iceslide_fem.scene.messages import shortened
from iceslide_fem.scene.model import FILE_KEYS, Scene, scene_from_dict
from iceslide_fem.scene.nested import merge, put
from iceslide_fem.scene.rows import RowsOf, names_a_file

DEEPEST = 8  # levels of nesting; a scene has two
MOST_BASES = 8  # of a scene file, one of the other
# Table and key of rows, which may be in a file.
ROWS_KEYS = [
    key.split(".") for key, field in leaves(Scene) if isinstance(quantity_of(field), RowsOf)
]
_BARE_UNIT = re.compile(r"=\s*[+-]?\.?\d[\d_.]*(?:[eE][+-]?\d+)?\s*[^\W\d_]|=.*\d\s*[%°]")


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> Scene:
    """Read a TOML scene file, apply `overrides` such as "load.pressure=3bar", and validate.

    Raises SceneError with one sentence if anything is wrong.
    """
    return scene_from_dict(read_scene(path, overrides))


def read_scene(path: Path | str, overrides: Sequence[str] = ()) -> dict[str, Any]:
    """The tables of a TOML scene file with `overrides` applied, not yet validated.

    With `base = "other.toml"` its tables are those of the other file, with its own values over
    them. A relative path, of a base or of `FILE_KEYS`, is relative to the file that it stands in;
    in an override it is relative to the working directory.
    Raises SceneError if a file or an override can't be read.
    """
    data = _read(Path(path), ())
    for change in overrides:
        override(data, change)
    _check_depth(path, data)
    return data


def _read(path: Path, above: tuple[Path, ...]) -> dict[str, Any]:
    """The tables of the file at `path` over those of its base; above: files that it is base of."""
    text = read_text(path, "the scene file")
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{path} is nested too deeply") from None
    except ValueError as error:  # invalid TOML, or an integer with thousands of digits
        raise SceneError(f"{path} is not valid TOML: {error}{_hint(text, str(error))}") from None
    _check_depth(path, data)
    set_folder(data, path.parent)
    if "base" not in data:
        return data
    base, files = data.pop("base"), (*above, path)
    if not isinstance(base, str):
        raise SceneError(f'base in {path} is no scene file; allowed: as in base = "other.toml"')
    if Path(base).resolve() in [file.resolve() for file in files]:
        raise SceneError(f"{path} has the base {base}, which is based on it in turn")
    if len(files) > MOST_BASES:
        raise SceneError(f"{files[0]} has more than {MOST_BASES} bases, one of the other")
    tables = _read(Path(base), files)
    merge(tables, data)
    return tables


def set_folder(data: dict[str, Any], folder: Path) -> None:
    """Put `folder` before the names of files in the tables of a scene, if they are relative."""
    kinds: list[tuple[Any, Callable[[Any], bool]]] = [
        *((place, lambda value: isinstance(value, str)) for place in FILE_KEYS),
        *((place, names_a_file) for place in ROWS_KEYS),
        (("friction", "law"), lambda value: ":" in str(value)),
    ]
    for (table, name), is_file in kinds:
        values: Any = data
        for part in table.split("."):
            values = values.get(part) if isinstance(values, dict) else None
        if isinstance(values, dict) and is_file(values.get(name)):
            values[name] = str(folder / values[name])
    if isinstance(data.get("base"), str):
        data["base"] = str(folder / data["base"])


def _hint(text: str, error: str) -> str:
    """Advice if the invalid TOML line has a unit without quotes."""
    lines = text.splitlines()
    at = re.search(r"at line (\d+)", error)
    line = lines[int(at[1]) - 1] if at and int(at[1]) <= len(lines) else ""
    return '; a value with a unit goes in quotes, as in "1 bar"' if _BARE_UNIT.search(line) else ""


def _check_depth(path: Path | str, data: dict[str, Any]) -> None:
    """Raise SceneError if `data` is nested too deeply for recursion."""
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        inner = (part.values() if isinstance(part, dict) else part for part in level)
        level = [value for values in inner for value in values if isinstance(value, dict | list)]
        if not level:
            return
    raise SceneError(f"{path} (with its overrides) is nested too deeply")


def override(data: dict[str, Any], change: str) -> None:
    """Set one "table.key=value" in `data`; the value is TOML, or a string without quotes."""
    key, text = key_and_text(change)
    put(data, key, parsed(text))


def key_and_text(override: str) -> tuple[str, str]:
    """Dotted key and text of "table.key=text". Raises SceneError if it is something else."""
    key, equals, text = override.partition("=")
    if not equals or not all(part.strip() for part in key.split(".")):
        raise SceneError(f'override "{shortened(override)}" is not of the form load.pressure=3bar')
    return key.strip(), text.strip()


def parsed(text: str) -> Any:
    """`text` as TOML, or as a string without quotes."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        return text


def as_toml(tables: Mapping[str, Any]) -> str:
    """Tables of a scene as the text of a scene file, without None values."""
    import tomlkit  # not needed to read scenes

    return tomlkit.dumps(without_none(tables))


def without_none(values: Any) -> Any:
    """Tables without None values, at any depth."""
    if isinstance(values, Mapping):
        return {key: without_none(value) for key, value in values.items() if value is not None}
    return [without_none(value) for value in values] if isinstance(values, list) else values
