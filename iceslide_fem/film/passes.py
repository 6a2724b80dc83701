"""Repeated passes over the same ice: heat and water at the start of the next pass.

Between passes nothing touches the ice; its columns conduct heat, solved exactly. The water of a
pass drains or stays. Water that stays freezes to cold ice, or only its films do, or nothing:
`Between`. Freezing water holds the surface at the melting point. What does not freeze within the
rest is still there.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from iceslide_fem.film.held_surface import HeldSurface
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.point import CONDENSED, simulate
from iceslide_fem.film.point_conditions import Conditions
from iceslide_fem.film.point_result import PointResult
from iceslide_fem.film.rubber_heat import INSULATED, RubberHeat
from iceslide_fem.runtime.arrays import Array

Between = Literal["drain", "nothing", "film", "all"]  # all water is gone, or which of it freezes


class Passes(NamedTuple):
    """A `number` of passes with a `period` (s), and what happens to water between them.

    carried: fraction of the water on the ice that the voids take in.
    """

    number: int
    period: float
    between: Between
    carried: float = 1.0

    def times(self, lasts: float) -> Array:
        """Times (s) of columns with the layers of a pass that `lasts` (s), deep enough for all."""
        return np.array([lasts, max(lasts, self.number * self.period)])


def column_for(conditions: Conditions, passes: Passes, tolerance: float, ground: Any) -> Column:
    """Columns of ice with the layers of one pass, deep enough for all passes."""
    longest = float(conditions.duration.max())
    times = passes.times(float(conditions.duration.min()))
    column = Column(conditions.temperature, times, solid=conditions.solid, ground=ground)
    return column.condensed(CONDENSED * tolerance, longest / times[1])


def simulate_passes(
    conditions: Conditions,
    passes: Passes,
    ice: Column,
    rubber: RubberHeat = INSULATED,
    **settings: Any,
) -> Iterator[PointResult]:
    """Results of `point.simulate` for each pass; times of each pass begin at 0.

    `settings` are the other arguments of `simulate`. Raises the same errors.
    """
    start = None
    for _ in range(passes.number):
        found = simulate(conditions, ice, rubber=rubber, start=start, **settings)
        yield found
        first, lasted = conditions.initial_height, conditions.duration
        start = next_start(found.state, conditions, ice, passes, first, lasted, rubber)


class Films(Protocol):
    """A law or conditions, by the films that they begin with."""

    def film_height(self, state: InterfaceState) -> Array:
        """h (m) of films, (n,)."""

    def films(self, height: Array, temperature: Array) -> tuple[Array, Array]:
        """ln h and internal variables of films of `height` (m) on ice of `temperature` (K)."""

    def untouched(self, n: int) -> Array:
        """History of the contact of `n` points of rubber that have not touched."""


def next_start(
    state: InterfaceState,
    films: Films,
    ice: Column,
    passes: Passes,
    first: float | Array,
    lasted: float | Array,
    rubber: RubberHeat = INSULATED,
) -> InterfaceState:
    """Initial state of a pass after one that `lasted` (s) and ends in `state`.

    first: height of films without water, m. The contact of the rubber begins untouched. Its heat
    spreads in it, and no air takes any.
    """
    rest = passes.period - lasted + np.zeros_like(state.log_height)
    warm = rubber.cooled(state.rubber, rest)
    water = molten(state, films, first, passes.between)
    heat, left, after = frozen(state.ice, water, rest, ice)
    heat = ice.cooled(heat, after)
    kelvin = ice.surface_temperature(heat)
    begun = after_rest(state, films, first, passes.between, left, kelvin)
    carried = passes.carried * begun.squeezed_height
    return begun._replace(squeezed_height=carried, ice=heat, rubber=warm)


def molten(state: InterfaceState, films: Films, first: Array | float, between: Between) -> Array:
    """Water (m) that freezes in a rest after `state`: of films above the `first` height, and all
    that is squeezed out.
    """
    height = films.film_height(state)
    if between == "all":
        return np.maximum(height + state.squeezed_height - first, 0.0)
    return np.maximum(height - first, 0.0) if between == "film" else np.zeros_like(height)


def after_rest(
    state: InterfaceState,
    films: Films,
    first: Array | float,
    between: Between,
    left: Array,
    kelvin: Array,
) -> InterfaceState:
    """`state` after a rest that leaves `left` (m) of the `molten` water, with the heat of before.

    kelvin: of the ice's surface, K.
    """
    height, squeezed = films.film_height(state), state.squeezed_height
    if between == "drain":
        height, squeezed = first + np.zeros_like(height), np.zeros_like(squeezed)
    elif between != "nothing":
        film = np.clip(height - first, 0.0, left)
        height = first + film
        squeezed = squeezed if between == "film" else np.maximum(left - film, 0.0)
    log_height, internal = films.films(height, kelvin)
    young = films.untouched(state.age.shape[-1])
    return InterfaceState(log_height, squeezed, state.ice, state.rubber, internal, young)


def frozen(heat: Array, water: Array, rest: Array, ice: Column) -> tuple[Array, Array, Array]:
    """Freeze `water` (m, (n,)) within a `rest` (s).

    Returns the heat state of the ice, the remaining water and the remaining time. The surface is at
    the melting point until the water is frozen.
    """
    solid, cold = ice.solid, heat
    held = HeldSurface(ice, heat, solid.melting_temperature)
    stored = solid.melting_enthalpy * water
    at_once = np.minimum(stored, np.maximum(held.given(np.zeros_like(rest)), 0.0))
    time = np.where(at_once < stored, held.time_of(stored, rest), 0.0)
    given = np.clip(held.given(time), at_once, stored)
    heat = np.where(time > 0.0, held.after(time), cold + at_once)
    left = np.where(
        (at_once < stored) & (time == rest), water - given / solid.melting_enthalpy, 0.0
    )
    return heat, left, rest - time


def base_temperature(ice: Column, heat: Array, depth: float) -> Array:
    """Temperature (K) at `depth` (m), (n,); the initial one below the column."""
    at_depths = ice.at_depths(heat)
    if depth > ice.depths[-1] * (1.0 + 1e-9):
        return np.asarray(ice.temperature + np.zeros(at_depths.shape[-1]))
    return np.array([np.interp(depth, ice.depths, column) for column in at_depths.T])
