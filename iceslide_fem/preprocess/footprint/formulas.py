"""The formulas of chapter 2 by their names, with every parameter: its unit, range and default."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint import empirical
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.materials import ZERO_CELSIUS
from iceslide_fem.scene.units import Quantity

MOST = 100_000  # values of one call


class Parameter(NamedTuple):
    """SI unit; its range as one would type it; what it is, and the default as typed (or none)."""

    unit: str
    low: str
    high: str
    meaning: str
    default: str = ""


class Formula(NamedTuple):
    """Its equation in the thesis, what it gives, parameters, and the function of them in SI."""

    equation: str
    gives: str
    parameters: dict[str, Parameter]
    function: Callable[..., Array]


_SPEED = Parameter("m/s", "1 mm/s", "100 m/s", "sliding speed", "3m/s")
_PRESSURE = Parameter("Pa", "0.001 bar", "1000 bar", "mean pressure", "2bar")
_ICE = Parameter("K", "-80 degC", "0 degC", "temperature of the ice", "-4degC")
_LENGTH = Parameter("m", "0.1 mm", "5 m", "length of the contact", "150mm")
_FILM = Parameter("m", "0.1 nm", "1 mm", "height of the water film", "100nm")
_DRY = Parameter("", "0", "2", "friction of the dry area", "0.1")
_WET = Parameter("m", "0 m", "5 m", "x_m, length of the wet area", "75mm")

_RECTANGLE = {
    "speed": _SPEED,
    "film": _FILM,
    "pressure": _PRESSURE,
    "x_m": _WET,
    "length": _LENGTH,
    "dry": _DRY,
}


def _peng(function: Callable[..., Array]) -> Callable[..., Array]:
    """One of Peng's formulas, which take a wet area within the contact only."""

    def checked(**values: Array) -> Array:
        if (values["x_m"] > values["length"]).any():
            raise SceneError("x_m is longer than length: the wet area is a part of the contact")
        return function(**values)

    return checked


FORMULAS = {
    "stopping-distance": Formula(
        "(1.1)",
        "distance (m)",
        {
            "speed": Parameter("m/s", "0.01 m/s", "150 m/s", "speed of the vehicle", "36km/h"),
            "mu": Parameter("", "1e-4", "2", "friction coefficient", "0.1"),
        },
        lambda speed, mu: empirical.stopping_distance(3.6 * speed, mu),
    ),
    "navin": Formula(
        "(1.2)",
        "mu",
        {
            "temperature": _ICE,
            "aggregate": Parameter(
                "g/m^2", "0 g/m^2", "1000 g/m^2", "aggregate spread on the ice", "0"
            ),
        },
        lambda temperature, aggregate: empirical.navin(temperature - ZERO_CELSIUS, aggregate),
    ),
    "hayhoe-shapley": Formula(
        "(1.3) to (1.5)",
        "mu",
        {"pressure": _PRESSURE, "speed": _SPEED, "temperature": _ICE, "length": _LENGTH},
        lambda pressure, speed, temperature, length: empirical.hayhoe_shapley(
            pressure, speed, temperature, length
        ),
    ),
    "peng-ellipse": Formula(
        "(1.6)",
        "mu",
        {
            "speed": _SPEED,
            "film": _FILM,
            "pressure": _PRESSURE,
            "x_m": _WET,
            "y_m": Parameter("", "0", "1.5708", "y_m, an angle (rad)", "0.7854"),
            "length": _LENGTH,
            "dry": _DRY,
        },
        _peng(
            lambda speed, film, pressure, x_m, y_m, length, dry: empirical.peng_ellipse(
                speed, film, pressure, x_m, y_m, length, dry
            )
        ),
    ),
    "peng-rectangle": Formula(
        "(1.7), weights put right",
        "mu",
        _RECTANGLE,
        _peng(
            lambda speed, film, pressure, x_m, length, dry: empirical.peng_rectangle(
                speed, film, pressure, x_m, length, dry
            )
        ),
    ),
    "peng-rectangle-printed": Formula(
        "(1.7) as printed",
        "mu",
        _RECTANGLE,
        _peng(
            lambda speed, film, pressure, x_m, length, dry: empirical.peng_rectangle_as_printed(
                speed, film, pressure, x_m, length, dry
            )
        ),
    ),
}


class Evaluated(NamedTuple):
    """A formula, the values of its parameters (n,) in SI, and what it gives (n,)."""

    formula: Formula
    values: dict[str, Array]
    result: Array


def evaluate(name: str, given: Sequence[str]) -> Evaluated:
    """The formula at KEY=VALUE; several values with commas, of all of which every combination.

    Raises SceneError with one sentence for what is wrong.
    """
    if name not in FORMULAS:
        raise SceneError(f'there is no formula "{name}"; there are: {", ".join(FORMULAS)}')
    formula = FORMULAS[name]
    texts = {key: each.default for key, each in formula.parameters.items()}
    seen: set[str] = set()
    for word in given:
        key, equals, text = word.partition("=")
        if key not in texts or not equals:
            raise SceneError(
                f'{name} takes KEY=VALUE with {", ".join(texts)}; given: "{word[:60]}"'
            )
        if key in seen:
            raise SceneError(f"{key} is given twice; several values follow each other with commas")
        seen.add(key)
        texts[key] = text
    lists = [_values(name, key, formula.parameters[key], text) for key, text in texts.items()]
    if math.prod(map(len, lists)) > MOST:
        raise SceneError(f"{math.prod(map(len, lists))} combinations are more than {MOST}")
    every = np.meshgrid(*lists, indexing="ij")
    values = {key: each.ravel() for key, each in zip(texts, every, strict=True)}
    return Evaluated(formula, values, np.asarray(formula.function(**values)))


def _values(name: str, key: str, parameter: Parameter, text: str) -> list[float]:
    return [_value(name, key, parameter, part.strip()) for part in text.split(",")]


def _value(name: str, key: str, parameter: Parameter, text: str) -> float:
    unit, low, high = parameter[:3]
    try:
        return Quantity(unit, low, high).in_range(as_number(text))
    except ValueError as error:
        raise SceneError(f'{name}: {key} "{text}" {error}; allowed: {low} to {high}') from None
