"""Conduction in a column of ice below a surface that is held at one temperature, exact in time.

In the modes of the column (`film.ice_heat.Column`) let x_j = phi_j theta_j. A flux q that holds the
surface at T_s gives

    dx/dt = -Lambda x + phi q,    phi . x = h = (T_s - T_0)/gain.

Let x_s be the steady state of this, and V with rates nu the modes of Lambda across phi, with
phi . V = 0. Then x = x_s + V exp(-nu t) c. The heat given to the ice follows from phi . x = h:

    phi . phi E(t) = h - phi . x(0) + (phi . Lambda x_s) t + phi . Lambda V ((1 - e^(-nu t))/nu) c

Its first part is the heat that brings the surface to T_s at once.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.linalg import eigh, null_space

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.runtime.arrays import Array

BISECTIONS = 60  # of the time in which a heat is given, to rounding


class HeldSurface:
    """Columns of `ice` that start from the `heat` state and are held at `kelvin` (K) at the top."""

    def __init__(self, ice: Column, heat: Array, kelvin: float) -> None:
        self._ice, self._heat = ice, heat
        phi, rates = ice.surface, ice.rates
        steady = ice.surface_temperature(np.zeros_like(heat))
        gain = (ice.surface_temperature(np.ones_like(heat)) - steady) / (phi @ phi)
        across = null_space(phi[None])
        self._rates, modes = eigh(across.T * rates @ across)
        self._modes = across @ modes
        held = (kelvin - steady) / gain
        if rates[0] > 0.0:  # its base is held
            profile = phi / rates / (phi @ (phi / rates))
        else:
            profile = np.eye(1, rates.size)[0] / phi[0]
        self._steady = np.multiply.outer(profile, held)
        start = phi[:, None] * heat
        self._parts = self._modes.T @ (start - self._steady)
        self._jump = (held - phi @ start) / (phi @ phi)

    def given(self, time: Array) -> Array:
        """Heat (J/m2) given to each column within a `time` (s, one per column)."""
        phi, rates = self._ice.surface, self._ice.rates
        passed = -np.expm1(-np.multiply.outer(self._rates, time)) / self._rates[:, None]
        steady = (phi * rates) @ self._steady * time
        return np.asarray(
            self._jump + (steady + self._outflow @ (passed * self._parts)) / (phi @ phi)
        )

    def time_of(self, heat: Array, longest: Array) -> Array:
        """Time (s) in which each column is given `heat` (J/m2), at most the `longest`."""
        low, high = np.zeros_like(longest), longest.copy()
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            less = self.given(middle) < heat
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        return np.where(self.given(longest) < heat, longest, high)

    def after(self, time: Array) -> Array:
        """Heat state of the columns after a `time` (s, one per column)."""
        fallen = np.exp(-np.multiply.outer(self._rates, time)) * self._parts
        after = (self._steady + self._modes @ fallen) / self._ice.surface[:, None]
        if self._ice.rates[0] == 0.0:  # this mode keeps all heat, to rounding
            after[0] = self._heat[0] + self.given(time)
        return np.asarray(after)

    @cached_property
    def _outflow(self) -> Array:
        """phi . Lambda V, (modes,)."""
        return np.asarray((self._ice.surface * self._ice.rates) @ self._modes)
