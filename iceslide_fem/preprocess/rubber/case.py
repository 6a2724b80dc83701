"""Input of `iceslide rubber`, validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.option_values import STRAIN, TEMPERATURE, Several, read_wlf
from iceslide_fem.relaxation.dma_fit import Law
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.scene.command_options import CommandOptions, Number, given, option, option_names
from iceslide_fem.scene.relaxation import MOST_ARMS
from iceslide_fem.scene.rules import Rule
from iceslide_fem.scene.units import Quantity

Temperature = Annotated[float, TEMPERATURE, Number]
RATE = Quantity("1/s", "1e-9 1/s", "1e9 1/s")
OF_A_TABLE = (
    "kind", "strain", "temperature", "reference", "shift", "wlf", "arrhenius_below", "arms",
    "modulus_is",
)  # fmt: skip


class RubberCase(CommandOptions):
    """A DMA table, or a scene (.toml), with options; SI units."""

    model_config = ConfigDict(alias_generator=option_names("source"))
    rules = (
        Rule((given("wlf"), given("arrhenius_below")),
             "the activation energy is fitted below a fitted WLF"),
        Rule((given("shift"), given("wlf")), "a shift is fitted or given"),
        *(
            Rule((given("shift", law), given("arrhenius_below")),
                 "the activation energy follows on a fitted WLF")
            for law in ("arrhenius", "table")
        ),
    )  # fmt: skip

    source: Path = option(
        ...,
        "Table of frequency, temperature, storage modulus, and loss modulus or tan delta; or of "
        "time, temperature, relaxation modulus; or a scene, whose rubber is shown.",
        "DMA.csv|SCENE.toml",
    )
    kind: Literal["E", "G"] | None = option(
        None, "What the moduli are of.", shown="as headings say, else E", alias="--of"
    )
    strain: Annotated[float, STRAIN, Number] | None = option(
        None, "Amplitude of the rows taken: 0.1%.", "STRAIN", "all"
    )
    temperature: Temperature | None = option(None, "Of a table without temperatures: 20degC.")
    reference: Temperature | None = option(
        None, "Of the master curve: 20degC.", shown="the isotherm nearest to 20degC"
    )
    shift: Law | None = option(
        None, "The law; a table has each isotherm's own factor.", shown="wlf"
    )
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(read_wlf)] = option(
        None, "Given instead of fitted: 7.4,121.6,20degC (log10, K).", "C1,C2,T"
    )
    arrhenius_below: Temperature | None = option(None, "Colder isotherms: an activation energy.")
    arms: Annotated[int, Field(ge=1, le=MOST_ARMS), Number] | None = option(
        None, "Most arms of the series, up to 60.", "N", "20"
    )
    modulus_is: Literal["instantaneous", "long-term"] | None = option(
        None, "C10 written.", shown="long-term"
    )
    rates: Annotated[tuple[float, ...], BeforeValidator(Several("--rates", RATE, "0.01,1,100"))] = (
        option((0.01, 1.0, 100.0), "Of strain, drawn; 1/s.", "R,...", "0.01,1,100")
    )
    temperatures: Annotated[
        tuple[float, ...] | None,
        BeforeValidator(Several("--temperatures", TEMPERATURE, "-20degC,20degC")),
    ] = option(None, "That are drawn.", "T,...", "-20degC,0degC,20degC")

    @model_validator(mode="after")
    def _fits_its_source(self) -> Self:
        given = [name for name in OF_A_TABLE if getattr(self, name) is not None]
        if self.is_scene and given:
            name = type(self).model_fields[given[0]].alias
            raise ValueError(f"{name} has no meaning for a scene: its rubber is shown as it is")
        return self

    @property
    def is_scene(self) -> bool:
        """Whether the source is a scene file."""
        return self.source.suffix.lower() == ".toml"

    @property
    def given_shift(self) -> Shift | None:
        """The given WLF shift, or None."""
        return None if self.wlf is None else Shift(*self.wlf)
