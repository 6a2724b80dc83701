"""How an uncertain input is spread, from a text: "0.266+-10%", "1bar..2bar", "~10%"."""

from __future__ import annotations

import math
import re
from typing import Literal, NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene.command_options import as_number
from iceslide_fem.scene.model import Scene
from iceslide_fem.scene.variation import Parameter, number_at, parameter, quantity

CUT = 3.5  # standard deviations, at which a distribution ends
BAND = 1.96  # standard deviations of a band of 95 %
ONE_SIGMA = np.array([0.158655, 0.841345])  # quantiles one standard deviation to both sides
_PART = re.compile(r"\s*([0-9.eE+-]+)\s*%\s*")
FORMS = '"0.266+-10%" or "-4degC+-0.5K" (normal), "1bar..2bar" (even), "~10%" (log-normal)'


class Distribution(NamedTuple):
    """How a number (SI) is spread.

    normal: mean `centre` and standard deviation `spread`; log-normal: the same of ln, the median is
    the centre; even: from `low` to `high`. All end at `low` and `high`.
    """

    parameter: Parameter
    kind: Literal["normal", "log-normal", "even"]
    centre: float
    spread: float
    low: float
    high: float

    def at(self, quantile: Array) -> Array:
        """Values at quantiles (0 to 1) of the distribution, any shape."""
        from scipy.stats import norm  # takes long to import

        if self.kind == "even":
            return np.asarray(self.low + quantile * (self.high - self.low))
        ends = [self._standard(end) for end in (self.low, self.high)]
        first, last = norm.cdf(ends)
        drawn = norm.ppf(first + quantile * (last - first))
        if self.kind == "normal":
            return np.clip(self.centre + self.spread * drawn, self.low, self.high)
        return np.clip(self.centre * np.exp(self.spread * drawn), self.low, self.high)

    @property
    def sides(self) -> tuple[float, float]:
        """Values one standard deviation to both sides of the middle."""
        low, high = self.at(ONE_SIGMA)
        return float(low), float(high)

    def _standard(self, value: float) -> float:
        """The value in standard deviations from the centre."""
        if self.kind == "normal":
            return (value - self.centre) / self.spread
        return math.log(value / self.centre) / self.spread if value > 0.0 else -math.inf


def read_distribution(scene: Scene, key: str, text: str) -> Distribution:
    """The distribution of `key` from a text. Raises SceneError with one sentence."""
    what, said = parameter(key), f'the uncertainty of {key}, "{text}",'
    own = number_at(scene, key)
    plain = text.replace("±", "+-")

    def number(part: str) -> float:
        try:
            return quantity(key).in_range(as_number(part.strip()))
        except ValueError as error:
            raise SceneError(
                f"{said} has a value that {error}; allowed: {' to '.join(what.shown)}"
            ) from None

    if ".." in plain:
        low, high = (number(part) for part in plain.split("..", 1))
        if not low < high:
            raise SceneError(f"{said} has its ends the wrong way round")
        return Distribution(what, "even", 0.5 * (low + high), (high - low) / math.sqrt(12.0),
                            low, high)  # fmt: skip
    if plain.strip().startswith("~"):
        if own is None or not own > 0.0:
            raise SceneError(f"{said} is relative, and the scene has no positive {key}")
        found = log_normal(what, own, plain)
        if found is None:
            raise SceneError(f"{said} is of no known form; allowed: {FORMS}")
        return found
    middle, sign, width = plain.partition("+-")
    if not sign:
        raise SceneError(f"{said} is of no known form; allowed: {FORMS}")
    centre = number(middle) if middle.strip() else own
    if centre is None:
        raise SceneError(f"{said} has no mean, and the scene has no {key}")
    spread = _width(said, width.strip(), centre, what)
    return _cut(Distribution(what, "normal", centre, spread, centre - CUT * spread,
                             centre + CUT * spread))  # fmt: skip


def log_normal(what: Parameter, median: float, text: str) -> Distribution | None:
    """A log-normal distribution around a `median` from "~10%"; None if the text is none."""
    ratio = _part(text.strip()[1:]) if text.strip().startswith("~") else None
    if ratio is None or not ratio > 0.0:
        return None
    spread = math.sqrt(math.log1p(ratio**2))
    ends = (median * math.exp(sign * CUT * spread) for sign in (-1.0, 1.0))
    return _cut(Distribution(what, "log-normal", median, spread, *ends))


def inputs_of(scene: Scene) -> list[Distribution]:
    """Distributions of the scene's table `[uncertainty]`. Raises SceneError."""
    return [read_distribution(scene, key, text) for key, text in scene.uncertainty.items()]


def _part(text: str) -> float | None:
    """A percentage as a number; None if it is none."""
    match = _PART.fullmatch(text)
    try:
        return None if match is None else float(match[1]) / 100.0
    except ValueError:
        return None


def _width(said: str, text: str, centre: float, what: Parameter) -> float:
    """A standard deviation (SI): a percentage of the centre, or a difference with its unit."""
    part = _part(text)
    if part is not None:
        spread = part * abs(centre)
    else:
        try:
            number = as_number(text)
            spread = number if isinstance(number, float) else to_si(text, what.unit)
        except ValueError as error:
            raise SceneError(f"{said} has a standard deviation that {error}") from None
        if what.unit == "K" and any(mark in text for mark in ("deg", "°")):
            raise SceneError(f"{said} has a standard deviation in degrees; allowed: as in 0.5K")
    if not 0.0 < spread < math.inf:
        raise SceneError(f"{said} has the standard deviation {spread:g}; allowed: more than 0")
    return spread


def _cut(found: Distribution) -> Distribution:
    """The distribution within the range of its key."""
    what = found.parameter
    return found._replace(low=max(found.low, what.low), high=min(found.high, what.high))
