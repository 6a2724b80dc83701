"""The friction law of a scene: one row for each name of `friction.law`.

Any other value names a class in a user's file.
"""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable, Mapping
from pathlib import Path

from iceslide_fem.laws.coulomb import Coulomb, check_weakening
from iceslide_fem.laws.film_of_scene import film_law
from iceslide_fem.laws.protocol import InterfaceLaw, Law
from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene

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


def law_of(scene: Scene) -> InterfaceLaw:
    """The law of `scene`. Runs a law's file; raises SceneError."""
    return LAWS.get(scene.friction.law, user_law)(scene)


def user_law(scene: Scene) -> UserLaw:
    """Coulomb's law, or one in a file. Raises SceneError."""
    friction, ice = scene.friction, scene.ice
    if friction.law == "coulomb":
        law: Law = Coulomb.of(friction.mu, friction.table)
        name = "coulomb"
    else:
        law, name = read_law(*friction.law_file, friction.parameters)
    bound = UserLaw(law, name, ice.temperature, ice.melting_temperature)
    passes = scene.model == "point" and ice.motion == "sliding"
    if passes and bound.fields and bound.frame(scene.film.carrier) == "rubber":
        raise SceneError(
            f'the friction law {name} has carrier = "rubber", which contradicts model = '
            '"point" where ice slides: its history is older than the ice below; allowed: '
            'model = "slice" or "block", or ice.motion = "attached"'
        )
    check_weakening(scene, bound)
    return bound


LAWS: dict[str, Callable[[Scene], InterfaceLaw]] = {"film": film_law, "coulomb": user_law}
