"""Units: the SI value of a text such as "1 bar", and readable text of a value."""

from __future__ import annotations

import re
from functools import cache, lru_cache

import pint

# Units of pressure as people write them, in lower case; case matters for mPa only.
_PRESSURES = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mpa": "MPa", "bar": "bar", "mbar": "mbar"}
_PRESSURES |= {"psi": "psi", "lb/in^2": "psi", "lbf/in^2": "psi", "lbs/in^2": "psi", "psig": "psi"}
_PRESSURES |= {"n/m^2": "Pa", "kn/m^2": "kPa", "n/cm^2": "N/cm^2", "n/mm^2": "N/mm^2"}
_PRESSURES |= {"kg/cm^2": "kgf/cm^2", "kp/cm^2": "kgf/cm^2", "kgf/cm^2": "kgf/cm^2"}
_PRESSURES |= {"g/cm^2": "gf/cm^2", "kg/mm^2": "kgf/mm^2", "kgf/mm^2": "kgf/mm^2"}
_PRESSURES |= {"mmhg": "mmHg", "inhg": "inHg", "torr": "torr", "atm": "atm"}
_FREQUENCIES = {
    "hz": "Hz",
    "khz": "kHz",
    "rad/sec": "rad/s",
    "rad·s-1": "rad/s",
    "rad s-1": "rad/s",
}
ZERO_CELSIUS = 273.15  # K
LONGEST = 100  # characters of a quantity
_NUMBER_AND_UNIT = re.compile(
    r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*?)\s*"
)
# Pint evaluates arithmetic in units, and 9**9**9 never ends. Only names, 1, products, quotients,
# brackets and one-digit exponents are allowed.
_PART = re.compile(
    r"(?P<power>\s*(?:\^|\*\*)\s*[+-]?[0-9](?![\w.])|⁻?[⁰¹²³⁴⁵⁶⁷⁸⁹])"
    r"|[A-Za-z_µμΩÅ°Δ%][A-Za-z0-9_µμΩÅ°]*|1(?![\w.])|[()*/·⋅\s]"
)


@cache
def _registry() -> pint.UnitRegistry:
    """Pint's units; it keeps their definitions, which take long to read, in the user's cache."""
    try:
        return pint.UnitRegistry(cache_folder=":auto:")
    except Exception:  # a cache that cannot be written, or that another process is writing
        return pint.UnitRegistry()


@lru_cache(maxsize=4096)
def to_si(text: str, unit: str) -> float:
    """Value of `text` ("1 bar", "-4 degC") in the SI `unit`.

    Raises ValueError with the reason if it has no number, no unit, an unknown unit or a unit of
    another dimension.
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
        written = _spelled(given, unit)
        _check_unit(written)
        value = _registry().Quantity(number, written).to(unit or "dimensionless").magnitude
    except pint.DimensionalityError:
        expected = f"in {unit}" if unit else "without a unit"
        raise ValueError(f"has the wrong unit (a quantity {expected} is expected)") from None
    except Exception:  # pint also raises tokenizer and assertion errors
        raise ValueError(f'has the unknown unit "{given}"') from None
    return float(f"{value:.15g}")  # "29 um" is 2.9e-05, not 2.8999999999999998e-05


def _check_unit(text: str) -> None:
    """Raise ValueError if `text` has other parts than `_PART`, or powers of other than names.

    Pint would also evaluate ((km^9)^9)^9.
    """
    at, before = 0, ""
    while at < len(text):
        part = _PART.match(text, at)
        if part is None or (part["power"] and not before[-1:].isalpha()):
            raise ValueError
        at, before = part.end(), part[0]


def _spelled(text: str, unit: str) -> str:
    """A unit with the dimension of the SI `unit` as pint spells it: N/cm^2 for N/cm2 or N/cm²."""
    text = text.replace("²", "^2").replace("³", "^3")
    text = re.sub(r"(?<=[A-Za-zµμ])([23])(?![0-9A-Za-z])", r"^\1", text)
    if unit != "Pa" or text == "mPa":
        return text
    return _PRESSURES.get(text.casefold().replace(" ", ""), text)


def si_unit(text: str, unit: str) -> str | None:
    """`text` as a unit for `to_si`, if it has the dimension of the SI `unit`; else None.

    Forms in headings of tables are accepted: C and °C, N/cm2 for N/cm^2, mPas, hz, "-" and "1" for
    none, also "%".
    """
    written = text.strip().replace("Âµ", "µ").replace("Î¼", "μ")  # UTF-8 read as Latin-1
    if not unit:
        return {"-": "", "1": "", "": "", "%": "%"}.get(written)
    written = _spelled(written, unit)
    if unit in ("Hz", "rad/s"):
        written = _FREQUENCIES.get(written.casefold(), written)
    if unit == "K":
        written = {"C": "degC", "°C": "degC", "℃": "degC", "deg C": "degC"}.get(written, written)
    if unit == "Pa*s":
        written = re.sub(r"^(m?Pa)[. -]?s$", r"\1*s", written)
    if not written or re.match(r"[0-9.,+\-]", written):
        return None
    try:
        to_si(f"1 {written}", unit)
    except ValueError:
        return None
    return written


def celsius(temperature: float) -> str:
    """A temperature (K) as a message says it: 269.15 is "-4 degC"."""
    return f"{temperature - ZERO_CELSIUS:.4g} degC"


def readable(value: float, unit: str, digits: int = 3) -> str:
    """`value` in `unit` with some `digits` and a suitable prefix: 8.8e-5, "m" is "88 µm"."""
    rounded = float(f"{value:.{digits}g}")  # before the prefix is chosen: avoids 1000 pm
    text = f"{_registry().Quantity(rounded, unit).to_compact():.{digits}g~P}"
    return text.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")  # depends on pint's version
