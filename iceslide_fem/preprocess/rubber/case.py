"""What `iceslide rubber` is asked for: validated like a scene, by the names of its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator

from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.scene.command_options import CommandOptions, as_number, option_names
from iceslide_fem.scene.units import Quantity

TEMPERATURE = Quantity("K", "-150 degC", "200 degC")
RATE = Quantity("1/s", "1e-9 1/s", "1e9 1/s")
OF_A_TABLE = ("kind", "reference", "wlf", "arrhenius_below", "modulus_is")


def _list(name: str, quantity: Quantity, example: str) -> BeforeValidator:
    """Several quantities with commas between them."""

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        try:
            found = tuple(quantity.in_range(as_number(part.strip())) for part in value.split(","))
        except ValueError as error:
            raise ValueError(
                f'{name} "{value}" is not of the form {example}: a value {error}; allowed: '
                f"{quantity.low} to {quantity.high}"
            ) from None
        if len(found) > 6:
            raise ValueError(f'{name} "{value}" has {len(found)} values; allowed: up to 6')
        return found

    return BeforeValidator(read)


def _wlf(value: Any) -> Any:
    """C1, C2 (K) and the reference temperature (K), from "7.4,121.6,20degC"."""
    if not isinstance(value, str):
        return value
    form = f'--wlf "{value}" is not of the form 7.4,121.6,20degC'
    parts = [part.strip() for part in value.split(",")]
    if len(parts) != 3:
        raise ValueError(f"{form} (C1 of log10, C2 in K, reference temperature)")
    allowed = (Quantity("", "1e-6", "1000"), Quantity("K", "0.1 K", "10000 K"), TEMPERATURE)
    try:
        return tuple(
            each.in_range(as_number(part)) for each, part in zip(allowed, parts, strict=True)
        )
    except ValueError as error:
        raise ValueError(f"{form}: a value {error}") from None


class RubberCase(CommandOptions):
    """A DMA table, or a scene (.toml), and what is asked of it; SI units.

    kind: whether the table is of Young's (E) or the shear modulus (G). reference: temperature of
    the master curve; wlf: C1, C2 and its own reference; arrhenius_below: a temperature, K.
    modulus_is: which modulus C10 is to be. rates (1/s) and temperatures (K): of curves of stress
    over strain.
    """

    model_config = ConfigDict(alias_generator=option_names("source"))

    source: Path
    kind: Literal["E", "G"] | None = Field(None, alias="--of")
    reference: Annotated[float | None, BeforeValidator(lambda v: v and TEMPERATURE.validate(v))] = (
        None
    )
    wlf: Annotated[tuple[float, float, float] | None, BeforeValidator(_wlf)] = None
    arrhenius_below: Annotated[
        float | None, BeforeValidator(lambda v: v and TEMPERATURE.validate(v))
    ] = None
    modulus_is: Literal["instantaneous", "long-term"] | None = None
    rates: Annotated[tuple[float, ...], _list("--rates", RATE, "0.01,1,100")] = (0.01, 1.0, 100.0)
    temperatures: Annotated[
        tuple[float, ...] | None, _list("--temperatures", TEMPERATURE, "-20degC,20degC")
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
        """The WLF shift that was given."""
        return None if self.wlf is None else Shift(*self.wlf)
