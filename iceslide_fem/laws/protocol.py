"""What the solver asks of a friction law, and the protocol of a user's law.

`InterfaceLaw` is the law of a scene. The film (`laws.film`) and users' laws (`laws.user_law`)
implement it; `laws.table` chooses the law. Its loads (`film.integrators.Loads`) hold at one end of
a step.

A user's law is a class with two members, in a file that a scene names
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

from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.driving import PointLoads
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.voids import WetVoids
from iceslide_fem.runtime.arrays import Array, Mask


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


# Shear law: function of pressures (Pa) and slip speeds (m/s). It returns the shear (Pa) and its
# derivatives with both. Arrays are (n,) or have any other shape of n entries.
Sheared = Callable[[Array, Array], tuple[Array, Array, Array]]


class InterfaceLaw(Protocol):
    """A friction law at n contact points."""

    @property
    def name(self) -> str:
        """Name of the law in messages."""

    @property
    def has_film(self) -> bool:
        """Whether water films with the scene's k, D and H_V separate rubber and ice.

        Steps at a point then end at melt onset and at saturation of the voids.
        """

    @property
    def wet(self) -> WetVoids | None:
        """Voids that carry and what drains them; None without."""

    @property
    def viscous(self) -> bool:
        """Whether shear is proportional to the slip speed at a given state.

        Shear then vanishes with the speed and cannot jump. Nothing is assumed of other laws.
        """

    @property
    def fault(self) -> str | None:
        """Message about an invalid result of the law on this rank, or None."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the internal variables in tables."""

    @property
    def internal_at_start(self) -> tuple[float, ...]:
        """Initial value of each internal variable."""

    def frame(self, asked: str) -> str:
        """Frame of the history on sliding ice, "ice" or "rubber"; asked: that of the scene.

        History on the ice is held by its nodes (`interface.build.ON_ICE`).
        """

    def initial(self, film_height: float, n: int) -> tuple[Array, Array, Array]:
        """ln h (h in m), H_s (m) and internal variables (m, n) of `n` points at the start."""

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables as of `initial`, for given films and ice.

        height: of the films, m; temperature: of the ice's surface, K; both (n,).
        """

    def untouched(self, n: int) -> Array:
        """History of the contact of `n` points of rubber that have not touched, (rows, n)."""

    def aged(
        self, age: Array, start: Array, end: Array, dt: Array | float, kelvin: Array | None
    ) -> Array:
        """History after `dt` (s) under pressures (Pa) from `start` to `end`, (n,).

        kelvin: temperature of the rubber's surface, K; None for that at the start.
        """

    def loads(self, pressure: Array, speed: Array, age: Array) -> PointLoads:
        """Loads at local `pressure` (Pa), slip `speed` (m/s) and history of the contact."""

    def sheared(self, state: InterfaceState, temperature: Callable[[], Array]) -> Sheared:
        """The shear law of points in `state`, on ice of `temperature` (K)."""

    def at_speed(self, state: InterfaceState, speed: float) -> InterfaceState:
        """`state` with its films sheared at the slip `speed` (m/s)."""

    def at_start(self, film_height: float, n: int) -> Sheared:
        """The initial shear law of `n` points, with films of the height (m) if the law has
        films.
        """

    def film_height(self, state: InterfaceState) -> Array:
        """Film heights (n,), m; NaN for a law without films."""

    def water_height(self, state: InterfaceState) -> Array:
        """Height (m) of squeezed-out water below the rubber, (n,)."""

    def reported(self, internal: Array, pressure: Array, age: Array) -> Mapping[str, Array]:
        """Column -> values, SI, of internal variables (m, n) and histories of the contact under
        pressures (Pa), (n,).
        """

    def contact_pressure(self, pressure: Array, water: Array, age: Array) -> Array:
        """p_c (Pa) that asperities bear under `pressure` (Pa) with `water` (m), (n,)."""

    def outside(self, pressure: Array) -> Mask:
        """Mask of pressures for which the law has no data."""
