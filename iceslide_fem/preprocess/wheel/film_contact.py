"""Sliding contact below a wheel under the film law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from iceslide_fem.film.first_films import films_of
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.loads import film_loads
from iceslide_fem.preprocess.footprint.aged_path import AgedPath
from iceslide_fem.preprocess.footprint.film_map import Lines, Start, one_pass, start_after
from iceslide_fem.preprocess.footprint.passing import FilmMap, Path
from iceslide_fem.preprocess.footprint.ride import Ahead, Ride
from iceslide_fem.preprocess.wheel.brush import Ends, ends_of
from iceslide_fem.preprocess.wheel.contact import SLOWEST, Onset, Slid
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.contact_table import ConstantContact, ContactTable, contact_on

if TYPE_CHECKING:  # takes long to import, and only rough ice needs it
    from iceslide_fem.surfaces.combined_contact import Change


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
        assert slid.ahead is not None  # of films
        return replace(self, start=slid.ahead())

    def onset(self, pressure: Array, dx: Array, passing: Array, speed: Array) -> Onset:
        """k eta v / (h + h_b), with the film, the water and the age of contact that has stuck."""
        ride = self.ride._replace(speed=passing, sliding_speed=speed)
        nowhere = np.zeros(pressure.shape, dtype=bool)
        films, _ = self._films(pressure, nowhere, dx, ride)
        ahead = ride.ahead if self.start is None else self.start.ahead
        p_at_ends, states = ends_of(pressure, pressure > 0.0), (_before(films, ahead), films)
        change = _change(ride, pressure)
        contacts = contacts_along(ride, pressure, dx / passing, self.contact_of, change)
        stress = [
            [
                self._stress(p, film, contact, ride, at, change)
                for at in (speed, np.full_like(speed, SLOWEST))
            ]
            for p, film, contact in zip(p_at_ends, states, contacts, strict=True)
        ]
        (first, first_rest), (last, last_rest) = stress
        return Onset(Ends(first, last), Ends(first_rest, last_rest))

    def slid(self, pressure: Array, slides: Mask, dx: Array, passing: Array, speed: Array) -> Slid:
        """Sliding contact by `footprint.film_map`, in which ice enters at the last column."""
        ride = self.ride._replace(speed=passing, sliding_speed=speed)
        films, ahead = self._films(pressure, slides, dx, ride)
        stress = Ends(films.shear, films.shear)
        of_ice = films.temperature, films.height, films.melting, films.saturated
        return Slid(stress, *of_ice, ahead)

    def _films(
        self, pressure: Array, slides: Mask, dx: Array, ride: Ride
    ) -> tuple[FilmMap, Callable[[], Start]]:
        """Films of this pass, and what makes the lines ahead of the next one."""
        below = Lines(pressure[:, ::-1], dx / ride.speed)
        found = one_pass(
            below, ride, self.contact_of, self.tolerance, slides=slides[:, ::-1],
            start=self.start,
        )  # fmt: skip
        films = FilmMap._make(field[:, ::-1] for field in found.films)
        return films, partial(start_after, found, below, ride, self.tolerance)

    def _stress(
        self,
        pressure: Array,
        films: FilmMap,
        contact: Contact,
        ride: Ride,
        speed: Array,
        change: Change | None,
    ) -> Array:
        """Friction stress (Pa) under `pressure` (n, nx) at a slip `speed` (m/s, (n,))."""
        flat, speeds = pressure.ravel(), np.repeat(speed, pressure.shape[1])
        warm, height, water = (
            part.ravel() for part in (films.temperature, films.height, films.squeezed)
        )
        viscosity, limit = ride.viscosity_at(warm), ride.limit
        dry = float(np.max(ride.initial_height))
        k, D, H_V, softness = (part.ravel() for part in contact)
        carried = ride.wet and ride.wet.carried(flat, self.contact_of, viscosity, dry, 1.0, change)
        carried = carried and carried._replace(softness=softness)
        limit = limit and limit._replace(viscosity=viscosity)
        before = np.broadcast_to(np.asarray(ride.temperature, dtype=float), speed.shape)
        rough = None
        if ride.hysteresis is not None:
            rough = ride.hysteresis.at(flat, speeds, np.repeat(before, pressure.shape[1]))
        loads = film_loads(flat, speeds, k, D, H_V, viscosity, None, limit, carried, rough=rough)
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


def _change(ride: Ride, pressure: Array) -> Change | None:
    """What rough ice changes below pixels (n, nx) of lines that slide, flat, (n nx,)."""
    if ride.rough is None:
        return None
    lines, columns = pressure.shape
    speed, kelvin = (
        np.repeat(np.broadcast_to(np.asarray(one, dtype=float), (lines,)), columns)
        for one in (ride.sliding_speed, ride.temperature)
    )
    return ride.change(pressure.ravel(), speed, kelvin)


class Contact(NamedTuple):
    """k, D (m), H_V (m), and p_e / p of pixels, (n, nx)."""

    k: Array
    D: Array
    H_V: Array
    softness: Array


def contacts_along(
    ride: Ride,
    pressure: Array,
    passing: Array,
    contact_of: ContactTable | ConstantContact,
    change: Change | None = None,
) -> tuple[Contact, Contact]:
    """The contact at both ends of pixels (n, nx), the first column at the leading edge.

    passing: time of the ice per pixel of each line, s, (n,); change: of `_change`.
    """
    rough = None if change is None else change.reshaped(*pressure.shape)
    k, D, H_V, _ = contact_on(contact_of, pressure, rough)
    if ride.age is None:
        fresh = Contact(k, D, H_V, np.ones_like(pressure))
        return fresh, fresh
    lines, columns = pressure.shape
    path = Path.below(pressure[:, ::-1], passing)
    kelvin, slower = (
        np.broadcast_to(np.asarray(one, dtype=float), (lines,)).copy()
        for one in (ride.rubber_temperature, ride.slower)
    )
    aged = AgedPath.along(
        ride.age, None, path.line, path.pressure, path.behind, passing, kelvin, slower
    )
    here = path.line, columns - 1 - path.column
    of_path = change and change.take(np.ravel_multi_index(here, pressure.shape))
    found = []
    for history in (aged.entering, aged.leaving):
        contact = ride.age.so_far(history)
        values = contact(path.pressure)
        if of_path is not None:
            values = ride.age.table.changed(contact.equivalent(path.pressure), of_path)
        parts = []
        for whole, some in zip(
            (k, D, H_V, np.ones_like(k)),
            (*values[:3], contact.softness(path.pressure)),
            strict=True,
        ):
            part = whole.copy()
            part[here] = some
            parts.append(part)
        found.append(Contact(*parts))
    return found[0], found[1]
