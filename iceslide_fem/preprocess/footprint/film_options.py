"""Film options of the commands on footprints: keys of a scene, and the law that they make."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, model_validator
from pydantic_core import PydanticCustomError

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.film.shear_strength import shear_strength
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.scene_keys import OF_AGE, dropped
from iceslide_fem.preprocess.footprint.source_options import Length
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.command_options import (
    CommandOptions,
    Number,
    Part,
    given,
    option,
    scene_option,
)
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import CONTACT_TABLES
from iceslide_fem.scene.rules import Rule
from iceslide_fem.scene.units import Quantity

# A pixel passes below the rubber as a point of attached ice does.
POINT = {
    "name": "options",
    "model": "point",
    "load.pressure": 1e5,
    "load.speed": 1.0,
    "load.duration": 1e-3,
}
WORDS = {
    'film.voids = "carry"': "--water",
    "film.contact_age = true": "--contact-age",
    "film.contact_age = false": "contact that does not age",
}


def _with_contact(compound: str) -> str:
    if compound not in CONTACT_TABLES:
        allowed = ", ".join(f'"{name}"' for name in CONTACT_TABLES)
        raise PydanticCustomError(
            "form", f"has no published contact parameters; allowed: {allowed}"
        )
    return compound


class FilmOptions(CommandOptions):
    """Options of the film and the ice below it; SI units."""

    group = "The film and the ice below it"
    rules: ClassVar[Sequence[Rule]] = (
        Rule((given("contact"), given("contact_age")), "the scene has a table"),
    )  # fmt: skip
    parts: ClassVar[Sequence[Part]] = ((("lug",), "water on the ice", "water"),)

    temperature: float = scene_option("ice.temperature", text="Temperature of the ice.")
    compound: Annotated[str, AfterValidator(_with_contact)] = scene_option(
        "rubber.compound", metavar="NAME", default="B"
    )
    contact: InputFile | None = scene_option(
        "film.contact", metavar="CSV",
        text="Table of k, D and H_V over pressure, instead of the compound's, as it stands.",
    )  # fmt: skip
    contact_age: InputFile | None = option(
        None, "Whose contact ages: its k, D and H_V, instead of the compound's.", "SCENE"
    )
    ice_material: tuple[float, float, float] | None = scene_option(
        "ice.conductivity", "ice.density", "ice.heat_capacity", text="Of the ice.", default=None,
        metavar="K,RHO,C", shown="2.22,917.8,2020; below the film 2.25,916,2220",
    )  # fmt: skip
    melting_temperature: float = scene_option("ice.melting_temperature")
    latent_heat: float = scene_option("ice.latent_heat")
    water_speed: float | None = scene_option("film.water_speed")
    viscosity: float | Path = scene_option("water.viscosity")
    initial_height: float | Path = scene_option("film.initial_height")
    dry_stress: float | Path | None = scene_option("film.dry_stress")
    dry_softening: float | None = scene_option("film.dry_softening")
    dry_residual: float = scene_option("film.dry_residual")
    water: float | None = scene_option(
        "ice.water", default=None,
        text="That the ice brings: 20um; then full voids carry. 0um: they carry without.",
    )  # fmt: skip
    lug: Length | None = option(
        None, "That it flows out of, along the wheel.", shown="a block's, or the footprint's"
    )
    tolerance: Annotated[float, Quantity("", "1e-6", "0.1"), Number] = option(
        1e-2, "Relative error of the film's mu."
    )

    @model_validator(mode="after")
    def _has_a_law(self) -> Self:
        try:
            _ = self.law
        except SceneError as error:
            raise ValueError(str(error)) from None
        return self

    @cached_property
    def law(self) -> Scene:
        """The scene whose friction law, ice, water and rubber these are. Raises SceneError."""
        more: dict[str, Any] = {**POINT, "ice.temperature": max(self.temperatures)}
        if self.water is not None:
            more["film.voids"] = "carry"
        if self.contact_age is not None:
            aged = load_scene(self.contact_age)
            if contact_age(aged) is None:
                raise SceneError(
                    f"--contact-age {self.contact_age} is a scene whose contact does not age; give "
                    "one with film.contact_age = true"
                )
            tables = aged.as_dict()
            more |= {key: tables[table][name] for key in OF_AGE for table, name in [key.split(".")]}
        return self.as_scene(more, WORDS)

    @property
    def contact_of(self) -> ContactTable | ConstantContact:
        """k, D and H_V over pressure (Pa) on smooth ice: those of the law, or of --contact as its
        table stands.

        That table is taken as one of the tread's own rubber.
        """
        return self.law.contact_on_smooth_ice if self.contact is None else self.law.given_table

    @property
    def temperatures(self) -> Sequence[float]:
        """All temperatures (K) of the ice that are computed."""
        return (self.temperature,)

    @property
    def scene_notes(self) -> list[str]:
        """What is not taken of the scene of --contact-age, though it would change mu."""
        if self.contact_age is None:
            return []
        others = dropped(load_scene(self.contact_age), self.law)
        if not others:
            return []
        return [
            f"of --contact-age {self.contact_age} the rubber and its contact are taken; not taken, "
            f"and different in this scene: {', '.join(others)}"
        ]

    @property
    def rubs_without_melting(self) -> bool:
        """Whether there is dry friction, or water, on ice that does not melt."""
        return shear_strength(self.law) is not None or self.law.ice.is_wet

    @property
    def files(self) -> list[Path]:
        """All input files, with those of the scene."""
        return [*super().files, *self.law.files.values()]

    def lug_below(self, length: float) -> float:
        """Length (m) of the lug below which water flows out; length: of the footprint, m."""
        return self.lug or length

    def ride_at(self, speed: float, sliding_speed: float, length: float = np.inf) -> Ride:
        """The ride at `speed` and `sliding_speed` (m/s) below a footprint of this length (m)."""
        lug = self.lug_below(length)
        return Ride.of(self.law, speed, sliding_speed, self.temperature, lug)
