"""The ice of a scene, and its melt water."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import field_validator, model_validator

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import (
    BOTTOMLESS,
    ICE,
    WATER_CONDUCTIVITY,
    WATER_VISCOSITY,
    Ground,
    Layer,
    Solid,
)
from iceslide_fem.scene.roughness import IceRoughness
from iceslide_fem.scene.rows import RowsOf, check_falls
from iceslide_fem.scene.units import Name, Quantity, Table, key

WARMEST = 1e-3  # K below its melting temperature
VISCOSITY = RowsOf(
    "water temperature",
    Quantity("K", "-80 degC", "100 degC"),
    Quantity("Pa*s", "0.01 mPa*s", "10 Pa*s"),
    "0.01 mPa*s",
)
ICE_TEMPERATURE = Quantity("K", "-80 degC", "0.01 degC")
WATER = RowsOf(
    "place along x", Quantity("m", "-10 m", "100 m"), Quantity("m", "0 um", "5 mm"), "0 um"
)
CONDUCTIVITY = RowsOf(
    "ice temperature",
    ICE_TEMPERATURE,
    Quantity("W/m/K", "0.01 W/m/K", "100 W/m/K"),
    "0.01 W/m/K",
)
HEAT_CAPACITY = RowsOf(
    "ice temperature",
    ICE_TEMPERATURE,
    Quantity("J/kg/K", "100 J/kg/K", "10000 J/kg/K"),
    "100 J/kg/K",
)


REGION = "ice"  # name of the ice region of a mesh


class GroundLayer(Table):
    """A layer below the ice: name, conductivity, density, heat capacity, and thickness.

    Units are W/(m K), kg/m3, J/(kg K) and m. A user's mesh has the thickness itself.
    """

    name: Name | None = None
    thickness: Annotated[float, Quantity("m", "1 um", "1 m")] | None = None
    conductivity: Annotated[float, Quantity("W/m/K", "0.001 W/m/K", "3000 W/m/K")]
    density: Annotated[float, Quantity("kg/m^3", "1 kg/m^3", "25000 kg/m^3")]
    heat_capacity: Annotated[float, Quantity("J/kg/K", "10 J/kg/K", "10000 J/kg/K")]

    @property
    def as_layer(self) -> Layer:
        """The layer with its thermal properties. Name and (without a mesh) thickness are given."""
        assert self.name is not None  # by `scene.ground`
        solid = Solid(self.conductivity, self.density, self.heat_capacity)
        return Layer(self.name, self.thickness or 0.0, solid)


class Ice(Table):
    """The ice, its motion under the rubber, and what lies below it; SI units.

    Defaults are those of the thesis's film model (its table 4).
    """

    temperature: Annotated[float, Quantity("K", "-80 degC", "-0.001 degC")] = key(
        269.15, "Temperature of all ice at the start."
    )
    margin: Annotated[float, Quantity("m", "0 m", "1 m")] = key(
        0.0, "Width of the cold ice beside the contact, for `continuum` and `mesh` ice."
    )
    cell: Annotated[float, Quantity("m", "0.1 um", "10 mm")] | None = key(
        None,
        "Length of the cells of sliding ice along x. Without it 1/100 of the block's length, "
        "divided by `numerics.refinement`.",
    )
    trail: Annotated[float, Quantity("m", "0 m", "1 m")] = key(
        0.0, "Length of the sliding ice that is kept behind the block."
    )
    motion: Literal["attached", "sliding"] = key(
        "attached",
        "`attached`: the same ice stays below the rubber. `sliding`: fresh ice passes below it.",
    )
    heat: Literal["half-space", "column", "continuum", "mesh"] = key(
        "column",
        "Model of heat conduction in the ice: below each point (`column`), in all directions "
        "(`continuum`, `mesh`), or by the closed form of the thesis (`half-space`).",
    )
    depth: Annotated[float, Quantity("m", "10 um", "1 m")] | None = key(
        None,
        "Thickness of the ice, for `column` and `mesh`. Without it the ice is as deep as heat "
        "reaches.",
    )
    base: Literal["insulated", "held"] = key(
        "insulated",
        "Lowest face of the ice or of its layers: no heat leaves it (`insulated`), or its "
        "temperature is held (`held`). `held` needs `ice.depth` or `ice.mesh`.",
    )
    base_temperature: Annotated[float, Quantity("K", "-80 degC", "30 degC")] | None = key(
        None,
        "Temperature of a held base from t = 0 on, below `ice.melting_temperature`. Without it "
        "`ice.temperature`.",
    )
    layers: tuple[GroundLayer, ...] = key((), "Layers of other materials below the ice, downwards.")
    mesh: InputFile | None = key(
        None,
        'Path of a mesh of your own of the ice and its layers, for `ice.heat = "mesh"`; '
        "relative to the scene file. Not for a point.",
    )
    mesh_unit: Literal["m", "cm", "mm", "um", "inch"] = key(
        "m", "Unit of the coordinates of `ice.mesh`."
    )
    conductivity: Annotated[Any, CONDUCTIVITY] = key(
        ICE.conductivity,
        "Heat conductivity of the ice. With `mesh` also rows over its temperature.",
    )
    density: Annotated[float, Quantity("kg/m^3", "10 kg/m^3", "10000 kg/m^3")] = key(
        ICE.density, "Density of the ice."
    )
    heat_capacity: Annotated[Any, HEAT_CAPACITY] = key(
        ICE.heat_capacity, "Heat capacity of the ice. With `mesh` also rows over its temperature."
    )
    melting_temperature: Annotated[float, Quantity("K", "-60 degC", "0.01 degC")] = key(
        ICE.melting_temperature,
        "Melting temperature. Salt and pressure lower it. It is at least 0.001 K above "
        "`ice.temperature`.",
    )
    latent_heat: Annotated[float, Quantity("J/kg", "1 kJ/kg", "10000 kJ/kg")] = key(
        ICE.latent_heat, "Latent heat of melting."
    )
    water: Annotated[Any, WATER] = key(
        0.0,
        'Height of the water on the ice at first, with `film.voids = "carry"`. Or rows `[x, '
        "water]`: x is a place on the ice from -10 m to 100 m, and 0 is below the middle of the"
        " block at the start. Water that melts or freezes is counted with the density of ice.",
    )

    roughness: IceRoughness = IceRoughness()

    @model_validator(mode="after")
    def _is_frozen(self) -> Self:
        highest = self.melting_temperature - WARMEST
        if self.temperature > highest + 1e-9:
            raise ValueError(
                f"ice.temperature = {self.temperature - ZERO_CELSIUS:.6g} degC is not below "
                f"ice.melting_temperature = {self.melting_temperature - ZERO_CELSIUS:.6g} degC; "
                f"allowed: up to {highest - ZERO_CELSIUS:.6g} degC"
            )
        return self

    @property
    def solid(self) -> Solid:
        """Thermal properties of the ice at its initial temperature."""
        return Solid(
            *(float(Curve.of(getattr(self, name))(self.temperature)) for name in Solid._fields)
        )

    @property
    def stack(self) -> tuple[Layer, ...]:
        """The ice and the layers below it, downwards; without a depth the ice is infinite."""
        own = Layer("ice", np.inf if self.depth is None else self.depth, self.solid)
        return (own, *(layer.as_layer for layer in self.layers))

    @property
    def held(self) -> float | None:
        """Temperature (K) of a held base, None for an insulated one."""
        if self.base == "insulated":
            return None
        return self.temperature if self.base_temperature is None else self.base_temperature

    @property
    def ground(self) -> Ground:
        """The ground below a column of ice; unknown for a user's mesh."""
        if self.is_half_space or self.mesh is not None:
            return BOTTOMLESS
        ice, *below = self.stack
        return Ground(ice.thickness, tuple(below), self.held)

    @property
    def is_wet(self) -> bool:
        """Whether there is water on the ice."""
        return self.water_has_rows or self.water > 0.0

    @property
    def water_has_rows(self) -> bool:
        """Whether the height of the water depends on the place."""
        return isinstance(self.water, tuple)

    def water_at(self, x: Array) -> Array:
        """Water (m) at positions `x` (m) on the ice, any shape; constant beyond the rows."""
        return Curve.of(self.water)(x)

    @property
    def is_half_space(self) -> bool:
        """Whether the ice is a half-space, without depth, layers or base."""
        return self.depth is None and self.mesh is None

    @property
    def has_rows(self) -> bool:
        """Whether a property depends on temperature."""
        return isinstance(self.conductivity, tuple) or isinstance(self.heat_capacity, tuple)


class Water(Table):
    """The water of the film; SI units. `table` has rows of the viscosity."""

    viscosity: Annotated[Any, VISCOSITY] = key(
        WATER_VISCOSITY,
        "Viscosity of the film. A number, or rows over the temperature of the film (or the path "
        "of a CSV file of them). Values must not rise with temperature. Between rows it is "
        "linear, outside it is constant.",
    )
    conductivity: Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "100 W/m/K")] = key(
        WATER_CONDUCTIVITY, "Heat conductivity of the film. For `rubber.heat`."
    )

    @field_validator("viscosity")
    @classmethod
    def _thins(cls, viscosity: Any) -> Any:
        """`viscosity` unchanged. Raises ValueError if it rises with temperature."""
        if isinstance(viscosity, tuple):
            why = "water gets thinner as it gets warmer; allowed: viscosities"
            check_falls(viscosity, "water.viscosity", why)
        return viscosity

    @property
    def table(self) -> Curve | None:
        """Viscosity over the film's temperature; None for a constant."""
        return Curve.of(self.viscosity) if isinstance(self.viscosity, tuple) else None
