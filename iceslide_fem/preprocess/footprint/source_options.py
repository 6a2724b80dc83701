"""Options on the source of the pressures, shared by commands on footprints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from iceslide_fem.preprocess.footprint.maps import UNITS
from iceslide_fem.preprocess.footprint.picture import Box
from iceslide_fem.preprocess.footprint.pressure_map import LINE_PIXELS
from iceslide_fem.runtime.units import si_unit
from iceslide_fem.scene.command_options import (
    CommandOptions,
    Number,
    as_number,
    given,
    option,
    option_names,
)
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.messages import missing
from iceslide_fem.scene.rules import Rule
from iceslide_fem.scene.units import Quantity


def _box(value: Any) -> Any:
    """LEFT,TOP,RIGHT,BOTTOM as four integers."""
    if not isinstance(value, str):
        return value
    try:
        left, top, right, bottom = map(int, value.split(","))
    except ValueError:
        form = "is not LEFT,TOP,RIGHT,BOTTOM in whole pixels"
        raise PydanticCustomError("form", form) from None
    return Box(left, top, right, bottom)


def _gaussian(value: Any) -> Any:
    """LENGTH,PEAK,SIGMA of a profile; by default SIGMA is a sixth of the length."""
    if not isinstance(value, str):
        return value
    parts = [as_number(part.strip()) for part in value.split(",")]
    if len(parts) not in (2, 3):
        raise PydanticCustomError("form", "is not LENGTH,PEAK,SIGMA, say 180mm,4bar,30mm")
    metres = Quantity("m", "1 mm", "5 m")
    length = metres.validate(parts[0])
    peak = Quantity("Pa", "0.1 bar", "100 bar").validate(parts[1])
    sigma = metres.validate(parts[2]) if len(parts) == 3 else length / 6.0
    if sigma < length / LINE_PIXELS:
        raise ValueError(
            f'SIGMA of --gaussian "{value}" is less than a pixel, LENGTH / {LINE_PIXELS} = '
            f"{1e3 * length / LINE_PIXELS:.3g} mm"
        )
    return length, peak, sigma


def _pressure_unit(value: Any) -> Any:
    """A unit of pressure."""
    if (unit := si_unit(value, "Pa") if isinstance(value, str) else None) is None:
        raise ValueError(
            f'--pressure-unit "{value}" is not a unit of pressure; allowed: {", ".join(UNITS)}, '
            "kgf/cm^2, mmHg"
        )
    return unit


Length = Annotated[float, Quantity("m", "1 mm", "5 m"), Number]
Pressure = Annotated[float, Quantity("Pa", "0 bar", "100 bar"), Number]
PixelBox = Annotated[Box, BeforeValidator(_box)]
GaussianText = Annotated[tuple[float, float, float], BeforeValidator(_gaussian)]
PressureUnit = Annotated[str, BeforeValidator(_pressure_unit)]

THRESHOLD = 0.05  # of the range of pressures
# Threshold of pressures given as numbers, Pa: below it is the tail of a Gaussian.
LOWEST_CONTACT = 1.0
LOWEST_SCALE = 0.1 * BAR  # least high end of the scale: a tyre's mean pressure is some bar
_named = option_names("image")
OF_A_PICTURE = "max_pressure min_pressure colormap legend background rotation crop dark_is".split()
OF_AN_AREA = [*OF_A_PICTURE, *"length width row load frame temperature_map state_map".split()]
GREY = "only a grey picture is dark or bright"
# Required and incompatible options of each source.
SOURCES: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "image": (("length", "width", "max_pressure"), ("pressure_unit", "frame")),
    "pressure_map": ((), OF_A_PICTURE),  # length and width, unless they are in the file
    "line": ((), OF_AN_AREA),
    "gaussian": ((), (*OF_AN_AREA, "pressure_unit")),
}


class SourceOptions(CommandOptions):
    """A footprint; SI units. Its keys are the options of the command.

    gaussian: the profile of fig. 6, length (m), peak (Pa), standard deviation (m).
    """

    model_config = ConfigDict(alias_generator=_named)
    group = "Where the pressures come from"
    rules: ClassVar[Sequence[Rule]] = (
        Rule((given("dark_is"), given("colormap")), GREY),
        Rule((given("dark_is"), given("legend")), GREY),
        Rule((given("colormap"), given("legend"))),
    )

    image: Path | None = option(None, "PNG, JPEG or TIFF.", "IMAGE")
    pressure_map: InputFile | None = option(
        None, "Pressures, .npy, text, points x, y or a sensor's frames, instead of a picture."
    )
    pressure_unit: PressureUnit | None = option(
        None, "Of pressures whose file does not say: kPa, bar, psi.", "UNIT", "Pa"
    )
    frame: Annotated[int, Field(ge=0, le=10_000_000)] | None = option(
        None, "Of a sensor's file.", "N", "that of the largest force"
    )
    line: InputFile | None = option(
        None,
        "One line: points x_m, or cells cell_m, and pressure_Pa, perhaps temperature_C, state.",
        "CSV",
    )
    gaussian: GaussianText | None = option(
        None, "One line: a Gaussian, say 180mm,4bar,30mm.", "L,PEAK,SIGMA"
    )
    row: Annotated[int, Field(ge=0, le=100_000)] | None = option(
        None, "One line: row N of the pixels, from the top.", "N"
    )
    length: Length | None = option(None, "Size along the direction of travel: 180mm.")
    width: Length | None = option(None, "Size across it; both of the cropped picture.")
    max_pressure: Pressure | None = option(None, "High end of the scale: 5bar.")
    min_pressure: Pressure = option(0.0, "Low end of the scale.", shown="0bar")
    threshold: Pressure | None = option(
        None, "No contact up to here.", shown="5 % of the scale above its low end; of numbers 1 Pa"
    )
    dark_is: Literal["high", "low"] | None = option(
        None, "Pressure where a grey picture is dark: high (an ink print) or low."
    )
    colormap: str | None = option(None, "A colour map of matplotlib; else grey.", "NAME")
    legend: PixelBox | None = option(
        None, "Box of the colour bar in the picture, in pixels.", "L,T,R,B"
    )
    background: str = option("white", "Colour of no contact beside the bar, or none.", "COLOUR")
    rotation: Annotated[float, Quantity("", "-360", "360"), Number] = option(
        0.0, "Counter-clockwise, to turn the direction of travel to the right.", "DEG", "0"
    )
    crop: PixelBox | None = option(
        None, "Box of the footprint after rotation, in pixels.", "L,T,R,B"
    )
    load: Annotated[float, Quantity("N", "1 N", "1e6 N"), Number] | None = option(
        None, "Wheel load to scale the pressures to: 3kN."
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        self._check_source()
        if self.max_pressure is not None:
            self._check_scale(self.min_pressure, self.max_pressure)
        return self

    def _check_source(self) -> None:
        """Raise ValueError unless one source is given, with its required options only."""
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

    @property
    def in_grey(self) -> bool:
        """Whether a picture is read as a grey scale."""
        return self.image is not None and self.legend is None and self.colormap is None

    @property
    def one_line(self) -> bool:
        """Whether one line along the footprint is computed (mono-dimensional model)."""
        return self.line is not None or self.gaussian is not None or self.row is not None

    @property
    def source(self) -> Path:
        """The file of the pressures; for a generated profile its name."""
        return self.image or self.pressure_map or self.line or Path("gaussian")

    @property
    def lowest_pressure(self) -> float:
        """The threshold of contact (Pa).

        By default 5 % of the range above its low end; 1 Pa for pressures given as numbers.
        """
        if self.threshold is not None:
            return self.threshold
        if self.max_pressure is None:
            return LOWEST_CONTACT
        return self.min_pressure + THRESHOLD * (self.max_pressure - self.min_pressure)
