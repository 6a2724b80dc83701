"""Input of `iceslide rubber`, validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.preprocess.relaxation_options import STRAIN, TEMPERATURE, read_wlf, several
from iceslide_fem.relaxation.dma_fit import Law
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.scene.command_options import CommandOptions, Number, option_names
from iceslide_fem.scene.relaxation import MOST_ARMS
from iceslide_fem.scene.units import Quantity

RATE = Quantity("1/s", "1e-9 1/s", "1e9 1/s")
OF_A_TABLE = (
    "kind", "strain", "temperature", "reference", "shift", "wlf", "arrhenius_below", "arms",
    "modulus_is",
)  # fmt: skip


class RubberCase(CommandOptions):
    """A DMA table, or a scene (.toml), with options; SI units.

    kind: Young's (E) or shear modulus (G) in the table; strain: amplitude of its rows that are
    taken; temperature: of a table without temperatures, K; reference: temperature of the master
    curve, K; shift: law that is fitted; wlf: C1, C2 and its reference; arrhenius_below: K; arms:
    most of them; modulus_is: kind of modulus of the written C10; rates (1/s), temperatures (K): of
    stress-strain curves.
    """

    model_config = ConfigDict(alias_generator=option_names("source"))

    source: Path
    kind: Literal["E", "G"] | None = Field(None, alias="--of")
    strain: Annotated[float, STRAIN, Number] | None = None
    temperature: Annotated[float, TEMPERATURE, Number] | None = None
    reference: Annotated[float, TEMPERATURE, Number] | None = None
    shift: Law | None = None
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(read_wlf)] = None
    arrhenius_below: Annotated[float, TEMPERATURE, Number] | None = None
    arms: Annotated[int, Field(ge=1, le=MOST_ARMS), Number] | None = None
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
        if self.shift is not None and self.wlf is not None:
            raise ValueError(
                "--shift and --wlf contradict each other: a shift is fitted or given; give one of "
                "them"
            )
        if self.shift in ("arrhenius", "table") and self.arrhenius_below is not None:
            raise ValueError(
                f"--shift {self.shift} and --arrhenius-below contradict each other: the activation "
                "energy follows on a fitted WLF; give one of them"
            )
        return self

    @property
    def is_scene(self) -> bool:
        """Whether the source is a scene file."""
        return self.source.suffix.lower() == ".toml"

    @property
    def given_shift(self) -> Shift | None:
        """The given WLF shift, or None."""
        return None if self.wlf is None else Shift(*self.wlf)
