"""k, D and H_V of a contact, the parameters of the film law."""

from __future__ import annotations

from math import log, pi
from typing import Generic, Literal, NamedTuple, TypeVar

import numpy as np
from scipy.ndimage import laplace

from iceslide_fem.preprocess.roughness.half_space import Contact, Waves
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import SimulationStopped

Value = TypeVar("Value", float, Array)
Definition = Literal["hydrodynamic", "thesis"]

# Correction of the area: touching pixels are counted whole, but rim pixels touch partly.
RIM = (pi - 1.0 + log(2.0)) / 24.0
# Distance from the last touching pixel's centre to the rim: half a pixel, corrected for the steps
# of a slanted rim. Discs with a radius of 8 pixels or more then have their diameter within 0.5 %.
TO_THE_RIM = 0.58
THESIS_SHARE = 0.75  # of the touching pixels
FREE_HEIGHT_AT_LEAST = 1e-10  # m, less than a water molecule: no free volume
FILM_HEIGHT = 70e-9  # m, h0
TOLERANCE = 1e-5  # of <phi>, twice that of D
MOST_ITERATIONS = 1000  # tens are usual


class Parameters(NamedTuple, Generic[Value]):
    """Contact parameters by one definition, and their raw data: scalars or arrays.

    k; D, H_V: m; k_raw: fraction of touching pixels; D_median: median run of touching pixels, m;
    open_area_below_h0: fraction of the nominal area with a gap below 70 nm.
    """

    k: Value
    D: Value
    H_V: Value
    k_raw: Value
    D_median: Value
    open_area_below_h0: Value


def measure(
    contact: Contact, pixel: float, definition: Definition, periodic: bool = True
) -> Parameters[float]:
    """Parameters of a contact on a map that is periodic, or continued by mirror images.

    (5.31), H_V = (1 - k) <d> with <d> the mean gap outside, is the mean gap over the whole area;
    its k is the fraction of touching pixels, without correction.
    """
    mask = contact.pressure > 0.0
    raw = float(mask.mean())
    median = median_run(mask, periodic) * pixel
    if definition == "thesis":
        k, D = THESIS_SHARE * raw, median
    else:
        k, D = corrected_share(mask, periodic), squeeze_diameter(mask, periodic) * pixel
    return Parameters(
        k=k,
        D=D,
        H_V=max(float(contact.gap.mean()), FREE_HEIGHT_AT_LEAST),
        k_raw=raw,
        D_median=median,
        open_area_below_h0=float((~mask & (contact.gap < FILM_HEIGHT)).mean()),
    )


def corrected_share(mask: Mask, periodic: bool = True) -> float:
    """Fraction of the area in contact, from touching pixels and the length of their rim.

    k = k_raw - (pi - 1 + ln 2)/24 S dx / A with the digital perimeter S: Yastrebov, Anciaux and
    Molinari, Tribol. Int. 114 (2017) 161-171.
    """
    return float(mask.mean() - RIM * _rim(mask, periodic) / mask.size)


def _rim(mask: Mask, periodic: bool) -> int:
    """Number of pixel sides between touching and other pixels, without those at mirror planes."""
    inside = sum(np.count_nonzero(np.diff(mask, axis=axis)) for axis in (0, 1))
    across = np.count_nonzero(mask[0] != mask[-1]) + np.count_nonzero(mask[:, 0] != mask[:, -1])
    return int(inside + across * periodic)


def squeeze_diameter(mask: Mask, periodic: bool = True) -> float:
    """Diameter (pixels) of the disc with the same squeeze-out rate as these patches.

    -lap(phi) = 1 on the mask with phi = 0 outside; D = sqrt(32 <phi>). Reynolds' equation for a
    film of uniform height gives dh/dt = -p h^3 / (12 eta <phi>), which is (5.14) with this D; a
    disc has <phi> = D^2/32. In full contact D is the longer side of the map, or of the periodic map
    of its mirror images. Raises SimulationStopped without convergence.
    """
    longest = float(max(mask.shape) * (1 if periodic else 2))
    if mask.all():
        return longest
    # The five-point stencil overestimates a strip by 1/6; a patch is at least one pixel.
    mean = max(_mean_flow(mask, periodic) - 1.0 / 6.0, 1.0 / (8.0 * pi))
    return min((32.0 * mean) ** 0.5, longest)


def _mean_flow(mask: Mask, periodic: bool) -> float:
    """<phi>, in square pixels, by the five-point Laplacian and conjugate gradients from zero.

    The preconditioner is the inverse of -lap + c on the whole map, restricted to the mask. On
    average open places act as a sink c of the order of (rim / area)^2. The inverse of -lap within
    the mask is at most that on the whole map. The product of residual and preconditioned residual
    therefore bounds the error of the energy, which is that of <phi>.
    """
    inside = mask.astype(float)
    edges = "grid-wrap" if periodic else "reflect"
    # The coefficient to an outside neighbour is 1 / TO_THE_RIM; the Laplacian already has 1 of it.
    to_rim = (1.0 - 1.0 / TO_THE_RIM) * laplace(inside, mode=edges) * inside
    waves = Waves((mask.shape[0], mask.shape[1]), 1.0, periodic)
    symbol = 4.0 - 2.0 * np.cos(waves.q_y) - 2.0 * np.cos(waves.q_x)
    area = float(inside.sum())
    inverse = 1.0 / (symbol + (_rim(mask, periodic) / area) ** 2)
    residual, total, last = inside.copy(), 0.0, np.inf
    direction = np.zeros_like(inside)
    for _ in range(MOST_ITERATIONS):
        preconditioned = waves.filtered(inverse, residual) * inside
        size = float(np.vdot(residual, preconditioned))
        if size <= TOLERANCE * total:
            return total / area
        direction *= size / last
        direction += preconditioned
        last = size
        image = to_rim * direction - laplace(direction, mode=edges) * inside
        length = size / float(np.vdot(direction, image))
        total += length * size
        residual -= length * image
    raise SimulationStopped("the squeeze flow between the contact patches has not converged")


def median_run(mask: Mask, periodic: bool = True) -> float:
    """Median length (pixels) of runs of touching pixels along x and y; 0 without any."""
    rows, columns = mask, mask.T
    if not periodic:
        rows, columns = (np.hstack([lines, lines[:, ::-1]]) for lines in (rows, columns))
    lengths = np.concatenate([_runs(rows), _runs(columns)])
    return float(np.median(lengths)) if lengths.size else 0.0


def _runs(mask: Mask) -> Array:
    """Lengths of the runs along periodic rows."""
    n = mask.shape[1]
    whole = mask.all(axis=1)
    rows = mask[~whole]
    # Each periodic row is rotated to start at an open pixel, so no run crosses its ends.
    order = (rows.argmin(axis=1)[:, None] + np.arange(n + 1)) % n
    opened = np.take_along_axis(rows, order, axis=1).astype(np.int8)
    change = np.diff(opened, axis=1)
    starts, ends = np.nonzero(change == 1)[1], np.nonzero(change == -1)[1]
    return np.concatenate([ends - starts, np.full(np.count_nonzero(whole), n)]).astype(float)
