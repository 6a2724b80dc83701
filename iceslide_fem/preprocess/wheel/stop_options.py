"""Options of a stop: the car, its brake and control, and between which speeds it is measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Self

from pydantic import BeforeValidator, Field, StrictBool, model_validator

from iceslide_fem.preprocess.wheel.option_values import SPEED
from iceslide_fem.preprocess.wheel.quarter_car import Brake, QuarterCar, Threshold
from iceslide_fem.scene.command_options import CommandOptions, Number, Part, as_number, option
from iceslide_fem.scene.units import Quantity

LATER = 0.8  # of the speed that a stop loses: a measurement begins when the brake has built up
PHASES = 8  # starts of a stop: their mean is within 0.3 % of that of 25 (docs/explanation/wheel.md)
CAR, BRAKE, CONTROL = QuarterCar(), Brake(), Threshold()
TORQUE_RATE = Quantity("N m/s", "1 N m/s", "1e6 N m/s")
SLIP_RATIO = Quantity("", "0.001", "0.99")


def read_measured(value: Any) -> Any:
    """Two speeds (m/s) from "20km/h:5km/h"; anything else unchanged."""
    if not isinstance(value, str):
        return value
    parts = value.split(":")
    said = f'--measure "{value}"'
    if len(parts) != 2:
        raise ValueError(f"{said} is not of the form 20km/h:5km/h")
    try:
        first, last = (SPEED.in_range(as_number(part.strip())) for part in parts)
    except ValueError as error:
        raise ValueError(f"{said}: a speed {error}; allowed: {SPEED.low} to {SPEED.high}") from None
    if not last < first:
        raise ValueError(f"{said} does not go down; allowed: as in 20km/h:5km/h")
    return first, last


Measured = Annotated[tuple[float, float], BeforeValidator(read_measured)]


class StopOptions(CommandOptions):
    """A stop of a quarter car; SI units. The defaults of car, brake and control are assumptions."""

    group = "A stop"
    parts: ClassVar[Sequence[Part]] = (
        (
            (
                "end_speed", "measure", "phases", "mass", "wheel_inertia", "wheel_radius",
                "brake_torque", "brake_time", "release_above", "build_below", "release_rate",
                "build_rate",
            ),
            "a stop", "abs",
        ),
    )  # fmt: skip

    abs: StrictBool = option(
        False, "Brake a quarter car, too: locked, by thresholds of slip, at the peak."
    )
    end_speed: Annotated[float, SPEED, Number] = option(
        5.0 / 3.6, "Where a stop ends.", shown="5km/h"
    )
    measure: Measured | None = option(
        None, "Speeds between which its deceleration is measured: 20km/h:5km/h.", "V:V",
        f"from {LATER:g} of what a stop loses to its end",
    )  # fmt: skip
    phases: Annotated[int, Field(ge=1, le=100), Number] = option(
        PHASES, "Starts of the stop by thresholds, over one cycle of the control.", "N", str(PHASES)
    )
    mass: Annotated[float, Quantity("kg", "1 kg", "100000 kg"), Number] | None = option(
        None, "Of the quarter car.", shown="what the load weighs; of a line 350kg"
    )
    wheel_inertia: Annotated[float, Quantity("kg m^2", "0.01 kg m^2", "1000 kg m^2"), Number] = (
        option(CAR.inertia, "Of the wheel about its axle.", shown="1 kg m^2")
    )
    wheel_radius: Annotated[float, Quantity("m", "5 cm", "2 m"), Number] = option(
        CAR.radius, "Of the wheel.", shown="0.3m"
    )
    brake_torque: Annotated[float, Quantity("N m", "1 N m", "1e6 N m"), Number] = option(
        BRAKE.largest_torque, "Largest of the brake.", shown="1500 N m"
    )
    brake_time: Annotated[float, Quantity("s", "1 ms", "10 s"), Number] = option(
        BRAKE.ramp_time, "Within which the torque rises to it.", shown="0.2s"
    )
    release_above: Annotated[float, SLIP_RATIO, Number] = option(
        CONTROL.high, "Slip ratio above which the control releases the brake.", shown="0.3"
    )
    build_below: Annotated[float, SLIP_RATIO, Number] = option(
        CONTROL.low, "Slip ratio at which it builds up again.", shown="0.1"
    )
    release_rate: Annotated[float, TORQUE_RATE, Number] = option(
        CONTROL.release, "Of the torque.", shown="5000 N m/s"
    )
    build_rate: Annotated[float, TORQUE_RATE, Number] = option(
        CONTROL.build, "Of the torque, after the first release.", shown="1000 N m/s"
    )

    @model_validator(mode="after")
    def _thresholds_in_order(self) -> Self:
        if self.build_below >= self.release_above:
            raise ValueError(
                f"--build-below {self.build_below:g} is not below --release-above "
                f"{self.release_above:g}"
            )
        return self

    @property
    def brakes(self) -> Brake:
        """The brake."""
        return Brake(self.brake_torque, self.brake_time)

    @property
    def control(self) -> Threshold:
        """The control by thresholds of slip."""
        return Threshold(self.release_above, self.build_below, self.release_rate, self.build_rate)

    def measured_from(self, speed: float) -> tuple[float, float]:
        """Speeds (m/s) between which a stop from `speed` is measured."""
        return self.measure or (self.end_speed + LATER * (speed - self.end_speed), self.end_speed)
