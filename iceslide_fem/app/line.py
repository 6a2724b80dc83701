"""The tab of the macroscopic line, 4.2 to 4.4 of the thesis, with the parameters of its window."""

from __future__ import annotations

import shlex
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from iceslide_fem.app.form import Slider, Texts
from iceslide_fem.film.doubts import WITHOUT_MELTING, partly_dry
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.line import film_line, gaussian_profile, macroscopic_line
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic, Source, State
from iceslide_fem.preprocess.footprint.option_values import IceTemperature, Length, PixelBox
from iceslide_fem.preprocess.footprint.reading import read_footprint
from iceslide_fem.preprocess.footprint.tables import read_profile
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.command_options import Number
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES, ZERO_CELSIUS, Solid
from iceslide_fem.scene.messages import first_sentence
from iceslide_fem.scene.units import Quantity

POINTS = 540  # of a Gaussian profile
THESIS = Macroscopic()

Pressure = Annotated[float, Quantity("Pa", "0.1 bar", "100 bar"), Number]
Conductivity = Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "1000 W/m/K"), Number]


class LineCase(BaseModel):
    """Every parameter of the line; SI. Its keys are the fields of the page.

    profile: where the pressure comes from. length (m), peak (Pa) and sigma (m) of a Gaussian; file:
    a profile as CSV; image with colours and `row`, the share of its height from below: of a
    picture.
    film_law: whether that is computed along the line, too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

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
    slip: Annotated[float, Quantity("", "1e-9", "1"), Number] = THESIS.slip
    static_friction: Annotated[float, Quantity("", "0.001", "2"), Number] = THESIS.static_friction
    ice_temperature: IceTemperature = THESIS.ice_temperature
    air_temperature: Annotated[float, Quantity("K", "-80 degC", "60 degC"), Number] | None = None
    source: Source = THESIS.source
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
    film_law: Literal["no", "yes"] = "no"

    @model_validator(mode="after")
    def _has_its_picture(self) -> Self:
        if self.profile == "picture" and self.image is None:
            raise ValueError("image is missing: the path of the picture of a footprint")
        if self.profile == "file" and self.file is None:
            raise ValueError("file is missing: the path of a profile as CSV")
        return self

    @classmethod
    def of(cls, texts: Texts) -> LineCase:
        """The case of the texts that are not empty. Raises SceneError with one sentence."""
        given = {key: text.strip() for key, text in texts.items() if text.strip()}
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise SceneError(first_sentence(error, KEYS)) from None

    @property
    def parameters(self) -> Macroscopic:
        """What the model takes beside the pressure."""
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
    """Pressures of a picture that was `changed` then; a line does not see its width."""
    values = {"image": image, "length": length, "width": length, "max_pressure": max_pressure}
    case = FootprintCase.of(values | {"legend": legend, "crop": crop})
    found = read_footprint(case).pressure_map
    return found.pressure, found.dx


KEYS = list(LineCase.model_fields)


def _slider(
    key: str,
    label: str,
    unit: str,
    scale: float,
    low: float,
    high: float,
    log: bool = True,
    shift: float = 0.0,
) -> Slider:
    """A slider that begins where the case does; of a key without a value, with the ice."""
    default = LineCase.model_fields[key].default
    start = THESIS.ice_temperature if default is None else default
    shown = float(f"{(start - shift) / scale:.12g}")
    return Slider(key, label, unit, scale, low, high, shown, log, shift)


T_0 = ZERO_CELSIUS
SLIDERS = (
    _slider("length", "length of the line", "mm", 1e-3, 20.0, 500.0, False),
    _slider("peak", "largest pressure", "bar", BAR, 0.2, 20.0),
    _slider("sigma", "standard deviation of the Gaussian", "mm", 1e-3, 2.0, 200.0),
    _slider("max_pressure", "high end of its colours", "bar", BAR, 0.2, 20.0),
    _slider("row", "row of the picture, 0 below to 1", "", 1.0, 0.0, 1.0, False),
    _slider("speed", "V, speed", "m/s", 1.0, 0.1, 50.0),
    _slider("slip", "S, slip ratio", "", 1.0, 1e-7, 1.0),
    _slider("static_friction", "μ_st, static friction", "", 1.0, 0.01, 1.0),
    _slider("ice_temperature", "T₀, ice temperature", "degC", 1.0, -30.0, -0.1, False, T_0),
    _slider("air_temperature", "air and tread (or as the ice)", "degC", 1.0, -30, 30, False, T_0),
    _slider("time", "t of (3.3), time", "s", 1.0, 0.01, 100.0),
    _slider("depth", "d, depth of heat", "mm", 1e-3, 0.01, 10.0),
    _slider("ice_conductivity", "ice: conductivity", "W/m/K", 1.0, 0.5, 5.0, False),
    _slider("ice_density", "ice: density", "kg/m^3", 1.0, 500.0, 1000.0, False),
    _slider("ice_heat_capacity", "ice: heat capacity", "J/kg/K", 1.0, 1000.0, 4000.0, False),
    _slider("tread_conductivity", "tread: conductivity", "W/m/K", 1.0, 0.05, 1.0, False),
    _slider("water_conductivity", "water: conductivity", "W/m/K", 1.0, 0.1, 2.0, False),
)
OF_PICTURE = ("length", "image", "max_pressure", "legend", "crop", "row")


def described() -> dict[str, Any]:
    """What the page needs to make the fields."""
    return {
        "sliders": [slider.described() for slider in SLIDERS],
        "texts": [
            ("file", "profile (CSV: x_mm, pressure_bar)"),
            ("image", "picture of a footprint (file on this machine)"),
            ("legend", "box of its colour bar: LEFT,TOP,RIGHT,BOTTOM"),
            ("crop", "box of the footprint: LEFT,TOP,RIGHT,BOTTOM"),
        ],
        "choices": [
            ("profile", "pressure along the line", ("gaussian", "file", "picture")),
            ("source", "heat comes from", ("next pixel", "moving")),
            ("film_law", "film law along the line", ("no", "yes")),
        ],
        "empty": ["air_temperature"],
        "gaussian": ["length", "peak", "sigma"],
        "file": ["file"],
        "picture": OF_PICTURE,
        "next_pixel": ["time"],
    }


def curves(texts: Texts) -> dict[str, Any]:
    """Everything that the tab shows. Raises SceneError, SimulationStopped.

    series over x (mm): pressure (bar), flux (W/m2), temperature (degC), mu, state by its name; with
    the film law its temperature and mu. notes: sentences on what is in doubt.
    """
    case = LineCase.of(texts)
    pressure, dx = case.pressure()
    line = macroscopic_line(pressure, dx, case.parameters)
    series: dict[str, list[Any]] = {
        "x": (1e3 * line.x).tolist(),
        "pressure": (line.pressure / BAR).tolist(),
        "flux": line.flux.tolist(),
        "temperature": (line.temperature - ZERO_CELSIUS).tolist(),
        "mu": line.mu.tolist(),
        "state": [State(each).name.lower().replace("_", " ") for each in line.state],
    }
    film, dry = {}, []
    if case.film_law == "yes":
        found = film_line(pressure, dx, case.parameters, CONTACT_TABLES["B"])
        touching = pressure > 0.0
        mu = np.divide(found.shear, pressure, out=np.zeros_like(pressure), where=touching)
        series |= {
            "film_temperature": (found.temperature - ZERO_CELSIUS).tolist(),
            "film_mu": mu.tolist(),
        }
        film = {"film_mu": float(found.shear.sum() / pressure.sum())}
        melting = float(found.melting[touching].mean())
        dry = partly_dry(melting) if melting else [f"The ice does not melt: {WITHOUT_MELTING}"]
    balance = line.balance
    return {
        "notes": [*line.doubts, *dry],
        "series": series,
        "numbers": {
            "mu_mean": line.mu_mean,
            "mu_balance": balance.mu,
            "peak_rise": float(line.rise.max()),
            "leading": line.edges.leading - ZERO_CELSIUS,
            "trailing": line.edges.trailing - ZERO_CELSIUS,
            "heat_of_ice": balance.ice,
            "heat_of_tread": balance.tread,
            "heat_of_water": balance.water,
            **film,
        },
        "values": {slider.key: getattr(case, slider.key) for slider in SLIDERS},
        "python": _lines(case),
        "command": _command(case),
    }


def _command(case: LineCase) -> str:
    """The command line that computes the same line; its model by the other source comes along."""
    p = case.parameters
    words: dict[str, object] = {}
    source = ""
    if case.profile == "gaussian":
        words["gaussian"] = _joined(case.length, case.peak, case.sigma)
    elif case.profile == "file":
        words["line"] = case.file
    else:
        source = f" {shlex.quote(str(case.image))}"
        words |= {"length": case.length, "width": case.length, "max-pressure": case.max_pressure}
        boxes = {"legend": case.legend, "crop": case.crop}
        words |= {name: _joined(*box) for name, box in boxes.items() if box}
        last = len(case.pressures()[0]) - 1
        words["row"] = last - round(case.row * last)
    words |= {"speed": p.speed, "temperature": p.ice_temperature}
    if p.source == "next pixel":
        words |= {"thesis-slip": p.slip, "thesis-time": p.time}
    if p.source == "moving" or case.film_law == "yes":
        words["slip"] = p.slip
    if p.air_temperature is not None:
        words["air-temperature"] = p.air_temperature
    words |= {
        "static-friction": p.static_friction,
        "depth": p.depth,
        "ice-material": _joined(*p.ice[:3]),
        "tread-material": _joined(*p.tread[:3]),
        "water-conductivity": p.water_conductivity,
    }
    options = (f"    --{name} {shlex.quote(str(value))}" for name, value in words.items())
    return " \\\n".join([f"iceslide footprint{source}", *options])


def _joined(*values: float) -> str:
    return ",".join(map(repr, values))


def _lines(case: LineCase) -> str:
    """Lines of Python that compute the same line."""
    before, other, names = "", "", "macroscopic_line"
    if case.profile == "gaussian":
        names = "gaussian_profile, macroscopic_line"
        pressure = (
            f"x, pressure = gaussian_profile({case.length!r}, {case.peak!r}, {POINTS}, "
            f"{case.sigma!r})\ndx = x[1] - x[0]"
        )
    elif case.profile == "file":
        before = "from pathlib import Path\n\n"
        other = "from iceslide_fem.preprocess.footprint.tables import read_profile\n"
        pressure = (
            f"profile = read_profile(Path({str(case.file)!r}))\n"
            "pressure, dx = profile.pressure, profile.dx"
        )
    else:
        before = "from iceslide_fem.preprocess.footprint.case import FootprintCase\n"
        other = "from iceslide_fem.preprocess.footprint.reading import read_footprint\n"
        options = {"image": str(case.image), "length": case.length, "width": case.length}
        options |= {"max_pressure": case.max_pressure}
        boxes = {"legend": case.legend, "crop": case.crop}
        options |= {name: _joined(*box) for name, box in boxes.items() if box}
        pressure = (
            f"footprint = read_footprint(FootprintCase.of({options!r})).pressure_map\n"
            f"pressure = footprint.pressure[round({case.row!r} * (len(footprint.pressure) - 1))]\n"
            "dx = footprint.dx"
        )
    p = case.parameters
    values = {field.name: repr(getattr(p, field.name)) for field in fields(p)}
    values |= {"ice": f"Solid{p.ice[:3]}", "tread": f"Solid{p.tread[:3]}"}
    given = "\n".join(f"    {name}={value}," for name, value in values.items())
    return f"""\
{before}from iceslide_fem.preprocess.footprint.line import {names}
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic
{other}from iceslide_fem.scene.materials import Solid

{pressure}
parameters = Macroscopic(
{given}
)
line = macroscopic_line(pressure, dx, parameters)
print(line.mu_mean)
"""
