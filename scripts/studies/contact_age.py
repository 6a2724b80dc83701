"""What k at the contact's age does to friction, and what it costs.

The base case: a block of 20 mm at 2 bar and 4 m/s for 5 ms on the surface of cases/surfaces/
compound_B.csv. What compound B relaxes by is not published. Two sets are assumed here, with the
table's modulus as the long-term one:

- one arm: g = 0.3, 5 ms, the same at every temperature;
- wide: eight arms g = 0.1 from 0.1 us to 1 s, a decade each, at 20 degC, and the universal WLF
  constants about a glass transition at -50 degC.

Printed are mean mu of points on ice of -4, -10 and -20 degC: with the table as it is, with the
instantaneous modulus, and at the contact's age; then of slices, wherever films live; then seconds
of the processor of 10,000 points in one call, the same ones each time, in turn, medians of five.
--quick: points alone, and 100 of them once.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from iceslide_fem.film.conditions import scene_loading, varied_conditions
from iceslide_fem.film.point import PointResult, simulate
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, scene_from_dict
from scripts.studies.common import ROOT, options, table, timed

SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
WLF = {"C1": 7.4005, "C2": 121.6, "reference": 20.0 + ZERO_CELSIUS}
SETS: dict[str, dict[str, Any]] = {
    "one arm": {"prony": [[0.3, 5e-3]]},
    "wide": {"prony": [[0.1, 10.0**decade] for decade in range(-7, 1)], "wlf": WLF},
}
CELSIUS = (-4.0, -10.0, -20.0)
FRAMES = {
    "attached": {"motion": "attached"},
    "on the rubber": {"motion": "sliding", "carrier": "rubber"},
    "on the ice": {"motion": "sliding", "carrier": "ice"},
}
POINTS, REPEATS = 10_000, 5
NEVER = 1e-9  # g of rubber that hardly relaxes


def scene(
    rubber: dict[str, Any],
    celsius: float = -4.0,
    model: str = "point",
    age: bool = True,
    motion: str = "attached",
    carrier: str = "ice",
) -> Scene:
    """The base case of rubber that relaxes so."""
    relaxes = {"modulus_is": "long-term", **rubber} if rubber else {}
    return scene_from_dict(
        {
            "name": "age",
            "model": model,
            "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01, **relaxes},
            "load": {"pressure": 2e5, "speed": 4.0, "duration": 5e-3},
            "ice": {"temperature": celsius + ZERO_CELSIUS, "motion": motion},
            "film": {"contact": str(SURFACE), "contact_age": age, "carrier": carrier},
            "numerics": {"tolerance": 1e-3 if model == "point" else 1e-2},
        }
    )


def instantaneous(rubber: dict[str, Any]) -> dict[str, Any]:
    """Rubber that keeps the modulus which it has at first."""
    stiffer = 1.0 - sum(g for g, _ in rubber["prony"])
    constants = {"C10": 0.1662e6 / stiffer, "C01": 0.1068e6 / stiffer, "D1": 0.0737e-6}
    return {"compound": None, "prony": [[NEVER, 1.0]], **constants}


def of_points() -> None:
    """Print mean mu at every temperature."""
    head = "rubber", "ice, degC", "table as it is", "instantaneous modulus", "at its age", "change"

    def rows() -> Any:
        for name, rubber in SETS.items():
            for celsius in CELSIUS:
                kinds = (
                    scene({}, celsius, age=False),
                    scene(instantaneous(rubber), celsius),
                    scene(rubber, celsius),
                )
                mu = [point_history(one)[1]["mu_mean"] for one in kinds]
                change = f"{mu[2] / mu[0] - 1.0:+.1%}"
                yield name, f"{celsius:g}", *(f"{one:.4f}" for one in mu), change

    table(head, rows())


def of_slices() -> None:
    """Print mean mu of slices, with the table as it is and at the contact's age."""
    from scripts.studies.blocks import slid  # loads DOLFINx

    def rows() -> Any:
        for name, frame in FRAMES.items():
            for what, age in (("table as it is", False), ("at its age", True)):
                rubber = SETS["one arm"] if age else {}
                found = slid(scene(rubber, -4.0, "slice", age, **frame))
                yield name, what, f"{found.mean:.4f}", found.steps, f"{found.seconds:.1f}"

    table(("films", "k", "mean mu", "steps", "processor, s"), rows())


def random_points(of: Scene, number: int) -> PointResult:
    """So many points at random, the same ones whatever their contact does."""
    random = np.random.default_rng(1)
    varied = {
        "speed": np.exp(random.uniform(np.log(0.1), np.log(10.0), number)),
        "temperature": ZERO_CELSIUS + random.uniform(-20.0, -1.0, number),
    }
    conditions = varied_conditions(of, **varied)
    return simulate(conditions, tolerance=1e-3, loading=scene_loading(of))


def cost(number: int, repeats: int) -> None:
    """Print seconds of points."""
    kinds: Sequence[tuple[str, Scene]] = (
        ("table as it is", scene({}, age=False)),
        *((f"at its age, {name}", scene(rubber)) for name, rubber in SETS.items()),
    )
    first = 0.0

    def rows() -> Any:
        nonlocal first
        for name, one in kinds:
            found, seconds = timed(partial(random_points, one, number), repeats)
            first = first or seconds
            steps = float((found.steps + found.rejected).mean())
            yield name, f"{seconds:.2f}", f"{seconds / first:.2f}", f"{steps:.1f}"

    table((f"{number} points", "processor, s", "times the first", "steps each"), rows())


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="points alone, and 100 of them once")
    quick = parser.parse_args().quick
    of_points()
    print()
    if not quick:
        of_slices()
        print()
    cost(*((100, 1) if quick else (POINTS, REPEATS)))


if __name__ == "__main__":
    main()
