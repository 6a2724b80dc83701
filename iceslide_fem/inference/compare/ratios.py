"""Ratios to a reference with their bands, and what they say in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

Verdict = Literal["better", "worse", "alike"]
LEAST = 1e-3  # a smaller difference means nothing on ice
CLASS_C1 = 1.18  # least ice grip index of a tyre for severe snow on ice, class C1 (UN R117)
REFERENCE = (0.9, 1.6)  # m/s2, mean deceleration of the reference tyre (ISO 19447)


class Ratio(NamedTuple):
    """A value over the reference's. numerical: part by which steps and meshes may move it; inputs:
    half width of its 95 % band by uncertain inputs, over it, None where they are exact.
    """

    value: float
    numerical: float
    inputs: float | None = None

    @property
    def width(self) -> float:
        """Half width of both bands together, over the ratio: their sum."""
        return self.numerical + (self.inputs or 0.0)

    @property
    def low(self) -> float:
        """Lower end."""
        return self.value * (1.0 - self.width)

    @property
    def high(self) -> float:
        """Upper end."""
        return self.value * (1.0 + self.width)

    @property
    def verdict(self) -> Verdict:
        """What it says: "alike" where the band holds 1, or the difference is below `LEAST`."""
        if abs(self.value - 1.0) < LEAST:
            return "alike"
        if self.low > 1.0:
            return "better"
        return "worse" if self.high < 1.0 else "alike"

    @property
    def percent(self) -> str:
        """By how much, in words: "12 to 15 %"."""
        ends = sorted(100.0 * abs(end - 1.0) for end in (self.low, self.high))
        if self.verdict == "alike":
            return f"{100 * (self.low - 1.0):+.2g} to {100 * (self.high - 1.0):+.2g} %"
        low, high = (f"{end:.2g}" for end in ends)
        return f"{low} %" if low == high else f"{low} to {high} %"


def sentence(
    name: str, reference: str, stops: bool, ratios: Mapping[str, Ratio], moved_by: str = ""
) -> str:
    """What the ratios of a candidate by conditions say; moved_by: the input that moves them most.

    stops: whether they are of decelerations, else of friction.
    """
    groups: dict[Verdict, list[str]] = {}
    for condition, ratio in ratios.items():
        where = "" if condition == "as given" else f" at {condition}"
        known = f"{ratio.percent}" if ratio.verdict != "alike" else ""
        groups.setdefault(ratio.verdict, []).append(f"{known}{where}".strip())
    verbs: dict[Verdict, str] = {
        "better": "brakes {} better" if stops else "has {} more friction",
        "worse": "brakes {} worse" if stops else "has {} less friction",
    }
    said = []
    for verdict, verb in verbs.items():
        if found := groups.get(verdict):
            first, *more = found
            amount, at, place = first.partition(" at ")
            text = verb.format(amount) + at + place
            said.append(", ".join([text, *more]))
    if alike := groups.get("alike"):
        places = ", ".join(place.removeprefix("at ") for place in alike if place)
        at = f"at {places} " if places else ""
        said.append(f"{at}cannot be told apart from {reference}")
    moved = f" What moves the ratio most is {moved_by}." if moved_by else ""
    return f"{name} {'; '.join(said)}.{moved}"


def flags(reference: Mapping[str, float], index: Mapping[str, Mapping[str, Ratio]]) -> list[str]:
    """Sentences on the rules for tyres: the reference's decelerations (m/s2) by condition, and the
    ice grip index of the others, by name and condition.
    """
    low, high = REFERENCE
    outside = [
        f"{value:.3g} m/s² at {condition}"
        for condition, value in reference.items()
        if not low <= value <= high
    ]
    said = []
    if outside:
        said.append(
            f"the reference brakes outside {low:g} to {high:g} m/s², where ISO 19447 wants it: "
            f"{', '.join(outside)}"
        )
    for name, ratios in index.items():
        said.append(f"{name}: ice grip index {_against_limit(ratios)}")
    return said


def _against_limit(ratios: Mapping[str, Ratio]) -> str:
    words: dict[str, list[str]] = {}
    for condition, ratio in ratios.items():
        if ratio.low >= CLASS_C1:
            how = f"reaches {CLASS_C1:g}"
        elif ratio.high < CLASS_C1:
            how = f"is below {CLASS_C1:g}"
        else:
            how = f"may reach {CLASS_C1:g}"
        words.setdefault(how, []).append(condition)
    parts = [f"{how} at {', '.join(places)}" for how, places in words.items()]
    return "; ".join(parts) + f" (UN R117, class C1: at least {CLASS_C1:g})"
