"""Values of the options of `iceslide footprint`: parsing and ranges."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError

from iceslide_fem.preprocess.footprint.maps import UNITS
from iceslide_fem.preprocess.footprint.picture import Box
from iceslide_fem.preprocess.footprint.pressure_map import LINE_PIXELS
from iceslide_fem.runtime.units import si_unit
from iceslide_fem.scene.command_options import Number, as_number
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
