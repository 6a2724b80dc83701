"""The thesis's closed-form flux into molten ice, below each contact point: `half-space` ice."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.law import Film, FilmStage, Surface
from iceslide_fem.runtime.arrays import Array, Index, Mask
from iceslide_fem.scene.materials import ICE, Solid

# A surface held at T_m deviates by rounding: within this (K) below T_m it counts as held.
ROUNDING = 1e-10


class HalfSpace:
    """The thesis's closed-form flux after melting: lambda (T_m - T_0) / sqrt(pi alpha t), (5.6).

    Up to melting the surface temperature is that of resolved conduction; afterwards it stays at
    T_m. (5.6) assumes that the surface jumps to T_m at t = 0. Right after the onset it is about
    half the true flux. t is the time in contact (the thesis's subroutine takes the run time). Heat
    state: that of `Column`, and t (s) as last row. After the onset the column is held at T_m, which
    marks a point as melting in a form that Runge-Kutta stages can combine.

    At the onset the flux jumps. A stage that contains the onset melts from its start, an error of
    the order of the step. A step that ends on the onset stays dry (`late`).
    """

    _late = 0.0

    def __init__(
        self, temperature: float | Array, duration: float | Array, solid: Solid = ICE
    ) -> None:
        """Half-space at `temperature` (K) for runs of `duration` (s); both scalar or per point."""
        self._column = Column(temperature, duration, solid=solid)

    def condensed(self, error: float) -> HalfSpace:
        """The half-space whose column is `Column.condensed`."""
        part = copy(self)
        part._column = self._column.condensed(error)
        return part

    def late(self, band: float) -> HalfSpace:
        """The half-space for steps that end on the onset.

        The onset is met within `band` * (T_m - T_0). A surface may exceed T_m by this amount before
        it melts. A melting surface may be below T_m by twice this amount.
        """
        part = copy(self)
        part._late = band
        return part

    def take(self, index: Index) -> HalfSpace:
        """The half-space below the points at `index` only."""
        part = copy(self)
        part._column = self._column.take(index)
        return part

    def initial(self, n_points: int) -> Array:
        """Ice at its initial temperature, contact time zero."""
        return np.vstack([self._column.initial(n_points), np.zeros((1, n_points))])

    def stage(self, start: Array, dt: Array | float, film: Film) -> tuple[Array, FilmStage]:
        """One implicit stage: conduction gives the onset of melting, (5.6) the flux after it."""
        amplitudes, time = start[:-1], start[-1] + dt
        solid = self._column.solid
        T_m = solid.melting_temperature
        undercooling = T_m - self._column.temperature
        late = self._late * undercooling
        melting = self.surface_temperature(start) >= T_m - 2.0 * late - ROUNDING
        resolved = self._column.response(amplitudes, dt)
        dry = resolved._replace(melted_flux=resolved.melted_flux + late / resolved.resistance)
        flux = solid.conductivity * undercooling / np.sqrt(np.pi * solid.diffusivity * time)
        at_T_m = np.broadcast_to(T_m, flux.shape)
        closed_form = Surface(at_T_m, resolved.resistance, flux, solid)
        result = film.solve(_chosen(melting, closed_form, dry))
        molten = melting
        begins = result.melting & ~melting
        if begins.any():
            melting = melting | begins
            result = film.solve(_chosen(melting, closed_form, dry))
        conducted = np.where(melting, resolved.melted_flux, result.ice_flux)
        amplitudes = self._column.heated(amplitudes, dt, dt * conducted)
        # Up to the onset the column warms, so its temperature gives the onset.
        unmolten = resolved.offset + resolved.resistance * result.friction_power
        unmolten = np.where(molten, T_m, unmolten)
        return np.vstack([amplitudes, time]), result._replace(dry_temperature=unmolten)

    def surface_temperature(self, heat_state: Array) -> Array:
        """Temperature of the surface (K), shape (n_points,)."""
        return self._column.surface_temperature(heat_state[:-1])

    def saved(self, heat_state: Array) -> dict[str, Array]:
        """Checkpoint arrays: those of `Column`, and the time in contact."""
        return self._column.saved(heat_state[:-1]) | {"time": heat_state[-1:]}

    def restored(self, saved: Mapping[str, Array]) -> Array:
        """Heat state from `saved` arrays, also those of a shorter run."""
        return np.vstack([self._column.restored(saved), saved["time"]])


def _chosen(first: Mask, one: Surface, other: Surface) -> Surface:
    """`one` at the points where `first` is true, `other` elsewhere."""
    offset, resistance, flux = (
        np.where(first, a, b) for a, b in zip(one[:3], other[:3], strict=True)
    )
    return Surface(offset, resistance, flux, one.solid)
