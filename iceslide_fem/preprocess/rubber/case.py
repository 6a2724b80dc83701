"""Input of `iceslide rubber`, validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.relaxation_options import TEMPERATURE, read_wlf, several
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.scene.command_options import CommandOptions, Number, option_names
from iceslide_fem.scene.units import Quantity

RATE = Quantity("1/s", "1e-9 1/s", "1e9 1/s")
OF_A_TABLE = ("kind", "reference", "wlf", "arrhenius_below", "modulus_is")


class RubberCase(CommandOptions):
    """A DMA table, or a scene (.toml), with options; SI units.

    kind: Young's (E) or shear modulus (G) in the table; reference: temperature of the master curve,
    K; wlf: C1, C2 and its reference; arrhenius_below: K; modulus_is: kind of modulus of the written
    C10; rates (1/s), temperatures (K): of stress-strain curves.
    """

    model_config = ConfigDict(alias_generator=option_names("source"))

    source: Path
    kind: Literal["E", "G"] | None = Field(None, alias="--of")
    reference: Annotated[float, TEMPERATURE, Number] | None = None
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(read_wlf)] = None
    arrhenius_below: Annotated[float, TEMPERATURE, Number] | None = None
    modulus_is: Literal["instantaneous", "long-term"] | None = None
    rates: Annotated[tuple[float, ...], several("--rates", RATE, "0.01,1,100")] = (0.01, 1.0, 100.0)
    temperatures: Annotated[
        tuple[float, ...] | None, several("--temperatures", TEMPERATURE, "-20degC,20degC")
    ] = None

    @model_validator(mode="after")
    def _fits_its_source(self) -> Self:
        given = [name for name in OF_A_TABLE if getattr(self, name) is not None]
        if self.is_scene and given:
            option = type(self).model_fields[given[0]].alias
            raise ValueError(f"{option} has no meaning for a scene: its rubber is shown as it is")
        if self.wlf is not None and self.arrhenius_below is not None:
            raise ValueError(
                "--wlf and --arrhenius-below contradict each other: the activation energy is "
                "fitted below a fitted WLF; give one of them"
            )
        return self

    @property
    def is_scene(self) -> bool:
        """Whether the source is a scene file."""
        return self.source.suffix.lower() == ".toml"

    @property
    def shift(self) -> Shift | None:
        """The given WLF shift, or None."""
        return None if self.wlf is None else Shift(*self.wlf)
