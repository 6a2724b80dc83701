"""Input of the tab of the wheel: keys, ranges, wheel and friction law."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import model_validator

from iceslide_fem.app.film_case import FilmCase, Pressure
from iceslide_fem.film.shear_strength import strength_of
from iceslide_fem.preprocess.footprint.line import as_map, gaussian_profile
from iceslide_fem.preprocess.footprint.option_values import Length
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Pattern, Rolling
from iceslide_fem.preprocess.wheel.contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import Tread
from iceslide_fem.scene.command_options import Number
from iceslide_fem.scene.materials import (
    BAR,
    COMPOUNDS,
    CONTACT_TABLES,
    MELTING_TEMPERATURE,
)
from iceslide_fem.scene.units import Quantity

COMPOUND = "B"
HEIGHT = 8e-3  # m, height of the tread whose stiffness G / H is the slider's initial value
CELLS = 20  # along the patch; a redraw takes less than 150 ms
PHASES = 5  # of a pattern, with the same time
# Slip ratios, denser at low slip, where dry contact has its peak.
SLIPS = tuple(round((i / 20) ** 2, 4) for i in range(21))
EVEN = 5.0  # m, standard deviation of a Gaussian that is uniform over any patch
TOLERANCE = 2e-2  # of the films; the cells dominate the error of the curve


class WheelLine(FilmCase):
    """A wheel on one line of its footprint; SI. Its keys are the fields of the page.

    profile: uniform pressure (Pa) over the length (m) of the patch, or a Gaussian with this peak
    and the standard deviation sigma (m). speed: of the vehicle, m/s; stiffness: shear stress over
    displacement of the tread's surface, Pa/m; tread: slick, or blocks with pitch and groove, m.
    """

    profile: Literal["even", "gaussian"] = "even"
    tread: Literal["slick", "blocks"] = "slick"
    speed: Annotated[float, Quantity("m/s", "0.1 m/s", "100 m/s"), Number] = 50.0 / 3.6
    pressure: Pressure = 2.0 * BAR
    length: Length = 0.12
    sigma: Length = 0.03
    stiffness: Annotated[float, Quantity("Pa/m", "1e4 Pa/m", "1e15 Pa/m"), Number] = (
        COMPOUNDS[COMPOUND].shear_modulus / HEIGHT
    )
    pitch: Length = 0.028
    groove: Annotated[float, Quantity("m", "0.1 mm", "1 m"), Number] = 8e-3

    @model_validator(mode="after")
    def _its_cells_show_it(self) -> Self:
        if self.profile == "gaussian" and self.sigma < self.length / CELLS:
            raise ValueError(
                f"sigma = {1e3 * self.sigma:.4g} mm is less than a cell of the patch, length / "
                f"{CELLS} = {1e3 * self.length / CELLS:.3g} mm"
            )
        return self

    @model_validator(mode="after")
    def _has_blocks(self) -> Self:
        if self.tread == "blocks" and self.groove >= self.pitch:
            raise ValueError(
                f"groove = {1e3 * self.groove:.4g} mm leaves no block of pitch = "
                f"{1e3 * self.pitch:.4g} mm; allowed: less than the pitch"
            )
        return self

    def footprint(self, cells: int = CELLS) -> PressureMap:
        """One line with this number of `cells`."""
        pressure = np.full(cells, self.pressure)
        if self.profile == "gaussian":
            _, pressure = gaussian_profile(self.length, self.pressure, cells, self.sigma)
        return as_map(pressure, self.length / cells)

    @property
    def wheel(self) -> tuple[list[Rolling], Tread, FilmContact]:
        """Arguments of `friction` besides the footprint.

        They are the wheel at `SLIPS`, from free rolling to locked, its tread, and the film law with
        the compound's table.
        """
        pattern = Pattern(self.pitch, self.groove, PHASES) if self.tread == "blocks" else None
        ride = Ride(
            self.speed,
            self.speed,
            self.ice_temperature,
            initial_height=self.initial_height,
            strength=strength_of(self.dry_shear, MELTING_TEMPERATURE),
        )
        contact = FilmContact(ride, CONTACT_TABLES[COMPOUND], TOLERANCE)
        return (
            [Rolling(self.speed, slip) for slip in SLIPS],
            Tread(self.stiffness, pattern),
            contact,
        )

    @property
    def options(self) -> dict[str, Any]:
        """Options of `iceslide wheel` for the same wheel, which has finer pixels.

        There a uniform pressure is a Gaussian much wider than the patch.
        """
        sigma = self.sigma if self.profile == "gaussian" else EVEN
        found = {
            "gaussian": (self.length, self.pressure, sigma),
            "speed": self.speed,
            "slip": list(SLIPS),
            "stiffness": f"{self.stiffness!r} Pa/m",
        }
        if self.tread == "blocks":
            found |= {"pitch": self.pitch, "groove": self.groove}
        return found | self.film_options


KEYS = list(WheelLine.model_fields)
