"""Sliding contact below a wheel: the film law, or any law of the common protocol."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, Step, advance
from iceslide_fem.film.loads import film_loads
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.film.step_control import step_factor
from iceslide_fem.film.voids import lugs_of
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.laws.table import law_of
from iceslide_fem.preprocess.footprint.aged_path import AgedPath
from iceslide_fem.preprocess.footprint.film_map import Start, one_pass, start_after
from iceslide_fem.preprocess.footprint.passing import FilmMap, Path
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ahead, Ride
from iceslide_fem.preprocess.wheel.brush import Ends, ends_of
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import NotConverged, SceneError, SimulationStopped
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable
from iceslide_fem.scene.materials import ICE, Solid

SLOWEST = 1e-6  # m/s, below which the wheel is at rest


class Slid(NamedTuple):
    """Results of sliding pixels, (n, nx), the first column at the leading edge.

    stress: friction at both ends, Pa; at the exit: temperature of the ice's surface, K; height of
    the film, m, NaN for a law without films; melting, saturated: masks of the switches. ahead: the
    lines ahead of the next pass, None without one.
    """

    stress: Ends
    temperature: Array
    height: Array
    melting: Mask
    saturated: Mask
    ahead: Start | None = None

    def lines(self, some: slice) -> Slid:
        """The results of `some` of the lines."""
        first, last = self.stress
        temperature, height = self.temperature[some], self.height[some]
        switches = self.melting[some], self.saturated[some]
        return Slid(Ends(first[some], last[some]), temperature, height, *switches)


class Onset(NamedTuple):
    """Friction stress (Pa) of rubber that begins to slide at its speed, and at rest."""

    begins: Ends
    rests: Ends

    @property
    def static(self) -> Ends:
        """The largest friction stress of rubber that sticks."""
        pairs = zip(self.begins, self.rests, strict=True)
        return Ends(*(np.maximum(one, other) for one, other in pairs))


class SlidingContact(Protocol):
    """A friction law, as the brush model uses it."""

    @property
    def passes(self) -> int:
        """Number of passes over the same ice."""

    def after(self, slid: Slid) -> SlidingContact:
        """The contact of the pass after `slid`."""

    def onset(self, pressure: Array, dx: float, passing: float, speed: Array) -> Onset:
        """Friction stress where sliding begins; arguments as of `slid`, below rubber that sticks.

        Raises SimulationStopped if a step fails.
        """

    def slid(self, pressure: Array, slides: Mask, dx: float, passing: float, speed: Array) -> Slid:
        """Sliding contact under `pressure` (n, nx), Pa, where it `slides`; elsewhere it sticks.

        dx: length of pixels, m; passing: speed of the ice, m/s; speed: of sliding, m/s, (n,).
        Raises SimulationStopped if a step fails.
        """


@dataclass(frozen=True)
class FilmContact:
    """The film law, with or without dry shear; `ride` has all parameters except the speeds.

    contact_of: k, D and H_V over pressure; tolerance: target relative error of mu; start: of the
    lines of this pass, by default untouched.
    """

    ride: Ride
    contact_of: ContactTable | ConstantContact
    tolerance: float = 1e-2
    start: Start | None = None

    @property
    def passes(self) -> int:
        """Number of passes over the same ice."""
        return self.ride.passes.number

    def after(self, slid: Slid) -> FilmContact:
        """The contact of the next pass."""
        return replace(self, start=slid.ahead)

    def onset(self, pressure: Array, dx: float, passing: float, speed: Array) -> Onset:
        """k eta v / (h + h_b), with the film, the water and the age of contact that has stuck."""
        ride = self.ride._replace(speed=passing, sliding_speed=speed)
        nowhere = np.zeros(pressure.shape, dtype=bool)
        films, _ = self._films(pressure, nowhere, dx, ride)
        ahead = ride.ahead if self.start is None else self.start.ahead
        p_at_ends, states = ends_of(pressure, pressure > 0.0), (_before(films, ahead), films)
        contacts = contacts_along(ride, pressure, dx / passing, self.contact_of)
        stress = [
            [
                self._stress(p, film, contact, ride, at)
                for at in (speed, np.full_like(speed, SLOWEST))
            ]
            for p, film, contact in zip(p_at_ends, states, contacts, strict=True)
        ]
        (first, first_rest), (last, last_rest) = stress
        return Onset(Ends(first, last), Ends(first_rest, last_rest))

    def slid(self, pressure: Array, slides: Mask, dx: float, passing: float, speed: Array) -> Slid:
        """Sliding contact by `footprint.film_map`, in which ice enters at the last column."""
        ride = self.ride._replace(speed=passing, sliding_speed=speed)
        films, ahead = self._films(pressure, slides, dx, ride)
        stress = Ends(films.shear, films.shear)
        of_ice = films.temperature, films.height, films.melting, films.saturated
        return Slid(stress, *of_ice, ahead)

    def _films(
        self, pressure: Array, slides: Mask, dx: float, ride: Ride
    ) -> tuple[FilmMap, Start | None]:
        """Films of this pass, and the lines ahead of the next one."""
        footprint = PressureMap(pressure[:, ::-1], dx, dx)
        found = one_pass(
            footprint, ride, self.contact_of, self.tolerance, slides=slides[:, ::-1],
            start=self.start,
        )  # fmt: skip
        films = FilmMap._make(field[:, ::-1] for field in found.films)
        if self.passes == 1:
            return films, None
        return films, start_after(found, footprint, ride, self.tolerance)

    def _stress(
        self, pressure: Array, films: FilmMap, contact: Contact, ride: Ride, speed: Array
    ) -> Array:
        """Friction stress (Pa) under `pressure` (n, nx) at a slip `speed` (m/s, (n,))."""
        flat, speeds = pressure.ravel(), np.repeat(speed, pressure.shape[1])
        warm, height, water = (
            part.ravel() for part in (films.temperature, films.height, films.squeezed)
        )
        viscosity, limit = ride.viscosity_at(warm), ride.limit
        dry = float(np.max(ride.initial_height))
        k, D, H_V, softness = (part.ravel() for part in contact)
        carried = ride.wet and ride.wet.carried(flat, self.contact_of, viscosity, dry, 1.0)
        carried = carried and carried._replace(softness=softness)
        limit = limit and limit._replace(viscosity=viscosity)
        loads = film_loads(flat, speeds, k, D, H_V, viscosity, None, limit, carried)
        below = np.maximum(ride.solid.melting_temperature - warm, 0.0)
        log_height, internal = films_of(height, warm, below, speeds, None, limit)
        state = InterfaceState(log_height, water, np.zeros((0, flat.size)), internal=internal)
        shear = loads.shear(state, Column(warm, 1.0))
        return np.where(pressure > 0.0, shear.reshape(pressure.shape), 0.0)


def _before(films: FilmMap, ahead: Ahead) -> FilmMap:
    """The films at the entry of each pixel: those of the pixel before, the first ones `ahead`."""
    first = FilmMap.untouched((len(films.shear), 1), ahead)
    pairs = zip(first, films, strict=True)
    return FilmMap._make(np.hstack([one, field[:, :-1]]) for one, field in pairs)


class Contact(NamedTuple):
    """k, D (m), H_V (m), and p_e / p of pixels, (n, nx)."""

    k: Array
    D: Array
    H_V: Array
    softness: Array


def contacts_along(
    ride: Ride, pressure: Array, passing: float, contact_of: ContactTable | ConstantContact
) -> tuple[Contact, Contact]:
    """The contact at both ends of pixels (n, nx), the first column at the leading edge.

    passing: time of the ice per pixel, s.
    """
    k, D, H_V, _ = contact_of(pressure)
    if ride.age is None:
        fresh = Contact(k, D, H_V, np.ones_like(pressure))
        return fresh, fresh
    lines, columns = pressure.shape
    path = Path.below(pressure[:, ::-1], passing)
    kelvin, slower = (
        np.broadcast_to(np.asarray(one, dtype=float), (lines,)).copy()
        for one in (ride.temperature, ride.slower)
    )
    aged = AgedPath.along(
        ride.age, None, path.line, path.pressure, path.behind, passing, kelvin, slower
    )
    found = []
    for history in (aged.entering, aged.leaving):
        contact = ride.age.so_far(history)
        values = contact(path.pressure)
        parts = []
        for whole, some in zip(
            (k, D, H_V, np.ones_like(k)),
            (*values[:3], contact.softness(path.pressure)),
            strict=True,
        ):
            part = whole.copy()
            part[path.line, columns - 1 - path.column] = some
            parts.append(part)
        found.append(Contact(*parts))
    return found[0], found[1]


METHOD = INTEGRATORS["sdirk2"]
SHORTEST = 1e-9  # of a pixel's time


class Passing(NamedTuple):
    """Lines in one pixel: sliding speed (m/s, 0 at rest), and pressure (Pa) at both ends, (n,)."""

    speed: Array
    first: Array
    last: Array

    def at(self, fraction: float) -> Array:
        """Pressure at a fraction of the pixel, Pa."""
        return np.asarray(self.first + fraction * (self.last - self.first))


@dataclass(frozen=True)
class LawContact:
    """Sliding contact under `law` on ice of a temperature (K).

    film_height: initial, for laws with films, m; tolerance: target relative error of mu.
    """

    law: InterfaceLaw
    temperature: float
    solid: Solid = ICE
    film_height: float = 70e-9
    tolerance: float = 1e-2

    @property
    def passes(self) -> int:
        """1: what passes leave behind is a film's."""
        return 1

    def after(self, slid: Slid) -> LawContact:
        """The same."""
        return self

    def onset(self, pressure: Array, dx: float, passing: float, speed: Array) -> Onset:
        """Stress of the law's initial state."""
        at_ends = ends_of(pressure, pressure > 0.0)
        begins, rests = (
            Ends(*(self._first(end, at) for end in at_ends))
            for at in (speed, np.full_like(speed, SLOWEST))
        )
        return Onset(begins, rests)

    def _first(self, pressure: Array, speed: Array) -> Array:
        flat, speeds = pressure.ravel(), np.repeat(speed, pressure.shape[1])
        shear, *_ = self.law.at_start(self.film_height, flat.size)(flat, speeds)
        return np.where(pressure > 0.0, shear.reshape(pressure.shape), 0.0)

    def slid(self, pressure: Array, slides: Mask, dx: float, passing: float, speed: Array) -> Slid:
        """Each line is one piece of ice that passes pixel after pixel; all have the same steps."""
        pressure = np.where(slides, pressure, 0.0)
        lines, columns = pressure.shape
        touching, dt = pressure > 0.0, dx / passing
        temperature = np.full(lines, self.temperature)
        ice = Column(temperature, columns * dt, solid=self.solid)
        log_height, squeezed, internal = self.law.initial(self.film_height, lines)
        heat = ice.initial(lines), INSULATED.initial(lines)
        state = InterfaceState(log_height, squeezed, *heat, internal, self.law.untouched(lines))
        at_ends = ends_of(pressure, touching)
        stress, found = np.zeros((2, lines, columns)), np.zeros((4, lines, columns))
        for i in range(columns):
            here = touching[:, i]
            pixel = Passing(np.where(here, speed, 0.0), *(end[:, i] for end in at_ends))
            first = self._stress(state, pixel, 0.0, ice)
            state, step = self._passed(state, pixel, dt, ice)
            last = self._stress(state, pixel, 1.0, ice)
            stress[:, :, i] = np.where(here, [first, last], 0.0)
            warm = ice.surface_temperature(state.ice)
            switches = step.last.melting, step.last.saturated
            found[:, :, i] = warm, self.law.film_height(state), *switches
        warm, height, melting, saturated = found
        return Slid(Ends(*stress), warm, height, melting > 0.0, saturated > 0.0)

    def _stress(self, state: InterfaceState, pixel: Passing, fraction: float, ice: Column) -> Array:
        """Friction stress (Pa) at a fraction of a pixel. Raises SimulationStopped."""
        shear = self.law.loads(pixel.at(fraction), pixel.speed, state.age).shear(state, ice)
        if self.law.fault:
            raise SimulationStopped(self.law.fault)
        return np.asarray(shear)

    def _passed(
        self, state: InterfaceState, pixel: Passing, dt: float, ice: Column
    ) -> tuple[InterfaceState, Step]:
        """State after a pixel that passes in `dt` (s), and the last step. Raises
        SimulationStopped.
        """
        done, trial = 0.0, 1.0
        scale = np.full(pixel.speed.size, self.solid.melting_temperature - self.temperature)
        while True:
            trial = min(trial, 1.0 - done)
            ends = (
                self.law.loads(pixel.at(fraction), pixel.speed, state.age)
                for fraction in (done, done + trial)
            )
            first, last = ends
            try:
                step = advance(state, first, last, trial * dt, ice, METHOD)
                error = float(last.local_error(step, ice, INSULATED, scale).max())
            except NotConverged:
                error = np.inf
            if self.law.fault:
                raise SimulationStopped(self.law.fault)
            error /= METHOD.allowed * self.tolerance
            following = trial * float(step_factor(error, METHOD.estimate_order))
            if error <= 1.0:
                state, done = step.state, done + trial
                if done >= 1.0:
                    return state, step
            elif following < SHORTEST:
                raise SimulationStopped(
                    f"the friction law {self.law.name} cannot be advanced below the wheel: even "
                    f"steps of {following * dt:.2g} s miss the tolerance"
                )
            trial = following


def contact_of_case(case: WheelCase, length: float) -> SlidingContact:
    """Sliding contact of one member of a family; length: of the footprint, m.

    Raises SceneError if a law in a file needs what a wheel does not have, and if passes follow each
    other faster than the ice is below the wheel.
    """
    law, period = case.law, case.law.load.period
    transit = length / (case.end_speed if case.abs else case.rolling(0.0).forward)
    if period is not None and period < transit:
        raise SceneError(
            f"load.period = {period:g} s of --scene {case.scene} is shorter than the ice is below "
            f"the wheel; allowed: {transit:.4g} s or more"
        )
    if law.friction.law == "film":
        ride = case.ride_at(case.speed, 0.0, length)
        if case.scene is not None and ride.wet is not None:
            lugs = lugs_of(law.rubber, wide=law.model != "block")
            ride = ride._replace(wet=ride.wet._replace(lug=lugs.longest))
        return FilmContact(ride, case.contact_of, case.tolerance)
    tables = law.as_dict()
    here = scene_from_dict(tables | {"ice": tables["ice"] | {"temperature": case.temperature}})
    height, own = float(here.initial_height), law_of(here)
    if own.internal_at_start and own.frame("ice") == "rubber":
        raise SceneError(
            f'the friction law {own.name} has carrier = "rubber", and below a wheel the history of '
            'a law stays on the ice; allowed: carrier = "ice"'
        )
    return LawContact(own, case.temperature, here.ice.solid, height, case.tolerance)
