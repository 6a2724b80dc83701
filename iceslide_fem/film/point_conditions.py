"""Conditions of points: constant values, and loads that change in time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.film.contact_age import ContactAge
from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.hysteresis import Hysteresis, Rough
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.limiting_shear import LimitingShear, ShearStrength, film_height
from iceslide_fem.film.loads import FilmLoads, film_loads
from iceslide_fem.film.phase import Refreeze
from iceslide_fem.film.strength_over_speed import SpeedLaw
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.runtime.arrays import Array, Index
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import (
    ICE,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
    Solid,
)

# Ranges of conditions, SI: those of a scene, and the values at single points of its contact.
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
FEW = 4  # points for which a table of hysteresis is not made
FROM_NOTHING = 0.0, 1e-5, "m"  # range for films that begin without water
DEFAULTS: dict[str, ArrayLike] = {"viscosity": WATER_VISCOSITY, **ICE._asdict()}


class Conditions(NamedTuple):
    """Conditions of points; arrays of one shape (n,).

    pressure (Pa), speed (m/s), temperature of the ice (K), k, D (m), H_V (m), initial_height
    (m), duration (s); viscosity of the water (Pa s); of the ice conductivity (W/(m K)), density
    (kg/m3), heat_capacity (J/(kg K)), melting_temperature (K), latent_heat (J/kg). limit: of the
    shear, or None; hysteresis: on rough ice, or None; rough: what it gives here.

    ```python
    import numpy as np
    from iceslide_fem import Conditions

    conditions = Conditions.of(
        pressure=1e5, speed=np.linspace(1, 5, 100), temperature=269.15, k=0.3, D=6e-4, H_V=2e-6,
        initial_height=7e-8, duration=7e-3,
    )
    conditions.pressure.shape  # (100,)
    ```
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
    limit: LimitingShear | None = None
    refreeze: Refreeze = "nothing"
    hysteresis: Hysteresis | None = None
    rough: Rough | None = None

    @classmethod
    def of(
        cls,
        strength: ShearStrength | None = None,
        refreeze: Refreeze = "nothing",
        fastest: float | None = None,
        hysteresis: Hysteresis | None = None,
        rate: SpeedLaw | None = None,
        **values: ArrayLike,
    ) -> Conditions:
        """Conditions from values that broadcast to one dimension; defaults for water and ice.

        strength: tau_b of dry rubber on ice if it limits the shear (`limiting_shear`). Films may
        then begin with the height 0, and freeze: `refreeze` is "nothing", "film" or "all". fastest:
        largest speed over time, m/s, by default `speed`; hysteresis: on rough ice; rate: how the
        strength depends on speed. Raises ValueError if a value is missing, unknown, or outside
        `RANGES`.
        """
        values = DEFAULTS | values
        for name in sorted({*RANGES} ^ {*values}):
            raise ValueError(f"{name} is {'unknown' if name in values else 'missing'}")
        ranges = RANGES if strength is None else RANGES | {"initial_height": FROM_NOTHING}
        for name, (low, high, unit) in ranges.items():
            given = np.asarray(values[name], dtype=float)
            wrong = given[~((given >= low * (1 - 1e-12)) & (given <= high * (1 + 1e-12)))]
            if wrong.size:
                allowed = f"{low:g} to {high:g} {unit}"
                raise ValueError(f"{name} = {wrong.flat[0]:g} is not possible; allowed: {allowed}")
        arrays = np.broadcast_arrays(*(np.atleast_1d(values[name]) for name in RANGES))
        numbers = {
            name: np.array(part, dtype=float).ravel()
            for name, part in zip(RANGES, arrays, strict=True)
        }
        if refreeze != "nothing" and numbers["initial_height"].any():
            raise ValueError(
                "films that freeze begin with the height 0: water on cold ice freezes at once"
            )
        if strength is None:
            return cls(**numbers)._replace(hysteresis=hysteresis).on_rough_ice()  # type: ignore[arg-type]
        speed = numbers["speed"] if fastest is None else fastest
        freezes = refreeze != "nothing"
        limit = LimitingShear.of(strength, numbers["viscosity"], speed, freezes, rate)
        components = {"limit": limit, "refreeze": refreeze, "hysteresis": hysteresis}
        return cls(**numbers, **components).on_rough_ice()  # type: ignore[arg-type]

    @classmethod
    def together(cls, parts: Sequence[Conditions]) -> Conditions:
        """Conditions of the points of all `parts`, which have all a limit or none, freeze alike,
        and slide on rough ice or not.
        """
        limits = [part.limit for part in parts if part.limit is not None]
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in RANGES}
        sizes = [part.pressure.size for part in parts]
        limit = LimitingShear.together(limits, sizes) if limits else None
        first, roughs = parts[0], [part.rough for part in parts if part.rough is not None]
        rough = None
        if roughs:
            rough = Rough(*(np.concatenate(some) for some in zip(*roughs, strict=True)))
        return cls(
            **arrays, limit=limit, refreeze=first.refreeze, hysteresis=first.hysteresis, rough=rough
        )

    def on_rough_ice(self) -> Conditions:
        """The conditions with hysteresis at their pressure and speed."""
        if self.hysteresis is None:
            return self
        here = self.pressure, self.speed, self.temperature
        return self._replace(rough=self.hysteresis.at(*here, exact=self.pressure.size <= FEW))

    def in_water(self, water: Curve | None) -> Conditions:
        """The conditions with the viscosity of a table over temperature, that of the cold ice."""
        if water is None:
            return self
        viscosity = water(self.temperature)
        limit = self.limit and self.limit._replace(viscosity=viscosity)
        return self._replace(viscosity=viscosity, limit=limit)

    def loads(self, water: Curve | None = None) -> FilmLoads:
        """Constant film loads; with `water` the viscosity is that of the table at T_0."""
        variable_viscosity = None if water is None else VariableViscosity(water, self.viscosity)
        contact = self.k, self.D, self.H_V
        return film_loads(
            self.pressure,
            self.speed,
            *contact,
            self.viscosity,
            variable_viscosity,
            self.limit,
            refreeze=self.refreeze,
            rough=self.rough,
        )

    @property
    def at_start(self) -> FilmStart:
        """Films before the first step."""
        return self.films(self.initial_height, self.temperature)

    def film_height(self, state: InterfaceState) -> Array:
        """h (m) of films, (n,)."""
        return film_height(state.log_height, self.limit)

    def untouched(self, n: int) -> Array:
        """No history of the contact."""
        return np.zeros((0, n))

    def films(self, height: Array, temperature: Array, water: Curve | None = None) -> FilmStart:
        """Films of the `height` (m) on ice whose surface has the `temperature` (K), (n,).

        water: as for `loads`.
        """
        viscosity = None
        if water is not None:
            viscosity = VariableViscosity(water, water(self.temperature))
        below = np.maximum(self.melting_temperature - temperature, 0.0)
        return FilmStart(*films_of(height, temperature, below, self.speed, viscosity, self.limit))

    @property
    def solid(self) -> Solid:
        """The ice, with scalars if it is the same at all points."""
        parts = (getattr(self, name) for name in Solid._fields)
        return Solid(*(part[0] if (part == part[0]).all() else part for part in parts))

    def take(self, index: Index) -> Conditions:
        """The conditions at `index`."""
        arrays = {name: getattr(self, name).take(index, mode="clip") for name in RANGES}
        limit = self.limit and self.limit.take(index)
        return self._replace(**arrays, limit=limit, rough=self.rough and self.rough.take(index))


class FilmStart(NamedTuple):
    """ln h, or ln(h + s) with a limit, and internal variables (m, n) of films at the start."""

    log_height: Array
    internal: Array


class Loading(NamedTuple):
    """Pressure (Pa) and speed (m/s) over time, for all points, instead of those of the conditions.

    contact: gives k, D and H_V; age: of the contact, whose k, D and H_V then hold instead; rubber:
    its temperature, K, by default that of the ice.
    """

    pressure: Course | None
    speed: Course | None
    contact: ContactTable | ConstantContact
    age: ContactAge | None = None
    rubber: float | None = None

    def at(self, here: Conditions, time: Array, age: Array) -> Conditions:
        """The conditions at `time` (s, one per point), with the history of the contact."""
        pressure = self.pressure_at(here, time)
        contact = self.contact if self.age is None else self.age.so_far(age)
        k, D, H_V, _ = contact(pressure)
        speed = here.speed if self.speed is None else self.speed(time)
        now = here._replace(pressure=pressure, speed=speed, k=k, D=D, H_V=H_V)
        return now.on_rough_ice()

    def pressure_at(self, here: Conditions, time: Array) -> Array:
        """Pressure (Pa) at `time` (s, one per point)."""
        return here.pressure if self.pressure is None else self.pressure(time)

    def untouched(self, n: int) -> Array:
        """History of the contact of `n` points that have not touched."""
        return np.zeros((0, n)) if self.age is None else self.age.fresh(n)

    def next_corner(self, time: Array) -> Array:
        """Time of the next kink of pressure or speed (s)."""
        found = np.full_like(time, np.inf)
        for course in (self.pressure, self.speed):
            if course is not None:
                found = np.minimum(found, course.next_corner(time))
        return found
