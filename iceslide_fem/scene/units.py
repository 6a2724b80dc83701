"""Quantities people type: plain numbers in SI, or strings that carry a unit."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import pint
from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

LONGEST = 100  # letters of a quantity
_NUMBER_AND_UNIT = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*?)\s*"
)
# Pint evaluates arithmetic in a unit, 9**9**9 for ever: names, 1, products, quotients, brackets and
# exponents of one digit are all that may stand there.
_PART = re.compile(
    r"(?P<power>\s*(?:\^|\*\*)\s*[+-]?[0-9](?![\w.])|⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹])"
    r"|[A-Za-z_µμΩÅ°Δ%][A-Za-z0-9_µμΩÅ°]*|1(?![\w.])|[()*/·⋅\s]"
)


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry()


@lru_cache(maxsize=4096)
def to_si(text: str, unit: str) -> float:
    """Value of `text` ("1 bar", "-4 degC") in the SI `unit`.

    Raises ValueError, with what is wrong with the text, if it has no number, no unit, an unknown
    unit or a unit of another dimension.
    """
    text = text.replace("\N{MINUS SIGN}", "-")  # as pages print it
    match = _NUMBER_AND_UNIT.fullmatch(text) if len(text) <= LONGEST else None
    if match is not None and re.match(",[0-9]", match[2]):
        raise ValueError("has a decimal comma instead of a point")
    if match is None:
        raise ValueError("is not a number with a unit")
    number, given = float(match[1]), match[2]
    if unit and not given:
        raise ValueError("has no unit")
    try:
        _check_unit(given)
        value = _registry().Quantity(number, given).to(unit or "dimensionless").magnitude
    except pint.DimensionalityError:
        expected = f"in {unit}" if unit else "without a unit"
        raise ValueError(f"has the wrong unit (a quantity {expected} is expected)") from None
    except Exception:  # pint lets tokenizer and assertion errors through, besides its own
        raise ValueError(f'has the unknown unit "{given}"') from None
    return float(f"{value:.15g}")  # "29 um" is 2.9e-05, not 2.8999999999999998e-05


def _check_unit(text: str) -> None:
    """Raise ValueError if `text` has another part than `_PART` names, or powers of anything else
    than a name: ((km^9)^9)^9 would be evaluated, too.
    """
    at, before = 0, ""
    while at < len(text):
        part = _PART.match(text, at)
        if part is None or (part["power"] and not before[-1:].isalpha()):
            raise ValueError
        at, before = part.end(), part[0]


def readable(value: float, unit: str) -> str:
    """`value` in `unit` to three digits with the prefix that suits it: 8.8e-5, "m" is "88 µm"."""
    rounded = float(f"{value:.3g}")  # before a prefix is chosen: no 1000 pm
    text = f"{_registry().Quantity(rounded, unit).to_compact():.3g~P}"
    return text.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")  # versions of pint differ


@dataclass(frozen=True)
class Quantity:
    """Annotation of a pydantic float field: SI `unit` ("" for a pure number), and its range.

    `low` and `high` (both allowed) are written as a person would type them and are shown in the
    error message: `pressure: Annotated[float, Quantity("Pa", "0.01 bar", "100 bar")]`.
    """

    unit: str
    low: str
    high: str

    def validate(self, value: Any) -> float:
        """`value` in SI; raises PydanticCustomError("quantity") with what is wrong and allowed."""
        try:
            return self.in_range(value)
        except ValueError as error:
            low, high = (json.dumps(end) if self.unit else end for end in (self.low, self.high))
            message = f"{error}; allowed: {low} to {high}"
            raise PydanticCustomError("quantity", "{message}", {"message": message}) from None

    def in_range(self, value: Any) -> float:
        """`value` in SI; raises ValueError with what is wrong, but not with what is allowed."""
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError("is not a number" + (" or a string with a unit" if self.unit else ""))
        number = to_si(value, self.unit) if isinstance(value, str) else value
        if not to_si(self.low, self.unit) <= number <= to_si(self.high, self.unit):
            plain = self.unit and not isinstance(value, str)
            meant = f" (a plain number is in {self.unit})" if plain else ""
            raise ValueError(f"is out of range{meant}")
        return float(number)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.validate, handler(source))
