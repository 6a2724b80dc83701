"""Input of `iceslide footprint`, validated like a scene, by the names of its options."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from pydantic import ConfigDict, StrictBool

from iceslide_fem.preprocess.footprint.film_options import FilmOptions
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE, TABLE_1_RUBBER
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.source_options import SourceOptions
from iceslide_fem.scene.command_options import Number, option, option_names, scene_option
from iceslide_fem.scene.input_file import InputFile
from iceslide_fem.scene.materials import ICE_EFFUSIVITY, Solid
from iceslide_fem.scene.units import Quantity

_named = option_names("image")
# Options that the thesis's balance alone uses.
OF_THE_BALANCE = (
    "temperature_map state_map depth thesis_slip thesis_time air_temperature tread_material "
    "water_conductivity"
).split()


class FootprintCase(SourceOptions, FilmOptions):
    """A footprint and how it slides; SI units. Its keys are the options of the command.

    Maps of temperature and state replace the results of modules 2 and 3 and have the pixels of the
    pressure. thesis_slip and thesis_time are used in (3.2) and (3.3) only.
    """

    model_config = ConfigDict(alias_generator=_named)
    parts = ((OF_THE_BALANCE, "the thesis's balance", "thesis_balance"),)

    speed: Annotated[float, Quantity("m/s", "0.001 m/s", "100 m/s"), Number] = option(
        3.0, "Speed of the vehicle."
    )
    slip: Annotated[float, Quantity("", "1e-6", "1"), Number] = option(
        1.0, "Slip ratio of film and moving source.", "S", "1, a locked wheel"
    )
    aggregate: Annotated[float, Quantity("g/m^2", "0 g/m^2", "1000 g/m^2"), Number] = option(
        0.0, "Spread on the ice, in (1.2).", "G/M2", "0"
    )
    thesis_balance: StrictBool = option(
        False, "The thesis's macroscopic model, too: (3.3), and its balance."
    )
    temperature_map: InputFile | None = option(
        None, "Temperatures of the ice in degC, for module 3."
    )
    state_map: InputFile | None = option(None, "States for module 3: 1 dry, 2 mixed, 3 wet.")
    static_friction: Annotated[float, Quantity("", "0.001", "2"), Number] = option(
        0.1, "mu_st of (3.2).", "MU"
    )
    depth: Annotated[float, Quantity("m", "1 um", "1 m"), Number] = option(
        1e-4, "Depth d of (3.5) to (3.7).", shown="0.1mm"
    )
    thesis_slip: Annotated[float, Quantity("", "1e-9", "1"), Number] = option(
        1e-5, "Slip in (3.2) for (3.3) alone.", "S"
    )
    thesis_time: Annotated[float, Quantity("s", "1 us", "1000 s"), Number] = option(
        1.0, "Time t in (3.3).", shown="1s"
    )
    air_temperature: Annotated[float, Quantity("K", "-80 degC", "60 degC"), Number] | None = option(
        None, "Of air and tread before they touch, in (3.6).", "T", "that of the ice"
    )
    tread_material: tuple[float, float, float] | None = scene_option(
        "rubber.conductivity", "rubber.density", "rubber.heat_capacity", default=None,
        text="Of the macroscopic model.", metavar="K,RHO,C", shown="0.19,940,1500",
    )  # fmt: skip
    water_conductivity: float = scene_option("water.conductivity", text="In (3.7).")

    @property
    def moving(self) -> Macroscopic:
        """The macroscopic model with a moving source."""
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
        """The macroscopic model as printed, with its own slip and time."""
        return replace(
            self.moving, source="next pixel", slip=self.thesis_slip, time=self.thesis_time
        )

    def ride(self, length: float = np.inf) -> Ride:
        """Kinematics and films of the ice below a footprint of this length (m): V and V S."""
        return self.ride_at(self.speed, self.slip * self.speed, length)
