"""Coulomb friction, tau = mu p, with mu a number or a table over temperature and speed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from iceslide_fem.laws.protocol import Contact, Response, Surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.mu_table import LARGEST, read_table

if TYPE_CHECKING:  # slow import, needed for tables only
    from scipy.interpolate import RegularGridInterpolator

# Bisections for the temperature consistent with its heat, to 1e-12 K.
BISECTIONS = 50


class Coulomb:
    """mu over surface temperature (K) and slip speed (m/s); constant beyond the table."""

    fields: Mapping[str, float] = {}

    def __init__(self, mu: float | RegularGridInterpolator) -> None:
        self._mu = mu

    @classmethod
    def of(cls, mu: float | None, table: Path | None) -> Self:
        """Build from the number `mu`, or from the file of a `table`. Raises SceneError."""
        return cls(read_table(table) if table is not None else mu or 0.0)

    def coefficient(self, temperature: Array, speed: Array) -> Array:
        """mu, (n,)."""
        if isinstance(self._mu, int | float):
            return np.full(speed.shape, self._mu)
        low, high = (np.array([axis[i] for axis in self._mu.grid]) for i in (0, -1))
        values = np.stack([temperature - ZERO_CELSIUS, speed], axis=-1)
        return np.asarray(self._mu(np.clip(values, low, high)))

    def respond(
        self, contact: Contact, state: Mapping[str, Array], surface: Surface, dt: float
    ) -> Response:
        """Shear at the temperature at the end of the step, consistent with the friction heat."""
        p, v = contact
        low = surface.offset
        high = np.maximum(low, surface.temperature(LARGEST * p * np.abs(v)))
        for _ in range(0 if isinstance(self._mu, int | float) else BISECTIONS):
            middle = 0.5 * (low + high)
            heat = self.coefficient(middle, v) * p * np.abs(v)
            warmer = surface.temperature(heat) > middle
            low, high = np.where(warmer, middle, low), np.where(warmer, high, middle)
        mu = self.coefficient(0.5 * (low + high), v)
        return Response(mu * p, mu)
