"""What other data of ice, water and rubber change of mu, against the defaults.

Slices of the thesis's scenes at 1 and 5 bar, 3 m/s and -4 degC: mu at its peak, mean and end, and
how much the block is pressed together.
"""

from __future__ import annotations

import json

from iceslide_fem.scene import Scene
from scripts.studies.blocks import slid
from scripts.studies.common import case, options, table


def viscosity(kelvin: float) -> float:
    """Of water at 1 bar from -20 degC on, supercooled, too, Pa s (IAPWS).

    M. L. Huber et al., J. Phys. Chem. Ref. Data 38 (2009) 101, their equation for 0.1 MPa.
    """
    terms = ((280.68, -1.9), (511.45, -7.7), (61.131, -19.6), (0.45903, -40.0))
    return 1e-6 * sum(factor * (kelvin / 300.0) ** power for factor, power in terms)


TABLE = [(273.15 + t, round(viscosity(273.15 + t), 8)) for t in range(-20, 1, 2)]
VARIANTS = {
    "defaults": (),
    "nu = 0.495 instead of D1": ("rubber.poisson_ratio=0.495",),
    "ice of table 1": ("ice.density=917.8", "ice.conductivity=2.22", "ice.heat_capacity=2020"),
    "melting at -1 degC": ("ice.melting_temperature=-1degC",),
    "viscosity 2.1 mPa s": ("water.viscosity=2.1mPa*s",),
    "viscosity of the film's temperature": (f"water.viscosity={json.dumps(TABLE)}",),
}


def cells(scene: Scene) -> tuple[float, ...]:
    """Peak, mean and end of mu, and how far the plate went down (fraction of the height)."""
    found = slid(scene)
    sunk = found.last.current.mechanics.plate_displacement / scene.rubber.height
    return float(found.mu.max()), found.mean, float(found.mu[-1]), abs(sunk)


def main() -> None:
    """Print a table for each pressure."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse, 2 ms, 1 bar only")
    arguments = parser.parse_args()
    changes = ["model=slice", "ice.heat=column", "numerics.tolerance=3e-3"]
    if arguments.quick:
        changes += ["numerics.refinement=0.5", "numerics.tolerance=3e-2", "load.duration=2ms"]
    for name in ("thesis_1bar", "thesis_5bar")[: 1 if arguments.quick else 2]:
        print(f"\n{name}")
        rows: list[tuple[str, ...]] = []
        first: tuple[float, ...] = ()
        for variant, data in VARIANTS.items():
            found = cells(case(name, *changes, *data))
            first = first or found
            shown = (f"{a:.4f} ({a / b - 1.0:+.1%})" for a, b in zip(found, first, strict=True))
            rows.append((variant, *shown))
        table(("data", "peak mu", "mean", "at the end", "pressed together"), rows)


if __name__ == "__main__":
    main()
