"""The protocol of a friction law: what the program gives it, and what it has to return.

A law is a class with two members, in a file that a scene names
(`friction.law = "my_law.py:MyLaw"`):

    fields                                            state of the law: name -> value at the start
    respond(contact, state, surface, dt) -> Response  one step, at all points at once

and, if it likes,

    carrier                                           "rubber" or "ice": where the state lives

All values are SI. Arrays have one shape (n,), an entry per contact point; n may be 0 and changes
from call to call: a law knows no point by its number.

contact: `pressure` (Pa, 0 where nothing touches) and `speed` of slip (m/s) at the end of the step.
state: for every name of `fields` its array at the start of the step, which must not be changed.
surface: how warm the ice gets at the end of the step under the heat that it is to be given,
`surface.temperature(heat)`; with heat in the rubber that is the answer of both bodies together.
carrier: where ice slides, the state stays with points of the rubber, or with places of the ice,
which come in at the leading edge with the values at the start and change while they are in contact.
Without it the scene's `film.carrier` decides.
dt: length of the step, s. It may be 0: then only the shear of that state is asked for.

A step is one of implicit Euler: the new state fulfils state + dt * rate(new state). From such steps
the program builds a Runge-Kutta method of second order with an estimate of its error, and turns
that into the error of the shear; a law estimates nothing itself. What is explicit works, too, with
shorter steps. `respond` is a pure function: it is called many times for a step, with trial values,
also of steps that are then refused, so it keeps nothing of its own.

The shear acts against sliding and must go to zero with the pressure: otherwise a contact chatters
whose edges lift. All friction work becomes heat, shear * speed, unless the law says otherwise
(`Response.heat`). Ice that would become warmer than it melts melts: the program sees to that. A law
that stores or frees energy makes the run's ledger fail to close, and the run stops.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.runtime.arrays import Array


class Contact(NamedTuple):
    """What acts at the points: pressure (Pa) and slip speed (m/s), arrays (n,)."""

    pressure: Array
    speed: Array


class Surface(NamedTuple):
    """The ice's surface at the end of a step: offset (K), resistance (K m2/W), melting point (K).

    The last may be a number; melted_flux is what the ice takes (W/m2) when it melts.
    """

    offset: Array
    resistance: Array
    melting_temperature: Array | float
    melted_flux: Array

    def temperature(self, heat: Array) -> Array:
        """Temperature (K) at the end of the step under `heat` (W/m2) from friction."""
        warm = self.offset + self.resistance * np.minimum(heat, self.melted_flux)
        return np.minimum(warm, self.melting_temperature)


class Response(NamedTuple):
    """What a law returns: arrays (n,).

    shear: stress, Pa; by_pressure: its derivative by the pressure, 1; heat: W/m2, None for shear *
    speed; state: name -> value at the end of the step, all fields.
    """

    shear: Array
    by_pressure: Array
    state: Mapping[str, Array] = {}
    heat: Array | None = None


class Law(Protocol):
    """A friction law; the module says what its members mean.

    A scene names the file and the class: `friction.law = "my_law.py:Growing"`.

    ```python
    from iceslide_fem import Contact, Law, Response, Surface

    class Growing(Law):  # friction that grows with the slip speed, without a state
        fields = {}

        def respond(self, contact, state, surface, dt):
            mu = 0.05 + 0.02 * contact.speed
            return Response(mu * contact.pressure, mu)
    ```
    """

    fields: Mapping[str, float]

    def respond(
        self, contact: Contact, state: Mapping[str, Array], surface: Surface, dt: float
    ) -> Response:
        """One step of `dt` (s) at all points."""
