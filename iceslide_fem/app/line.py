"""The tab of the macroscopic line, 4.2 to 4.4 of the thesis, with the parameters of its window."""

from __future__ import annotations

import shlex
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from iceslide_fem.app.form import Texts
from iceslide_fem.app.slider import Slider
from iceslide_fem.film.doubts import WITHOUT_MELTING, partly_dry
from iceslide_fem.preprocess.footprint.case import FootprintCase, PixelBox
from iceslide_fem.preprocess.footprint.line import (
    film_line,
    gaussian_profile,
    macroscopic_line,
)
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic, Source, State
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

Length = Annotated[float, Quantity("m", "1 mm", "5 m"), Number]
Pressure = Annotated[float, Quantity("Pa", "0.1 bar", "100 bar"), Number]
Speed = Annotated[float, Quantity("m/s", "0.001 m/s", "100 m/s"), Number]
Share = Annotated[float, Quantity("", "0", "1"), Number]
Slip = Annotated[float, Quantity("", "1e-9", "1"), Number]
Friction = Annotated[float, Quantity("", "0.001", "2"), Number]
IceTemperature = Annotated[float, Quantity("K", "-80 degC", "-0.001 degC"), Number]
AirTemperature = Annotated[float, Quantity("K", "-80 degC", "60 degC"), Number]
Time = Annotated[float, Quantity("s", "1 us", "1000 s"), Number]
Depth = Annotated[float, Quantity("m", "1 um", "1 m"), Number]
Conductivity = Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "1000 W/m/K"), Number]
Density = Annotated[float, Quantity("kg/m^3", "1 kg/m^3", "30000 kg/m^3"), Number]
HeatCapacity = Annotated[float, Quantity("J/kg/K", "1 J/kg/K", "100000 J/kg/K"), Number]


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
    row: Share = 0.5
    speed: Speed = THESIS.speed
    slip: Slip = THESIS.slip
    static_friction: Friction = THESIS.static_friction
    ice_temperature: IceTemperature = THESIS.ice_temperature
    air_temperature: AirTemperature | None = None
    source: Source = THESIS.source
    time: Time = THESIS.time
    depth: Depth = THESIS.depth
    ice_conductivity: Conductivity = THESIS.ice.conductivity
    ice_density: Density = THESIS.ice.density
    ice_heat_capacity: HeatCapacity = THESIS.ice.heat_capacity
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
        return _pressures(
            _Picture(
                self.image,
                self.image.stat().st_mtime,
                self.length,
                self.max_pressure,
                self.legend,
                self.crop,
            )
        )


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
    return Slider(
        key, label, unit, scale, low, high, float(f"{(start - shift) / scale:.12g}"), log, shift
    )


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
EMPTY_AT_FIRST = ("air_temperature",)
OF_GAUSSIAN = ("length", "peak", "sigma")
OF_FILE = ("file",)
OF_PICTURE = ("length", "image", "max_pressure", "legend", "crop", "row")
OF_NEXT_PIXEL = ("time",)
TEXTS = (
    ("file", "profile (CSV: x_mm, pressure_bar)"),
    ("image", "picture of a footprint (file on this machine)"),
    ("legend", "box of its colour bar: LEFT,TOP,RIGHT,BOTTOM"),
    ("crop", "box of the footprint: LEFT,TOP,RIGHT,BOTTOM"),
)
CHOICES = (
    ("profile", "pressure along the line", ("gaussian", "file", "picture")),
    ("source", "heat comes from", ("next pixel", "moving")),
    ("film_law", "film law along the line", ("no", "yes")),
)


def described() -> dict[str, Any]:
    """What the page needs to make the fields."""
    return {
        "sliders": [slider.described() for slider in SLIDERS],
        "texts": TEXTS,
        "choices": CHOICES,
        "empty": EMPTY_AT_FIRST,
        "gaussian": OF_GAUSSIAN,
        "file": OF_FILE,
        "picture": OF_PICTURE,
        "next_pixel": OF_NEXT_PIXEL,
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


class _Picture(NamedTuple):
    """What decides how a picture is read; `changed` when the file was."""

    image: Path
    changed: float
    length: float
    max_pressure: float
    legend: Any
    crop: Any


@lru_cache(maxsize=4)
def _pressures(picture: _Picture) -> tuple[Array, float]:
    """Pressures (ny, nx) of the picture, Pa, and the length of a pixel (m)."""
    case = FootprintCase.of(
        {name: value for name, value in picture._asdict().items() if name != "changed"}
        | {"width": picture.length}  # which a line does not see
    )
    found = read_footprint(case).pressure_map
    return found.pressure, found.dx


def _command(case: LineCase) -> str:
    """The command line that computes the same line; its model by the other source comes along."""
    p, ice, tread = case.parameters, case.parameters.ice, case.parameters.tread
    words: dict[str, object] = {}
    source = ""
    if case.profile == "gaussian":
        words["gaussian"] = f"{case.length!r},{case.peak!r},{case.sigma!r}"
    elif case.profile == "file":
        words["line"] = case.file
    else:
        source = f" {shlex.quote(str(case.image))}"
        rows = len(case.pressures()[0])
        words |= {"length": case.length, "width": case.length, "max-pressure": case.max_pressure}
        boxes = {"legend": case.legend, "crop": case.crop}
        words |= {name: ",".join(map(str, box)) for name, box in boxes.items() if box}
        words["row"] = rows - 1 - round(case.row * (rows - 1))
    words |= {"speed": p.speed, "temperature": p.ice_temperature}
    if p.source == "next pixel":
        words |= {"thesis-slip": p.slip, "thesis-time": p.time}
    if p.source == "moving" or case.film_law == "yes":
        words["slip"] = p.slip
    if p.air_temperature is not None:
        words["air-temperature"] = p.air_temperature
    words |= {"static-friction": p.static_friction, "depth": p.depth}
    words["ice-material"] = ",".join(map(repr, (ice.conductivity, ice.density, ice.heat_capacity)))
    words["tread-material"] = ",".join(
        map(repr, (tread.conductivity, tread.density, tread.heat_capacity))
    )
    words["water-conductivity"] = p.water_conductivity
    options = (f"    --{name} {shlex.quote(str(value))}" for name, value in words.items())
    return " \\\n".join([f"iceslide footprint{source}", *options])


def _lines(case: LineCase) -> str:
    """Lines of Python that compute the same line."""
    p = case.parameters
    given = "\n".join(f"    {name}={getattr(p, name)!r}," for name in _PLAIN)
    if case.profile == "gaussian":
        pressure = (
            f"x, pressure = gaussian_profile({case.length!r}, {case.peak!r}, {POINTS}, "
            f"{case.sigma!r})\ndx = x[1] - x[0]"
        )
        imports = (
            "from iceslide_fem.preprocess.footprint.line import gaussian_profile, macroscopic_line"
        )
    elif case.profile == "file":
        pressure = (
            f"profile = read_profile(Path({str(case.file)!r}))\n"
            "pressure, dx = profile.pressure, profile.dx"
        )
        imports = "from pathlib import Path\n\n"
        imports += "from iceslide_fem.preprocess.footprint.line import macroscopic_line"
    else:
        names = ("length", "max_pressure", "legend", "crop")
        options = {name: getattr(case, name) for name in names if getattr(case, name) is not None}
        options = {"image": str(case.image), "width": case.length} | {
            name: ",".join(map(str, value)) if isinstance(value, tuple) else value
            for name, value in options.items()
        }
        pressure = (
            f"footprint = read_footprint(FootprintCase.of({options!r})).pressure_map\n"
            f"pressure = footprint.pressure[round({case.row!r} * (len(footprint.pressure) - 1))]\n"
            "dx = footprint.dx"
        )
        imports = (
            "from iceslide_fem.preprocess.footprint.case import FootprintCase\n"
            "from iceslide_fem.preprocess.footprint.line import macroscopic_line"
        )
    imports += "\nfrom iceslide_fem.preprocess.footprint.macroscopic import Macroscopic"
    if case.profile == "file":
        imports += "\nfrom iceslide_fem.preprocess.footprint.tables import read_profile"
    if case.profile == "picture":
        imports += "\nfrom iceslide_fem.preprocess.footprint.reading import read_footprint"
    return f"""\
{imports}
from iceslide_fem.scene.materials import Solid

{pressure}
parameters = Macroscopic(
{given}
    ice={_solid(p.ice)},
    tread={_solid(p.tread)},
)
line = macroscopic_line(pressure, dx, parameters)
print(line.mu_mean)
"""


_PLAIN = (
    "speed",
    "slip",
    "static_friction",
    "ice_temperature",
    "air_temperature",
    "source",
    "time",
    "depth",
    "water_conductivity",
    "effusivity",
)


def _solid(solid: Solid) -> str:
    return f"Solid({solid.conductivity!r}, {solid.density!r}, {solid.heat_capacity!r})"
