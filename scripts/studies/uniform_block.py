"""Uniform pressure: a thin, stiff block without transverse strain against the point level.

Prints the largest and the mean relative difference of mu(t) between `slice` or `block` and
`point`, before and after melting and through saturation, for every ice model and refinement.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from itertools import product

import numpy as np

from iceslide_fem.film.conditions import scene_conditions
from iceslide_fem.film.point import simulate
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.simulate import run
from scripts.studies.common import options, table

LIMIT = 0.005
HEATS = ("column", "half-space", "continuum")
# Pa/m. Softer than the block, so that the pressure is even up to the edges; with the default one
# the edges, as wide as the block is tall, melt and fill earlier or later (up to 0.9 %).
PENALTY = 1e12


def uniform_scene(model: str, heat: str, refinement: float, tolerance: float) -> Scene:
    """1 mm x 1 mm x 0.05 mm with nu = 0 (D1 = 0.0055 1/MPa), 5 bar, 4 m/s: melts and saturates."""
    return scene_from_dict(
        {
            "name": f"uniform-{model}-{heat}",
            "model": model,
            "rubber": {
                "C10": "166.2 MPa",
                "C01": "106.8 MPa",
                "D1": "0.0055 1/MPa",
                "height": "0.05 mm",
            },
            "load": {"pressure": "5 bar", "speed": "4 m/s", "duration": "7 ms"},
            "ice": {"heat": heat},
            "film": {"k": 0.405, "D": "46.5 um", "H_V": "0.56 um"},
            "numerics": {"tolerance": tolerance, "refinement": refinement, "penalty": PENALTY},
        }
    )


def compare(scene: Scene) -> tuple[Array, dict[str, float]]:
    """Relative differences of mu at the run's own times, and its summary."""
    with tempfile.TemporaryDirectory() as folder:
        summary = run(scene, folder)
        history = read_run(folder).history
    time, mu = history["time_s"], history["mu"]
    heat = "half-space" if scene.ice.heat == "half-space" else "column"
    point = simulate(scene_conditions(scene), heat, tolerance=1e-5, times=time).samples[:, 0]
    return mu / point - 1.0, summary


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="slice only, coarse")
    quick = parser.parse_args().quick
    cases = [("slice", 1.0, 1e-3)]
    if not quick:
        cases += [("slice", 2.0, 1e-4), ("block", 1.0, 1e-3)]
    found: list[float] = []

    def rows() -> Iterator[tuple[object, ...]]:
        for (model, refinement, tolerance), heat in product(cases, HEATS):
            difference, summary = compare(uniform_scene(model, heat, refinement, tolerance))
            largest, mean = np.abs(difference).max(), np.abs(difference).mean()
            found.append(largest)
            yield (
                model, heat, f"{refinement:g}", f"{tolerance:.0e}", f"{largest:.3%}", f"{mean:.3%}",
                f"{summary['wall_s']:.1f}",
            )  # fmt: skip

    table(("model", "ice", "refinement", "tolerance", "largest", "mean", "s"), rows())
    print(f"largest difference {max(found):.2%}, to stay below {LIMIT:.1%}")
    raise SystemExit(int(max(found) > LIMIT))


if __name__ == "__main__":
    main()
