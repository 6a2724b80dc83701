"""What `iceslide roughness` is asked for: validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.command_options import (
    CommandOptions,
    Number,
    as_number,
    option_name,
    option_names,
)
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import YOUNGS_MODULUS
from iceslide_fem.scene.units import Quantity

# What two pixels of 17.5 um, the source's mesh, can show: the published table is of such waves.
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
    form = f'--pressures "{value}" is not of the form 0.2bar:20bar:12'
    allowed = Quantity("Pa", "0.001 bar", "100 bar")
    parts = value.split(":")
    if len(parts) != 3:
        raise ValueError(form)
    try:
        first, last = (allowed.in_range(as_number(part)) for part in parts[:2])
        count = int(parts[2])
    except ValueError as error:
        raise ValueError(f"{form}: {error} (0.001 bar to 100 bar)") from None
    if not (first < last and 2 <= count <= 200):
        raise ValueError(f"{form}: rising, with 2 to 200 pressures")
    return tuple(float(f"{p:.6g}") for p in np.geomspace(first, last, count))


Length = Annotated[float, Quantity("m", "1 nm", "10 mm"), Number]


class RoughnessCase(CommandOptions):
    """A surface, the rubber under it, and how it is pressed; SI units.

    surface: a height map, or a `surface.toml` that generates `realisations` of one. pixel,
    height_unit (m): of a map that does not say. compound, modulus (Young's, Pa, incompressible)
    or scene: the rubber. shortest_wave: shorter waves of the surface are removed, m.
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

    @property
    def rubber(self) -> tuple[str, float]:
        """What the rubber is called, and its E* = E / (1 - nu^2), Pa; incompressible by default.

        Raises SceneError if the scene cannot be read.
        """
        if self.modulus is not None:
            return f"E = {self.modulus / 1e6:.4g} MPa", self.modulus / 0.75
        compound = self.compound or "B"
        if self.scene is not None:
            scene = load_scene(self.scene)
            if scene.rubber.compound is None:
                rubber = scene.mooney_rivlin
                modulus = rubber.youngs_modulus / (1.0 - rubber.poissons_ratio**2)
                return f"the rubber of {self.scene}", modulus
            compound = scene.rubber.compound
        return f"compound {compound}", YOUNGS_MODULUS[compound] / 0.75
