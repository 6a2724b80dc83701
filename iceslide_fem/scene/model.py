"""A complete scene: its tables, and derived quantities.

Numbers are SI (temperatures in kelvin); a file may give strings with a unit instead ("1 bar").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import ValidationError, model_validator

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable, read_contact_table
from iceslide_fem.scene.fields import html_table
from iceslide_fem.scene.materials import (
    BAR,
    CONTACT_TABLES,
    YOUNGS_MODULUS,
    MooneyRivlin,
)
from iceslide_fem.scene.messages import dotted_keys, first_sentence
from iceslide_fem.scene.nested import change
from iceslide_fem.scene.tables import Tables, check_contradictions

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from iceslide_fem.surfaces.combined_contact import Change, CombinedContact

FILE_KEYS = (
    ("rubber", "mesh"),
    ("rubber", "step"),
    ("rubber", "outline"),
    ("rubber", "dma"),
    ("ice", "mesh"),
    ("ice.roughness", "map"),
    ("rubber.roughness", "map"),
    ("film", "contact"),
    ("friction", "table"),
)  # table and key of file names

COUETTE = 0.5  # mean speed of water between rubber and ice at rest, over the sliding speed


class Scene(Tables):
    """A complete scene: its tables without contradiction, and what follows from them."""

    @model_validator(mode="after")
    def _no_contradiction(self) -> Self:
        check_contradictions(self)
        if self.model != "point":
            for compound in self.rubber.compounds.values():
                compound.check_bulk()
        return self

    @property
    def ages_in_warm_rubber(self) -> bool:
        """Whether k, D and H_V follow an age that depends on a changing temperature."""
        return self.film.contact_age and bool(self.rubber.heat)

    @property
    def several_passes(self) -> bool:
        """Whether rubber slides over the same ice more than once."""
        return self.load.passes > 1 or self.rubber.rows > 1

    @property
    def initial_height(self) -> float:
        """h0 (m) on ice of the scene's temperature."""
        return float(self.height_on(self.ice.temperature))

    def height_on(self, temperature: ArrayLike) -> Array:
        """h0 (m) on ice of `temperature` (K), any shape; rows are linear, constant outside."""
        return Curve.of(self.film.initial_height)(temperature)

    @property
    def viscosity(self) -> float:
        """Initial viscosity of the film's water, at the ice's initial temperature, Pa s."""
        table = self.water.table
        return self.water.viscosity if table is None else float(table(self.ice.temperature))

    @property
    def refreeze(self) -> Literal["nothing", "film", "all", "area"]:
        """Which water freezes: `film.refreeze`, or its default."""
        if self.film.refreeze is not None:
            return self.film.refreeze
        with_ice = self.film.carrier == "ice" or self.ice.motion == "attached"
        return "area" if self.ice.is_wet and with_ice else "nothing"

    @property
    def between(self) -> Literal["drain", "nothing", "film", "all"]:
        """Which water freezes between passes, or that all of it is gone.

        Water that stays freezes as far as the rest lets it, unless `film.refreeze` says less.
        Between rows of blocks it stays.
        """
        asked = "keep" if self.rubber.rows > 1 else self.film.between
        if asked == "drain":
            return "drain"
        kept = self.film.refreeze if asked == "keep" else "all"
        return kept if kept == "nothing" or kept == "film" else "all"

    @property
    def water_speed(self) -> float:
        """Speed of water relative to the rubber over the sliding speed: given, or its default."""
        if self.film.water_speed is not None:
            return self.film.water_speed
        if self.film.voids != "carry":
            return 1.0
        change = self.change_by_ice
        if change is None:
            return COUETTE
        # Water in valleys of the ice passes with the ice.
        held = self.touching_table(self.load.pressures.mean).H_V + change.gap
        return COUETTE + (1.0 - COUETTE) * float(change.gap / held)

    @property
    def mooney_rivlin(self) -> MooneyRivlin:
        """Constants of the rubber that touches the ice (SI), of the compound or as given.

        For viscoelastic rubber C10 and C01 are instantaneous.
        """
        return self.rubber.constants()

    @property
    def long_term(self) -> MooneyRivlin:
        """The same, but C10 and C01 of viscoelastic rubber are long-term."""
        return self.rubber.constants("long-term")

    @property
    def softest(self) -> MooneyRivlin:
        """Constants of the softest rubber, that at the ice or a layer."""
        every = (compound.constants() for compound in self.rubber.compounds.values())
        return min(every, key=lambda constants: constants.shear_modulus)

    @property
    def contact_modulus(self) -> float:
        """Young's modulus (Pa) of the rubber in contact with the ice, 3 G.

        With `film.contact_age` it is that of fresh contact, instantaneous. Without an age contact
        is old, and the modulus long-term; a compound has the one that is published.
        """
        if self.film.contact_age:
            return 3.0 * self.mooney_rivlin.shear_modulus
        if self.rubber.compound is not None:
            return YOUNGS_MODULUS[self.rubber.compound]
        return 3.0 * self.long_term.shear_modulus

    @property
    def contact_parameters(self) -> ContactTable | ConstantContact:
        """k, D and H_V over pressure (Pa) at the load's speed, on rough ice if both are rough.

        Only the film law needs them; other laws may have none.
        """
        smooth, change = self.contact_on_smooth_ice, self.change_by_ice
        return smooth if change is None else smooth.on_rough_ice(change)

    @property
    def contact_on_smooth_ice(self) -> ContactTable | ConstantContact:
        """k, D and H_V over pressure (Pa): the film's constants, or those of `touching_table`."""
        film = self.film
        if film.k is not None and film.D is not None and film.H_V is not None:
            return ConstantContact(film.k, film.D, film.H_V).scaled(*film.contact_scales)
        return self.touching_table

    @property
    def contact_table(self) -> ContactTable:
        """`touching_table`, on rough ice if both are rough."""
        table, change = self.touching_table, self.change_by_ice
        return table if change is None else table.on_rough_ice(change)

    @property
    def rough_contact(self) -> CombinedContact | None:
        """What rough ice changes in the contact; None if ice or rubber is smooth.

        The rubber's own waves have its long-term modulus, or that at the end of the load if the
        contact ages.
        """
        own, ice, relaxation = self.rubber.roughness, self.ice.roughness, self.rubber.relaxation
        if not (own.is_rough and ice.is_rough) or relaxation is None:
            return None
        from iceslide_fem.surfaces.combined_contact import combined_contact  # takes long to import

        assert own.spectrum is not None and ice.spectrum is not None
        instantaneous, kelvin = 3.0 * self.mooney_rivlin.shear_modulus, self.rubber.temperature
        modulus = instantaneous * relaxation.prony.long_term
        if self.film.contact_age:
            modulus = instantaneous / self._softness
        given = ice.spectrum, own.spectrum, instantaneous, relaxation, modulus, kelvin
        return combined_contact(*given)

    @property
    def _softness(self) -> float:
        """Growth of the compliance of asperities until the end of the load, if contact ages."""
        relaxation = self.rubber.relaxation
        if relaxation is None or not self.film.contact_age:
            return 1.0
        kelvin = self.rubber.temperature or self.ice.temperature
        return float(relaxation.compliance(self.load.duration, kelvin))

    @property
    def change_by_ice(self) -> Change | None:
        """What rough ice changes in k, D and H_V at the load's mean speed and pressure, or None."""
        contact, load = self.rough_contact, self.load
        if contact is None:
            return None
        p = np.array(load.pressures.mean / self._softness)
        return contact.at(p, load.speeds.mean, self.ice.temperature)

    @property
    def given_table(self) -> ContactTable:
        """k, D and H_V over pressure (Pa) as the film's table or the compound's has them, times the
        film's factors, with the modulus of its rubber if that is known.
        """
        film = self.film
        if film.contact is None:
            assert self.rubber.compound is not None  # by Scene's validation
            return CONTACT_TABLES[self.rubber.compound].scaled(*film.contact_scales)
        table = read_contact_table(film.contact, "film.contact").scaled(*film.contact_scales)
        return replace(table, youngs_modulus=table.youngs_modulus or film.contact_modulus)

    @property
    def touching_table(self) -> ContactTable:
        """`given_table` at `contact_modulus`; as it stands if its rubber's modulus is unknown."""
        table, modulus = self.given_table, self.contact_modulus
        if table.youngs_modulus in (None, modulus):
            return table
        return table.at_modulus(modulus)

    def outside_table(self) -> str | None:
        """A message if the nominal pressure is outside the table of k, D, H_V, else None."""
        if self.friction.law != "film":
            return None
        table, pressure = self.contact_parameters, self.load.pressures.mean
        if not isinstance(table, ContactTable) or not table.outside(pressure):
            return None
        low, high = table.pressure[0] / BAR, table.pressure[-1] / BAR
        said = (
            f"k, D and H_V ({table.source}) are given from {low:g} to {high:g} bar; at the "
            f"nominal {pressure / BAR:g} bar the nearest end is taken"
        )
        if self.film.contact_age and pressure / BAR < low:
            first = self.given_table.pressure[0] / BAR * pressure / BAR / low
            said += (
                ", so the table's first row decides k of fresh contact: a table from "
                f"{first:.2g} bar on is needed (iceslide roughness --pressures)"
            )
        return said

    @property
    def files(self) -> dict[tuple[str, str], Path]:
        """Table and key -> path of every file that the scene names."""
        named = {place: attrgetter(".".join(place))(self) for place in FILE_KEYS}
        return {place: path for place, path in named.items() if path is not None}

    def _repr_html_(self) -> str:
        """A table for notebooks: the keys that differ from their defaults, with units."""
        return html_table(self.name, self)

    def replace(self, changes: Mapping[str, Any]) -> Scene:
        """A new scene, validated, with other values by dotted keys or in tables.

        `{"load.pressure": "3 bar"}` and `{"load": {"pressure": "3 bar"}}` are the same. Numbers are
        SI, and None takes a value out. Raises SceneError with one sentence.
        """
        tables = self.model_dump(mode="json", exclude_unset=True)
        change(tables, changes)
        return scene_from_dict(tables)

    def as_dict(self) -> dict[str, Any]:
        """All values with defaults, in SI, JSON-compatible; `scene_from_dict` reads it."""
        return self.model_dump(mode="json")


def scene_from_dict(data: Mapping[str, Any]) -> Scene:
    """Validate a nested dictionary; raises SceneError with one sentence on the first fault."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        raise SceneError(first_sentence(error, list(dotted_keys(Scene)))) from None
