"""Error messages for a scene, or for options of a command, in one sentence."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator, Sequence
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

_FORM = re.compile(r"<.*|float|int|constrained-.*")


def first_sentence(error: ValidationError, keys: Sequence[str]) -> str:
    """The first fault in `error` as one sentence: the dotted key, what was given, what is allowed.

    `keys` are all dotted keys of a scene. Unknown keys come first, because a misspelt key is also
    reported as missing. All missing keys are named together.
    """
    fault = min(error.errors(), key=lambda fault: fault["type"] != "extra_forbidden")
    key = _dotted(fault["loc"])
    given = f"{shortened(key)} = {_shown(fault['input'])}"
    match fault["type"]:
        case "extra_forbidden":
            return unknown_key(key, keys)
        case "missing":
            faults = [fault for fault in error.errors() if fault["type"] == "missing"]
            return missing([shortened(_dotted(fault["loc"])) for fault in faults])
        case "value_error":
            return str(fault["ctx"]["error"])
        case "quantity" | "table" | "form":
            return f"{given} {fault['msg']}"
        case "literal_error":
            return f"{given} is not available; allowed: {fault['ctx']['expected']}"
        case "bool_type":
            return f"{given} is not a switch; allowed: true or false"
        case "string_pattern_mismatch":
            return (
                f"{given} is not a name; allowed: up to 100 letters from a to z and A to Z, "
                "digits, and . _ - after the first one"
            )
        case "path_not_file":
            return f"{given} is not a file"
        case "model_type":
            return f"{given} is not a table; write its keys under [{key}]"
        case _:
            return f"{given} is not allowed: {fault['msg'][:1].lower()}{fault['msg'][1:]}"


def _dotted(place: Sequence[int | str]) -> str:
    """Dotted key of a pydantic location, without the names of union members."""
    return ".".join(str(part) for part in place if not _FORM.fullmatch(str(part)))


def missing(names: Sequence[str]) -> str:
    """A sentence that names all keys or options that are missing."""
    *others, last = names
    return f"{', '.join(others)} and {last} are missing" if others else f"{last} is missing"


def _shown(value: Any) -> str:
    """`value` as it would stand in a scene file, cut to a readable length."""
    try:
        return shortened(json.dumps(value, ensure_ascii=False, default=str))
    except (RecursionError, ValueError):  # too deeply nested, or too long
        return "..."


def shortened(text: str) -> str:
    """`text`, cut to a readable length."""
    return text if len(text) <= 60 else text[:57] + "..."


def unknown_key(key: str, keys: Sequence[str]) -> str:
    """A sentence for a `key` that is not among `keys`.

    Suggests the closest key of the table, else keys of the same name in other tables (`load`
    first), else lists the table's keys.
    """
    key = shortened(key)
    table, _, name = key.rpartition(".")
    table = re.sub(r"\.\d+", "", table)  # index in a list of tables
    siblings = [known for known in keys if known.rpartition(".")[0] == table]
    for candidates in (siblings, sorted(keys, key=lambda known: not known.startswith("load."))):
        names = [known.rpartition(".")[2].lower() for known in candidates]
        if close := difflib.get_close_matches(name.lower(), names, n=1):
            meant = [k for k, known in zip(candidates, names, strict=True) if known == close[0]]
            return f"{key} is not a known key; did you mean {' or '.join(meant)}?"
    return f"{key} is not a known key; allowed: {', '.join(siblings)}"


def dotted_keys(model: type[BaseModel], prefix: str = "") -> Iterator[str]:
    """All dotted keys of a `model`, those of tables and of what they hold."""
    for name, field in model.model_fields.items():
        yield prefix + name
        for table in _tables(field.annotation):
            yield from dotted_keys(table, f"{prefix}{name}.")


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    """Tables that a field may hold: itself, or a list of them."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    elif get_origin(annotation) is not dict:  # whose keys are the user's own
        for part in get_args(annotation):
            yield from _tables(part)
