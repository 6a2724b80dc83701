"""What `iceslide footprint` is asked for of the film: its water, and dry rubber on ice."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import model_validator

from iceslide_fem.preprocess.footprint.option_values import DryStressText, ViscosityText
from iceslide_fem.preprocess.footprint.ride import FIRST_HEIGHT
from iceslide_fem.scene.command_options import CommandOptions, Number, option_name
from iceslide_fem.scene.dry_shear import DRY_STRESS, RESIDUAL, SOFTENING, USUAL_RESIDUAL, DryShear
from iceslide_fem.scene.ice import VISCOSITY, viscosity_table
from iceslide_fem.scene.materials import WATER_VISCOSITY, ViscosityTable
from iceslide_fem.scene.units import Quantity


class FilmOptions(CommandOptions):
    """Of the film; SI units.

    viscosity (Pa s, or a CSV file of it over temperature); initial_height (m), 0 with dry shear
    alone; dry_stress (Pa, or a CSV file of it over temperature), dry_softening (K), dry_residual
    (K): dry rubber on ice, as in a scene's film.
    """

    viscosity: ViscosityText = WATER_VISCOSITY
    initial_height: Annotated[float, Quantity("m", "0 nm", "10 um"), Number] = FIRST_HEIGHT
    dry_stress: DryStressText | None = None
    dry_softening: Annotated[float, SOFTENING, Number] | None = None
    dry_residual: Annotated[float, RESIDUAL, Number] = USUAL_RESIDUAL

    @model_validator(mode="after")
    def _dry_shear_is_whole(self) -> Self:
        self.dry_shear.check(self.initial_height, option_name)
        if self.dry_stress is not None and isinstance(self.viscosity, Path):
            raise ValueError(
                f"--dry-stress and --viscosity {self.viscosity} contradict each other; allowed: "
                "one viscosity"
            )
        return self

    @property
    def water(self) -> float | ViscosityTable:
        """The film's viscosity (Pa s), or the file's over temperature."""
        if not isinstance(self.viscosity, Path):
            return self.viscosity
        table = viscosity_table(VISCOSITY.validate(str(self.viscosity)), "--viscosity")
        assert table is not None  # the validator saw to it
        return table

    @property
    def dry_shear(self) -> DryShear:
        """Dry rubber on ice, whose stress is a number, or the rows of the file."""
        given = self.dry_stress
        stress = DRY_STRESS.validate(str(given)) if isinstance(given, Path) else given
        return DryShear(stress, self.dry_softening, self.dry_residual)
