"""Common parts of the tabs line and wheel: validated texts, films, sliders."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from iceslide_fem.app.form import Slider, Texts
from iceslide_fem.preprocess.footprint.ride import FIRST_HEIGHT
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import Number
from iceslide_fem.scene.dry_shear import RESIDUAL, SOFTENING, USUAL_RESIDUAL, DryShear
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.units import Quantity

Pressure = Annotated[float, Quantity("Pa", "0.1 bar", "100 bar"), Number]


class FilmCase(BaseModel):
    """Films and dry contact of a tab.

    initial_height: m; ice_temperature: K; dry_stress: Pa, 0 for none; dry_softening, dry_residual:
    K.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    ice_temperature: Annotated[float, Quantity("K", "-80 degC", "-0.001 degC"), Number] = 269.15
    initial_height: Annotated[float, Quantity("m", "0 nm", "10 um"), Number] = FIRST_HEIGHT
    dry_stress: Annotated[float, Quantity("Pa", "0 Pa", "1 GPa"), Number] = 0.0
    dry_softening: Annotated[float, SOFTENING, Number] = 10.0
    dry_residual: Annotated[float, RESIDUAL, Number] = USUAL_RESIDUAL

    @model_validator(mode="after")
    def _begins_with_a_film(self) -> Self:
        self.dry_shear.check(self.initial_height, lambda key: key)
        return self

    @classmethod
    def of(cls, texts: Texts) -> Self:
        """The case from the non-empty texts. Raises SceneError."""
        given = {key: text.strip() for key, text in texts.items() if text.strip()}
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise SceneError(first_sentence(error, list(cls.model_fields))) from None

    @property
    def dry_shear(self) -> DryShear:
        """Dry rubber on ice, below the film law."""
        if self.dry_stress == 0.0:
            return DryShear()
        return DryShear(self.dry_stress, self.dry_softening, self.dry_residual)

    @property
    def film_options(self) -> dict[str, Any]:
        """Options of a command on footprints with the same films."""
        given = {"temperature": self.ice_temperature, "initial_height": self.initial_height}
        dry = self.dry_shear
        if dry.stress is not None:
            given |= {f"dry_{name}": value for name, value in dry._asdict().items()}
        return given


def slider_of(
    case: type[FilmCase],
    key: str,
    label: str,
    unit: str,
    scale: float,
    low: float,
    high: float,
    log: bool = True,
    shift: float = 0.0,
    zero: bool = False,
) -> Slider:
    """A slider with the value of `case` at its start; without a value, that of the ice."""
    fields = case.model_fields
    default = fields[key].default
    start = fields["ice_temperature"].default if default is None else default
    shown = float(f"{(start - shift) / scale:.12g}")
    return Slider(key, label, unit, scale, low, high, shown, log, shift, zero)
