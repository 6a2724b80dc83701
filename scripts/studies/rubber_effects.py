"""What each effect of rubber that relaxes moves: k at the contact's age, the block, its heat.

A tread block of 20 mm x 8 mm at 2 bar and 4 m/s for 5 ms, on ice that stays under it, with the
surface of cases/surfaces/compound_B.csv and the constants of compound B as long-term ones, which
relax by the wide set of `contact_age`: assumed, not measured. At every temperature: mean mu of a
point and of a slice, elastic; what `film.contact_age` changes at the point; what the block's own
relaxation changes in the slice, alone and with `film.contact_age`; the rubber's heat over the
friction's; E(t) after 1 us and at the end. Tolerance 3e-3. --quick: one temperature, 1e-2.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.results.run_directory import read_run
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.simulate import run
from scripts.studies.common import options, table
from scripts.studies.contact_age import SETS, SURFACE

RELAXES = {**SETS["wide"], "modulus_is": "long-term"}
HEAD = (
    "ice, degC", "E(1 us), MPa", "E(5 ms), MPa", "point, elastic", "k at age", "slice, elastic",
    "block relaxes", "both", "heat of the rubber / friction",
)  # fmt: skip


def scene(celsius: float, tolerance: float, model: str, relaxes: bool, age: bool) -> Scene:
    """The block on ice of a temperature; with rubber that relaxes, and k at the contact's age."""
    rubber: dict[str, Any] = {"compound": "B", "length": 20e-3, "width": 20e-3, "height": 8e-3}
    if relaxes:
        rubber |= RELAXES
    return scene_from_dict(
        {
            "name": "rubber", "model": model, "rubber": rubber,
            "load": {"pressure": 2e5, "speed": 4.0, "duration": 5e-3},
            "ice": {"temperature": celsius + ZERO_CELSIUS, "motion": "attached"},
            "film": {"contact": str(SURFACE), "contact_age": age},
            "numerics": {"tolerance": tolerance},
            "output": {"times": 0},
        }
    )  # fmt: skip


def found(*settings: Any) -> tuple[float, float]:
    """Mean mu of the scene with these settings, and the rubber's heat over the friction's."""
    with tempfile.TemporaryDirectory() as folder:
        run(scene(*settings), Path(folder), force=True, pictures=False)
        result = read_run(folder)
        history = result.history
        heat, work = history["rubber_dissipation_J"][-1], history["friction_work_J"][-1]
        return float(result.summary["mu_mean"]), float(heat / work)


def rows(temperatures: Sequence[float], tolerance: float) -> Iterator[tuple[object, ...]]:
    """One for each temperature (degC)."""
    for celsius in temperatures:
        relaxing = scene(celsius, tolerance, "slice", True, False)
        relaxation, constants = relaxing.rubber.relaxation, relaxing.mooney_rivlin
        assert relaxation is not None
        moduli = [
            constants.stiffer(float(relaxation.modulus(time, celsius + ZERO_CELSIUS)))
            for time in (1e-6, 5e-3)
        ]
        point, aged = (found(celsius, tolerance, "point", age, age)[0] for age in (False, True))
        elastic, _ = found(celsius, tolerance, "slice", False, False)
        block, _ = found(celsius, tolerance, "slice", True, False)
        both, heat = found(celsius, tolerance, "slice", True, True)
        yield (
            f"{celsius:g}", *(f"{one.youngs_modulus / 1e6:.3g}" for one in moduli),
            f"{point:.4f}", f"{aged / point - 1.0:+.1%}",
            f"{elastic:.4f}", f"{block / elastic - 1.0:+.1%}", f"{both / elastic - 1.0:+.1%}",
            f"{heat:.1e}",
        )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="one temperature, tolerance 1e-2")
    quick = parser.parse_args().quick
    table(HEAD, rows([-4.0] if quick else [-4.0, -10.0, -20.0], 1e-2 if quick else 3e-3))


if __name__ == "__main__":
    main()
