"""Stress-strain curves of viscoelastic rubber at a constant rate: isochoric, finite strain.

    S = S_e - sum g_i r_i,   tau_i dr_i/dt = S_e - r_i                                      (1)

S_e is the isochoric second Piola-Kirchhoff stress of the instantaneous Mooney-Rivlin constants
(J. C. Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153; G. A. Holzapfel, *Nonlinear Solid
Mechanics*, 2000, section 6.10), of an incompressible body.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iceslide_fem.relaxation.prony import Prony, delayed
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MooneyRivlin

STEPS = 200
Path = Callable[[float], Array]  # from the strain to the deformation gradient (3, 3)


def uniaxial(strain: float) -> Array:
    """F of an incompressible bar at a uniaxial `strain`."""
    stretch = 1.0 + strain
    return np.diag([stretch, stretch**-0.5, stretch**-0.5])


def simple_shear(strain: float) -> Array:
    """F of simple shear along x."""
    result = np.eye(3)
    result[0, 1] = strain
    return result


def stresses(
    constants: MooneyRivlin, prony: Prony, path: Path, strains: Array, times: Array
) -> Array:
    """Cauchy stress (Pa) without the unknown pressure, (strains, 3, 3), at ends of linear steps.

    strains, times (reduced, s): (strains,). Both are 0 before the first entry; a first time of 0
    means a jump.
    """
    g, tau = np.array(prony.fractions)[:, None, None], np.array(prony.times)[:, None, None]
    lagging = np.zeros((len(g), 3, 3))
    before, time, result = np.zeros((3, 3)), 0.0, np.empty((len(strains), 3, 3))
    for i, (strain, until) in enumerate(zip(strains, times, strict=True)):
        F = path(float(strain))
        elastic = _isochoric(constants, F.T @ F)
        lagging = delayed(lagging, before, elastic, (until - time) / tau)
        result[i] = F @ (elastic - (g * lagging).sum(axis=0)) @ F.T
        before, time = elastic, float(until)
    return result


def at_rate(
    constants: MooneyRivlin, prony: Prony, path: Path, largest: float, rate: float
) -> tuple[Array, Array]:
    """Strains up to the `largest` (from 0), and the stress (Pa) at a reduced `rate` (1/s).

    It is the nominal stress of a bar with free sides, or sigma_12 in shear.
    """
    strains = np.linspace(0.0, largest, STEPS + 1)[1:]
    found = stresses(constants, prony, path, strains, strains / rate)
    if path is simple_shear:
        stress = found[:, 0, 1]
    else:
        stress = (found[:, 0, 0] - found[:, 1, 1]) / (1.0 + strains)
    return np.append(0.0, strains), np.append(0.0, stress)


def _isochoric(constants: MooneyRivlin, C: Array) -> Array:
    """S_e (Pa) of the right Cauchy-Green tensor C (3, 3), whose determinant is 1."""
    S = 2.0 * (constants.C10 + constants.C01 * np.trace(C)) * np.eye(3) - 2.0 * constants.C01 * C
    return np.asarray(S - np.tensordot(S, C) / 3.0 * np.linalg.inv(C))
