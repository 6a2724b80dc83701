"""Hysteresis of a scene under many conditions, and where it comes from."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.film.hysteresis import Hysteresis, hysteresis_of
from iceslide_fem.preprocess.hysteresis.case import HysteresisCase
from iceslide_fem.runs.notes import counted_twice
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.contact_table import contact_on
from iceslide_fem.surfaces.rough_ice import Sliding

CUT_OFFS = 0.1, 0.32, 1.0, 3.2, 10.0  # shortest waves over that of the scene
CHUNK = 500  # conditions at a time: more only take memory
TOO_MANY = 2.0  # ratio of mu_h for half and twice the shortest wave that gives a warning


class CutOff(NamedTuple):
    """mu_h at the scene's own condition with another shortest wave (m)."""

    shortest: float
    mu: float
    contact_fraction: float


class Found(NamedTuple):
    """conditions: rows of speed (m/s), temperature (K), pressure (Pa), the first the scene's own;
    mu, contact_fraction: (rows,); k: of the contact table, (rows,); own: along the waves, of the
    first row; cut_offs: of the shortest wave.
    """

    law: Hysteresis
    conditions: Array
    mu: Array
    contact_fraction: Array
    k: Array
    own: Sliding
    cut_offs: list[CutOff]


def survey(case: HysteresisCase) -> Found:
    """Compute all conditions of a case."""
    scene = case.read
    law = hysteresis_of(scene)
    assert law is not None  # by validation of case and scene
    conditions = case.conditions
    speed, kelvin, pressure = conditions.T
    reduced = speed * law.shift(kelvin)
    own = law.along(reduced[0], pressure[0])
    mu, fraction = [own.mu], [own.contact_fraction]
    for first in range(1, speed.size, CHUNK):
        some = slice(first, first + CHUNK)
        at = law.along(reduced[some], pressure[some])
        mu.append(at.mu)
        fraction.append(at.contact_fraction)
    both = scene.rough_contact
    change = None if both is None else both.at(pressure, speed, kelvin)
    contact = contact_on(scene.contact_on_smooth_ice, pressure, change)
    k = np.broadcast_to(contact.k, pressure.shape)
    cuts = []
    for factor in CUT_OFFS:
        wave = factor * law.ice.shortest
        if wave > 0.5 * law.ice.longest:
            continue
        # The waves of a map end at its pixels, and go on as their last power law.
        other = replace(law, ice=law.ice.between(law.ice.longest, wave))
        at_wave = other.along(reduced[0], pressure[0])
        cuts.append(CutOff(wave, float(at_wave.mu[0]), float(at_wave.contact_fraction[0])))
    return Found(law, conditions, np.concatenate(mu), np.concatenate(fraction), k, own, cuts)


def columns(found: Found) -> dict[str, Array]:
    """Columns of hysteresis.csv, names with units -> (rows,)."""
    speed, kelvin, pressure = found.conditions.T
    return {
        "speed_m_s": speed,
        "temperature_K": kelvin,
        "pressure_Pa": pressure,
        "mu_hysteresis": found.mu,
        "contact_fraction": found.contact_fraction,
        "k": found.k,
    }


def spectrum_columns(found: Found) -> dict[str, Array]:
    """Columns of waves.csv: what every wave gives at the scene's own condition."""
    own = found.own
    sums = np.cumsum(own.friction[0] * own.weights)
    return {
        "wave_m": 2.0 * np.pi / own.q,
        "q_rad_m": own.q,
        "C_m4": found.law.ice(own.q),
        "contact_fraction": own.contact[0],
        "dmu_dlnq": own.friction[0],
        "mu_hysteresis_to_q": sums,
    }


def figures(case: HysteresisCase, found: Found) -> dict[str, Any]:
    """All data for summary.json; SI units as in the names."""
    ice = found.law.ice
    speed, kelvin, pressure = found.conditions[0]
    return {
        "name": case.read.name,
        "mu_hysteresis": float(found.mu[0]),
        "contact_fraction": float(found.contact_fraction[0]),
        "speed_m_s": float(speed),
        "temperature_K": float(kelvin),
        "pressure_Pa": float(pressure),
        "roughness": {
            "rms_m": ice.rms,
            "rms_slope": ice.slope,
            "longest_m": ice.longest,
            "shortest_m": ice.shortest,
            "gamma": found.law.gamma,
        },
        "cut_offs": [one._asdict() for one in found.cut_offs],
        "warnings": warnings(case, found),
    }


def warnings(case: HysteresisCase, found: Found) -> list[str]:
    """What is in doubt."""
    said = []
    near = [one for one in found.cut_offs if 0.2 < one.shortest / found.law.ice.shortest < 5.0]
    if len(near) > 1:
        mu = [one.mu for one in near]
        if max(mu) > TOO_MANY * min(mu):
            said.append(
                f"mu_h is {min(mu):.3g} to {max(mu):.3g} for shortest waves from "
                f"{1e6 * near[-1].shortest:.3g} to {1e6 * near[0].shortest:.3g} um: the cut-off "
                "decides it"
            )
    return said + counted_twice(case.read)
