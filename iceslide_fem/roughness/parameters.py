"""k, D and H_V of a contact: what the film law takes from a rough surface under load."""

from __future__ import annotations

from math import log, pi
from typing import Generic, Literal, NamedTuple, TypeVar

import numpy as np

from iceslide_fem.arrays import Array, Mask
from iceslide_fem.errors import SimulationStopped
from iceslide_fem.roughness.half_space import Contact

Value = TypeVar("Value", float, Array)
Definition = Literal["hydrodynamic", "thesis"]

# Of the true area: pixels that touch are counted whole, and those at the rim touch in part.
RIM = (pi - 1.0 + log(2.0)) / 24.0
# Half a pixel from the last touching pixel's middle to the rim, and what steps make of a slanted
# rim; with it discs of 8 pixels' radius and more have their diameter within 0.5 %.
TO_THE_RIM = 0.58
THESIS_SHARE = 0.75  # of the pixels that touch
FREE_HEIGHT_AT_LEAST = 1e-10  # m, less than a molecule of water: then there is no free volume
FILM_HEIGHT = 70e-9  # m, h0


class Parameters(NamedTuple, Generic[Value]):
    """Contact parameters by one definition, and what both of them rest on: numbers, or arrays.

    k; D, H_V (m); k_raw: share of pixels that touch; D_median: median run of touching pixels, m;
    open_area_below_h0: share of the nominal area that is open by less than 70 nm.
    """

    k: Value
    D: Value
    H_V: Value
    k_raw: Value
    D_median: Value
    open_area_below_h0: Value


class Measure:
    """Parameters of the contacts of one surface under rising pressure.

    The last solution of the squeeze flow starts the next one; nothing else is remembered.
    """

    def __init__(self, pixel: float, definition: Definition) -> None:
        self._pixel = pixel
        self._definition = definition
        self._flow: Array | None = None

    def __call__(self, contact: Contact) -> Parameters[float]:
        """Parameters of `contact`.

        (5.31), H_V = (1 - k) <d> with <d> the mean gap outside, is the mean gap over the whole
        area: the k in it is the share of pixels that touch, whatever is then made of that share.
        """
        mask = contact.pressure > 0.0
        raw = float(mask.mean())
        median = median_run(mask) * self._pixel
        if self._definition == "thesis":
            k, D = THESIS_SHARE * raw, median
        else:
            k = corrected_share(mask)
            self._flow, diameter = squeeze_diameter(mask, self._flow)
            D = diameter * self._pixel
        return Parameters(
            k=k,
            D=D,
            H_V=max(float(contact.gap.mean()), FREE_HEIGHT_AT_LEAST),
            k_raw=raw,
            D_median=median,
            open_area_below_h0=float((~mask & (contact.gap < FILM_HEIGHT)).mean()),
        )


def corrected_share(mask: Mask) -> float:
    """Share of the area in contact, from the pixels that touch and the length of their rim.

    k = k_raw - (pi - 1 + ln 2)/24 S dx / A with the digital perimeter S: Yastrebov, Anciaux and
    Molinari, Tribol. Int. 114 (2017) 161-171.
    """
    rim = sum(np.count_nonzero(mask != np.roll(mask, 1, axis)) for axis in (0, 1))
    return float(mask.mean() - RIM * rim / mask.size)


def squeeze_diameter(mask: Mask, start: Array | None = None) -> tuple[Array, float]:
    """Diameter (pixels) of the disc that squeezes its film out as slowly as these patches do.

    -lap(phi) = 1 on the periodic mask with phi = 0 outside; D = sqrt(32 <phi>). Reynolds' equation
    for a film of uniform height gives dh/dt = -p h^3 / (12 eta <phi>), which is (5.14) with this D;
    a disc has <phi> = D^2/32. Returns phi, too, which starts the next solution.
    """
    if mask.all():
        return np.zeros(mask.shape), float(max(mask.shape))
    inside = mask.astype(float)
    neighbours = np.zeros(mask.shape)
    for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
        neighbours += np.roll(inside, shift, axis)
    diagonal = neighbours + (4.0 - neighbours) / TO_THE_RIM
    phi = _poisson(inside, diagonal, inside if start is None else start * inside)
    # Five points give a strip 1/6 too much, whatever its width; a patch is a pixel at least.
    mean = max(float(phi.sum() / inside.sum()) - 1.0 / 6.0, 1.0 / (8.0 * pi))
    return phi, min((32.0 * mean) ** 0.5, float(max(mask.shape)))


def _poisson(inside: Array, diagonal: Array, phi: Array, tolerance: float = 1e-6) -> Array:
    """Conjugate gradients for the five-point Laplacian on the pixels where `inside` is 1."""

    def negative_laplacian(x: Array) -> Array:
        y = diagonal * x
        y[1:] -= x[:-1]
        y[0] -= x[-1]
        y[:-1] -= x[1:]
        y[-1] -= x[0]
        y[:, 1:] -= x[:, :-1]
        y[:, 0] -= x[:, -1]
        y[:, :-1] -= x[:, 1:]
        y[:, -1] -= x[:, 0]
        y *= inside
        return np.asarray(y)

    residual = inside - negative_laplacian(phi)
    goal = tolerance**2 * inside.sum()
    direction, last = np.zeros_like(phi), np.inf
    for _ in range(20 * sum(inside.shape)):
        if np.vdot(residual, residual) <= goal:
            return phi
        scaled = residual / diagonal
        size = float(np.vdot(residual, scaled))
        direction *= size / last
        direction += scaled
        last = size
        image = negative_laplacian(direction)
        length = size / float(np.vdot(direction, image))
        phi = phi + length * direction
        residual -= length * image
    raise SimulationStopped("the squeeze flow between the contact patches has not converged")


def median_run(mask: Mask) -> float:
    """Median length (pixels) of the runs of touching pixels along x and along y; 0 without any."""
    lengths = np.concatenate([_runs(mask), _runs(mask.T)])
    return float(np.median(lengths)) if lengths.size else 0.0


def _runs(mask: Mask) -> Array:
    """Lengths of the runs along the rows, which are closed to rings."""
    n = mask.shape[1]
    whole = mask.all(axis=1)
    rows = mask[~whole]
    # Every ring is opened at a pixel that does not touch, so that no run crosses its ends.
    order = (rows.argmin(axis=1)[:, None] + np.arange(n + 1)) % n
    opened = np.take_along_axis(rows, order, axis=1).astype(np.int8)
    change = np.diff(opened, axis=1)
    starts, ends = np.nonzero(change == 1)[1], np.nonzero(change == -1)[1]
    return np.concatenate([ends - starts, np.full(np.count_nonzero(whole), n)]).astype(float)
