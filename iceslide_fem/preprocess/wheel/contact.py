"""Sliding contact below a wheel: the film law, or any law of the common protocol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.limiting_shear import shearing
from iceslide_fem.film.loads import film_loads
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.passing import FilmMap
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.brush import Ends
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable

SLOWEST = 1e-6  # m/s, below which the wheel is at rest


class Slid(NamedTuple):
    """Results of sliding pixels, (n, nx), the first column at the leading edge.

    stress: friction at both ends, Pa; at the exit: temperature of the ice's surface, K; height of
    the film, m, NaN for a law without films; melting, saturated: masks of the switches.
    """

    stress: Ends
    temperature: Array
    height: Array
    melting: Mask
    saturated: Mask

    def lines(self, some: slice) -> Slid:
        """The results of `some` of the lines."""
        first, last = self.stress
        temperature, height = self.temperature[some], self.height[some]
        switches = self.melting[some], self.saturated[some]
        return Slid(Ends(first[some], last[some]), temperature, height, *switches)


class SlidingContact(Protocol):
    """A friction law, as the brush model uses it."""

    def fresh(self, pressure: Array, speed: Array) -> Array:
        """Friction stress (Pa) at the onset of sliding.

        pressure: Pa, (n, nx); speed: m/s, (n,).
        """

    def slid(self, pressure: Array, dx: float, passing: float, speed: Array) -> Slid:
        """Sliding contact under `pressure` (n, nx), Pa, 0 where nothing slides.

        dx: length of pixels, m; passing: speed of the ice, m/s; speed: of sliding, m/s, (n,).
        Raises SimulationStopped if a step fails.
        """


@dataclass(frozen=True)
class FilmContact:
    """The film law, with or without dry shear; `ride` has all parameters except the speeds.

    contact_of: k, D and H_V over pressure; tolerance: target relative error of mu.
    """

    ride: Ride
    contact_of: ContactTable | ConstantContact
    tolerance: float = 1e-2

    def fresh(self, pressure: Array, speed: Array) -> Array:
        """k eta v / (h0 + h_b) of contact with initial films of h0."""
        flat, speeds = pressure.ravel(), np.repeat(speed, pressure.shape[1])
        ride = self.ride._replace(sliding_speed=speed)
        limit, T_0 = ride.limit, np.full_like(flat, ride.temperature)
        contact, viscosity = self.contact_of(flat)[:3], ride.viscosity_at(T_0)
        loads = film_loads(flat, speeds, *contact, viscosity, limit=limit)
        height = np.full_like(flat, ride.initial_height)
        if ride.wet is not None:
            water = np.full_like(flat, ride.wet.height)
            carrying = ride.wet.loads(loads, flat, self.contact_of, float(viscosity[0]))
            shear = carrying.tau(height, water)
        elif limit is None:
            shear = loads.viscous / height
        else:
            strength = limit.strength(np.maximum(ride.solid.melting_temperature - T_0, 0.0))
            shear = loads.viscous * shearing(height, strength, limit.drag(speeds))
        return np.where(pressure > 0.0, shear.reshape(pressure.shape), 0.0)

    def slid(self, pressure: Array, dx: float, passing: float, speed: Array) -> Slid:
        """Sliding contact by `footprint.film_map`, in which ice enters at the last column."""
        ride = self.ride._replace(speed=passing, sliding_speed=speed)
        footprint = PressureMap(pressure[:, ::-1], dx, dx)
        films = film_map(footprint, ride, self.contact_of, self.tolerance)
        films = FilmMap._make(field[:, ::-1] for field in films)
        stress = Ends(films.shear, films.shear)
        return Slid(stress, films.temperature, films.height, films.melting, films.saturated)
