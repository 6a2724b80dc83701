"""The water film as a friction law: its loads and shear under a contact pressure.

The law is made of components (`film.loads`): contact, which may age; shear, which a strength may
limit; voids, which may carry; phase change. A scene without any of their keys has the published
law.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.carrying import Carried
from iceslide_fem.film.contact_age import CONTACT_AREA, AnyContact, ContactAge
from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.hysteresis import Hysteresis
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.law import log_shearing
from iceslide_fem.film.limiting_shear import (
    SHEAR_STRENGTH,
    LimitingShear,
    film_height,
)
from iceslide_fem.film.loads import MOLTEN, FilmLoads, film_loads, viscosity_row
from iceslide_fem.film.phase import Refreeze
from iceslide_fem.film.shear_strength import SLOWEST
from iceslide_fem.film.viscosity import FILM_VISCOSITY, VariableViscosity
from iceslide_fem.film.voids import WetVoids
from iceslide_fem.laws.protocol import Sheared
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import MELTING_TEMPERATURE, WATER_VISCOSITY

NOTHING = 1e-15  # m, capacity of voids whose water does not move: they are full
YOUNG = np.zeros((0, 1))  # history of a contact that does not age


class First(NamedTuple):
    """Start of a run: temperature of ice and rubber (K), slip speed (m/s), film height (m), and
    the melting temperature of the ice (K).
    """

    temperature: float = MELTING_TEMPERATURE - 4.0
    rubber: float = MELTING_TEMPERATURE - 4.0
    speed: float = 1.0
    height: float = 70e-9
    melting_temperature: float = MELTING_TEMPERATURE


class Seen(NamedTuple):
    """Films as points of the rubber see them; arrays (n,).

    height: h eta_0 / eta, m; strength: tau_b, Pa, with a limit; water: in voids that carry, m, else
    None; age: history of the contact; viscosity: eta / eta_0.
    """

    height: Array
    strength: Array | None
    water: Array | None
    age: Array
    viscosity: Array | None = None


@dataclass(frozen=True, eq=False)
class FilmLaw:
    """The film law with the parameters that follow from the contact pressure.

    contact: k, D, H_V over pressure, fresh with an `age`; nominal: pressure (Pa) used for them and
    for squeeze-out instead of the local one, or None; ramp_pressure: pressure (Pa) over which shear
    fades in, because film shear does not vanish with p and would jump at touchdown; viscosity:
    eta_0 of water, Pa s. Components are None if the law does not have them; refreeze: which water
    freezes; flows: speed of water over that of ice that passes (`film.carrying`), below points;
    rough: hysteresis on rough ice.
    """

    contact: AnyContact
    nominal: float | None
    ramp_pressure: float
    viscosity: float = WATER_VISCOSITY
    first: First = First()
    water: VariableViscosity | None = None
    limit: LimitingShear | None = None
    age: ContactAge | None = None
    wet: WetVoids | None = None
    refreeze: Refreeze = "nothing"
    flows: float = 1.0
    rough: Hysteresis | None = None
    fault: str | None = None
    has_film: bool = True

    @property
    def name(self) -> str:
        """Name in messages, with the components."""
        return "film" + "".join(
            words
            for words, component in (
                (" with a limiting shear stress", self.limit),
                (" at the contact's age", self.age),
                (" beside voids that carry", self.wet),
                (" on rough ice", self.rough),
            )
            if component is not None
        )

    @property
    def viscous(self) -> bool:
        """Whether shear is proportional to the slip speed: without a limit, on smooth ice."""
        return self.limit is None and self.rough is None

    def freezes_open(self, state: InterfaceState) -> Mask | bool:
        """Whether water also freezes where no rubber covers the ice, in a step from `state`.

        By area it does where rubber has passed over it. Water that is on the ice before does not.
        """
        if self.refreeze == "area" and self.wet is not None:
            return np.asarray(state.internal[MOLTEN] > 0.5)
        return self.refreeze in ("film", "all")

    @property
    def columns(self) -> tuple[str, ...]:
        """tau_b, the viscosity, and k, where they change."""
        return tuple(
            name
            for name, component in (
                (SHEAR_STRENGTH, self.limit), (FILM_VISCOSITY, self.water), (CONTACT_AREA, self.age)
            )
            if component is not None
        )  # fmt: skip

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Internal variables of films on fresh ice, below the longest lug."""
        return tuple(self.initial(self.first.height, 1)[2][:, 0].tolist())

    def frame(self, asked: str) -> str:
        """The frame that the scene has `asked` for."""
        return asked

    def untouched(self, n: int) -> Array:
        """History of the contact of `n` points of rubber that have not touched, (rows, n)."""
        return np.zeros((0, n)) if self.age is None else self.age.fresh(n)

    def aged(
        self, age: Array, start: Array, end: Array, dt: Array | float, kelvin: Array | None
    ) -> Array:
        """History after `dt` (s) under pressures (Pa) from `start` to `end`, (n,).

        kelvin: temperature of the rubber's surface, K; None for that at the start.
        """
        if self.age is None:
            return age
        kelvin = np.full_like(end, self.first.rubber) if kelvin is None else kelvin
        first, last = (np.where(p > 0.0, self.read_at(p), 0.0) for p in (start, end))
        return self.age.after(age, first, last, self.age.relaxation.reduced(dt, kelvin))

    def of_contact(self, age: Array) -> AnyContact:
        """k, D, H_V over pressure at this history."""
        return self.contact if self.age is None else self.age.so_far(age)

    def _carried(self, pressure: Array, age: Array) -> Carried | None:
        """Load-bearing voids under local `pressure` (Pa), None if voids do not carry."""
        if self.wet is None:
            return None
        ramp, _ = self.ramp(pressure)
        softness: Array | float = 1.0
        if self.age is not None:
            softness = self.age.so_far(age).softness(self.read_at(pressure))
        data = self.wet.voids, pressure, ramp, self.viscosity, softness, self.first.height
        return Carried(*data, flows=self.flows)

    def loads(self, pressure: Array, speed: Array, age: Array = YOUNG) -> FilmLoads:
        """Loads of the film at local `pressure` (Pa), `speed` (m/s) and history of the contact."""
        p, contact = self.read_at(pressure), self.of_contact(age)
        k, D, H_V, _ = contact(p)
        ramp, _ = self.ramp(pressure)
        carried = self._carried(pressure, age)
        p, k = np.where(pressure > 0.0, p, 0.0), ramp * k
        components = self.water, self.limit, carried, self.refreeze
        room = np.maximum(self.flows * H_V, NOTHING) if self.flows != 1.0 else H_V
        rough = None
        if self.rough is not None:
            rough = self.rough.at(pressure, speed, self.first.rubber)
        return film_loads(p, speed, k, D, room, self.viscosity, *components, rough=rough)

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """Films of the height (m) on ice at its initial temperature, with the water on it."""
        heights = np.full(n, film_height)
        log_height, internal = self.films(heights, np.full(n, self.first.temperature))
        return log_height, self.flows * self.brought(np.zeros(n)), internal

    def brought(self, x: Array) -> Array:
        """Water height (m) on the ice at positions `x` (m)."""
        return np.zeros_like(x) if self.wet is None else self.wet.brought(x)

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables of films of `height` (m) on ice of `temperature` (K).

        The slip speed is the first one of the scene.
        """
        below = np.maximum(self.first.melting_temperature - temperature, 0.0)
        speed = np.full_like(height, self.first.speed)
        lug = None if self.wet is None else self.wet.lugs.longest
        return films_of(height, temperature, below, speed, self.water, self.limit, lug)

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of films in `state`, with their present strength and water."""

        def borne(pressure: Array) -> Array:
            if self.wet is None:
                return pressure
            found = self.contact_pressure(pressure.ravel(), state.squeezed_height, state.age)
            return found.reshape(pressure.shape)

        return self.on_rough_ice(self._films(state), borne)

    def _films(self, state: InterfaceState) -> Sheared:
        """The shear law of films in `state` alone."""
        water = None if self.wet is None else state.squeezed_height
        row = viscosity_row(self.limit)
        ratio = None if self.water is None else np.exp(state.internal[row])
        if self.limit is None:
            return self.over(Seen(np.exp(-log_shearing(state)), None, water, state.age, ratio))
        height = self.limit.height(state.log_height)
        height = height if ratio is None else height / ratio
        return self.over(Seen(height, state.internal[1], water, state.age, ratio))

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """`state` with the shearing of its films at the slip `speed` (m/s).

        Viscous shear is proportional to the speed, and the state does not have it.
        """
        if self.limit is None:
            return state
        log_viscosity, internal = np.zeros_like(state.log_height), state.internal.copy()
        if self.water is not None:
            log_viscosity = internal[viscosity_row(self.limit)]
        limit = self.limit.at_viscosity(np.exp(log_viscosity))
        height, strength = limit.height(state.log_height), internal[1]
        rows = limit.internal(height, np.full_like(height, speed), strength)
        internal[0] = rows[0] + log_viscosity
        return state._replace(internal=internal)

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The shear law of `n` films of the height (m)."""
        log_height, water, internal = self.initial(film_height, n)
        state = InterfaceState(
            log_height, water, np.zeros((0, n)), internal=internal, age=self.untouched(n)
        )
        return self.sheared(state, lambda: np.full(n, self.first.temperature))

    def film_height(self, state: InterfaceState) -> Array:
        """h of every film (n,), m."""
        return film_height(state.log_height, self.limit)

    def height_at(self, state: InterfaceState, read: Callable[[Array], Array]) -> Array:
        """Mean h (m) of the films around points.

        It is the harmonic one, which gives their mean shear, where h cannot be 0. read:
        interpolation from films to points. Collective if `read` is.
        """
        if self.limit is None:
            return np.asarray(1.0 / read(np.exp(-state.log_height)))
        return read(self.film_height(state))

    def read(self, shearing: Array, internal: Array, speed: Array, age: Array = YOUNG) -> Sheared:
        """The shear law of points with the mean `shearing` (1/m), (n,), exp of `log_shearing`.

        Voids that carry and hysteresis are left out.
        """
        whole = 1.0 / shearing
        if self.limit is None:
            return self.over(Seen(whole, None, None, age))
        drag = self.limit.drag(speed)
        dry = np.minimum(drag / internal[1], whole)
        return self.over(Seen(whole - dry, drag / dry, None, age))

    def water_height(self, state: InterfaceState) -> Array:
        """Height (m) of squeezed-out water below the rubber, (n,)."""
        return (
            np.asarray(state.squeezed_height / self.flows) if self.flows else state.squeezed_height
        )

    def reported(self, internal: Array, pressure: Array, age: Array) -> Mapping[str, Array]:
        """The `columns` from internal variables (m, n) and histories under `pressure` (Pa)."""
        found: dict[str, Array] = {}
        if self.limit is not None:
            found[SHEAR_STRENGTH] = internal[1]
        if self.water is not None:
            found[FILM_VISCOSITY] = self.viscosity * np.exp(internal[viscosity_row(self.limit)])
        if self.age is not None:
            k, _ = self.age.so_far(age).contact_area(self.read_at(pressure))
            found[CONTACT_AREA] = k
        return found

    def over(self, films: Seen) -> Sheared:
        """The shear law of films: tau = k eta v / (h + h_b), faded in with pressure; see
        `film.carrying` for voids that carry.
        """

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            height = films.height.reshape(pressure.shape)
            whole, viscous = height, np.ones_like(height)
            if self.limit is not None and films.strength is not None:
                whole = height + self.limit.drag(speed) / films.strength.reshape(pressure.shape)
                viscous = np.where(np.abs(speed) > SLOWEST, height / whole, 1.0)
            if films.water is None:
                unit, slope = self.shear(pressure, np.ones_like(whole), whole, films.age)
                return unit * speed, slope * speed, unit * viscous
            step = 1e-6 * np.maximum(np.abs(pressure), 1.0)
            film, thick = self._beside(np.stack([pressure, pressure + step]), whole, films)
            here, more = film + thick
            slope = (more - here) / step
            return here * speed, slope * speed, film[0] * viscous + thick[0]

        return shear

    def on_rough_ice(self, film: Sheared, borne: Callable[[Array], Array]) -> Sheared:
        """The shear of films and of hysteresis; borne: p -> p_c (Pa), any shape."""
        if self.rough is None:
            return film
        rough, kelvin = self.rough, self.first.rubber

        def shear(pressure: Array, speed: Array) -> tuple[Array, Array, Array]:
            tau, by_pressure, by_speed = film(pressure, speed)
            step = 1e-6 * np.maximum(np.abs(pressure), 1.0)
            solid, more = borne(pressure), borne(pressure + step)
            lossy, slope, rate = rough.shear(solid, speed, kelvin)
            return tau + lossy, by_pressure + slope * (more - solid) / step, by_speed + rate

        return shear

    def _beside(self, pressure: Array, whole: Array, films: Seen) -> tuple[Array, Array]:
        """tau of film and water over the slip speed (Pa s/m), beside voids that carry.

        pressure: several (Pa) at all points, (m, ...), as the results.
        """
        assert films.water is not None
        flat, many = pressure.ravel(), len(pressure)
        loads = self.loads(flat, np.ones_like(flat), np.tile(films.age, many))
        assert loads.carried is not None
        shared = loads.carried.sharing(np.tile(films.water, many), loads.speed)
        film = (loads.viscous * shared.viscous).reshape(pressure.shape) / whole
        thick = shared.thick.reshape(pressure.shape)
        if films.viscosity is not None:
            thick = thick * films.viscosity.reshape(whole.shape)
        return film, thick

    def shear(
        self, pressure: Array, speed: Array, film_height: Array, age: Array = YOUNG
    ) -> tuple[Array, Array]:
        """tau = k eta v / h (5.29), faded in with pressure (Pa), and d tau / d p."""
        k, dk_dp = self.of_contact(age).contact_area(self.read_at(pressure))
        if self.nominal is not None:
            dk_dp = np.zeros_like(dk_dp)
        ramp, slope = self.ramp(pressure)
        factor = self.viscosity * speed / film_height
        return ramp * k * factor, (slope * k + ramp * dk_dp) * factor

    def contact_pressure(self, pressure: Array, water: Array, age: Array) -> Array:
        """p_c (Pa) that asperities bear under `pressure` (Pa) with `water` (m), (n,)."""
        carried = self._carried(pressure, age)
        return pressure if carried is None else carried.contact_pressure(water)

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures outside the table of k, D, H_V."""
        return self.contact.outside(self.read_at(pressure))

    def read_at(self, pressure: Array) -> Array:
        """The pressure for k, D, H_V and squeeze-out, Pa: local or nominal."""
        return pressure if self.nominal is None else np.full_like(pressure, self.nominal)

    def ramp(self, pressure: Array) -> tuple[Array, Array]:
        """Fade-in factor of the shear at a pressure (Pa), and its derivative, 1/Pa."""
        x = pressure / self.ramp_pressure
        return np.clip(x, 0.0, 1.0), np.where((x > 0.0) & (x < 1.0), 1.0 / self.ramp_pressure, 0.0)
