"""Material data of rubber, ice and water, and the contact parameters of compound B.

Source, unless stated otherwise: R. Leonardi, *Advanced numerical model for viscous friction between
rough rubber and smooth ice*, Politecnico di Torino, 2017-18 ("the thesis").
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Index
from iceslide_fem.runtime.curve import LogCurve
from iceslide_fem.scene.contact_table import ContactTable

BAR = 1.0e5

ICE_DENSITY = 916.0  # kg/m3
LATENT_HEAT = 330.0e3  # J/kg
ICE_CONDUCTIVITY = 2.25  # W/(m K)
ICE_HEAT_CAPACITY = 2220.0  # J/(kg K)
ICE_DIFFUSIVITY = ICE_CONDUCTIVITY / (ICE_DENSITY * ICE_HEAT_CAPACITY)  # m2/s
ICE_EFFUSIVITY = (ICE_CONDUCTIVITY * ICE_DENSITY * ICE_HEAT_CAPACITY) ** 0.5  # W s^0.5/(m2 K)
MELTING_TEMPERATURE = 273.15  # K
MELTING_ENTHALPY = ICE_DENSITY * LATENT_HEAT  # J/m3, rho L

WATER_VISCOSITY = 1.8e-3  # Pa s
WATER_CONDUCTIVITY = 0.56  # W/(m K)

RUBBER_CONDUCTIVITY = 0.19  # W/(m K)
RUBBER_HEAT_CAPACITY = 1500.0  # J/(kg K)


# Thermal layers sqrt(alpha t) that heat reaches, where erfc(2) = 0.5 % of the rise remains.
HEATED_LAYERS = 4.0


class Solid(NamedTuple):
    """Thermal properties: conductivity (W/(m K)), density (kg/m3), heat capacity (J/(kg K)).

    Also melting_temperature (K), infinite without melting, and latent_heat (J/kg). Values are
    scalars, or arrays with one value per point.
    """

    conductivity: Any
    density: Any
    heat_capacity: Any
    melting_temperature: Any = np.inf
    latent_heat: Any = 0.0

    @property
    def diffusivity(self) -> Any:
        """alpha = lambda / (rho c), m2/s."""
        return self.conductivity / (self.density * self.heat_capacity)

    def heated_depth(self, duration: float) -> float:
        """Depth (m) that heat from a surface reaches in `duration` (s): some sqrt(alpha t)."""
        return HEATED_LAYERS * math.sqrt(self.diffusivity * duration)

    @property
    def effusivity(self) -> Any:
        """e = sqrt(lambda rho c), W s^0.5/(m2 K)."""
        return (self.conductivity * self.density * self.heat_capacity) ** 0.5

    @property
    def melting_enthalpy(self) -> Any:
        """rho L, J/m3."""
        return self.density * self.latent_heat

    def at(self, index: Index) -> Solid:
        """The same at the points of `index` only."""
        return Solid(*(part[index] if np.ndim(part) else part for part in self))


class Layer(NamedTuple):
    """A layer: name, thickness (m, infinite for a half-space), and solid."""

    name: str
    thickness: float
    solid: Solid


class Ground(NamedTuple):
    """The ground of ice of thickness `depth` (m): `layers` downwards.

    The lowest face is `held` at a temperature (K), or insulated (None).
    """

    depth: float = np.inf
    layers: tuple[Layer, ...] = ()
    held: float | None = None

    def stack(self, ice: Solid) -> tuple[Layer, ...]:
        """The ice and the layers below it, downwards."""
        return (Layer("ice", self.depth, ice), *self.layers)


BOTTOMLESS = Ground()  # for half-space ice
ICE = Solid(ICE_CONDUCTIVITY, ICE_DENSITY, ICE_HEAT_CAPACITY, MELTING_TEMPERATURE, LATENT_HEAT)


def rubber_solid(
    density: float,
    conductivity: float = RUBBER_CONDUCTIVITY,
    heat_capacity: float = RUBBER_HEAT_CAPACITY,
) -> Solid:
    """Rubber of this density (kg/m3)."""
    return Solid(conductivity, density, heat_capacity)


@dataclass(frozen=True)
class MooneyRivlin:
    """Constants of W = C10 (I1bar - 3) + C01 (I2bar - 3) + (J - 1)^2 / D1.

    C10, C01 in Pa, D1 in 1/Pa (the thesis prints MPa for D1; its number is in 1/MPa).
    """

    C10: float
    C01: float
    D1: float

    @classmethod
    def from_nu(cls, C10: float, C01: float, nu: float) -> MooneyRivlin:
        """Constants with D1 = 2/K that gives Poisson's ratio `nu` at small strain."""
        shear = 2.0 * (C10 + C01)
        bulk = 2.0 * shear * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu))
        return cls(C10, C01, 2.0 / bulk)

    def stiffer(self, factor: float) -> MooneyRivlin:
        """The same with C10 and C01 times `factor`, and the same bulk modulus."""
        return MooneyRivlin(factor * self.C10, factor * self.C01, self.D1)

    @property
    def shear_modulus(self) -> float:
        """G = 2 (C10 + C01), Pa."""
        return 2.0 * (self.C10 + self.C01)

    @property
    def bulk_modulus(self) -> float:
        """K = 2 / D1, Pa."""
        return 2.0 / self.D1

    @property
    def youngs_modulus(self) -> float:
        """E = 9 K G / (3 K + G), Pa."""
        K, G = self.bulk_modulus, self.shear_modulus
        return 9.0 * K * G / (3.0 * K + G)

    @property
    def poissons_ratio(self) -> float:
        """nu = (3 K - 2 G) / (6 K + 2 G)."""
        K, G = self.bulk_modulus, self.shear_modulus
        return (3.0 * K - 2.0 * G) / (6.0 * K + 2.0 * G)


# The thesis's finite element chapter; nu = 0.490 follows (it prints 0.495).
COMPOUNDS = {"B": MooneyRivlin(C10=0.1662e6, C01=0.1068e6, D1=0.0737e-6)}
# Young's moduli of the thesis's table 3, Pa. Nothing else is published about A and C.
YOUNGS_MODULUS = {"A": 1.10e6, "B": 1.64e6, "C": 2.04e6}
YOUNGS_MODULUS_ONLY = {name: E for name, E in YOUNGS_MODULUS.items() if name not in COMPOUNDS}


# Table 8 of the thesis. It prints k = 0.105 at 5 bar, but k must rise with pressure. 0.405 is
# assumed here, without certainty (docs/explanation/data.md).
CONTACT_TABLES = {
    "B": ContactTable(
        source="compound B, as published",
        k=LogCurve.of([(1.0 * BAR, 0.266), (5.0 * BAR, 0.405)]),
        D=LogCurve.of([(1.0 * BAR, 29.0e-6), (5.0 * BAR, 46.5e-6)]),
        H_V=LogCurve.of([(1.0 * BAR, 2.86e-6), (5.0 * BAR, 0.56e-6)]),
        youngs_modulus=YOUNGS_MODULUS["B"],
    )
}
