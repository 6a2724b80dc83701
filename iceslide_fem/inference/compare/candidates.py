"""What is compared: scenes, or wheels with the ice and rubber below them, read from files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from iceslide_fem.inference.parameters import checked
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, flat, put, scene_from_dict
from iceslide_fem.scene.command_options import scene_keys
from iceslide_fem.scene.rows import names_a_file
from iceslide_fem.scene.toml import read_scene

WHEEL, VARIATIONS = "wheel", "variations"  # tables of files
FILES = ("image", "pressure_map", "line", "contact", "contact_age", "scene")
ROWS = ("viscosity", "initial_height", "dry_stress")  # numbers, or files with rows


class Candidate(NamedTuple):
    """A scene, on its model level, or the law below a wheel, and that wheel's options or None."""

    name: str
    scene: Scene
    wheel: WheelCase | None = None

    @property
    def kind(self) -> str:
        """What it is, in words."""
        if self.wheel is None:
            return "scenes"
        return "stops" if self.wheel.abs else "wheels"

    @property
    def tables(self) -> dict[str, Any]:
        """All values, SI, by tables."""
        scene = self.scene.as_dict()
        if self.wheel is None:
            return scene
        own = [
            name
            for name, field in WheelCase.model_fields.items()
            if not scene_keys(field) and name not in ("scene", "vary")
        ]
        options = {name: getattr(self.wheel, name) for name in own}
        options["stiffness"] = self.wheel.stiffness and self.wheel.stiffness.value
        plain = {
            name: str(value) if isinstance(value, tuple | Path) else value
            for name, value in options.items()
        }
        law = {key: scene[key] for key in ("rubber", "film", "ice", "friction", "water")}
        return {WHEEL: plain, **law}

    def under(self, scene: Scene) -> Candidate:
        """The same with another scene."""
        wheel = None if self.wheel is None else self.wheel.under(scene)
        return self._replace(scene=scene, wheel=wheel)

    def footprint(self) -> PressureMap:
        """The footprint of its wheel, whose tread's stiffness is in the cache afterwards.

        Raises SceneError.
        """
        assert self.wheel is not None
        found = read_source(self.wheel).pressure_map
        stiffness_of(self.wheel, found)
        return found


class Condition(NamedTuple):
    """Ice that all candidates are on: temperature (K), its water (m); None: their own."""

    temperature: float | None = None
    water: float | None = None

    @property
    def name(self) -> str:
        """In words."""
        return ", ".join(self._parts(" °C", " µm of water")) or "as given"

    @property
    def file_name(self) -> str:
        """As a part of a file's name."""
        return "_".join(self._parts("degC", "um")) or "as_given"

    def _parts(self, celsius: str, micrometres: str) -> list[str]:
        """What is given, with these units."""
        parts = []
        if self.temperature is not None:
            parts.append(f"{self.temperature - ZERO_CELSIUS:.4g}{celsius}")
        if self.water is not None:
            parts.append(f"{1e6 * self.water:.4g}{micrometres}")
        return parts

    def of(self, one: Candidate) -> Candidate:
        """The candidate on this ice. Raises SceneError if its scene does not take it."""
        values: dict[str, Any] = {}
        if self.temperature is not None:
            values["ice.temperature"] = self.temperature
        if self.water is not None:
            values |= {"ice.water": self.water, "film.voids": "carry"}
        if not values:
            return one
        try:
            return one.under(checked(one.scene, values))
        except SceneError as error:
            raise SceneError(f"{one.name} at {self.name}: {error}") from None


def read_candidates(
    reference: Path, others: Sequence[Path], stop: Mapping[str, Any]
) -> list[Candidate]:
    """The reference and the others of some files; stop: options of a stop for every wheel.

    Raises SceneError, also if they are not all of one kind or two have the same name.
    """
    found = _named_in(reference, _of_file(reference, stop))
    if len(found) != 1:
        raise SceneError(f"{reference} has variations; the reference is a scene or a wheel")
    for path in others:
        found += _named_in(path, _of_file(path, stop, (reference, found[0].name)))
    for one in found[1:]:
        if one.kind != found[0].kind:
            raise SceneError(
                f"{found[0].name} is of {found[0].kind}, and {one.name} of {one.kind}; allowed: "
                "all of one kind"
            )
    names = [one.name for one in found]
    for name in names:
        if names.count(name) > 1:
            raise SceneError(f"two candidates have the name {name}; rename a file")
    if stop and found[0].wheel is None:
        raise SceneError(
            f"--stop is of wheels, and {reference} has no table [wheel] with the options of "
            "iceslide wheel"
        )
    return found


def _named_in(path: Path, candidates: Iterator[Candidate]) -> list[Candidate]:
    """The candidates of a file. Raises SceneError with its path."""
    try:
        return list(candidates)
    except SceneError as error:
        said = str(error)
        raise SceneError(said if str(path) in said else f"{path}: {said}") from None


def _of_file(
    path: Path, stop: Mapping[str, Any], reference: tuple[Path, str] | None = None
) -> Iterator[Candidate]:
    """The candidates of a file; reference: file and name of what variations are of."""
    tables = read_scene(path)
    if VARIATIONS not in tables:
        yield _candidate(path.stem, path, {}, stop)
        return
    of_all = tables[VARIATIONS]
    if reference is None or len(tables) > 1 or not isinstance(of_all, dict) or not of_all:
        raise SceneError(
            f"{path}: a file with variations has tables [variations.NAME] only, and is not the "
            "first"
        )
    for name, changes in of_all.items():
        if not isinstance(changes, dict):
            raise SceneError(f"{path}: variations.{name} is not a table of keys")
        yield _candidate(str(name), reference[0], flat(_with_folder(changes, path.parent)), stop)


def _candidate(
    name: str, path: Path, changes: Mapping[str, Any], stop: Mapping[str, Any]
) -> Candidate:
    """The candidate of a file with `changes` by keys. Raises SceneError."""
    tables = read_scene(path)
    if WHEEL not in tables:
        for key, value in changes.items():
            put(tables, key, value)
        return Candidate(name, resolved(scene_from_dict(tables)))
    if len(tables) > 1 or not isinstance(tables[WHEEL], dict):
        raise SceneError(
            f"{path}: a file with a table [wheel] has no other one; name a scene in it, "
            'scene = "FILE.toml"'
        )
    options = {key.replace("-", "_"): value for key, value in tables[WHEEL].items()}
    options = _with_folder(options, path.parent)
    of_scene = {key: value for key, value in changes.items() if "." in key}
    options |= {key: value for key, value in changes.items() if "." not in key} | dict(stop)
    wheel = WheelCase.of(options)
    if wheel.vary:
        raise SceneError(f"{path}: vary is not compared; leave it out")
    if of_scene:
        if wheel.scene is None:
            raise SceneError(
                f"{next(iter(of_scene))} of {name} is a key of a scene, and {path} names none; "
                "allowed: options of the wheel, or a scene there"
            )
        changed = read_scene(wheel.scene)
        for key, value in of_scene.items():
            put(changed, key, value)
        return Candidate(name, wheel.law, wheel).under(scene_from_dict(changed))
    return Candidate(name, wheel.law, wheel)


def _with_folder(options: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Options of a wheel whose files are relative to a `folder`."""
    found = dict(options)
    for key, value in options.items():
        if (key in FILES and isinstance(value, str)) or (key in ROWS and names_a_file(value)):
            found[key] = str(folder / value)
        elif isinstance(value, list):
            found[key] = ",".join(map(str, value))
    return found
