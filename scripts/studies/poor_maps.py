"""What maps do to results that cannot carry them: saturated pressures, short and coarse surfaces,
and missing heights.

Friction of synthetic footprints whose highest pressures are cut (3 m/s, -4 degC), against those as
they are: with the load that is left, and scaled to the true one. k, D and H_V at 1 bar of surfaces
with a roll-off of 0.1 mm (Hurst exponent 0.8, waves down to 16 um, 3 MPa), against those of a long,
fine and whole map: of a part of it, without its shorter waves, and with missing heights, written as
0 or filled. --quick takes one surface instead of three.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.ndimage import gaussian_filter

from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.footprint.synthetic import Tread
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import CONTACT_TABLES
from iceslide_fem.surfaces.surface import Surface, levelled, low_passed
from scripts.studies.common import options, table

CUT = (0.1, 0.25, 0.5, 0.75, 0.9)  # fraction of the pixels at the largest pressure
RIDE = Ride(3.0, 3.0, 269.15)
ROLLOFF, SHORTEST = 1e-4, 1.6e-5  # m
SPEC = SurfaceSpec(
    rms_height=5e-6,
    hurst=0.8,
    rolloff=ROLLOFF,
    shortest_wave=SHORTEST,
    size=16 * ROLLOFF,
    pixels=512,
)
SIDES, WAVES = (8, 4, 2, 1, 0.5), (0.2, 0.25, 0.5, 1.0)  # in roll-offs
MISSING = (0.02, 0.05, 0.09, 0.15)
MODULUS, PRESSURE = 4e6, np.array([1e5])  # E* of 3 MPa


def footprints() -> dict[str, PressureMap]:
    """A tread, and slicks with the pressure of a paraboloid and of a Gaussian, of 2 to 3 bar."""
    y, x = ((np.arange(n) + 0.5) / n * 2.1 - 1.05 for n in (30, 40))
    square = x**2 + y[:, None] ** 2
    inside, side = square < 0.96, (0.2 / 40, 0.15 / 30)
    return {
        "tread": Tread(roughness=0.1).footprint((60, 120)),
        "paraboloid": PressureMap(np.where(inside, 2.5e5 * (1.0 - square), 0.0), *side),
        "Gaussian": PressureMap(np.where(inside, 3e5 * np.exp(-3.2 * square), 0.0), *side),
    }


def mu(footprint: PressureMap) -> float:
    """Mean friction of the film law."""
    return film_map(footprint, RIDE, CONTACT_TABLES["B"]).mean_friction(footprint)


def saturated() -> Iterator[tuple[str, ...]]:
    """Load and mu of cut footprints, relative to the whole ones."""
    for name, whole in footprints().items():
        true = mu(whole)
        for part in CUT:
            top = float(np.quantile(whole.pressure[whole.contact], 1.0 - part))
            cut = PressureMap(np.minimum(whole.pressure, top), whole.dx, whole.dy)
            scaled, _ = cut.carrying(whole.load)
            ratios = cut.load / whole.load, mu(cut) / true, mu(scaled) / true
            yield name, f"{part:g}", *(f"{100.0 * (ratio - 1.0):+.1f}" for ratio in ratios)


def found(surface: Surface) -> Array:
    """k, D and H_V at 1 bar."""
    return np.array(parameters(surface, MODULUS, PRESSURE)[:3])[:, 0]


def part(whole: Surface, side: float) -> Surface:
    """A part of a surface with a side in roll-offs."""
    pixels = round(side * ROLLOFF / whole.pixel)
    return levelled(Surface(whole.heights[:pixels, :pixels], whole.pixel, False))


def missing(whole: Surface, fraction: float, patches: bool, filled: bool) -> Surface:
    """A surface with missing heights, at random or in patches, filled or written as 0."""
    random = np.random.default_rng(1).standard_normal(whole.heights.shape)
    noise = gaussian_filter(random, 3.0) if patches else random
    lost = noise > np.quantile(noise, 1.0 - fraction)
    mark = np.nan if filled else 0.0
    holed = Surface(np.where(lost, mark, whole.heights), whole.pixel, False)
    return low_passed(levelled(holed), SHORTEST)


def poor(whole: Surface) -> Iterator[tuple[str, Surface]]:
    """Poor maps of a surface by name."""
    for side in SIDES:
        yield f"{side:g} roll-offs long", part(whole, side)
    for wave in WAVES:
        yield f"waves down to {wave:g} roll-offs", low_passed(whole, wave * ROLLOFF)
    for fraction in MISSING:
        for patches in (False, True):
            where = "in patches" if patches else "at random"
            name = f"{100 * fraction:g} % missing {where}"
            yield f"{name}, written as 0", missing(whole, fraction, patches, False)
            if fraction < 0.1:  # more is refused
                yield f"{name}, filled", missing(whole, fraction, patches, True)


def surfaces(count: int) -> Iterator[tuple[str, ...]]:
    """Differences of k, D and H_V of poor maps, means over `count` surfaces, in percent."""
    wholes = [generate(SPEC, number) for number in range(count)]
    true = np.mean([found(whole) for whole in wholes], axis=0)
    for maps in zip(*(poor(whole) for whole in wholes), strict=True):
        mean = np.mean([found(surface) for _, surface in maps], axis=0)
        yield maps[0][0], *(f"{change:+.0f}" for change in 100.0 * (mean / true - 1.0))


def main() -> None:
    """Print both tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="one surface")
    asked = parser.parse_args()
    table(("footprint", "cut", "load (%)", "mu (%)", "mu at the true load (%)"), saturated())
    print()
    table(("map", "k (%)", "D (%)", "H_V (%)"), surfaces(1 if asked.quick else 3))


if __name__ == "__main__":
    main()
