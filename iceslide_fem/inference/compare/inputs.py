"""Uncertain inputs of candidates: which vary together, and what a standard deviation means."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.inference.compare.candidates import Candidate
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.distribution import BAND, log_normal, read_distribution
from iceslide_fem.scene.variation import Parameter, number_at, with_values

STIFFNESS = "wheel.stiffness"  # the only input that is no key of a scene
WIDEST = math.sqrt(math.log(2.0))  # spread of ln of 100 %
_FACTOR = Parameter(STIFFNESS, "", 1e-3, 1e3)


class Side(NamedTuple):
    """A candidate with one input moved: its number, the input, -1 or 1, its scene, and the factor
    on its tread's stiffness.
    """

    number: int
    key: str
    sign: int
    scene: Scene
    stiffness: float = 1.0


class Inputs(NamedTuple):
    """Spreads as typed by keys, for each candidate; own: keys that vary apart."""

    spreads: Sequence[Mapping[str, str]]
    own: frozenset[str]

    @property
    def keys(self) -> list[str]:
        """All uncertain keys."""
        return [*dict.fromkeys(key for one in self.spreads for key in one)]

    def shared(self, key: str, one: int) -> bool:
        """Whether a key varies together in a candidate and the reference."""
        same = self.spreads[0].get(key) == self.spreads[one].get(key)
        return same and key not in self.own

    def sides(self, scenes: Sequence[Scene]) -> Iterator[Side]:
        """All candidates, whose `scenes` are given, with every input moved to both sides."""
        for number, (scene, spreads) in enumerate(zip(scenes, self.spreads, strict=True)):
            for key, text in spreads.items():
                for sign, moved in zip((-1, 1), _moved(scene, key, text), strict=True):
                    if key == STIFFNESS:
                        yield Side(number, key, sign, scene, moved)
                    else:
                        yield Side(number, key, sign, with_values(scene, {key: moved}))


class Slopes(NamedTuple):
    """d ln(value) per standard deviation of the inputs, (candidates, conditions, keys)."""

    inputs: Inputs
    values: Array

    def band_of_value(self, one: int) -> Array:
        """Half width of the 95 % band of a candidate's value, over it, (conditions,)."""
        return np.asarray(BAND * np.linalg.norm(self.values[one], axis=-1))

    def band_of_ratio(self, one: int) -> Array:
        """That of the ratio to the reference, whose shared inputs are the same, (conditions,)."""
        if one == 0:
            return np.zeros(self.values.shape[1])
        return np.asarray(BAND * np.linalg.norm(self._of_ratio(one), axis=-1))

    def most_of_ratio(self, one: int) -> str:
        """The input that moves the ratio of a candidate most, "" without any."""
        sizes = np.abs(self._of_ratio(one)).max(axis=0)
        if not sizes.any():
            return ""
        return (self.inputs.keys * 2)[int(sizes.argmax())]

    def _of_ratio(self, one: int) -> Array:
        """Slopes of ln(ratio): of the candidate's inputs, then of the reference's own ones."""
        shared = np.array([self.inputs.shared(key, one) for key in self.inputs.keys], dtype=bool)
        mine, reference = self.values[one], self.values[0]
        apart = np.where(shared, 0.0, reference)
        return np.concatenate([mine - np.where(shared, reference, 0.0), apart], axis=-1)


def read_inputs(
    candidates: Sequence[Candidate], texts: Mapping[str, str], own: Sequence[str]
) -> Inputs:
    """The inputs of scenes, and `texts` of all candidates by keys. Raises SceneError."""
    spreads = [{**one.scene.uncertainty, **texts} for one in candidates]
    found = Inputs(spreads, frozenset(own))
    for key in own:
        if key not in found.keys:
            allowed = ", ".join(found.keys) or "none: give --input"
            raise SceneError(f"--own {key} is not uncertain; allowed: {allowed}")
    for one, here in zip(candidates, spreads, strict=True):
        if STIFFNESS in here and one.wheel is None:
            raise SceneError(f"{STIFFNESS} is of wheels, and {one.name} is a scene")
        for key, text in here.items():
            _moved(one.scene, key, text)
    return found


def _moved(scene: Scene, key: str, text: str) -> tuple[float, float]:
    """Values of an input one standard deviation to both sides; of the stiffness factors."""
    if key == STIFFNESS:
        factor = log_normal(_FACTOR, 1.0, re.sub(r"^\s*(\+-|±)", "~", text))
        if factor is None or not factor.spread < WIDEST:
            raise SceneError(f'--input {key}="{text}" is of no known form; allowed: ~5%')
        return factor.sides
    if number_at(scene, key) is None and not text[:1].isdigit():
        raise SceneError(
            f"{key} has no value in {scene.name}; allowed: a key with a number in every scene, as "
            "film.k_scale, ice.temperature or load.pressure (rubber.C10 is one where the scene has "
            "constants in place of rubber.compound)"
        )
    return read_distribution(scene, key, text).sides
