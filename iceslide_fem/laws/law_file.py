"""A friction law in a user's file, read and checked."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Mapping
from pathlib import Path

from iceslide_fem.laws.protocol import Law
from iceslide_fem.runtime.errors import SceneError

CARRIERS = ("ice", "rubber")  # where the state of a law is held


def read_law(path: Path, name: str, parameters: Mapping[str, float]) -> tuple[Law, str]:
    """An instance of the class `name` in the file at `path`, and its name in messages.

    `parameters` are its keyword arguments. Executes the file. Raises SceneError if the file cannot
    be loaded or does not contain a law.
    """
    where = f"friction.law = {path.name}:{name}"
    spec = importlib.util.spec_from_file_location(f"_law_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise SceneError(f"{where} cannot be loaded: {path} is not a Python file (.py)")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise SceneError(f"{where} cannot be loaded: {type(error).__name__}: {error}") from None
    if not isinstance(kind := getattr(module, name, None), type):
        raise SceneError(f"{where} cannot be loaded: {path} has no class {name}")
    try:
        law: Law = kind(**parameters)
    except Exception as error:
        raise SceneError(
            f"{where} cannot be made with friction.parameters = {dict(parameters)}: {error}"
        ) from None
    for member in ("fields", "respond"):
        if not hasattr(law, member):
            raise SceneError(f"{where} has no {member}: a law needs fields and respond(...)")
    _check(law, where)
    return law, f"{path.name}:{name}"


def _check(law: Law, where: str) -> None:
    """Raise SceneError unless fields have finite numbers and respond is callable."""
    fields = law.fields
    good = isinstance(fields, Mapping) and all(
        isinstance(key, str)
        and re.fullmatch("[A-Za-z][A-Za-z0-9_]{0,40}", key)
        and isinstance(value, int | float)
        and abs(value) < 1e300
        for key, value in fields.items()
    )
    if not good:
        raise SceneError(
            f"{where} needs fields = {{name: value at the start}} with names like wear_m and "
            "finite numbers"
        )
    if getattr(law, "carrier", None) not in (None, *CARRIERS):
        raise SceneError(f'{where} has carrier = {law.carrier!r}; allowed: "ice" or "rubber"')  # type: ignore[attr-defined]
    if not callable(law.respond):
        raise SceneError(f"{where} needs respond to be a method")
