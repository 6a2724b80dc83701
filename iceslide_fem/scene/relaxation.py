"""Viscoelasticity in a scene: Prony series, and shift with temperature."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, PlainSerializer, model_validator
from pydantic_core import PydanticCustomError

from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.scene.units import Quantity, Table

MOST_ARMS = 60
FRACTION = Quantity("", "1e-9", "0.999999")
TIME = Quantity("s", "1e-15 s", "1e15 s")
TEMPERATURE = Quantity("K", "-150 degC", "200 degC")
LOG = Quantity("", "-50", "50")
MOST_FACTORS = 200
SOFTEST = 1e-6  # long-term modulus over the instantaneous one


def read_factors(given: Any) -> Any:
    """Rows (temperature in K, log10 a_T) by temperature, colder rubber being slower.

    Raises PydanticCustomError if they are invalid.
    """
    form = 'is no list of two or more rows [temperature, log10 a_T], as in [["-20 degC", 2.1], ...]'
    rows = _pairs(given, (TEMPERATURE, LOG), (2, MOST_FACTORS), "row", form, form)
    if rows is None:
        return None
    rows.sort()
    for (colder, before), (warmer, after) in pairwise(rows):
        if colder == warmer or after >= before:
            raise _fault(
                f"log10 a_T does not fall from {colder:g} to {warmer:g} K; "
                "allowed: rows of different temperatures, the colder the larger"
            )
    if not rows[-1][1] <= 0.0 <= rows[0][1]:
        raise _fault("log10 a_T is nowhere 0 in its range, so no temperature is the reference")
    return tuple(rows)


def read_arms(given: Any) -> Any:
    """Arms (g, tau) sorted by tau: fractions of the instantaneous modulus, and times (s).

    Raises PydanticCustomError if they are invalid.
    """
    form = f'is no list of 1 to {MOST_ARMS} arms [g, tau], as in [[0.3, "5 ms"]]'
    pair = 'arm {} is no pair of g and tau, as in [0.3, "5 ms"]'
    arms = _pairs(given, (FRACTION, TIME), (1, MOST_ARMS), "arm", form, pair)
    if arms is None:
        return None
    arms.sort(key=lambda arm: arm[1])
    for (_, before), (_, after) in pairwise(arms):
        if before == after:
            raise _fault(f"two arms have the same tau, {after:g} s; give their sum")
    total = sum(g for g, _ in arms)
    if total > 1.0 - SOFTEST:
        raise _fault(
            f"the fractions g are {total:.6g} in sum, of the instantaneous modulus; allowed: "
            f'less than {1.0 - SOFTEST:g} (the page "Rubber that relaxes" has other '
            "programs' conventions)"
        )
    return tuple(arms)


def _pairs(
    given: Any, quantities: tuple[Quantity, Quantity], counts: tuple[int, int], what: str,
    form: str, pair: str,
) -> list[tuple[float, float]] | None:  # fmt: skip
    """Pairs of `quantities`, SI, None for None; form, pair: faults of the list and of a pair."""
    if given is None:
        return None
    if not isinstance(given, list | tuple) or not counts[0] <= len(given) <= counts[1]:
        raise _fault(form)
    found = []
    for number, each in enumerate(given, start=1):
        if not isinstance(each, list | tuple) or len(each) != 2:
            raise _fault(pair.format(number))
        try:
            found.append((quantities[0].validate(each[0]), quantities[1].validate(each[1])))
        except PydanticCustomError as error:
            raise _fault(f"{what} {number}, {json.dumps(each)}: {error.message()}") from None
    return found


def _fault(message: str) -> PydanticCustomError:
    return PydanticCustomError("prony", "{message}", {"message": message})


Arms = Annotated[
    tuple[tuple[float, float], ...] | None,
    BeforeValidator(read_arms),
    PlainSerializer(lambda arms: arms and [list(arm) for arm in arms], when_used="json"),
]


Factors = Annotated[
    tuple[tuple[float, float], ...] | None,
    BeforeValidator(read_factors),
    PlainSerializer(lambda rows: rows and [list(row) for row in rows], when_used="json"),
]


class Wlf(Table):
    """log10 a_T = -C1 (T - reference) / (C2 + T - reference), C2 and the reference in K.

    Below `arrhenius_below` (K) the Arrhenius law with `activation_energy` (J/mol) applies.
    `measured` are the coldest and the warmest isotherm (K) that it comes from.
    """

    C1: Annotated[float, Quantity("", "0", "1000")]
    C2: Annotated[float, Quantity("K", "0.1 K", "10000 K")]
    reference: Annotated[float, TEMPERATURE]
    arrhenius_below: Annotated[float, TEMPERATURE] | None = None
    activation_energy: Annotated[float, Quantity("J/mol", "0.1 kJ/mol", "2000 kJ/mol")] | None = (
        None
    )
    measured: tuple[Annotated[float, TEMPERATURE], Annotated[float, TEMPERATURE]] | None = None

    @model_validator(mode="after")
    def _both_or_none(self) -> Self:
        if (self.arrhenius_below is None) != (self.activation_energy is None):
            given = "activation_energy" if self.arrhenius_below is None else "arrhenius_below"
            raise ValueError(
                f"rubber.wlf has {given} only; give arrhenius_below and activation_energy "
                "together, or none of them"
            )
        if self.arrhenius_below is not None and self.reference < self.arrhenius_below:
            raise ValueError(
                f"rubber.wlf.reference = {self.reference:g} K is colder than arrhenius_below = "
                f"{self.arrhenius_below:g} K; allowed: a reference where WLF holds, and a_T is 1"
            )
        return self

    @property
    def shift(self) -> Shift:
        """As a function of the temperature."""
        below, energy = self.arrhenius_below or 0.0, self.activation_energy or 0.0
        return Shift(self.C1, self.C2, self.reference, below, energy)
