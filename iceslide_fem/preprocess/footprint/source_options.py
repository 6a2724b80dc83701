"""Options on the source of the pressures, shared by commands on footprints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from iceslide_fem.preprocess.footprint.option_values import (
    GaussianText,
    Length,
    PixelBox,
    Pressure,
    PressureUnit,
)
from iceslide_fem.scene.command_options import CommandOptions, Number, option_names
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import BAR
from iceslide_fem.scene.messages import missing
from iceslide_fem.scene.units import Quantity

THRESHOLD = 0.05  # of the range of pressures
# Threshold of pressures given as numbers, Pa: below it is the tail of a Gaussian.
LOWEST_CONTACT = 1.0
LOWEST_SCALE = 0.1 * BAR  # least high end of the scale: a tyre's mean pressure is some bar
_named = option_names("image")
OF_A_PICTURE = "max_pressure min_pressure colormap legend background rotation crop dark_is".split()
OF_AN_AREA = [*OF_A_PICTURE, *"length width row load frame".split()]
# Required and incompatible options of each source.
SOURCES: dict[str, tuple[Sequence[str], Sequence[str]]] = {
    "image": (("length", "width", "max_pressure"), ("pressure_unit", "frame")),
    "pressure_map": ((), OF_A_PICTURE),  # length and width, unless they are in the file
    "line": ((), OF_AN_AREA),
    "gaussian": ((), (*OF_AN_AREA, "pressure_unit")),
}


def results_folder(values: Mapping[str, Any], ending: str = "") -> Path:
    """Default output folder, by the file of pressures in `values`."""
    named = (values.get(name) for name in ("image", "pressure_map", "line"))
    source = next(filter(None, named), "gaussian" if values.get("gaussian") else "footprint")
    return Path("results") / f"{Path(source).stem}{ending}"


class SourceOptions(CommandOptions):
    """A footprint; SI units. Its keys are the options of the command.

    The source is one of: image; pressure_map, a table of pressures (in Pa unless the file or
    pressure_unit gives another unit) or frames of a sensor (`frame`, by default the one with the
    largest force); line, a profile; gaussian, the profile of fig. 6 (length in m, peak in Pa,
    standard deviation in m). `row` selects one line of pixels of image or map, from the top.
    length, width: of the picture after rotation and cropping, along and across the direction of
    travel, m; dark_is: whether dark means high or low pressure in a grey picture; min_pressure,
    max_pressure: ends of the colour scale, Pa; rotation: degrees counter-clockwise, which turns the
    direction of travel to the right; load: to which all pressures are scaled, N.
    """

    model_config = ConfigDict(alias_generator=_named)

    image: Path | None = None
    pressure_map: InputFile | None = None
    line: InputFile | None = None
    gaussian: GaussianText | None = None
    row: Annotated[int, Field(ge=0, le=100_000)] | None = None
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
        if self.dark_is is not None and (self.colormap or self.legend):
            raise ValueError(
                "--dark-is is of grey pictures: it does not fit --colormap or --legend"
            )
        if self.colormap is not None and self.legend is not None:
            raise ValueError("--colormap and --legend contradict each other; give one of them")

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
