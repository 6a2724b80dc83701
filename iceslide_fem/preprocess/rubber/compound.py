"""The rubber of a DMA table or of a scene, and its stress at a constant rate of stretch: isochoric,
finite strain.

    S = S_e - sum g_i r_i,   tau_i dr_i/dt = S_e - r_i                                      (1)

S_e is the isochoric second Piola-Kirchhoff stress of the instantaneous Mooney-Rivlin constants
(J. C. Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153; G. A. Holzapfel, *Nonlinear Solid
Mechanics*, 2000, section 6.10), of an incompressible body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.relaxation.dma import read_dma
from iceslide_fem.relaxation.dma_fit import Characterised, characterised
from iceslide_fem.relaxation.prony import Prony, Relaxation, delayed
from iceslide_fem.relaxation.prony_fit import MOST_ARMS
from iceslide_fem.relaxation.shift import NoShift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import celsius
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.materials import MooneyRivlin

SAID = "the DMA table"
# Pa; 14 rubbers are within 35 % of it: J. Burns, P. S. Dubbelday, R. Y. Ting, J. Polym. Sci. B 28
# (1990) 1187.
BULK_MODULUS = 2.9e9
SHOWN = (253.15, 273.15, 293.15)  # K, default temperatures
UNITS = {"compound": "", "C10": "Pa", "C01": "Pa", "D1": "1/Pa", "nu": ""}
DECADES = 4.0  # range beyond the arms in which a scene's series is shown


@dataclass(frozen=True)
class Compound:
    """A viscoelastic compound.

    name: for titles; modulus: instantaneous, Pa; of: its kind, Young's (E) or shear modulus (G);
    constants: instantaneous; keys: of a scene's `[rubber]`, with comments; measured: data of a DMA
    table, or None; of_is_assumed: whether nothing says what `of` is.
    """

    name: str
    of: str
    modulus: float
    relaxation: Relaxation
    constants: MooneyRivlin
    keys: dict[str, tuple[Any, str]]
    modulus_is: str
    measured: Characterised | None = None
    of_is_assumed: bool = False

    @property
    def reference(self) -> float | None:
        """Reference temperature (K) of the arms' times; None if times do not shift."""
        shift = self.relaxation.shift
        return None if isinstance(shift, NoShift) else shift.reference

    @property
    def frequencies(self) -> tuple[float, float]:
        """Range of known reduced angular frequencies (rad/s)."""
        if self.measured is not None:
            reduced = self.measured.reduced
            return float(reduced.min()), float(reduced.max())
        times, beyond = self.relaxation.prony.times, 10.0 ** (0.5 * DECADES)
        return 1.0 / (times[-1] * beyond), beyond / times[0]

    @property
    def isotherms(self) -> Array:
        """Measured temperatures (K); empty for a scene."""
        return np.array([]) if self.measured is None else self.measured.dma.isotherms


def compound(case: RubberCase) -> Compound:
    """The rubber of a case. Raises SceneError, one sentence."""
    found = _of_scene(case) if case.is_scene else _of_table(case)
    coldest = [T for T in case.temperatures or () if not np.isfinite(found.relaxation.shift(T))]
    if coldest:
        raise SceneError(
            f"--temperatures: the WLF shift has no value at {celsius(coldest[0])}; "
            "allowed: warmer ones"
        )
    return found


def temperatures(case: RubberCase, found: Compound) -> list[float]:
    """Temperatures (K) of stress-strain curves."""
    shift = found.relaxation.shift
    if isinstance(shift, NoShift):
        return [float(found.isotherms[0])] if found.isotherms.size else list(SHOWN[-1:])
    return [T for T in case.temperatures or SHOWN if np.isfinite(shift(T))] or [shift.reference]


def _of_table(case: RubberCase) -> Compound:
    table = read_dma(case.source, SAID, case.kind, case.strain, case.temperature)
    said = f"{SAID} {case.source}"
    isotherms = table.isotherms
    if len(isotherms) == 1 and case.wlf is None:
        for option in ("reference", "shift", "arrhenius_below"):
            if getattr(case, option) is not None:
                raise SceneError(
                    f"{said} has one temperature, {celsius(isotherms[0])}, so that "
                    f"--{option.replace('_', '-')} has no meaning; leave it out, or give --wlf"
                )
    measured = characterised(
        table, said, case.given_shift, case.reference, case.arrhenius_below, case.shift or "wlf",
        case.arms or MOST_ARMS,
    )  # fmt: skip
    shear = measured.instantaneous / (3.0 if table.of == "E" else 1.0)
    now = MooneyRivlin(0.5 * shear, 0.0, 2.0 / BULK_MODULUS)
    modulus_is = case.modulus_is or "long-term"
    long_term = measured.relaxation.prony.long_term
    given = now if modulus_is == "instantaneous" else now.stiffer(long_term)
    keys: dict[str, tuple[Any, str]] = {
        "C10": (
            given.C10,
            f"Pa; Neo-Hookean, half of the {modulus_is} shear modulus, {2.0 * given.C10:.4g} Pa",
        ),
        "C01": (0.0, "Pa; moduli at small strain say nothing about it"),
        "D1": (
            given.D1,
            f"1/Pa; not in a DMA table: of a bulk modulus of {BULK_MODULUS / 1e9:g} GPa",
        ),
    }
    return Compound(
        case.source.stem, table.of, measured.instantaneous, measured.relaxation, now, keys,
        modulus_is, measured, case.kind is None and not table.named,
    )  # fmt: skip


def _of_scene(case: RubberCase) -> Compound:
    scene = load_scene(case.source)
    rubber, relaxation = scene.rubber, scene.rubber.relaxation
    if relaxation is None or rubber.modulus_is is None:
        raise SceneError(
            f"the rubber of {case.source} is elastic: it has neither rubber.prony nor rubber.dma"
        )
    now = scene.mooney_rivlin
    keys = {
        name: (getattr(rubber, name), unit)
        for name, unit in UNITS.items()
        if getattr(rubber, name) is not None
    }
    found = Compound(scene.name, "E", now.youngs_modulus, relaxation, now, keys, rubber.modulus_is)
    if rubber.dma is None:
        return found
    measured = rubber.measured
    assert measured is not None  # of rubber.dma
    table = measured.dma
    # The table gives ratios, so its moduli are scaled to the constants.
    ratio = now.youngs_modulus / measured.instantaneous
    loss = None if table.loss is None else ratio * table.loss
    scaled = replace(table, of="E", storage=ratio * table.storage, loss=loss)
    return replace(found, measured=replace(measured, dma=scaled, instantaneous=now.youngs_modulus))


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
