"""The power spectrum of a measured height map."""

from __future__ import annotations

import numpy as np

from iceslide_fem.surfaces.power_spectrum import ROUNDING, PowerSpectrum
from iceslide_fem.surfaces.surface import Surface, low_passed, spectrum, statistics

PER_DECADE = 6  # rows of the spectrum


def measured(surface: Surface, shortest: float) -> PowerSpectrum:
    """The spectrum of a levelled map down to the wave `shortest` (m), in bands of equal ratio.

    A band has the mean of its rings of wave numbers, weighted by their number of waves. The rms
    height is that of the kept waves.
    """
    found, rms = spectrum(surface), statistics(low_passed(surface, shortest)).rms_height
    kept = (found.q <= 2.0 * np.pi / shortest * (1.0 + 1e-9)) & (found.density > 0.0)
    q, C = found.q[kept], found.density[kept] / (2.0 * np.pi) ** 2
    bands = max(3, round(PER_DECADE * float(np.log10(q[-1] / q[0]))) + 1)
    edges = np.geomspace(q[0] * 0.999, q[-1] * 1.001, bands)
    band = np.clip(np.searchsorted(edges, q) - 1, 0, bands - 2)
    weight = np.bincount(band, q)
    there = weight > 0.0
    mean_q = np.exp(np.bincount(band, q * np.log(q))[there] / weight[there])
    mean_C = np.bincount(band, q * C)[there] / weight[there]
    rows = PowerSpectrum(tuple(mean_q), tuple(mean_C))
    inner = mean_q[(mean_q > q[0] * (1.0 + ROUNDING)) & (mean_q < q[-1] * (1.0 - ROUNDING))]
    ends = np.array([q[0], *inner, q[-1]])
    return PowerSpectrum(tuple(ends), tuple(rows(ends))).scaled(rms)
