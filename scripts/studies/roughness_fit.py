"""Which generated surface has the contact parameters that are published for compound B?

Searches rms slope, Hurst exponent, roll-off over shortest wave and skewness by differential
evolution; the scale of the surface, by which D and H_V grow alike, follows by itself. Once for each
reading of k at 5 bar and each choice of what is fitted, by either definition of k and D (the
thesis's with two pixels to the shortest wave, as its mesh has). Prints the best surfaces and their
misfits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.preprocess.roughness.survey import parameters
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES, YOUNGS_MODULUS
from scripts.studies.common import options

B = CONTACT_TABLES["B"]
MODULUS = YOUNGS_MODULUS["B"] / 0.75
PRESSURES = np.array([1.0, 5.0]) * BAR
SHORTEST = 35e-6  # before scaling
PIXELS_PER_WAVE: dict[Definition, int] = {"hydrodynamic": 5, "thesis": 2}
WAVES: dict[Definition, int] = {
    "hydrodynamic": 20,
    "thesis": 28,
}  # of the shortest wave along a side
BOUNDS = [(0.15, 0.6), (0.0, 1.0), (1.2, 8.0), (-1.8, 0.8)]
FAILED = 10.0


class Target(NamedTuple):
    """What is fitted: k at 5 bar, and the weights of k, D and H_V at (1 bar, 5 bar)."""

    name: str
    k_5bar: float
    weight: Array


NO_D = np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 1.0]])
ONE_D = np.array([[1.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
TARGETS = [
    Target("k, H_V", 0.605, NO_D),
    Target("k, H_V", 0.505, NO_D),
    Target("k, H_V", 0.405, NO_D),
    Target("k, H_V, D at 1 bar", 0.605, ONE_D),
]


def surface_of(values: Array, definition: Definition) -> SurfaceSpec:
    """The unscaled surface with slope, Hurst exponent, roll-off and skewness in `values`."""
    slope, hurst, ratio, skewness = (float(value) for value in values)
    return SurfaceSpec(
        rms_slope=slope,
        hurst=hurst,
        rolloff=ratio * SHORTEST,
        shortest_wave=SHORTEST,
        skewness=skewness,
        size=WAVES[definition] * SHORTEST,
        pixels=WAVES[definition] * PIXELS_PER_WAVE[definition],
    )


def found(values: Array, definition: Definition, realisations: int) -> Array:
    """k, D, H_V (rows) at 1 and 5 bar of the unscaled surface, mean over realisations."""
    spec = surface_of(values, definition)
    each = [
        np.array(parameters(generate(spec, number), MODULUS, PRESSURES, definition)[:3])
        for number in range(realisations)
    ]
    return np.asarray(np.mean(each, axis=0))


def misfit(target: Target, parameters_found: Array) -> tuple[Array, float]:
    """Logarithmic differences after the best scaling of the surface, and that scale."""
    wanted = np.array([[B.k[0], target.k_5bar], B.D, B.H_V])
    difference = np.log(parameters_found / wanted)
    lengths = target.weight[1:]
    scale = -float((lengths * difference[1:]).sum() / lengths.sum())
    difference[1:] += scale
    return difference, float(np.exp(scale))


def rms(target: Target, difference: Array) -> float:
    """Root of the weighted mean square."""
    return float(np.sqrt((target.weight * difference**2).sum() / target.weight.sum()))


def best(target: Target, definition: Definition, generations: int, realisations: int) -> Array:
    """The four numbers of the surface that fits best."""

    def cost(values: Array) -> float:
        try:
            return rms(target, misfit(target, found(values, definition, realisations))[0])
        except IceslideError:  # its skewness cannot be had
            return FAILED

    result = differential_evolution(
        cost, BOUNDS, maxiter=generations, popsize=6, seed=1, polish=False, init="sobol"
    )
    return np.asarray(result.x)


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="few surfaces: shows that it works")
    parser.add_argument("--definition", choices=["hydrodynamic", "thesis"], help="else both")
    parser.add_argument("--targets", type=int, nargs="+", help="numbers of what is fitted, from 1")
    given = parser.parse_args()
    generations, realisations, shown = (1, 1, 1) if given.quick else (15, 3, 8)
    definitions = [given.definition] if given.definition else list(PIXELS_PER_WAVE)
    head = "definition | fitted | k at 5 bar | rms misfit | k | D, um | H_V, um | rms height, um"
    head += " | rms slope | Hurst | roll-off, um | shortest wave, um | skewness"
    print(f"| {head} |\n|{'---|' * (head.count('|') + 1)}")
    for definition in definitions:
        for number in given.targets or ([1] if given.quick else range(1, len(TARGETS) + 1)):
            target = TARGETS[number - 1]
            values = best(target, definition, generations, realisations)
            fitted = found(values, definition, shown)
            difference, scale = misfit(target, fitted)
            fitted[1:] *= scale
            surface = generate(surface_of(values, definition))
            slope, hurst, ratio, skewness = values
            k, D, H_V = ("{:.3g}, {:.3g}".format(*row) for row in fitted * [[1], [1e6], [1e6]])
            cells = [definition, target.name, target.k_5bar, f"{rms(target, difference):.1%}"]
            cells += [k, D, H_V, f"{1e6 * scale * surface.heights.std():.2f}"]
            cells += [f"{value:.2f}" for value in (slope, hurst)]
            cells += [f"{1e6 * scale * wave * SHORTEST:.1f}" for wave in (ratio, 1.0)]
            print(f"| {' | '.join(map(str, cells))} | {skewness:.2f} |", flush=True)


if __name__ == "__main__":
    main()
