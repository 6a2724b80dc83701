"""Rough rubber on rough ice: k, D and the gap from spectra, beside maps that are pressed.

Waves of the ice meet a stiffer rubber than waves of the rubber. A map on which every wave of the
ice is higher by the ratio of both moduli has the same contact with elastic rubber, and the same k
and D. Its mean gap is that of the theory for the spectrum of this map. The change of H_V weighs the
waves by the modulus that they meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.surfaces.combined_contact import Change, CombinedContact, gap
from iceslide_fem.surfaces.power_spectrum import PowerSpectrum, self_affine
from iceslide_fem.surfaces.rough_ice import INCOMPRESSIBLE, Moduli, waves_of
from iceslide_fem.surfaces.surface import Surface
from iceslide_fem.surfaces.waves import Waves
from scripts.studies.common import options, table

# Rubber of nine arms, as that of the case `rough_ice`.
NUMBERS = np.arange(1.0, 10.0)
ARMS = Moduli(2e6, np.asarray(0.6e6 * 1.9**NUMBERS), np.asarray(10.0**-NUMBERS))
SHIFT = Shift(7.4005, 121.6, 20.0 + ZERO_CELSIUS)
CELSIUS, PRESSURE = -2.0, 2e5
SPEEDS = 1e-3, 0.1
SIDE, PIXELS, LONGEST, SHORTEST = 0.8e-3, 512, 200e-6, 12.5e-6


class Pair(NamedTuple):
    """rms heights (m) and Hurst exponents of rubber and ice."""

    rubber: float
    of_rubber: float
    ice: float
    of_ice: float


PAIRS = Pair(5e-6, 0.8, 0.3e-6, 0.8), Pair(5e-6, 0.8, 1e-6, 0.8), Pair(3e-6, 1.0, 0.5e-6, 0.7)


def height_map(rms: float, hurst: float, seed: int) -> Array:
    """A random self-affine surface, m."""
    spec = SurfaceSpec(
        rms_height=rms, hurst=hurst, rolloff=LONGEST, shortest_wave=SHORTEST, size=SIDE,
        pixels=PIXELS, seed=seed,
    )  # fmt: skip
    waves = Waves((PIXELS, PIXELS), SIDE / PIXELS)
    kept = (waves.q >= 2.0 * np.pi / LONGEST * (1.0 - 1e-9)).astype(float)
    found = waves.filtered(kept, generate(spec).heights)
    return np.asarray(found * rms / np.sqrt(np.mean(found**2)))


def stiffer(reduced: float, q: Array) -> Array:
    """Modulus that waves of the ice meet at v a_T (m/s), over the long-term modulus."""
    return np.asarray(np.sqrt(ARMS.means(reduced * q)[1]) / ARMS.long_term)


def pressed(pair: Pair, reduced: float, less: float, seed: int) -> list[Array]:
    """k, D and gap of the rubber on smooth ice, of both, and of the rubber at `less` pressure."""
    own, ice = height_map(pair.rubber, pair.of_rubber, seed), height_map(*pair[2:], seed + 100)
    waves = Waves((PIXELS, PIXELS), SIDE / PIXELS)
    both = own + waves.filtered(stiffer(reduced, np.maximum(waves.q, waves.q[0, 1])), ice)
    found = []
    for heights, p in ((own, PRESSURE), (both, PRESSURE), (own, less * PRESSURE)):
        surface = Surface(heights, SIDE / PIXELS, periodic=True)
        one = parameters(surface, ARMS.long_term / INCOMPRESSIBLE, np.array([p]))
        found.append(np.array([one.k[0], one.D[0], one.H_V[0]]))
    return found


def of_spectra(pair: Pair, reduced: float) -> tuple[Change, float]:
    """What the ice changes, and the factor on the gap of the stretched map."""
    own, ice = (self_affine(*one, LONGEST, SHORTEST) for one in (pair[:2], pair[2:]))
    p, E = np.array([PRESSURE]), ARMS.long_term
    change = CombinedContact(ice, own, ARMS, SHIFT, E).exact(reduced, p)
    rows = np.geomspace(own.q[0], own.q[1], 200)
    C = own(rows) + ice(rows) * stiffer(reduced, rows) ** 2
    q, weights = waves_of(own)
    both, alone = (
        gap(one(q) * E, one(q) * E**2, q, weights, p)
        for one in (PowerSpectrum(tuple(rows), tuple(C)), own)
    )
    return change, float(both[0] / alone[0])


def rows(realisations: int) -> Iterator[tuple[object, ...]]:
    """What the ice changes, by theory and by pressed maps."""
    for pair in PAIRS:
        for speed in SPEEDS:
            reduced = speed * float(SHIFT(CELSIUS + ZERO_CELSIUS))
            change, of_gap = of_spectra(pair, reduced)
            less, width = float(change.pressure[0]), float(change.width[0])
            found = [pressed(pair, reduced, less, seed) for seed in range(realisations)]
            smooth, both, lower = (np.mean(part, axis=0) for part in zip(*found, strict=True))
            theory = lower[0], width * lower[1], of_gap * smooth[2]
            yield (
                f"{1e6 * pair.rubber:g} um, {pair.of_rubber:g}",
                f"{1e6 * pair.ice:g} um, {pair.of_ice:g}", f"{speed:g}", f"{less:.3f}",
                f"{smooth[0]:.3f}", f"{theory[0]:.4f}", f"{both[0]:.4f}",
                f"{1e6 * smooth[1]:.1f}", f"{1e6 * theory[1]:.1f}", f"{1e6 * both[1]:.1f}",
                f"{of_gap:.2f}", f"{both[2] / smooth[2]:.2f}", f"{1e6 * change.gap[0]:.3f}",
            )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--realisations", type=int, default=4)
    head = (
        "rubber: rms, Hurst", "ice", "m/s", "pressure", "k, smooth ice", "k, theory", "k, maps",
        "D, smooth ice, um", "D, theory", "D, maps", "gap of the map, theory", "maps",
        "added to H_V, um",
    )  # fmt: skip
    table(head, rows(parser.parse_args().realisations))


if __name__ == "__main__":
    main()
