"""Creep of a rough viscoelastic half-space under constant loads.

The displacement under the pressure p equals that of an elastic half-space with the instantaneous
modulus under

    P = integral of E_0 J dp,   p = P - sum g_i r_i,   tau_i dr_i/dt = P - r_i.       (1)

P is linear in a step, so each r_i is exact (`relaxation.prony.delayed`) and p = a P - M with known
a and M. A step is then an elastic contact with the compliance C / a and the heights minus C M / a.
This is the scheme of tamaas's MaxwellViscoelastic (L. Frérot et al., J. Open Source Softw. 5 (2020)
2121), with second-order arms instead of backward Euler.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from iceslide_fem.preprocess.roughness.half_space import (
    TOLERANCE,
    Contact,
    Waves,
    compliance,
    press,
    pressed,
)
from iceslide_fem.relaxation.prony import Prony, delayed, mean_response
from iceslide_fem.runtime.arrays import Array

# Error of the mean of P, which is exactly p E_0 J(t) under a constant load.
STEP_TOLERANCE = 1e-3
PER_DECADE = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 64)  # numbers of steps tried


def hold(
    heights: Array,
    pixel: float,
    modulus: float,
    pressures: Sequence[float],
    prony: Prony,
    ages: Sequence[float],
    tolerance: float = TOLERANCE,
    periodic: bool = True,
) -> Iterator[list[Contact]]:
    """Contacts at the `ages` after sudden loading by each mean pressure (Pa).

    heights: m, (rows, columns), asperities up, periodic or continued by mirror images; pixel: m;
    modulus: instantaneous E* = E / (1 - nu^2), Pa; ages: reduced times, s, ascending. Iterations
    count from the last age. Raises SimulationStopped if an iteration does not converge.
    """
    waves = Waves((heights.shape[0], heights.shape[1]), pixel, periodic)
    soft, times = compliance(waves, modulus), steps(prony, ages)
    level = heights - heights.mean()
    for contact in press(heights, pixel, modulus, pressures, tolerance, periodic):
        yield _held(level, waves, soft, contact, prony, times, ages, tolerance)


def _held(
    heights: Array,
    waves: Waves,
    soft: Array,
    contact: Contact,
    prony: Prony,
    times: Array,
    ages: Sequence[float],
    tolerance: float,
) -> list[Contact]:
    """Contacts at the ages, from the contact at time 0."""
    g = np.array(prony.fractions)
    p = equivalent = contact.pressure
    lagging = np.zeros((len(g), *heights.shape))
    found, iterations, error = [], contact.iterations, contact.error
    if ages[0] == 0.0:
        found, iterations = [contact], 0
    for before, now in pairwise(times):
        x = ((now - before) / np.array(prony.times))[:, None, None]
        # Arms for constant P; a change of P adds a proportional part.
        lagging = delayed(lagging, equivalent, equivalent, x)
        reached = mean_response(x)
        part = 1.0 - float(g @ reached.ravel())
        known = np.tensordot(g, lagging - reached * equivalent, axes=1)
        lifted = heights - waves.filtered(soft, known) / part
        contact = pressed(lifted, waves, soft / part, p, tolerance)
        p, last = contact.pressure, equivalent
        equivalent = (p + known) / part
        lagging += reached * (equivalent - last)
        iterations, error = iterations + contact.iterations, max(error, contact.error)
        if now in ages:
            found.append(contact._replace(iterations=iterations, error=error))
            iterations = 0
    return found


def steps(prony: Prony, ages: Sequence[float]) -> Array:
    """Times (s) from 0 through all ascending `ages`, in equal ratios after the first one.

    Their number is the smallest with an accurate mean of P at the ages, which follows from (1) with
    p = 1 without contact. Arms much faster than an age need no separate steps.
    """
    last = max(ages)
    if last == 0.0:
        return np.zeros(1)
    soonest = min(age for age in ages if age > 0.0)
    decades = int(np.ceil(max(0.0, np.log10(soonest / prony.times[0])))) + 2
    best = None
    for per_decade in PER_DECADE:
        for earlier in range(decades + 1):
            first = soonest * 10.0**-earlier
            number = 1 + int(np.ceil(per_decade * np.log10(last / first)))
            between = np.geomspace(first, last, number)[:-1]
            times = np.unique(np.concatenate([[0.0], between, ages]))
            if (best is None or len(times) < len(best)) and (
                step_error(prony, times, ages) <= STEP_TOLERANCE
            ):
                best = times
    return times if best is None else best


def step_error(prony: Prony, times: Array, ages: Sequence[float]) -> float:
    """Largest relative error of the mean of P at the `ages`, with steps that end at `times` (s)."""
    g, tau = np.array(prony.fractions), np.array(prony.times)
    P, lagging, found = 1.0, np.zeros_like(g), [1.0]
    for before, now in pairwise(times):
        x = (now - before) / tau
        lagging, reached = delayed(lagging, np.array(P), np.array(P), x), mean_response(x)
        new = (1.0 + float(g @ (lagging - reached * P))) / (1.0 - float(g @ reached))
        lagging, P = lagging + reached * (new - P), new
        found.append(P)
    at = np.isin(times, ages)
    return float(np.abs(np.array(found)[at] / prony.creep.compliance(times[at]) - 1.0).max())
