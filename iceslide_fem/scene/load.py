"""The table `load` of a scene: pressure and speed over time."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from iceslide_fem.runtime.curve import Curve, SmoothCurve
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.rows import Rows, RowsOf
from iceslide_fem.scene.units import Quantity, Table, key

TIME = Quantity("s", "0 s", "1000 s")
PRESSURE = RowsOf("time", TIME, Quantity("Pa", "0.01 bar", "100 bar"), "0.01 bar")
SPEED = RowsOf("time", TIME, Quantity("m/s", "1e-6 m/s", "100 m/s"), "0 m/s")


class Load(Table):
    """Pressure and speed, in time and over several passes; SI units.

    `pressures` and `speeds` are functions of time.
    """

    pressure: Annotated[Any, PRESSURE] = key(
        ...,
        "Nominal pressure: the force of the plate over the nominal area. A number, rows of "
        "times and values, or the path of a CSV file.",
    )
    speed: Annotated[Any, SPEED] = key(
        ..., "Sliding speed: a number, rows, or a file. In rows it may be 0."
    )
    duration: Annotated[float, Quantity("s", "1e-6 s", "100 s")] = key(
        ..., "Sliding time. The press and the speed ramp come before it."
    )
    static_friction: Annotated[float, Quantity("", "0", "2")] = key(
        0.1, "Friction coefficient while the block is pressed on the ice."
    )
    interpolation: Literal["linear", "smooth"] = key(
        "linear",
        "Between rows of times and values: straight lines, or a smooth curve without overshoot.",
    )
    passes: Annotated[int, Field(ge=1, le=100_000)] = key(
        1,
        "How often the rubber slides over the same ice.",
    )
    period: Annotated[float, Quantity("s", "1e-6 s", "1e6 s")] | None = key(
        None, "Time from the beginning of one pass to the beginning of the next."
    )
    pressure_scale: Annotated[float, Quantity("", "0.001", "1000")] = key(
        1.0, "Factor on the pressure. A sweep can vary rows with it."
    )
    speed_scale: Annotated[float, Quantity("", "0.001", "1000")] = key(
        1.0, "Factor on the speed. A sweep can vary rows with it."
    )

    @field_validator("speed", mode="before")
    @classmethod
    def _goes_one_way(cls, speed: Any) -> Any:
        """`speed` unchanged. Raises ValueError if it reverses."""
        for number, (_, value) in enumerate(SPEED.rows(speed), start=1):
            if value < 0.0:
                raise ValueError(
                    f"load.speed is {value:g} m/s in row {number}: the sliding would reverse, "
                    "over ice and films that it has left behind; allowed: 0 m/s to 100 m/s"
                )
        return speed

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        for name, unit, low, high in (("pressure", "Pa", 1e3, 1e7), ("speed", "m/s", 1e-6, 100.0)):
            course: Course = getattr(self, f"{name}s")
            scale, given = getattr(self, f"{name}_scale"), getattr(self, name)
            most, least = max(course.curve.values), min(course.curve.values)
            if most > high * (1 + 1e-9) or (scale != 1.0 and 0.0 < least < low * (1 - 1e-9)):
                raise ValueError(
                    f"load.{name}_scale = {scale:g} leads out of range: load.{name} becomes "
                    f"{least:g} to {most:g} {unit}; allowed: {low:g} to {high:g} {unit}"
                )
            if isinstance(given, tuple) and not course.mean > 0.0:
                raise ValueError(f"load.{name} is 0 {unit} throughout; nothing would slide")
        return self

    @property
    def pressures(self) -> Course:
        """Nominal pressure over time, Pa."""
        return self._course(self.pressure, self.pressure_scale)

    @property
    def speeds(self) -> Course:
        """Sliding speed over time, m/s."""
        return self._course(self.speed, self.speed_scale)

    @property
    def rest(self) -> float:
        """Rest of the ice between two passes, s."""
        return 0.0 if self.period is None else self.period - self.duration

    @property
    def sliding_time(self) -> float:
        """Sliding time of all passes without the rests, s."""
        return self.passes * self.duration

    @property
    def heated_for(self) -> float:
        """Time (s) from the start of the first pass to the end of the last one."""
        return self.sliding_time + (self.passes - 1) * self.rest

    @property
    def changes(self) -> bool:
        """Whether pressure or speed change in time."""
        return not (self.pressures.is_constant and self.speeds.is_constant)

    def _course(self, given: float | Rows, scale: float) -> Course:
        return _course(given, scale, self.duration, self.interpolation == "smooth")


@lru_cache(maxsize=64)
def _course(given: float | Rows, scale: float, duration: float, smooth: bool) -> Course:
    kind = SmoothCurve if smooth and isinstance(given, tuple) else Curve
    return Course(kind.of(given).scaled(values=scale), duration)
