"""What `iceslide footprint` is asked for: validated like a scene, by the names of its options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from iceslide_fem.preprocess.footprint.film_options import FilmOptions
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE, TABLE_1_RUBBER
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic
from iceslide_fem.preprocess.footprint.option_values import (
    GaussianText,
    IceTemperature,
    Length,
    PixelBox,
    Pressure,
    PressureUnit,
    SolidText,
)
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.scene.command_options import Number, option_names
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import (
    BAR,
    ICE,
    ICE_EFFUSIVITY,
    WATER_CONDUCTIVITY,
    ZERO_CELSIUS,
    Solid,
)
from iceslide_fem.scene.messages import missing
from iceslide_fem.scene.units import Quantity

THRESHOLD = 0.05  # of the range of pressures
# Of pressures that are numbers, Pa: what a Gaussian has far out, which no tyre presses with.
LOWEST_CONTACT = 1.0
_named = option_names("image")
OF_A_PICTURE = "max_pressure min_pressure colormap legend background rotation crop dark_is".split()
OF_AN_AREA = [*OF_A_PICTURE, *"length width row temperature_map state_map load frame".split()]
# What each source needs, and what does not fit it.
SOURCES: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "image": (("length", "width", "max_pressure"), ("pressure_unit", "frame")),
    "pressure_map": ((), OF_A_PICTURE),  # length and width, unless its file says them
    "line": ((), OF_AN_AREA),
    "gaussian": ((), (*OF_AN_AREA, "pressure_unit")),
}
LOWEST_SCALE = 0.1 * BAR  # for its high end: a tyre's mean pressure is some bar


class FootprintCase(FilmOptions):
    """A footprint and how it slides; SI units. Its keys are the options of the command.

    One of image, pressure_map (a table of pressures, in Pa unless its file or pressure_unit says
    another unit, or frames of a sensor, of which `frame` is read, else that of the largest force)
    and line (a profile) is read, or gaussian is made, the profile of fig. 6 (length in m, peak in
    Pa, standard deviation in m); of image and map, row takes one line of pixels from the top.
    temperature_map (degC) and state_map (1 dry, 2 mixed, 3 wet) replace what modules 2 and 3
    compute; they have the pixels of the pressure. length, width: of the picture after rotation and
    cropping, along and across the direction of travel (m). dark_is: the pressure where a grey
    picture is dark, high or low. min_pressure and max_pressure: ends of the colour scale (Pa).
    rotation: degrees counter-clockwise, to turn the direction of travel to the right. slip, of film
    and moving source: 1 is a locked wheel. thesis_slip and thesis_time (s) enter (3.2) and (3.3)
    alone. air_temperature
    (K): of the tread before it touches, else the ice's. ice_material, tread_material,
    water_conductivity: of the macroscopic model, else table 1; the ice's is that below the film,
    too. melting_temperature (K), latent_heat (J/kg): of film and ice. aggregate: of (1.2), g/m2.
    """

    model_config = ConfigDict(alias_generator=_named)

    image: Path | None = None
    pressure_map: InputFile | None = None
    line: InputFile | None = None
    gaussian: GaussianText | None = None
    row: Annotated[int, Field(ge=0, le=100_000)] | None = None
    temperature_map: InputFile | None = None
    state_map: InputFile | None = None
    length: Length | None = None
    width: Length | None = None
    max_pressure: Pressure | None = None
    min_pressure: Pressure = 0.0
    threshold: Pressure | None = None
    colormap: str | None = None
    legend: PixelBox | None = None
    background: str = "white"
    rotation: Annotated[float, Quantity("", "-360", "360"), Number] = 0.0
    crop: PixelBox | None = None
    dark_is: Literal["high", "low"] | None = None
    pressure_unit: PressureUnit | None = None
    frame: Annotated[int, Field(ge=0, le=10_000_000)] | None = None
    load: Annotated[float, Quantity("N", "1 N", "1e6 N"), Number] | None = None
    speed: Annotated[float, Quantity("m/s", "0.001 m/s", "100 m/s"), Number] = 3.0
    slip: Annotated[float, Quantity("", "1e-6", "1"), Number] = 1.0
    water_speed: Annotated[float, Quantity("", "0", "1"), Number] = 1.0
    temperature: IceTemperature = 269.15
    static_friction: Annotated[float, Quantity("", "0.001", "2"), Number] = 0.1
    depth: Annotated[float, Quantity("m", "1 um", "1 m"), Number] = 1e-4
    thesis_slip: Annotated[float, Quantity("", "1e-9", "1"), Number] = 1e-5
    thesis_time: Annotated[float, Quantity("s", "1 us", "1000 s"), Number] = 1.0
    air_temperature: Annotated[float, Quantity("K", "-80 degC", "60 degC"), Number] | None = None
    ice_material: SolidText | None = None
    tread_material: SolidText | None = None
    water_conductivity: Annotated[float, Quantity("W/m/K", "0.01 W/m/K", "10 W/m/K"), Number] = (
        WATER_CONDUCTIVITY
    )
    melting_temperature: Annotated[float, Quantity("K", "-60 degC", "0.01 degC"), Number] = (
        ICE.melting_temperature
    )
    latent_heat: Annotated[float, Quantity("J/kg", "1 kJ/kg", "10000 kJ/kg"), Number] = (
        ICE.latent_heat
    )
    aggregate: Annotated[float, Quantity("g/m^2", "0 g/m^2", "1000 g/m^2"), Number] = 0.0
    tolerance: Annotated[float, Quantity("", "1e-6", "0.1"), Number] = 1e-2
    scenes: Annotated[int, Field(ge=0, le=1000)] = 0
    tread_height: Length = 8e-3

    @model_validator(mode="after")
    def _no_contradiction(self) -> Self:
        if self.temperature > self.melting_temperature - 1e-3 + 1e-9:
            raise ValueError(
                f"--temperature {self.temperature - ZERO_CELSIUS:.6g} degC is not below "
                f"--melting-temperature {self.melting_temperature - ZERO_CELSIUS:.6g} degC"
            )
        self._check_source()
        if self.max_pressure is not None:
            self._check_scale(self.min_pressure, self.max_pressure)
        return self

    def _check_source(self) -> None:
        """Raise ValueError unless one source is given, with what it needs and nothing else."""
        given = [name for name in SOURCES if getattr(self, name) is not None]
        if len(given) != 1:
            what = "; ".join(map(_named, given)) if given else "none of them"
            raise ValueError(
                f"give one of IMAGE, --pressure-map, --line and --gaussian; given: {what}"
            )
        needed, unfit = SOURCES[given[0]]
        if absent := [_named(name) for name in needed if getattr(self, name) is None]:
            raise ValueError(missing(absent))
        for name in unfit:
            if name in self.model_fields_set:
                raise ValueError(f"{_named(name)} does not fit {_named(given[0])}")
        if self.one_line and self.scenes:
            raise ValueError(
                "--scenes takes the blocks of a whole footprint: it does not fit one line"
            )

    def _check_scale(self, low: float, high: float) -> None:
        """Raise ValueError unless pressures (Pa) and colours of a picture fit together."""
        if high < LOWEST_SCALE:
            raise ValueError(
                f"--max-pressure {high:g} Pa is no pressure of a tyre; a number without a unit is "
                f'in Pa, say "{high:g}bar" for bar; allowed: {LOWEST_SCALE / BAR:g} to 100 bar'
            )
        ends = f"--min-pressure ({low / BAR:g} bar)", f"--max-pressure ({high / BAR:g} bar)"
        if high <= low:
            raise ValueError(f"{ends[1]} is not above {ends[0]}")
        if self.threshold is not None and not low <= self.threshold < high:
            raise ValueError(
                f"--threshold ({self.threshold / BAR:g} bar) is not between {' and '.join(ends)}"
            )
        if self.dark_is is not None and (self.colormap or self.legend):
            raise ValueError(
                "--dark-is is of grey pictures: it does not fit --colormap or --legend"
            )
        if self.colormap is not None and self.legend is not None:
            raise ValueError("--colormap and --legend contradict each other; give one of them")

    @property
    def in_grey(self) -> bool:
        """Whether a picture is taken as a grey scale."""
        return self.image is not None and self.legend is None and self.colormap is None

    @property
    def one_line(self) -> bool:
        """Whether one line along the footprint is asked for, the mono-dimensional model."""
        return self.line is not None or self.gaussian is not None or self.row is not None

    @property
    def source(self) -> Path:
        """The file that the pressure comes from; of a profile that is made, its name."""
        return self.image or self.pressure_map or self.line or Path("gaussian")

    @property
    def lowest_pressure(self) -> float:
        """The threshold of contact (Pa): as given, else 5 % of the range above its low end; of
        pressures that are given as numbers 1 Pa.
        """
        if self.threshold is not None:
            return self.threshold
        if self.max_pressure is None:
            return LOWEST_CONTACT
        return self.min_pressure + THRESHOLD * (self.max_pressure - self.min_pressure)

    @property
    def moving(self) -> Macroscopic:
        """The macroscopic model with a source that moves."""
        ice = Solid(*self.ice_material) if self.ice_material else None
        return Macroscopic(
            speed=self.speed,
            slip=self.slip,
            static_friction=self.static_friction,
            ice_temperature=self.temperature,
            air_temperature=self.air_temperature,
            source="moving",
            depth=self.depth,
            ice=ice or TABLE_1_ICE,
            tread=Solid(*self.tread_material) if self.tread_material else TABLE_1_RUBBER,
            water_conductivity=self.water_conductivity,
            effusivity=ice.effusivity if ice else ICE_EFFUSIVITY,
        )

    @property
    def thesis(self) -> Macroscopic:
        """The macroscopic model as printed, with slip and time of its own."""
        return replace(
            self.moving, source="next pixel", slip=self.thesis_slip, time=self.thesis_time
        )

    @property
    def ride(self) -> Ride:
        """How the ice passes: V and V S."""
        return Ride(
            self.speed,
            self.slip * self.speed,
            self.temperature,
            self.initial_height,
            ICE._replace(
                **dict(zip(Solid._fields, self.ice_material or (), strict=False)),
                melting_temperature=self.melting_temperature,
                latent_heat=self.latent_heat,
            ),
            self.water,
            self.water_speed,
            self.dry_shear.strength(self.melting_temperature),
            self.age,
        )
