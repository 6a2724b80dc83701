"""The formulas of chapter 2 by name, with unit, range and default of every parameter."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint import empirical
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.units import Quantity

MOST = 100_000  # values of one call


class Parameter(NamedTuple):
    """A parameter: SI unit, range and default as a user types them, and meaning."""

    unit: str
    low: str
    high: str
    meaning: str
    default: str

    def value(self, text: str) -> float:
        """The value of `text` in SI. Raises ValueError if it is invalid or out of range."""
        return Quantity(self.unit, self.low, self.high).in_range(as_number(text.strip()))


PARAMETERS = {
    "speed": Parameter("m/s", "1 mm/s", "100 m/s", "sliding speed", "3m/s"),
    "pressure": Parameter("Pa", "0.001 bar", "1000 bar", "mean pressure", "2bar"),
    "temperature": Parameter("K", "-80 degC", "0 degC", "temperature of the ice", "-4degC"),
    "length": Parameter("m", "0.1 mm", "5 m", "length of the contact", "150mm"),
    "film": Parameter("m", "0.1 nm", "1 mm", "height of the water film", "100nm"),
    "dry": Parameter("", "0", "2", "friction of the dry area", "0.1"),
    "x_m": Parameter("m", "0 m", "5 m", "x_m, length of the wet area", "75mm"),
    "y_m": Parameter("", "0", "1.5708", "y_m, an angle (rad)", "0.7854"),
    "mu": Parameter("", "1e-4", "2", "friction coefficient", "0.1"),
    "aggregate": Parameter("g/m^2", "0 g/m^2", "1000 g/m^2", "aggregate spread on the ice", "0"),
}
_VEHICLE = Parameter("m/s", "0.01 m/s", "150 m/s", "speed of the vehicle", "36km/h")


class Formula(NamedTuple):
    """A formula: equation in the thesis, result, function in SI, and parameters."""

    equation: str
    gives: str
    function: Callable[..., Array]
    parameters: dict[str, Parameter]


def _formula(
    equation: str, function: Callable[..., Array], gives: str = "mu", **other: Parameter
) -> Formula:
    """The formula of a function whose arguments have the names in `PARAMETERS` and `other`."""
    known = PARAMETERS | other
    names = inspect.signature(function).parameters
    return Formula(equation, gives, function, {name: known[name] for name in names})


FORMULAS = {
    "stopping-distance": _formula(
        "(1.1)", empirical.stopping_distance, "distance (m)", speed=_VEHICLE
    ),
    "navin": _formula("(1.2)", empirical.navin),
    "hayhoe-shapley": _formula("(1.3) to (1.5)", empirical.hayhoe_shapley),
    "peng-ellipse": _formula("(1.6)", empirical.peng_ellipse),
    "peng-rectangle": _formula("(1.7), weights put right", empirical.peng_rectangle),
    "peng-rectangle-printed": _formula("(1.7) as printed", empirical.peng_rectangle_as_printed),
}


class Evaluated(NamedTuple):
    """A formula, the values of its parameters (n,) in SI, and its results (n,)."""

    formula: Formula
    values: dict[str, Array]
    result: Array


def evaluate(name: str, given: Sequence[str]) -> Evaluated:
    """Evaluate the formula at KEY=VALUE; with several values (commas) every combination.

    Raises SceneError.
    """
    if name not in FORMULAS:
        raise SceneError(f'there is no formula "{name}"; there are: {", ".join(FORMULAS)}')
    formula = FORMULAS[name]
    texts: dict[str, str] = {}
    for word in given:
        key, equals, text = word.partition("=")
        if key not in formula.parameters or not equals:
            raise SceneError(
                f'{name} takes KEY=VALUE with {", ".join(formula.parameters)}; given: "{word[:60]}"'
            )
        if key in texts:
            raise SceneError(f"{key} is given twice; several values follow each other with commas")
        texts[key] = text
    lists = []
    for key, parameter in formula.parameters.items():
        parts = texts.get(key, parameter.default).split(",")
        lists.append([_value(f"{name}: {key}", parameter, part) for part in parts])
    if math.prod(map(len, lists)) > MOST:
        raise SceneError(f"{math.prod(map(len, lists))} combinations are more than {MOST}")
    every = [each.ravel() for each in np.meshgrid(*lists, indexing="ij")]
    values = dict(zip(formula.parameters, every, strict=True))
    if "x_m" in values and (values["x_m"] > values["length"]).any():
        raise SceneError("x_m is longer than length: the wet area is a part of the contact")
    return Evaluated(formula, values, formula.function(**values))


def _value(said: str, parameter: Parameter, text: str) -> float:
    try:
        return parameter.value(text)
    except ValueError as error:
        raise SceneError(
            f'{said} "{text.strip()}" {error}; allowed: {parameter.low} to {parameter.high}'
        ) from None
