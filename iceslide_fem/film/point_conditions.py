"""What acts at points, for many conditions at once: their values, and loads that go in time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.loads import FilmLoads, film_loads
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import (
    ICE,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
    Solid,
    ViscosityTable,
)

# What conditions may be, SI: those of a scene, and what single points of its contact come to.
RANGES = {
    "pressure": (1.0, 1e8, "Pa"),
    "speed": (1e-6, 100.0, "m/s"),
    "temperature": (193.15, MELTING_TEMPERATURE - 1e-3, "K (degrees Celsius and 273.15)"),
    "k": (1e-12, 1.0, "of the nominal area"),
    "D": (1e-9, 0.1, "m"),
    "H_V": (1e-10, 0.1, "m"),
    "initial_height": (1e-9, 1e-5, "m"),
    "duration": (1e-9, 1e3, "s"),
    "viscosity": (1e-5, 10.0, "Pa s"),
    "conductivity": (1e-3, 1e3, "W/(m K)"),
    "density": (1.0, 1e5, "kg/m3"),
    "heat_capacity": (1.0, 1e5, "J/(kg K)"),
    "melting_temperature": (193.15, 373.15, "K"),
    "latent_heat": (1.0, 1e8, "J/kg"),
}
DEFAULTS: dict[str, ArrayLike] = {"viscosity": WATER_VISCOSITY, **ICE._asdict()}


class Conditions(NamedTuple):
    """What distinguishes the points; arrays of one shape (n,).

    pressure (Pa), speed (m/s), temperature of the ice (K), k, D (m), H_V (m), initial_height
    (m), duration (s); viscosity of the water (Pa s); of the ice conductivity (W/(m K)), density
    (kg/m3), heat_capacity (J/(kg K)), melting_temperature (K), latent_heat (J/kg).
    """

    pressure: Array
    speed: Array
    temperature: Array
    k: Array
    D: Array
    H_V: Array
    initial_height: Array
    duration: Array
    viscosity: Array
    conductivity: Array
    density: Array
    heat_capacity: Array
    melting_temperature: Array
    latent_heat: Array

    @classmethod
    def of(cls, **values: ArrayLike) -> Conditions:
        """Conditions from anything that broadcasts to one dimension; water and ice as by default.

        Raises ValueError, with a sentence, where a value is missing, unknown, or outside `RANGES`.
        """
        values = DEFAULTS | values
        for name in sorted({*cls._fields} ^ {*values}):
            raise ValueError(f"{name} is {'unknown' if name in values else 'missing'}")
        for name, (low, high, unit) in RANGES.items():
            given = np.asarray(values[name], dtype=float)
            wrong = given[~((given >= low * (1 - 1e-12)) & (given <= high * (1 + 1e-12)))]
            if wrong.size:
                allowed = f"{low:g} to {high:g} {unit}"
                raise ValueError(f"{name} = {wrong.flat[0]:g} is not possible; allowed: {allowed}")
        arrays = np.broadcast_arrays(*(np.atleast_1d(values[name]) for name in cls._fields))
        return cls(*(np.array(a, dtype=float).ravel() for a in arrays))

    def loads(self, water: ViscosityTable | None = None) -> FilmLoads:
        """The film's loads, constant in time; with `water` the viscosity is that table's at T_0."""
        variable_viscosity = None if water is None else VariableViscosity(water, self.viscosity)
        contact = self.k, self.D, self.H_V
        return film_loads(self.pressure, self.speed, *contact, self.viscosity, variable_viscosity)

    @property
    def solid(self) -> Solid:
        """The ice, in numbers where it is the same for all."""
        parts = (getattr(self, name) for name in Solid._fields)
        return Solid(*(part[0] if (part == part[0]).all() else part for part in parts))

    def take(self, index: Index) -> Conditions:
        """The conditions at `index`."""
        return Conditions(*(part.take(index, mode="clip") for part in self))


class Loading(NamedTuple):
    """Pressure (Pa) and speed (m/s) over time, for all points; `contact` gives k, D and H_V."""

    pressure: Course
    speed: Course
    contact: ContactTable | ConstantContact

    def at(self, here: Conditions, time: Array) -> Conditions:
        """The conditions at `time` (s, one per point)."""
        pressure = self.pressure(time)
        k, D, H_V, _ = self.contact(pressure)
        speed = self.speed(time)
        return here._replace(pressure=pressure, speed=speed, k=k, D=D, H_V=H_V)

    def next_corner(self, time: Array) -> Array:
        """When either has its next corner (s)."""
        return np.minimum(self.pressure.next_corner(time), self.speed.next_corner(time))
