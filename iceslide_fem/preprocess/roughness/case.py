"""Input of `iceslide roughness`, validated like a scene, by the names of its options."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.option_values import (
    TEMPERATURE,
    Several,
    in_equal_ratios,
    read_prony,
    read_wlf,
    rubber_in,
)
from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.relaxation.prony import Prony, Relaxation
from iceslide_fem.relaxation.shift import AnyShift, NoShift, Shift
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS, to_si
from iceslide_fem.scene import Rubber
from iceslide_fem.scene.command_options import (
    CommandOptions,
    Number,
    as_number,
    given,
    option,
    option_names,
)
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import YOUNGS_MODULUS
from iceslide_fem.scene.rules import Rule
from iceslide_fem.scene.units import Quantity

# Shortest wave on two pixels of 17.5 um, the source's mesh, as in the published table.
SOURCE_WAVE = 35e-6
PIXELS_PER_WAVE = 4.0


def _unit(value: Any) -> Any:
    """Metres in one "um"."""
    try:
        number = as_number(value)
        return to_si(f"1 {value}", "m") if isinstance(number, str) else number
    except ValueError:
        raise ValueError(
            f'--height-unit "{value}" is not a unit of length; allowed: m, mm, um, nm'
        ) from None


PRESSURES = "0.2bar:20bar:12"
_several = Several(
    "--pressures", Quantity("Pa", "0.001 bar", "100 bar"), PRESSURES, 2, 200, in_equal_ratios
)


def _pressures(value: Any) -> Any:
    """Pressures (Pa) of a range, or of a list with commas."""
    found = _several(value)
    if list(found) != sorted(set(found)):
        raise ValueError(f'--pressures "{value}" is not rising; allowed: as in {PRESSURES}')
    return found


AGES = Several("--age", Quantity("s", "0 s", "1e9 s"), "1ms,5ms")
Length = Annotated[float, Quantity("m", "1 nm", "10 mm"), Number]


class RoughnessCase(CommandOptions):
    """A surface, the rubber under it, and how it is pressed; SI units."""

    model_config = ConfigDict(alias_generator=option_names("surface"))
    rules = tuple(
        Rule((given(one), given(other)))
        for one, other in combinations(("compound", "modulus", "scene"), 2)
    )
    parts = (
        (("prony", "modulus_is", "wlf", "temperature"), "rubber that relaxes", "ages"),
        (("modulus_is",), "arms that are given", "prony"),
    )

    surface: Path = option(
        ...,
        "Height map of the rubber (.npy, text, .x3p, instruments' formats), or a surface.toml that "
        "generates one.",
        "SURFACE",
    )
    compound: Literal["A", "B", "C"] | None = option(None, "Rubber.", shown="B")
    modulus: Annotated[float, Quantity("Pa", "1 kPa", "100 GPa"), Number] | None = option(
        None, "Rubber: Young's modulus, 1.6MPa; incompressible."
    )
    scene: InputFile | None = option(None, "Rubber: that of a scene.", "TOML")
    pressures: Annotated[tuple[float, ...], BeforeValidator(_pressures)] = option(
        _pressures(PRESSURES), "First, last, count, in equal ratios; or P,P,...",
        "P:P:N", PRESSURES,
    )  # fmt: skip
    realisations: Annotated[int, Field(ge=1, le=1000)] = option(8, "Of a generated surface.")
    definition: Definition = option("hydrodynamic", "Of k and D.")
    shortest_wave: Length | None = option(
        None, "Remove shorter waves.", shown="35um for a map, with hydrodynamic"
    )
    ages: Annotated[tuple[float, ...], BeforeValidator(AGES)] = option(
        (), "After loading, of rubber that relaxes: 1ms,5ms; a table each.", "S,...", alias="--age"
    )
    prony: Annotated[Path | tuple[tuple[float, float], ...] | None, BeforeValidator(read_prony)] = (
        option(None, "Arms, 0.3:5ms,0.2:1ms, or a rubber.toml or scene with them.", "G:TAU,...")
    )
    modulus_is: Literal["instantaneous", "long-term"] | None = option(
        None, "The rubber's, with --prony."
    )
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(read_wlf)] = option(
        None, "Shift of the arms' times: 7.4,121.6,20degC.", "C1,C2,T"
    )
    temperature: Annotated[float, TEMPERATURE, Number] | None = option(
        None, "Of the rubber, for that shift: -4degC."
    )
    pixel: Length | None = option(None, "Pixel of a map that does not say: 17.5um.")
    height_unit: Annotated[float, BeforeValidator(_unit)] | None = option(
        None, "Of lengths that do not say: um.", "UNIT", "m"
    )

    @model_validator(mode="after")
    def _age_is_whole(self) -> Self:
        if self.ages and self.prony is None and self.scene is None:
            raise ValueError(
                "--age asks for rubber that relaxes; give --prony, or a --scene whose rubber does"
            )
        if self.prony is not None and self.modulus_is is None:
            raise ValueError(
                "--modulus-is is missing: --prony does not say which modulus the rubber's is; "
                "allowed: instantaneous, long-term"
            )
        return self

    @property
    def source(self) -> Path:
        """The file of the surface."""
        return self.surface

    @property
    def rising_ages(self) -> tuple[float, ...]:
        """The ages, sorted, without duplicates."""
        return tuple(sorted(set(self.ages)))


class Material(NamedTuple):
    """name: for output; modulus: E* = E / (1 - nu^2), Pa, instantaneous if viscoelastic.

    prony: None for elastic rubber; stretched: a_T at the requested temperature.
    """

    name: str
    modulus: float
    prony: Prony | None = None
    stretched: float = 1.0


def material(case: RoughnessCase) -> Material:
    """The rubber of a case. Raises SceneError, one sentence."""
    rubber = None if case.scene is None else rubber_in(case.scene)
    name, modulus = _elastic(case, rubber)
    if not case.ages:
        return Material(name, modulus)
    relaxation = _relaxation(case, rubber)
    if case.prony is not None and case.modulus_is == "long-term":
        modulus /= relaxation.prony.long_term
    return Material(name, modulus, relaxation.prony, _stretched(case, relaxation.shift))


def _elastic(case: RoughnessCase, rubber: Rubber | None) -> tuple[str, float]:
    """Name and E* (Pa), incompressible by default; instantaneous for a scene with a series."""
    if case.modulus is not None:
        return f"E = {case.modulus / 1e6:.4g} MPa", case.modulus / 0.75
    compound: str = case.compound or "B"
    if rubber is not None:
        if rubber.compound is None:
            elastic = rubber.constants()
            modulus = elastic.youngs_modulus / (1.0 - elastic.poissons_ratio**2)
            return f"the rubber of {case.scene}", modulus
        compound = rubber.compound
    stiffer = 1.0
    if rubber is not None and rubber.modulus_is == "long-term":
        assert rubber.relaxation is not None  # by its validation
        stiffer = 1.0 / rubber.relaxation.prony.long_term
    return f"compound {compound}", stiffer * YOUNGS_MODULUS[compound] / 0.75


def _relaxation(case: RoughnessCase, rubber: Rubber | None) -> Relaxation:
    """Arms and shift, from --prony or from the scene."""
    shift: AnyShift = NoShift() if case.wlf is None else Shift(*case.wlf)
    if isinstance(case.prony, tuple):
        return Relaxation(Prony(*zip(*case.prony, strict=True)), shift)
    if case.prony is not None:
        found, said = rubber_in(case.prony).relaxation, str(case.prony)
    else:
        assert rubber is not None  # by the case's validation
        found, said = rubber.relaxation, str(case.scene)
    if found is None:
        raise SceneError(f"the rubber of {said} is elastic, and --age asks for one that relaxes")
    return found if case.wlf is None else Relaxation(found.prony, shift)


def _stretched(case: RoughnessCase, shift: AnyShift) -> float:
    """a_T at the given temperature. Raises SceneError if it is missing or has no effect."""
    if isinstance(shift, NoShift):
        if case.temperature is not None:
            raise SceneError(
                "--temperature has no meaning for times that do not shift with it; leave it out, "
                "or give --wlf"
            )
        return 1.0
    if case.temperature is None:
        raise SceneError("--temperature is missing: the times of this rubber shift with it")
    factor = float(shift(case.temperature))
    if not np.isfinite(factor):
        raise SceneError(
            f"the WLF shift has no value at --temperature {case.temperature - ZERO_CELSIUS:.4g} "
            "degC; allowed: a warmer one"
        )
    return factor
