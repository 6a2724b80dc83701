"""Values of the options of `iceslide wheel`: parsing and ranges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BeforeValidator

from iceslide_fem.preprocess.option_values import Several, in_equal_steps
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene.units import Quantity

SPEED = Quantity("m/s", "0.1 m/s", "100 m/s")
TEMPERATURE = Quantity("K", "-80 degC", "-0.001 degC")
VARIED = {
    "speed": (SPEED, "20km/h,50km/h"),
    "temperature": (TEMPERATURE, "-10degC,-2degC"),
}
# Stiffness of the whole patch (N/m per m of length), and per area.
RANGES: dict[Literal["Pa", "Pa/m"], tuple[str, str]] = {
    "Pa": ("1e3 N/m^2", "1e13 N/m^2"),
    "Pa/m": ("1e4 Pa/m", "1e15 Pa/m"),
}


class Stiffness(NamedTuple):
    """A given stiffness: of the patch's width in Pa (N/m2), or per area in Pa/m."""

    value: float
    unit: Literal["Pa", "Pa/m"]

    def __str__(self) -> str:
        """As the option takes it."""
        return f"{self.value:.10g}{self.unit}"


_several = Several(
    "--slip", Quantity("", "-1", "1"), "0:1:21 or 0.05,0.1,1", 1, 1001, in_equal_steps
)


def _slips(value: Any) -> Any:
    """Slip ratios in ascending order, from "first:last:count" or "0.1,0.2"."""
    return tuple(sorted({slip + 0.0 for slip in _several(value)}))


def _stiffness(value: Any) -> Any:
    """ "auto" as None, else a number in N/m2 or in Pa/m."""
    if not isinstance(value, str):
        return value
    if value.strip() == "auto":
        return None
    allowed = " or ".join(f"{low} to {high}" for low, high in RANGES.values())
    for unit, (low, high) in RANGES.items():
        try:
            number = to_si(value, unit)
        except ValueError:
            continue
        if to_si(low, unit) <= number <= to_si(high, unit):
            return Stiffness(number, unit)
        raise ValueError(f'--stiffness "{value}" is out of range; allowed: {low} to {high}')
    raise ValueError(
        f'--stiffness "{value}" is neither "auto" nor a number with its unit, N/m^2 (of the whole '
        f"patch, per length and displacement) or Pa/m; allowed: {allowed}"
    )


def _varied(value: Any) -> Any:
    """Values by key from texts such as "speed=20km/h,50km/h", or from texts or lists by key."""
    texts = (str(text).partition("=")[::2] for text in value)
    found: dict[str, tuple[float, ...]] = {}
    for name, values in value.items() if isinstance(value, Mapping) else texts:
        key, text = name.strip(), values if isinstance(values, str) else ",".join(map(str, values))
        if key not in VARIED or not text:
            raise ValueError(
                f'--vary "{name}={text}" is not of the form speed=20km/h,50km/h; allowed keys: '
                f"{' and '.join(VARIED)}"
            )
        if key in found:
            raise ValueError(f"--vary {key} is given twice; give all of its values at once")
        found[key] = Several(f"--vary {key}", *VARIED[key])(text.strip())
        if len(set(found[key])) < len(found[key]):
            raise ValueError(f'--vary "{name}={text}" has a value twice')
    return found


Slips = Annotated[tuple[float, ...], BeforeValidator(_slips)]
StiffnessText = Annotated[Stiffness | None, BeforeValidator(_stiffness)]
Varied = Annotated[dict[str, tuple[float, ...]], BeforeValidator(_varied)]
