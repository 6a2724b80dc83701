"""What all components of the film law together cost: processor time per step, over the default's.

A point, slices on ice that is attached or slides, and a block: default, each component alone, all
together. The default keeps the shape of a block while its shear hardly changes; rubber that relaxes
needs an equilibrium in every step. --quick: short runs.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.point_pass import ice_of, one_pass
from iceslide_fem.scene import Scene, scene_from_dict
from scripts.studies.common import ROOT, options, table

SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
COMPONENTS: Mapping[str, Mapping[str, Any]] = {
    "the published law": {},
    "wet ice": {"film": {"voids": "carry"}, "ice": {"water": 10e-6}},
    "dry strength": {"film": {"dry_stress": 4e5, "dry_softening": 13.5, "initial_height": 0.0}},
    "contact age": {
        "rubber": {"prony": [[0.3, 1e-4], [0.3, 1e-2]], "modulus_is": "instantaneous"},
        "film": {"contact_age": True},
    },
    "heat in the rubber": {"rubber": {"heat": True}},
    "viscosity over temperature": {"water": {"viscosity": [[253.15, 4e-3], [273.15, 1.8e-3]]}},
}
MODELS = {
    "point": ("point", "attached"),
    "slice, attached": ("slice", "attached"),
    "slice, sliding": ("slice", "sliding"),
    "block, attached": ("block", "attached"),
}
DURATIONS = {"point": 2e-3, "slice": 0.5e-3, "block": 0.05e-3}  # s


def scene(model: str, motion: str, duration: float, changes: list[Mapping[str, Any]]) -> Scene:
    """Rubber of 20 mm at 2 bar and 4 m/s on ice of -5 degC."""
    tables: dict[str, Any] = {
        "rubber": {"C10": 0.8e6, "C01": 0.2e6, "nu": 0.48, "length": 20e-3, "width": 20e-3,
                   "height": 8e-3, "inertia": True},
        "load": {"pressure": 2e5, "speed": 4.0, "duration": duration},
        "ice": {"temperature": 268.15, "motion": motion},
        "film": {"contact": str(SURFACE)},
        "numerics": {"tolerance": 1e-2},
    }  # fmt: skip
    for change in changes:
        for name, values in change.items():
            tables[name] = tables.get(name, {}) | values
    return scene_from_dict({"name": "everything", "model": model, **tables})


def cost(given: Scene) -> tuple[int, float]:
    """Steps of a run without start, tried ones too, and processor seconds per step."""
    if given.model == "point":
        law, ice = law_of(given), ice_of(given)
        one_pass(given, law, ice, shown=False)
        begun = time.process_time()
        _, found = one_pass(given, law, ice, shown=False)
        steps = int(found.steps[0] + found.rejected[0])
        return steps, (time.process_time() - begun) / steps
    from iceslide_fem.coupling.sliding import Sliding
    from iceslide_fem.fenics.compat import MPI
    from iceslide_fem.mechanics.block import build_block
    from iceslide_fem.mechanics.press import press, start_sliding

    block = build_block(given, MPI.COMM_SELF)
    press(block, lambda point: None)
    start_sliding(block, lambda point: None)
    sliding = Sliding(block)
    begun = time.process_time()
    steps = sum(1 + accepted.rejected for accepted in sliding.steps())
    return steps, (time.process_time() - begun) / steps


def main() -> None:
    """Print one table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="short runs")
    quick = parser.parse_args().quick
    together = {**{name: [change] for name, change in COMPONENTS.items()},
                "all": list(COMPONENTS.values())}  # fmt: skip
    first: dict[str, float] = {}
    rows = []
    for name, changes in together.items():
        row: list[object] = [name]
        for where, (model, motion) in MODELS.items():
            duration = DURATIONS[model]
            steps, each = cost(scene(model, motion, 0.1 * duration if quick else duration, changes))
            first.setdefault(where, each)
            row += [steps, f"{1e3 * each:.1f}", f"{each / first[where]:.2f}"]
        rows.append(tuple(row))
    heads = [f"{where}: {what}" for where in MODELS for what in ("steps", "ms each", "ratio")]
    table(("components", *heads), rows)


if __name__ == "__main__":
    main()
