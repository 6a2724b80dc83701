"""Input of the tab of a line along a footprint: keys, ranges, and pressure."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import model_validator

from iceslide_fem.app.film_case import FilmCase, Pressure
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.line import gaussian_profile
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic, Source
from iceslide_fem.preprocess.footprint.option_values import Length, PixelBox
from iceslide_fem.preprocess.footprint.profile import read_profile
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.command_options import Number
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import BAR, Solid
from iceslide_fem.scene.units import Quantity

POINTS = 540  # of a Gaussian profile
THESIS = Macroscopic()

Conductivity = Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "1000 W/m/K"), Number]


class LineCase(FilmCase):
    """Every parameter of the line; SI. Its keys are the fields of the page.

    profile: source of the pressure. length (m), peak (Pa) and sigma (m): of a Gaussian; file: a
    profile as CSV; image, colours and `row` (fraction of its height from below): of a picture;
    thesis_balance: whether to compute the thesis's macroscopic model beside the film law.
    """

    profile: Literal["gaussian", "file", "picture"] = "gaussian"
    file: InputFile | None = None
    length: Length = 0.18
    peak: Pressure = 4.0 * BAR
    sigma: Length = 0.03
    image: InputFile | None = None
    max_pressure: Pressure = 4.0 * BAR
    legend: PixelBox | None = None
    crop: PixelBox | None = None
    row: Annotated[float, Quantity("", "0", "1"), Number] = 0.5
    speed: Annotated[float, Quantity("m/s", "0.001 m/s", "100 m/s"), Number] = THESIS.speed
    slip: Annotated[float, Quantity("", "1e-9", "1"), Number] = 1.0
    static_friction: Annotated[float, Quantity("", "0.001", "2"), Number] = THESIS.static_friction
    air_temperature: Annotated[float, Quantity("K", "-80 degC", "60 degC"), Number] | None = None
    source: Source = "moving"
    time: Annotated[float, Quantity("s", "1 us", "1000 s"), Number] = THESIS.time
    depth: Annotated[float, Quantity("m", "1 um", "1 m"), Number] = THESIS.depth
    ice_conductivity: Conductivity = THESIS.ice.conductivity
    ice_density: Annotated[float, Quantity("kg/m^3", "1 kg/m^3", "30000 kg/m^3"), Number] = (
        THESIS.ice.density
    )
    ice_heat_capacity: Annotated[float, Quantity("J/kg/K", "1 J/kg/K", "100000 J/kg/K"), Number] = (
        THESIS.ice.heat_capacity
    )
    tread_conductivity: Conductivity = THESIS.tread.conductivity
    water_conductivity: Conductivity = THESIS.water_conductivity
    thesis_balance: Literal["no", "yes"] = "no"

    @model_validator(mode="after")
    def _has_its_picture(self) -> Self:
        if self.profile == "picture" and self.image is None:
            raise ValueError("image is missing: the path of the picture of a footprint")
        if self.profile == "file" and self.file is None:
            raise ValueError("file is missing: the path of a profile as CSV")
        return self

    @property
    def parameters(self) -> Macroscopic:
        """Parameters of the model besides the pressure."""
        ice = Solid(self.ice_conductivity, self.ice_density, self.ice_heat_capacity)
        return Macroscopic(
            speed=self.speed,
            slip=self.slip,
            static_friction=self.static_friction,
            ice_temperature=self.ice_temperature,
            air_temperature=self.air_temperature,
            source=self.source,
            time=self.time,
            depth=self.depth,
            ice=ice,
            tread=THESIS.tread._replace(conductivity=self.tread_conductivity),
            water_conductivity=self.water_conductivity,
            effusivity=ice.effusivity,
        )

    def pressure(self) -> tuple[Array, float]:
        """The profile (nx,), Pa, and the length of a pixel (m). Raises SceneError."""
        if self.profile == "gaussian":
            x, pressure = gaussian_profile(self.length, self.peak, POINTS, self.sigma)
            return pressure, float(x[1] - x[0])
        if self.profile == "file":
            assert self.file is not None
            profile = read_profile(self.file)
            return profile.pressure, profile.dx
        pressures, dx = self.pressures()
        return pressures[round(self.row * (len(pressures) - 1))], dx

    def pressures(self) -> tuple[Array, float]:
        """All rows of the picture (ny, nx), Pa, and the length of a pixel (m)."""
        assert self.image is not None
        changed = self.image.stat().st_mtime
        return _pressures(
            self.image, changed, self.length, self.max_pressure, self.legend, self.crop
        )


@lru_cache(maxsize=4)
def _pressures(
    image: Path, changed: float, length: float, max_pressure: float, legend: Any, crop: Any
) -> tuple[Array, float]:
    """Pressures of a picture, cached by its time `changed`; a line does not use its width."""
    values = {"image": image, "length": length, "width": length, "max_pressure": max_pressure}
    case = FootprintCase.of(values | {"legend": legend, "crop": crop})
    found = read_footprint(case).pressure_map
    return found.pressure, found.dx


KEYS = list(LineCase.model_fields)
