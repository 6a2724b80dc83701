"""Input of `iceslide roughness`, validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.relaxation_options import (
    TEMPERATURE,
    read_prony,
    read_wlf,
    several,
)
from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene.command_options import (
    CommandOptions,
    Number,
    as_number,
    option_name,
    option_names,
)
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import YOUNGS_MODULUS
from iceslide_fem.scene.ranges import read_range
from iceslide_fem.scene.units import Quantity

# Shortest wave on two pixels of 17.5 um, the source's mesh, as in the published table.
SOURCE_WAVE = 35e-6
PIXELS_PER_WAVE = 4.0


def _unit(value: Any) -> Any:
    """Metres in one "um"."""
    try:
        return to_si(f"1 {value}", "m") if isinstance(value, str) else value
    except ValueError:
        raise ValueError(
            f'--height-unit "{value}" is not a unit of length; allowed: m, mm, um, nm'
        ) from None


def _pressures(value: Any) -> Any:
    """Pressures (Pa) in equal ratios, from "first:last:count"."""
    if not isinstance(value, str):
        return value
    said = f'--pressures "{value}"'
    allowed = Quantity("Pa", "0.001 bar", "100 bar")
    try:
        *ends, count = read_range(value)
        first, last = (allowed.in_range(as_number(end)) for end in ends)
    except ValueError as error:
        raise ValueError(f"{said} {error}; allowed: as in 0.2bar:20bar:12") from None
    if not (first < last and 2 <= count <= 200):
        raise ValueError(f"{said} is not rising, with 2 to 200 pressures, as in 0.2bar:20bar:12")
    return tuple(float(f"{p:.6g}") for p in np.geomspace(first, last, count))


_ages = several("--age", Quantity("s", "0 s", "1e9 s"), "1ms,5ms")
Length = Annotated[float, Quantity("m", "1 nm", "10 mm"), Number]


class RoughnessCase(CommandOptions):
    """A surface, the rubber under it, and how it is pressed; SI units.

    surface: a height map, or a `surface.toml` that generates `realisations` of a surface. pixel,
    height_unit: of a map without them, m. compound, modulus (Young's, Pa, incompressible) or scene:
    the rubber. shortest_wave: shorter waves of the surface are removed, m. ages: times after
    loading, s, ascending; prony: arms or their file; modulus_is: kind of the modulus; wlf: C1, C2
    and reference of the arms' times; temperature: K.
    """

    model_config = ConfigDict(alias_generator=option_names("surface"))

    surface: Path
    pixel: Length | None = None
    height_unit: Annotated[float, BeforeValidator(_unit)] | None = None
    compound: str | None = None
    modulus: Annotated[float, Quantity("Pa", "1 kPa", "100 GPa"), Number] | None = None
    scene: InputFile | None = None
    pressures: Annotated[tuple[float, ...], BeforeValidator(_pressures)] = _pressures(
        "0.2bar:20bar:12"
    )
    realisations: Annotated[int, Field(ge=1, le=1000)] = 8
    definition: Definition = "hydrodynamic"
    ages: Annotated[tuple[float, ...], _ages, Field(alias="--age")] = ()
    prony: Annotated[Path | tuple[tuple[float, float], ...] | None, BeforeValidator(read_prony)] = (
        None
    )
    modulus_is: Literal["instantaneous", "long-term"] | None = None
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(read_wlf)] = None
    temperature: Annotated[float, TEMPERATURE, Number] | None = None
    shortest_wave: Length | None = None

    @model_validator(mode="after")
    def _one_rubber(self) -> Self:
        given = [name for name in ("compound", "modulus", "scene") if getattr(self, name)]
        if len(given) > 1:
            raise ValueError(
                f"{option_name(given[0])} and {option_name(given[1])} contradict each other; "
                "give one of them"
            )
        if self.compound is not None and self.compound not in YOUNGS_MODULUS:
            allowed = ", ".join(f'"{name}"' for name in YOUNGS_MODULUS)
            raise ValueError(f'--compound "{self.compound}" is not known; allowed: {allowed}')
        return self

    @model_validator(mode="after")
    def _age_is_whole(self) -> Self:
        if not self.ages:
            for name in ("prony", "modulus_is", "wlf", "temperature"):
                if getattr(self, name) is not None:
                    raise ValueError(f"{option_name(name)} has no meaning without --age")
        elif self.prony is None and self.scene is None:
            raise ValueError(
                "--age asks for rubber that relaxes; give --prony, or a --scene whose rubber does"
            )
        elif self.prony is None and self.modulus_is is not None:
            raise ValueError("--modulus-is has no meaning without --prony: the scene says it")
        elif self.prony is not None and self.modulus_is is None:
            raise ValueError(
                "--modulus-is is missing: --prony does not say which modulus the rubber's is; "
                "allowed: instantaneous, long-term"
            )
        return self

    @property
    def rising_ages(self) -> tuple[float, ...]:
        """The ages, sorted, without duplicates."""
        return tuple(sorted(set(self.ages)))
