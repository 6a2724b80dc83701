"""Seconds and memory of rough contact over pixels and pressure, beside two other programs.

Processor seconds of one thread. tamaas and ContactMechanics press the same maps in the same run
where they are installed (both want a NumPy of their own: a virtual environment with them, pydantic,
pint and pandas, and this folder in PYTHONPATH).
"""

from __future__ import annotations

import argparse
import importlib.util
import resource
import sys
from collections.abc import Callable
from time import process_time

import numpy as np

from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import Definition, measure
from iceslide_fem.preprocess.roughness.surface import Surface
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BAR, YOUNGS_MODULUS

MODULUS = YOUNGS_MODULUS["B"] / 0.75
LIKE_B = {
    "rms_height": 5.8e-6, "hurst": 0.2, "rolloff": 175e-6, "shortest_wave": 35e-6, "skewness": -1.2,
}  # fmt: skip
MANY = np.geomspace(0.2, 20.0, 12) * BAR
FIVE = np.array([0.5, 1.0, 2.0, 3.5, 5.0]) * BAR
Found = list[tuple[float, float]]  # fraction of pixels that touch, mean gap (m)


def surface_of(pixels: int, pixel: float, realisation: int = 0) -> Surface:
    """A surface like compound B's with this many pixels (m) a side."""
    spec = SurfaceSpec.model_validate(LIKE_B | {"size": pixels * pixel, "pixels": pixels})
    return generate(spec, realisation)


def ours(surface: Surface, pressures: Array) -> Found:
    """Our own solver."""
    contacts = press(surface.heights, surface.pixel, MODULUS, pressures.tolist())
    return [(float((c.pressure > 0).mean()), float(c.gap.mean())) for c in contacts]


def tamaas(surface: Surface, pressures: Array) -> Found:
    """Polonsky and Keer's method of tamaas."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.warning)
    model = tm.ModelFactory.createModel(
        tm.model_type.basic_2d, list(surface.size), list(surface.heights.shape)
    )
    model.E, model.nu = MODULUS, 0.0
    kind = tm.PolonskyKeerRey.pressure
    solver = tm.PolonskyKeerRey(model, surface.heights.copy(), 1e-9, kind, kind)
    solver.max_iter = 10000
    found = []
    for p in pressures:
        solver.solve(p)
        found.append(
            _share_and_gap(surface, np.array(model.traction), np.array(model.displacement))
        )
    return found


def contact_mechanics(surface: Surface, pressures: Array) -> Found:
    """The constrained conjugate gradients of ContactMechanics."""
    from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
    from SurfaceTopography import Topography

    shape, area = surface.heights.shape, surface.size[0] * surface.size[1]
    substrate = PeriodicFFTElasticHalfSpace(shape, MODULUS, surface.size)
    system = make_system(substrate=substrate, surface=Topography(surface.heights, surface.size))
    found = []
    for p in pressures:
        result = system.minimize_proxy(external_force=p * area, pentol=1e-12, maxiter=10000)
        if not result.success:
            raise RuntimeError(result.message)
        force = np.abs(np.asarray(substrate.force))
        found.append(_share_and_gap(surface, force, np.asarray(system.disp)))
    return found


def _share_and_gap(surface: Surface, pressure: Array, displacement: Array) -> tuple[float, float]:
    touching, gap = pressure > 0, displacement - surface.heights
    return float(touching.mean()), float((gap - gap[touching].mean()).clip(0.0).mean())


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(  # `common` wants more than an environment for the others has
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small maps")
    parser.add_argument("--largest", type=int, default=2048, help="pixels a side")
    parser.add_argument("--others-up-to", type=int, default=512, help="for the other programs")
    given = parser.parse_args()
    print("| thesis-size maps, 12 pressures | seconds |")
    print("|---|---|")
    definition: Definition
    for definition in ("thesis", "hydrodynamic"):
        begun = process_time()
        for realisation in range(1 if given.quick else 8):
            surface = surface_of(57, 17.5e-6, realisation)
            for contact in press(surface.heights, surface.pixel, MODULUS, MANY.tolist()):
                measure(contact, surface.pixel, definition)
        print(f"| {realisation + 1} of 57 x 57, {definition} | {process_time() - begun:.2f} |")

    pixels = 128 if given.quick else 512
    print(f"\n| {pixels} x {pixels}, pressure, bar | iterations | seconds | k_raw | H_V, um |")
    print("|---|---|---|---|---|")
    surface = surface_of(pixels, 4e-6)
    total, last = 0.0, process_time()
    pressures = np.geomspace(0.2, 20.0, 10) * BAR
    contacts = press(surface.heights, surface.pixel, MODULUS, pressures.tolist())
    for p, contact in zip(pressures, contacts, strict=True):
        at = measure(contact, surface.pixel, "hydrodynamic")
        spent, last = process_time() - last, process_time()
        total += spent
        print(
            f"| {p / BAR:.3g} | {contact.iterations} | {spent:.2f} | {at.k_raw:.4f} "
            f"| {1e6 * at.H_V:.4f} |",
            flush=True,
        )
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    print(f"| all, with k, D, H_V | | {total:.1f} | | |")
    print(f"\nMost memory of the process until here: {memory:.0f} MB.")

    programs: dict[str, Callable[[Surface, Array], Found]] = {"this program": ours}
    others = {"tamaas": tamaas, "ContactMechanics": contact_mechanics}
    for name, other in others.items():
        if importlib.util.find_spec(name):
            programs[name] = other
        else:
            print(f"{name} is not installed.", file=sys.stderr)
    print("\n| pixels | program | seconds, five pressures | k_raw at 0.5, 1, 5 bar | H_V, um |")
    print("|---|---|---|---|---|")
    for pixels in (64, 128) if given.quick else (128, 256, 512, 1024, 2048):
        if pixels > given.largest:
            break
        surface = surface_of(pixels, 4e-6)
        for name, solver in programs.items():
            if solver is not ours and pixels > given.others_up_to:
                continue
            begun = process_time()
            found = solver(surface, FIVE)
            spent = process_time() - begun
            k = ", ".join(f"{found[i][0]:.5f}" for i in (0, 1, 4))
            H = ", ".join(f"{1e6 * found[i][1]:.5f}" for i in (0, 1, 4))
            print(f"| {pixels} x {pixels} | {name} | {spent:.2f} | {k} | {H} |", flush=True)


if __name__ == "__main__":
    main()
