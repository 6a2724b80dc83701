"""Mean friction of a footprint over the temperature of the ice, beside formulas of chapter 2."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.empirical import hayhoe_shapley, navin, peng_rectangle
from iceslide_fem.preprocess.footprint.jaeger import friction_flux
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import (
    ICE_EFFUSIVITY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
    ZERO_CELSIUS,
)

# K, how far below the melting temperature the ice is
UNDERCOOLING = np.array([20.0, 15.0, 10.0, 7.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5])
LINES = 20  # of the footprint that stand for those around them: 0.2 % of mu on a tread


class Curves(NamedTuple):
    """Mean mu over the ice's temperature (K), arrays of one shape."""

    temperature: Array
    film: Array
    navin: Array
    hayhoe: Array
    peng: Array


class OtherIce(NamedTuple):
    """Lines of a footprint that stand for all, on ice of other temperatures.

    temperature: (n,), K; pressure: of the lines, once for each of them, (n lines, nx), Pa.
    """

    temperature: Array
    pressure: Array

    @classmethod
    def below(cls, footprint: PressureMap, melting_temperature: float) -> OtherIce:
        """Every n-th line that touches, on ice as cold as `UNDERCOOLING` has it."""
        lines = np.flatnonzero(footprint.contact.any(axis=1))
        every = max(1, lines.size // LINES)
        some = footprint.pressure[lines[every // 2 :: every]]
        temperatures = melting_temperature - UNDERCOOLING
        return cls(temperatures, np.tile(some, (temperatures.size, 1)))

    @property
    def of_lines(self) -> Array:
        """The temperature below each line, K."""
        return np.repeat(self.temperature, len(self.pressure) // self.temperature.size)

    def friction(self, shear: Array) -> Array:
        """Mean mu at each temperature from the `shear` of the lines (Pa)."""
        n = self.temperature.size
        return np.asarray(
            shear.reshape(n, -1).sum(axis=1) / self.pressure.reshape(n, -1).sum(axis=1)
        )


def friction_curves(footprint: PressureMap, case: FootprintCase, mu: Array) -> Curves:
    """Mean friction at `UNDERCOOLING`: `mu` of the film law, and the formulas.

    The formulas see one contact with the footprint's mean pressure; it is as long as the area in
    contact on the lines that touch is on average. Peng's wet area begins where the moving source
    with static friction reaches T_m; its film is that of Hayhoe and Shapley. Water and salt enter
    the film law alone: Navin's formula goes by degC, the others are of pure ice that is as far
    below its melting temperature.
    """
    temperatures = case.melting_temperature - UNDERCOOLING
    pure = MELTING_TEMPERATURE - UNDERCOOLING
    lines = np.flatnonzero(footprint.contact.any(axis=1))
    p, v = footprint.mean_pressure, case.ride.sliding_speed
    length = footprint.contact[lines].sum(axis=1).mean() * footprint.dx
    hayhoe = hayhoe_shapley(p, v, pure, length)
    # Under the flux q a half-space rises by 2 q sqrt(t / pi) / e.
    q = friction_flux(case.static_friction, p, case.speed, case.slip)
    onset = np.pi * (UNDERCOOLING * ICE_EFFUSIVITY / (2.0 * q)) ** 2 * case.speed
    wet = np.maximum(length - onset, 1e-9)
    height = WATER_VISCOSITY * v / (p * hayhoe_shapley(p, v, pure, wet))
    peng = peng_rectangle(v, height, p, wet, length, case.static_friction)
    celsius = temperatures - ZERO_CELSIUS
    return Curves(temperatures, mu, navin(celsius, case.aggregate), hayhoe, peng)
