"""The protocol of a user's friction law: its arguments and its result.

A law is a class with two members, in a file that a scene names
(`friction.law = "my_law.py:MyLaw"`):

    fields                                            state of the law: name -> value at the start
    respond(contact, state, surface, dt) -> Response  one step, at all points at once

and one optional member

    carrier                                           "rubber" or "ice": where the state lives

All values are SI. Arrays have the shape (n,), one entry per contact point. n may be 0 and changes
from call to call, so a law must not identify points by index.

contact: `pressure` (Pa, 0 where nothing touches) and `speed` of slip (m/s) at the end of the step.
state: for every name of `fields` its array at the start of the step, which must not be changed.
surface: gives the ice's surface temperature at the end of the step under a heat flux,
`surface.temperature(heat)`. With heat in the rubber this is the joint response of both bodies.
carrier: on sliding ice the state is held either by points of the rubber or by places on the ice.
Places on the ice enter at the leading edge with the initial values and change while they are in
contact. Without this member the scene's `film.carrier` decides.
dt: length of the step, s. With dt = 0 only the shear of the given state is needed.

A step is an implicit Euler step: new state = state + dt * rate(new state). From such steps the
program builds a second-order Runge-Kutta method with an error estimate, so a law estimates no
error. An explicit step also works, with shorter steps. `respond` must be a pure function: it is
called many times per step with trial values, also in rejected steps. It must not store anything.

The shear acts against sliding and must vanish with the pressure. Otherwise contact chatters at
lifting edges. All friction work, shear * speed, becomes heat, unless the law returns another
`Response.heat`. The program handles melting: ice at the melting point melts. If a law stores or
frees energy, the energy balance does not close, and the run stops.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.runtime.arrays import Array


class Contact(NamedTuple):
    """Loads at the points: pressure (Pa) and slip speed (m/s), arrays (n,)."""

    pressure: Array
    speed: Array


class Surface(NamedTuple):
    """The ice's surface at the end of a step: offset (K), resistance (K m2/W), melting point (K).

    The melting point may be a scalar. melted_flux: heat flux into melting ice, W/m2.
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
    """The result of a law; arrays (n,).

    shear: stress, Pa; by_pressure: derivative of shear with pressure, 1; heat: W/m2, None for shear
    * speed; state: name -> value at the end of the step, for all fields.
    """

    shear: Array
    by_pressure: Array
    state: Mapping[str, Array] = {}
    heat: Array | None = None


class Law(Protocol):
    """A friction law. The module docstring explains its members.

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
