"""Input of `iceslide wheel`, validated like a scene, by the names of its options."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import product
from typing import Annotated, Self

from pydantic import ConfigDict, model_validator

from iceslide_fem.preprocess.footprint.film_options import FilmOptions
from iceslide_fem.preprocess.footprint.scene_keys import refused
from iceslide_fem.preprocess.footprint.source_options import Length, SourceOptions
from iceslide_fem.preprocess.wheel.brush import Pattern, Rolling
from iceslide_fem.preprocess.wheel.option_values import (
    RANGES,
    SPEED,
    Slips,
    StiffnessText,
    Varied,
)
from iceslide_fem.preprocess.wheel.quarter_car import GRAVITY, QuarterCar
from iceslide_fem.preprocess.wheel.stop_options import StopOptions
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.command_options import Number, given, option, option_name, option_names
from iceslide_fem.scene.ice import WARMEST
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.rules import Rule
from iceslide_fem.scene.units import Quantity

# Film options that do not go with a scene.
OF_A_SCENE = [key for key in FilmOptions.model_fields if key not in ("temperature", "tolerance")]


class WheelCase(SourceOptions, FilmOptions, StopOptions):
    """A wheel: footprint, slip and friction law; SI units. Keys are the command's options.

    slip_angle: rad; stiffness: None to compute it; the weight of a quarter car's mass is the load
    of the wheel.
    """

    model_config = ConfigDict(alias_generator=option_names("image"))
    parts = (
        (("pitch",), "a pattern", "groove"),
        (("groove",), "a pattern", "pitch"),
    )
    rules = (
        Rule((given("abs", nothing=False), given("vary", nothing={})), "a stop is of one wheel"),
        Rule((given("abs", nothing=False), given("slip_angle", nothing=0.0)),
             "a stop goes straight"),
        Rule((given("load"), given("mass")), "the wheel of a stop carries the weight of its mass"),
    )  # fmt: skip

    speed: Annotated[float, SPEED, Number] = option(
        50.0 / 3.6, "Speed of the vehicle.", shown="50km/h"
    )
    slip: Slips = option(
        tuple(round(0.05 * i, 2) for i in range(21)),
        "Slip ratios: 1 locked, 0 rolling, below 0 driven.", "A:B:N|S,...", "0:1:21",
    )  # fmt: skip
    slip_angle: Annotated[float, Quantity("rad", "-45 deg", "45 deg"), Number] = option(
        0.0, "Of the wheel's motion to its plane.", "ANGLE", "0"
    )
    vary: Varied = option(
        {}, "A family of curves over speed or temperature: speed=20km/h,50km/h. May be repeated.",
        "KEY=V,V",
    )  # fmt: skip
    stiffness: StiffnessText = option(
        None, "Shear stiffness of the tread: of a patch, or per area. A number does not relax.",
        "auto|N/M2|PA/M", "auto",
    )  # fmt: skip
    carcass: Annotated[float, Quantity("Pa/m", *RANGES["Pa/m"]), Number] | None = option(
        None, "Shear stiffness of the carcass in series with the tread: 60MPa/m.", "PA/M",
        "rigid",
    )  # fmt: skip
    tread_height: Length = option(8e-3, "Height of tread or blocks.")
    pitch: Length | None = option(None, "Of blocks along the wheel, edge to edge: 28mm.")
    groove: Annotated[float, Quantity("m", "0.1 mm", "1 m"), Number] | None = option(
        None, "Between two of them: 8mm."
    )
    scene: InputFile | None = option(
        None, "Whose friction law, ice, water and rubber are taken instead.", "SCENE"
    )

    @model_validator(mode="after")
    def _pattern_has_blocks(self) -> Self:
        if self.pitch is not None and self.groove is not None and self.groove >= self.pitch:
            raise ValueError(
                f"--groove {1e3 * self.groove:.4g} mm leaves no block of --pitch "
                f"{1e3 * self.pitch:.4g} mm; allowed: less than the pitch"
            )
        return self

    @model_validator(mode="after")
    def _stop_goes_down(self) -> Self:
        if self.abs and self.end_speed >= self.speed:
            raise ValueError(
                f"--end-speed {3.6 * self.end_speed:.4g} km/h is not below --speed "
                f"{3.6 * self.speed:.4g} km/h"
            )
        if self.abs and self.measure is not None:
            first, last = (3.6 * speed for speed in self.measure)
            whole = f"{3.6 * self.speed:.4g} to {3.6 * self.end_speed:.4g} km/h"
            if self.measure[0] > self.speed or self.measure[1] < self.end_speed:
                raise ValueError(
                    f"--measure {first:.4g}km/h:{last:.4g}km/h is not within the stop, {whole}"
                )
        return self

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        others = [name for name in OF_A_SCENE if name in self.model_fields_set]
        if self.scene is not None and others:
            raise ValueError(
                f"--scene and {option_name(others[0])} contradict each other: the scene says what "
                "rubs; give one of them"
            )
        return self

    @model_validator(mode="after")
    def _varied_once(self) -> Self:
        for key in self.vary:
            if key in self.model_fields_set:
                raise ValueError(f"--vary {key} and --{key} contradict each other; give one")
        melting, warmest = self.law.ice.melting_temperature, max(self.temperatures)
        if warmest > melting - WARMEST + 1e-9:
            raise ValueError(
                f"the ice's temperature of {warmest - ZERO_CELSIUS:.6g} degC is not below its "
                f"melting temperature, {melting - ZERO_CELSIUS:.6g} degC"
            )
        return self

    @model_validator(mode="after")
    def _stiffness_has_a_width(self) -> Self:
        if self.one_line and self.stiffness is not None and self.stiffness.unit == "Pa":
            raise ValueError(
                "--stiffness in N/m^2 is that of a whole patch, and one line has no width; give "
                "it in Pa/m"
            )
        return self

    @cached_property
    def law(self) -> Scene:
        """The scene of --scene, or of the options.

        Raises SceneError, also if the scene has physics that a wheel does not have.
        """
        if self.scene is None:
            return super().law
        scene = load_scene(self.scene)
        if fault := refused(scene):
            raise SceneError(f"--scene {self.scene}: {fault}")
        return scene

    @property
    def temperatures(self) -> Sequence[float]:
        """Ice temperature (K) of every member of the family."""
        if "temperature" in self.vary:
            return self.vary["temperature"]
        if self.scene is None or "temperature" in self.model_fields_set:
            return (self.temperature,)
        return (self.law.ice.temperature,)

    @property
    def members(self) -> list[Self]:
        """The family: this case at all speeds and temperatures."""
        speeds = self.vary.get("speed", (self.speed,))
        return [
            self.model_copy(update={"speed": speed, "temperature": temperature})
            for speed, temperature in product(speeds, self.temperatures)
        ]

    @property
    def pattern(self) -> Pattern | None:
        """Blocks and grooves of the tread; None for a slick tread."""
        if self.pitch is None or self.groove is None:
            return None
        return Pattern(self.pitch, self.groove)

    def lug_below(self, length: float) -> float:
        """Length of the lug for outflow; that of a block if the tread has a pattern, m."""
        pattern = self.pattern
        block = length if pattern is None else pattern.pitch - pattern.groove
        return super().lug_below(block)

    def car(self, load: float) -> QuarterCar:
        """The quarter car of a stop, by default of the mass that the footprint's `load` (N) weighs.

        A line has no width, and by default the quarter car's usual mass.
        """
        mass = self.mass
        if mass is None:
            mass = QuarterCar().mass if self.one_line else load / GRAVITY
        return QuarterCar(mass, self.wheel_inertia, self.wheel_radius)

    def under(self, law: Scene) -> Self:
        """The same wheel on the ice, and with the friction law, of another scene."""
        found = self.model_copy(update={"temperature": law.ice.temperature})
        vars(found)["law"] = law
        return found

    def rolling(self, slip: float) -> Rolling:
        """The wheel at a slip ratio."""
        return Rolling(self.speed, slip, self.slip_angle)
