"""Fields and sliders of the page: keys of a scene, and keys named in messages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pprint import pformat
from textwrap import indent
from typing import Any, Literal, NamedTuple, get_args, get_origin

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import Scene, parsed, put, scene_from_dict
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.fields import default_text, leaves, number_of
from iceslide_fem.scene.materials import COMPOUNDS

Texts = Mapping[str, str]
_NO_LIST = r"[^,;.\[\]\"']"
_DECIMAL_COMMA = re.compile(
    rf"(\s*[-+\N{{MINUS SIGN}}]?\d*),(\d+(?:[eE][-+]?\d+)?(?:\s*(?![\s\d]){_NO_LIST}+)?\s*)"
)
_THOUSANDS = re.compile(r"\s*[-+\N{MINUS SIGN}]?[1-9]\d{0,2},\d{3}(?!\d)")


class Slider(NamedTuple):
    """Slider of the field `key`, from `low` to `high` in `unit`, with the initial value `start`.

    SI = `scale` x value + `shift`; log: logarithmic scale; zero: its lowest position is 0 instead
    of `low`. A typed text may exceed the slider's range, within the range of the key.
    """

    key: str
    label: str
    unit: str
    scale: float
    low: float
    high: float
    start: float
    log: bool = True
    shift: float = 0.0
    zero: bool = False

    def text(self, value: float) -> str:
        """`value`, in the slider's unit, as a user types it."""
        return f"{value:g} {self.unit}".strip()

    def si(self, value: Array) -> Array:
        """`value` in SI."""
        return self.scale * value + self.shift

    def values(self, count: int) -> Array:
        """`count` values from `low` to `high`, in the slider's unit."""
        space = np.geomspace if self.log else np.linspace
        return np.asarray(space(self.low, self.high, count))

    def described(self) -> dict[str, Any]:
        """Data of the page to draw it."""
        return self._asdict() | {"text": self.text(self.start)}


def fields() -> list[dict[str, Any]]:
    """Data of a field for every key of a scene, in the order of the model.

    key; kind: text, choice, switch, or list of several lines; choices; unit; low and high as a user
    types them; help: what it means; default: shown in an empty field; required.
    """
    return [_field(key, field) for key, field in leaves(Scene)]


def keys() -> list[str]:
    """All dotted keys of a scene."""
    return [key for key, _ in leaves(Scene)]


def meanings(of: Sequence[str]) -> dict[str, str]:
    """What some keys of a scene mean."""
    return {key: field.description or "" for key, field in leaves(Scene) if key in of}


def tables(texts: Texts) -> dict[str, Any]:
    """Nested tables from non-empty texts of dotted keys, parsed as by `--set`."""
    data: dict[str, Any] = {}
    for key, text in texts.items():
        if text.strip():
            put(data, key, parsed(text.strip()))
    return data


def scene_of(texts: Texts) -> Scene:
    """The scene of the fields. Raises SceneError as the command line."""
    return scene_from_dict(tables(texts))


def texts_of(data: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Inverse of `tables`: dotted key -> text. Lists, and tables that are one key, are TOML."""
    found: dict[str, str] = {}
    known = set(keys())
    for name, value in data.items():
        key = prefix + name
        if isinstance(value, Mapping) and key not in known:
            found |= texts_of(value, f"{key}.")
        else:
            found[key] = _text(value)
    return found


def named_in(sentence: str, known: list[str]) -> list[str]:
    """Those of the `known` keys that a sentence names, as `load.pressure` or `--speed`.

    Without a full name its first word may be a table ("film has k only"), and other words keys in
    it.
    """
    found = [
        key
        for key in known
        if re.search(rf"(?<![\w.-]){re.escape(key)}(?![\w-]|\.\w)", sentence)
        and ("." in key or key.startswith("-") or sentence.startswith(key))
    ]
    if found:
        return found
    table, words = sentence.partition(" ")[0], set(re.findall(r"\w+", sentence))
    return [
        key
        for key in known
        if key.partition(".")[0] == table and key.rpartition(".")[2] in words and "." in key
    ]


def chosen(texts: Texts, key: str, allowed: Sequence[str]) -> str:
    """The text of a choice, by default the first one that is allowed. Raises SceneError."""
    text = texts.get(key) or allowed[0]
    if text not in allowed:
        raise SceneError(f'{key} = "{text[:60]}" is not available; allowed: {", ".join(allowed)}')
    return text


def dry_without_meaning(texts: Texts, table: str = "") -> set[str]:
    """Keys of dry contact that say nothing: with a stress of 0 or none, or with rows of it.

    table: what stands before the keys.
    """
    stress, *softening = (f"{table}dry_{name}" for name in ("stress", "softening", "residual"))
    number = _number(texts.get(stress, ""))
    if number is None:
        return {*softening}
    return {stress, *softening} if number == 0.0 else set()


def _number(text: str) -> float | None:
    """Number of a text, 0 or in Pa; 0 for an empty text, None for other texts."""
    value = as_number(text.strip() or "0")
    try:
        return value if isinstance(value, float) else to_si(value, "Pa")
    except ValueError:
        return None


def scene_lines(given: Mapping[str, Any]) -> str:
    """Python code that makes the scene of nested tables, with `ice` for the package."""
    return f"scene = ice.load_scene(\n{indent(pformat(dict(given), sort_dicts=False), '    ')}\n)"


def _field(key: str, field: Any) -> dict[str, Any]:
    quantity = number_of(field)
    choices = list(COMPOUNDS) if key == "rubber.compound" else []
    if get_origin(field.annotation) is Literal:
        choices = [str(each) for each in get_args(field.annotation)]
    kind = "switch" if field.annotation is bool else "choice" if choices else "text"
    if quantity is None and re.search(r"tuple|dict|Mapping", str(field.annotation)):
        kind = "list"
    return {
        "key": key,
        "kind": kind,
        "choices": choices,
        "unit": quantity.unit if quantity else "",
        "low": quantity.low if quantity else "",
        "high": quantity.high if quantity else "",
        "help": field.description or "",
        "required": field.is_required(),
        "default": default_text(field),
    }


def _text(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(each) for each in value) + "]"
    if isinstance(value, Mapping):
        entries = (f"{_toml(str(name))} = {_toml(each)}" for name, each in value.items())
        return "{" + ", ".join(entries) + "}"
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return _text(value)


def checked_texts(values: Any) -> dict[str, str]:
    """Data of the page as a table of texts, numbers with a decimal point. Raises SceneError."""
    if not isinstance(values, dict):
        raise SceneError("fields are a table of texts")
    for key, text in values.items():
        if not isinstance(text, str) or len(text) > 10_000:
            raise SceneError(f"{key[:60]} is not a text")
    return {key: with_point(text) for key, text in values.items()}


def with_point(text: str) -> str:
    """A `text` that is a number with a decimal comma, and perhaps a unit, with a decimal point.

    "1,500 Pa" may mean 1500 Pa, and stays for the program to refuse.
    """
    match = _DECIMAL_COMMA.fullmatch(text)
    return text if match is None or _THOUSANDS.match(text) else f"{match[1]}.{match[2]}"
