"""A rough elastic half-space pressed on a rigid plane, without friction or adhesion.

The surface is periodic or mirrored, on a grid. Displacements are computed by FFT, pressures by
bound-constrained conjugate gradients (Polonsky and Keer, Wear 231 (1999) 206-219). The
preconditioner is the stiffness of the half-space restricted to the contact; it reduces the
iterations to a quarter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.surfaces.waves import Waves

TOLERANCE = 1e-7
MOST_ITERATIONS = 2000


class Contact(NamedTuple):
    """A rough surface on a plane; arrays of the map's shape (rows, columns).

    pressure: Pa, positive exactly in contact; gap: m, zero in contact; error: residual of gap times
    pressure and of overlap, over the rms height.
    """

    pressure: Array
    gap: Array
    iterations: int
    error: float


def compliance(waves: Waves, modulus: float) -> Array:
    """Displacement over pressure of every wave: 2 / (E* |q|), m/Pa.

    Johnson, *Contact Mechanics*, 1985, section 13.2. The mean displacement of a half-space is
    undefined, and set to zero. modulus: E*, Pa.
    """
    q = waves.q
    q[0, 0] = inf
    return np.asarray(2.0 / (modulus * q))


def press(
    heights: Array,
    pixel: float,
    modulus: float,
    pressures: Sequence[float],
    tolerance: float = TOLERANCE,
    periodic: bool = True,
) -> Iterator[Contact]:
    """Press the surface on the plane with each mean pressure (Pa); ascending ones are fastest.

    heights: m, (rows, columns), asperities up, periodic or continued by mirror images; pixel: m;
    modulus: E* = E / (1 - nu^2) of the rubber, Pa. Raises SimulationStopped if the iteration does
    not converge.
    """
    waves = Waves((heights.shape[0], heights.shape[1]), pixel, periodic)
    soft = compliance(waves, modulus)
    heights = heights - heights.mean()
    distribution = np.ones_like(heights)
    for mean in pressures:
        contact = pressed(heights, waves, soft, distribution * mean, tolerance)
        yield contact
        distribution = contact.pressure / mean


def pressed(heights: Array, waves: Waves, soft: Array, p: Array, tolerance: float) -> Contact:
    """Pressure and gap at the mean pressure of the first guess `p` (Pa).

    soft: see `compliance`; heights: m, of mean 0; arrays have the map's shape. Raises
    SimulationStopped, as `press`. The solution minimises p.u/2 - p.h over p >= 0 with the given
    mean, with the displacement u of p. The gradient, g = u - h minus its mean over the contact, is
    the gap at the solution.
    """
    mean, rms = float(p.mean()), float(np.sqrt(np.mean(heights**2)))
    if rms == 0.0:
        return Contact(p, np.zeros_like(p), 0, 0.0)
    stiff = np.divide(1.0, soft, out=np.zeros_like(soft), where=soft > 0.0)
    u = waves.filtered(soft, p)
    step, before, last = np.zeros_like(p), np.zeros_like(p), inf
    for iteration in range(MOST_ITERATIONS):
        touching = p > 0.0
        count = float(np.count_nonzero(touching))
        g = u - heights
        g -= np.vdot(p, g) / p.sum()
        overlap = -float(g.min(where=~touching, initial=0.0))
        error = max(float(np.vdot(p, np.abs(g)) / p.sum()), overlap) / rms
        if error <= tolerance:
            g[touching] = 0.0
            return Contact(p, np.maximum(g, 0.0, out=g), iteration, error)

        inside = g * touching
        inside -= inside.sum() / count * touching
        preconditioned = waves.filtered(stiff, inside) * touching
        preconditioned -= preconditioned.sum() / count * touching
        size = float(np.vdot(inside, preconditioned))
        # Polak and Ribiere's factor: it restarts automatically when the contact changes.
        step *= max(0.0, (size - float(np.vdot(before, preconditioned))) / last)
        step += preconditioned
        step *= touching
        before, last = inside, size or inf
        response = waves.filtered(soft, step)
        curvature = np.vdot(step, response) - step.sum() * np.vdot(response, touching) / count
        slope = float(np.vdot(inside, step))
        length = slope / float(curvature) if slope else 0.0
        moved = p - length * step

        linear = moved.min() >= 0.0
        np.maximum(moved, 0.0, out=moved)
        if overlap > 0.0:
            # Pixels that come into contact get the mean ratio of change to gap; a single pixel has
            # none.
            stiffness = float(stiff[stiff > 0.0].min())
            if slope:
                stiffness = length * slope / float(np.vdot(inside, inside))
            entering = ~touching & (g < 0.0)
            moved[entering] = -stiffness * g[entering]
            linear = False
        factor = mean / float(moved.mean())
        p = moved * factor
        u = (u - length * response) * factor if linear else waves.filtered(soft, p)
    raise SimulationStopped(
        f"the contact at {mean:.4g} Pa has not converged in {MOST_ITERATIONS} iterations "
        f"(error {error:.2g} of the rms height)"
    )
