"""Film options of the commands on footprints: contact, ice, water, dry rubber."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Self

from pydantic import field_validator, model_validator

from iceslide_fem.film.contact_age import ContactAge, contact_age
from iceslide_fem.film.shear_strength import strength_of
from iceslide_fem.preprocess.footprint.option_values import (
    DryStressText,
    IceTemperature,
    Length,
    SolidText,
    ViscosityText,
)
from iceslide_fem.preprocess.footprint.ride import FIRST_HEIGHT, Ride, WetIce
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.command_options import CommandOptions, Number, option, option_name
from iceslide_fem.scene.contact_table import ContactTable, read_contact_table
from iceslide_fem.scene.dry_shear import (
    DRY_STRESS,
    RESIDUAL,
    SOFTENING,
    USUAL_RESIDUAL,
    DryShear,
)
from iceslide_fem.scene.ice import VISCOSITY, WARMEST, viscosity_table
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import CONTACT_TABLES, ICE, WATER_VISCOSITY, Solid
from iceslide_fem.scene.units import Quantity


class FilmOptions(CommandOptions):
    """Options of the film and the ice below it; SI units."""

    group = "The film and the ice below it"

    temperature: IceTemperature = option(269.15, "Temperature of the ice.")
    compound: str = option("B", "Rubber compound.", "NAME")
    contact: InputFile | None = option(
        None, "Table of k, D, H_V over pressure instead of the compound's.", "CSV"
    )
    contact_age: InputFile | None = option(
        None, "Whose contact ages: its k, D and H_V, instead of the compound's.", "SCENE"
    )
    ice_material: SolidText | None = option(
        None, "Of the ice, SI units.", "K,RHO,C", "2.22,917.8,2020; below the film 2.25,916,2220"
    )
    melting_temperature: Annotated[float, Quantity("K", "-60 degC", "0.01 degC"), Number] = option(
        ICE.melting_temperature, "Of the ice, as of salt.", "T"
    )
    latent_heat: Annotated[float, Quantity("J/kg", "1 kJ/kg", "10000 kJ/kg"), Number] = option(
        ICE.latent_heat, "Of melting.", shown="330kJ/kg"
    )
    water_speed: Annotated[float, Quantity("", "0", "1"), Number] = option(
        1.0, "Of squeezed-out water on the rubber, over that of the ice."
    )
    viscosity: ViscosityText = option(
        WATER_VISCOSITY, "Of the film's water; or a CSV file of it over temperature.",
        "PA*S", "1.8mPa*s",
    )  # fmt: skip
    initial_height: Annotated[float, Quantity("m", "0 nm", "10 um"), Number] = option(
        FIRST_HEIGHT, "Of the film at first."
    )
    dry_stress: DryStressText | None = option(
        None, "Of dry rubber on ice, the film's limit; or a CSV file over temperature.", "PA"
    )
    dry_softening: Annotated[float, SOFTENING, Number] | None = option(
        None, "Over which a number of it falls."
    )
    dry_residual: Annotated[float, RESIDUAL, Number] = option(
        USUAL_RESIDUAL, "Above melting where it is 0."
    )
    water: Annotated[float, Quantity("m", "0 um", "5 mm"), Number] | None = option(
        None, "That the ice brings: 20um; then full voids carry. 0um: they carry without."
    )
    lug: Length | None = option(
        None, "That it flows out of, along the wheel.", shown="a block's, or the footprint's"
    )
    tolerance: Annotated[float, Quantity("", "1e-6", "0.1"), Number] = option(
        1e-2, "Relative error of the film's mu."
    )

    @model_validator(mode="after")
    def _is_frozen(self) -> Self:
        if self.temperature > self.melting_temperature - WARMEST + 1e-9:
            raise ValueError(
                f"--temperature {self.temperature - ZERO_CELSIUS:.6g} degC is not below "
                f"--melting-temperature {self.melting_temperature - ZERO_CELSIUS:.6g} degC"
            )
        return self

    @field_validator("compound")
    @classmethod
    def _has_contact_parameters(cls, compound: str) -> str:
        if compound not in CONTACT_TABLES:
            allowed = ", ".join(f'"{name}"' for name in CONTACT_TABLES)
            raise ValueError(
                f'--compound "{compound}" has no published contact parameters; allowed: {allowed}'
            )
        return compound

    @field_validator("contact")
    @classmethod
    def _is_a_table(cls, contact: Path | None) -> Path | None:
        if contact is not None:
            read_contact_table(contact, "--contact")
        return contact

    @model_validator(mode="after")
    def _contact_may_age(self) -> Self:
        if self.contact_age is None:
            return self
        if self.contact is not None:
            raise ValueError(
                "--contact and --contact-age contradict each other: the scene has a table; give "
                "one of them"
            )
        if contact_age(load_scene(self.contact_age)) is None:
            raise ValueError(
                f"--contact-age {self.contact_age} is a scene whose contact does not age; give "
                "one with film.contact_age = true"
            )
        return self

    @model_validator(mode="after")
    def _dry_shear_is_whole(self) -> Self:
        self.dry_shear.check(self.initial_height, option_name)
        if self.dry_stress is not None and isinstance(self.viscosity, Path):
            raise ValueError(
                f"--dry-stress and --viscosity {self.viscosity} contradict each other; allowed: "
                "one viscosity"
            )
        return self

    @model_validator(mode="after")
    def _voids_can_carry(self) -> Self:
        if self.water is None:
            if self.lug is not None:
                raise ValueError("--lug is what water on the ice flows out of; give --water, too")
            return self
        for other, there, allowed in (
            ("--contact-age", self.contact_age is not None, "contact that does not age"),
            ("--dry-stress", self.dry_stress is not None, "no dry shear"),
            (f"--viscosity {self.viscosity}", isinstance(self.viscosity, Path), "one viscosity"),
            ("--water-speed below 1", self.water_speed < 1.0, "water that stays with the ice"),
        ):
            if there:
                raise ValueError(
                    f"--water and {other} contradict each other: the water in the voids and the "
                    f"contact are found together; allowed: {allowed}"
                )
        return self

    def lug_below(self, length: float) -> float:
        """Length (m) of the lug below which water flows out; length: of the footprint, m."""
        return self.lug or length

    def wet_ice(self, length: float) -> WetIce | None:
        """Water on the ice before a footprint of `length` (m); None if voids do not bear load."""
        return None if self.water is None else WetIce(self.water, self.lug_below(length))

    @property
    def water_viscosity(self) -> float | Curve:
        """The film's viscosity (Pa s), or the file's over temperature."""
        if not isinstance(self.viscosity, Path):
            return self.viscosity
        table = viscosity_table(VISCOSITY.validate(str(self.viscosity)), "--viscosity")
        assert table is not None  # checked by the validator
        return table

    @property
    def dry_shear(self) -> DryShear:
        """Dry rubber on ice, with the stress as a number or rows of the file."""
        given = self.dry_stress
        stress = DRY_STRESS.validate(str(given)) if isinstance(given, Path) else given
        return DryShear(stress, self.dry_softening, self.dry_residual)

    @cached_property
    def aged_scene(self) -> Scene | None:
        """The scene with contact age."""
        return None if self.contact_age is None else load_scene(self.contact_age)

    @property
    def age(self) -> ContactAge | None:
        """The ageing contact on passing ice, without holding the largest contact."""
        age = None if self.aged_scene is None else contact_age(self.aged_scene)
        return age and replace(age, holds=False)

    def ride_at(self, speed: float, sliding_speed: float) -> Ride:
        """The ride on ice without water, at `speed` and `sliding_speed` (m/s)."""
        return Ride(
            speed,
            sliding_speed,
            self.temperature,
            self.initial_height,
            ICE._replace(
                **dict(zip(Solid._fields, self.ice_material or (), strict=False)),
                melting_temperature=self.melting_temperature,
                latent_heat=self.latent_heat,
            ),
            self.water_viscosity,
            self.water_speed,
            strength_of(self.dry_shear, self.melting_temperature),
            self.age,
        )

    @property
    def contact_table(self) -> ContactTable:
        """k, D and H_V over pressure, from a file or a scene, else from the compound."""
        if self.aged_scene is not None:
            return self.aged_scene.touching_table
        if self.contact is not None:
            return read_contact_table(self.contact, "--contact")
        return CONTACT_TABLES[self.compound]
