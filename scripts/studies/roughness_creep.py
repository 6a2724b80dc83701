"""Rough rubber that creeps into contact, stepped in time, against the correspondence principle.

Under a load that is held contact only grows, and k, D and H_V are those of elastic rubber at
p_eff = p E_0 J(t / a_T) (E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438). Three generated
surfaces, one standard linear solid and a series of ten arms over nine decades; pressures to full
contact, at 0, 1, 5 and 100 ms; H_V where it is above 1 nm. Then a wave of 1 um and 50 um under
50 kPa, whose k is (2/pi) asin sqrt(p_eff / p*), p* = pi E* 1 um / 50 um (H. M. Westergaard,
J. Appl. Mech. 6 (1939) 49), and how many steps a tolerance takes. --fine has four times the pixels.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time

import numpy as np

from iceslide_fem.preprocess.roughness import creep
from iceslide_fem.preprocess.roughness.creep import hold, steps
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import measure
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.runtime.arrays import Array
from scripts.studies.common import options, table

SLS = Prony((0.3,), (5e-3,))
_TIMES = np.logspace(-7.0, 2.0, 10)
TEN = Prony(tuple((0.9 * _TIMES**-0.1 / (_TIMES**-0.1).sum()).tolist()), tuple(_TIMES.tolist()))
SERIES = {"one arm": SLS, "ten arms": TEN}
AGES = (0.0, 1e-3, 5e-3, 0.1)  # s
MODULUS = 4.0 * 546e3  # E* = 4 G of incompressible rubber, Pa
SURFACES = {
    "smooth, Hurst 0.8": {"rms_slope": 0.2, "hurst": 0.8, "rolloff": 2e-4, "shortest_wave": 5e-5},
    "rough, Hurst 0.3": {"rms_slope": 0.4, "hurst": 0.3, "rolloff": 1e-4, "shortest_wave": 5e-5},
    "valleys": {
        "rms_slope": 0.3, "hurst": 0.9, "rolloff": 2e-4, "shortest_wave": 5e-5, "skewness": -0.9,
    },
}  # fmt: skip
SIDE, PIXELS = 5e-4, 64  # m
LOADS = (0.05, 0.15, 0.4)  # of E* times the rms slope


def compared(name: str, series: str, pixels: int) -> tuple[str, ...]:
    """The row of one surface and series: over all loads and ages, the largest differences."""
    given, prony = SURFACES[name], SERIES[series]
    spec = SurfaceSpec.model_validate({**given, "size": SIDE, "pixels": pixels})
    heights, pixel = generate(spec).heights, SIDE / pixels
    pressures = [load * MODULUS * given["rms_slope"] for load in LOADS]
    begun = process_time()
    held = list(hold(heights, pixel, MODULUS, pressures, prony, AGES))
    seconds = process_time() - begun
    iterations = sum(contact.iterations for contacts in held for contact in contacts)
    found = []
    for pressure, contacts in zip(pressures, held, strict=True):
        effective = (pressure * prony.creep.compliance(AGES)).tolist()
        for pair in zip(contacts, press(heights, pixel, MODULUS, effective), strict=True):
            found.append([measure(each, pixel, "hydrodynamic", True)[:3] for each in pair])
    values = np.array(found)  # (loads and ages, held and elastic, k, D and H_V)
    k, open_ = values[:, 1, 0], values[:, 1, 2] > 1e-9
    off = 100.0 * np.abs(values[:, 0] - values[:, 1]) / np.maximum(values[:, 1], 1e-12)
    largest = [f"{part.max():.2f} %" for part in (off[:, 0], off[:, 1], off[open_, 2])]
    number = len(steps(prony, AGES)) - 1
    return (
        name, series, f"{k.min():.3f} to {k.max():.3f}", *largest, str(number), str(iterations),
        f"{seconds:.1f}",
    )  # fmt: skip


def wave(pixels: int) -> Iterator[tuple[str, ...]]:
    """Rows of the wave: k by pixels and exactly, one for each age."""
    amplitude, length, pressure, ages = 1e-6, 50e-6, 50e3, (0.0, 1e-3, 5e-3, 10.0)
    x = np.arange(pixels) / pixels
    heights: Array = np.tile(amplitude * np.cos(2.0 * np.pi * x), (2, 1))
    (contacts,) = hold(heights, length / pixels, MODULUS, [pressure], SLS, ages)
    full = np.pi * MODULUS * amplitude / length
    for age, contact in zip(ages, contacts, strict=True):
        exact = 2.0 / np.pi * np.arcsin((pressure * SLS.creep.compliance(age) / full) ** 0.5)
        yield f"{1e3 * age:g}", f"{(contact.pressure > 0.0).mean():.6f}", f"{exact:.6f}"


def finer() -> Iterator[tuple[str, ...]]:
    """Rows of steps: how many, and how far the mean of P is off, by its tolerance."""
    before = creep.STEP_TOLERANCE
    for name, prony in SERIES.items():
        for tolerance in (1e-2, 1e-3, 1e-4):
            creep.STEP_TOLERANCE = tolerance
            times = steps(prony, AGES)
            yield (
                name,
                f"{tolerance:g}",
                str(len(times) - 1),
                f"{creep.step_error(prony, times, AGES):.1e}",
            )
    creep.STEP_TOLERANCE = before


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--fine", action="store_true", help="four times the pixels")
    pixels = PIXELS * (2 if parser.parse_args().fine else 1)
    head = ("surface", "series", "k", "k off", "D off", "H_V off", "steps", "iterations", "seconds")
    table(head, (compared(name, series, pixels) for name in SURFACES for series in SERIES))
    print("\nwave")
    table(("age, ms", "k", "exact"), wave(2000))
    print("\nsteps")
    table(("series", "tolerance", "steps", "error of the mean of P"), finer())


if __name__ == "__main__":
    main()
