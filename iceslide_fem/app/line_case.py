"""Input of the tab of a line along a footprint: keys, ranges, and pressure."""

from __future__ import annotations

from functools import lru_cache
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
from iceslide_fem.scene.materials import BAR
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
    def options(self) -> dict[str, Any]:
        """Options of `iceslide footprint` for the same line, with both sources of heat."""
        found: dict[str, Any] = {}
        if self.profile == "gaussian":
            found["gaussian"] = self.length, self.peak, self.sigma
        elif self.profile == "file":
            found["line"] = str(self.file)
        else:
            last = len(self.pressures()[0]) - 1
            found = self.picture | {"row": last - round(self.row * last)}
        found |= {"speed": self.speed, "slip": self.slip} | self.film_options
        return found | (self.balance if self.thesis_balance == "yes" else {})

    @property
    def picture(self) -> dict[str, Any]:
        """Options of the picture; a line does not use its width."""
        size = {"length": self.length, "width": self.length, "max_pressure": self.max_pressure}
        boxes = {"legend": self.legend, "crop": self.crop}
        given = {name: str(box) for name, box in boxes.items() if box}
        return {"image": str(self.image)} | size | given

    @property
    def balance(self) -> dict[str, Any]:
        """Options of the thesis's macroscopic model."""
        ice = self.ice_conductivity, self.ice_density, self.ice_heat_capacity
        tread = THESIS.tread._replace(conductivity=self.tread_conductivity)
        found: dict[str, Any] = {
            "thesis_balance": True,
            "static_friction": self.static_friction,
            "depth": self.depth,
            "ice_material": ice,
            "tread_material": tread[:3],
            "water_conductivity": self.water_conductivity,
        }
        if self.source == "next pixel":
            found |= {"thesis_slip": self.slip, "thesis_time": self.time}
        air = self.air_temperature
        return found | ({} if air is None else {"air_temperature": air})

    @property
    def parameters(self) -> Macroscopic:
        """Parameters of the thesis's model besides the pressure."""
        case = FootprintCase.of(self.options | self.balance)
        return case.moving if self.source == "moving" else case.thesis

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
        return _pressures(self.image.stat().st_mtime, **self.picture)


@lru_cache(maxsize=4)
def _pressures(changed: float, **picture: Any) -> tuple[Array, float]:
    """Pressures of a picture, cached by the time that it was `changed`."""
    found = read_footprint(FootprintCase.of(picture)).pressure_map
    return found.pressure, found.dx


KEYS = list(LineCase.model_fields)
