"""Seconds and memory of `iceslide roughness` on an instrument's map, and what thinning changes.

The map is synthetic: self-affine with all waves down to its pixels, tilted, with missing heights
that are scattered and in spots. The command runs in a process of its own, whose processor seconds
and largest memory are printed. Then a smaller part is pressed on all of its pixels and on coarser
ones. `--fine` presses a large map whose shortest wave needs every pixel: a quarter of an hour.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np

from iceslide_fem.preprocess.roughness.case import SOURCE_WAVE
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import (
    Parameters,
    corrected_share,
    squeeze_diameter,
)
from iceslide_fem.preprocess.roughness.prepare import thinned_pixel
from iceslide_fem.preprocess.roughness.surface import Surface, coarsened, levelled, low_passed
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, YOUNGS_MODULUS
from scripts.studies.common import iceslide_words, options, table

MODULUS = YOUNGS_MODULUS["B"] / 0.75
PRESSURES = np.geomspace(0.2, 20.0, 10) * BAR
PIXELS_PER_WAVE = (4.0, 6.0, 8.0, 10.0, 12.0, 16.0)
NEARLY_FULL = 0.98  # k beyond which H_V is a few nanometres


def instrument_map(pixels: int, pixel: float, seed: int = 7) -> Array:
    """Heights (m), (pixels, pixels), NaN where missing: rms 5 um, Hurst 0.8, roll-off 0.2 mm."""
    random = np.random.default_rng(seed)
    whole = pixels + pixels // 8  # of which a part is not periodic
    q = np.hypot(np.fft.fftfreq(whole, pixel)[:, None], np.fft.rfftfreq(whole, pixel))
    amplitude = np.maximum(q, 1.0 / 0.2e-3) ** -1.8
    amplitude[0, 0] = 0.0
    noise = np.fft.rfft2(random.standard_normal((whole, whole)))
    heights = np.fft.irfft2(amplitude * noise, s=(whole, whole))[:pixels, :pixels]
    heights *= 5e-6 / heights.std()
    heights += 0.01 * pixel * np.arange(pixels)
    heights[random.random(heights.shape) < 0.01] = np.nan
    y, x = np.indices(heights.shape)
    for centre_y, centre_x in random.integers(0, pixels, (30, 2)):
        radius = random.integers(3, max(4, pixels // 80))
        heights[(y - centre_y) ** 2 + (x - centre_x) ** 2 < radius**2] = np.nan
    return np.asarray(heights)


def command(heights: Array, pixel: float, *more: str) -> tuple[str, str, float, float]:
    """Pixels pressed, contact.csv, processor seconds and largest memory (MB) of the command."""
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder, "map.npy"), Path(folder, "out")
        np.save(path, heights)
        given = ["--pixel", f"{1e6 * pixel:g}um", "--pressures", "0.2bar:20bar:10", *more]
        words = iceslide_words("roughness", str(path), *given, "--out", str(out))
        started = subprocess.Popen(words, stdout=subprocess.DEVNULL)
        _, status, used = os.wait4(started.pid, 0)
        started.returncode = os.waitstatus_to_exitcode(status)
        if started.returncode:
            raise RuntimeError(f"{' '.join(words)} has ended with {started.returncode}")
        found = json.loads((out / "surface.json").read_text())
        columns, rows = found["pixels"]
        grid = f"{columns} x {rows} of {1e6 * found['cut_offs']['pixel_m']:.4g} um"
        seconds = used.ru_utime + used.ru_stime
        return grid, (out / "contact.csv").read_text(), seconds, used.ru_maxrss / 1e3


def commands(pixels: int, fine: bool) -> None:
    """Print what the command costs, and what it finds."""
    runs: list[tuple[float, tuple[str, ...]]] = [(0.5e-6, ()), (1.25e-6, ())]
    if fine:
        runs.append((1e-6, ("--shortest-wave", "8um")))
    found: list[tuple[float, str]] = []

    def rows() -> Iterator[tuple[object, ...]]:
        for pixel, more in runs:
            heights = instrument_map(pixels, pixel)
            grid, text, seconds, memory = command(heights, pixel, *more)
            found.append((pixel, text))
            yield (
                f"{pixels} x {pixels} of {1e6 * pixel:g} um",
                more[1] if more else f"{1e6 * SOURCE_WAVE:g} um",
                grid,
                f"{seconds:.1f}",
                f"{memory:.0f}",
            )

    table(("map", "shortest wave", "pressed on", "processor seconds", "memory, MB"), rows())
    for pixel, text in found:
        print(f"\nPixels of {1e6 * pixel:g} um:\n")
        table(
            ("p, bar", "k", "D, um", "H_V, um"),
            (
                (
                    f"{float(row['pressure_Pa']) / BAR:.3g}",
                    f"{float(row['k']):.4f}",
                    f"{1e6 * float(row['D_m']):.1f}",
                    f"{1e6 * float(row['H_V_m']):.4f}",
                )
                for row in csv.DictReader(text.splitlines())
            ),
        )


def thinning(level: Surface) -> None:
    """Print what coarser pixels change in k, D and H_V."""
    whole = low_passed(level, SOURCE_WAVE)
    begun = process_time()
    exact = parameters(whole, MODULUS, PRESSURES)
    print(
        f"\nAll {whole.heights.shape[0]} x {whole.heights.shape[1]} pixels of "
        f"{1e6 * whole.pixel:g} um: {process_time() - begun:.1f} processor seconds. Differences "
        f"to their k, D, H_V on coarser ones, largest where k is below {NEARLY_FULL:g}:\n"
    )

    def rows() -> Iterator[tuple[object, ...]]:
        pixels = [SOURCE_WAVE / number for number in PIXELS_PER_WAVE]
        for pixel in (*pixels, thinned_pixel(level, SOURCE_WAVE)):
            coarse = low_passed(coarsened(level, pixel), SOURCE_WAVE)
            begun = process_time()
            found = parameters(coarse, MODULUS, PRESSURES)
            seconds = process_time() - begun
            yield (
                f"{SOURCE_WAVE / coarse.pixel:.3g}" + " (the program)" * (pixel not in pixels),
                f"{coarse.heights.shape[0]} x {coarse.heights.shape[1]}",
                *differences(found, exact),
                f"{seconds:.2f}",
            )

    table(("pixels per wave", "pixels", "k", "D", "H_V", "processor seconds"), rows())


def differences(found: Parameters[Array], exact: Parameters[Array]) -> Iterator[str]:
    """Largest relative difference of k, D and H_V, in per cent."""
    open_ = exact.k < NEARLY_FULL
    for ours, theirs in zip(found[:3], exact[:3], strict=True):
        yield f"{100.0 * np.abs(ours[open_] / theirs[open_] - 1.0).max():.2f} %"


def diameters(surface: Surface) -> None:
    """Print seconds of the contact and of D over pressure."""
    grid = " x ".join(map(str, surface.heights.shape))
    print(f"\nThe contact and the squeeze flow that gives D, processor seconds, {grid} pixels:\n")
    pixel, periodic = surface.pixel, surface.periodic
    contacts = press(surface.heights, pixel, MODULUS, PRESSURES.tolist(), periodic=periodic)

    def rows() -> Iterator[tuple[object, ...]]:
        begun = process_time()
        for contact, pressure in zip(contacts, PRESSURES, strict=True):
            pressed = process_time()
            mask = contact.pressure > 0.0
            diameter = squeeze_diameter(mask, periodic) * pixel
            measured = process_time()
            yield (
                f"{pressure / BAR:.3g}",
                f"{corrected_share(mask, periodic):.4f}",
                f"{1e6 * diameter:.1f}",
                f"{pressed - begun:.2f}",
                f"{measured - pressed:.2f}",
            )
            begun = process_time()

    table(("p, bar", "k", "D, um", "contact", "D"), rows())


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps")
    parser.add_argument("--fine", action="store_true", help="a wave that needs every pixel, too")
    given = parser.parse_args()
    commands(512 if given.quick else 2048, given.fine)
    part = 128 if given.quick else 512
    level = levelled(Surface(instrument_map(part, 1.25e-6), 1.25e-6, periodic=False))
    thinning(level)
    diameters(low_passed(coarsened(level, SOURCE_WAVE / 20.0), SOURCE_WAVE))


if __name__ == "__main__":
    main()
