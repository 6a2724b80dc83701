"""What dry shear costs: 10,000 points with the film law and with dry shear; and 1000 passes.

Points of compound B at 2 bar for 7 ms, at speeds of 0.1 to 10 m/s (even in their logarithm) and on
ice of -20 to -1 degC at random, the same with either, at a tolerance of 1e-3; each in one call, in
turn, medians of five. With dry shear films begin without water, and with `refreeze = "film"`, too.
Then one point that slides over the same ice 1000 times, 5 ms in every second at 2 bar and 4 m/s, on
ice at -4 degC, as the history of a run. Seconds are of the processor and by the clock. --quick: 100
points once, 10 passes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from statistics import median
from time import perf_counter, process_time
from typing import Any

import numpy as np

from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, scene_from_dict
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES
from scripts.studies.common import options, table
from scripts.studies.dry_calibration import CALIBRATED

POINTS, REPEATS, PASSES = 10_000, 5, 1000
PRESSURE = 2.0  # bar
DURATION, TOLERANCE = 7e-3, 1e-3  # s
SPEEDS, CELSIUS = (0.1, 10.0), (-20.0, -1.0)  # m/s, degC
H0 = 70e-9  # m, of the film law


def random_conditions(number: int, dry: bool, refreeze: str = "nothing") -> Conditions:
    """So many points, the same ones whatever rubs."""
    random = np.random.default_rng(1)
    slowest, fastest = np.log(SPEEDS)
    speed = np.exp(random.uniform(slowest, fastest, number))
    k, D, H_V, _ = CONTACT_TABLES["B"](np.array([PRESSURE * BAR]))
    return Conditions.of(
        strength=CALIBRATED.strength if dry else None, refreeze=refreeze, pressure=PRESSURE * BAR,
        speed=speed, temperature=ZERO_CELSIUS + random.uniform(*CELSIUS, number),
        k=k, D=D, H_V=H_V, initial_height=0.0 if dry else H0, duration=DURATION,
    )  # fmt: skip


def clocked(task: Callable[[], Any]) -> tuple[Any, float, float]:
    """The result of a task, its processor seconds and those by the clock."""
    clock, processor = perf_counter(), process_time()
    result = task()
    return result, process_time() - processor, perf_counter() - clock


def scene_of(passes: int) -> Scene:
    """The point that slides over the same ice so many times."""
    return scene_from_dict(
        {
            "name": "passes",
            "model": "point",
            "rubber": {"compound": "B", "length": 0.02, "width": 0.02, "height": 0.01},
            "load": {
                "pressure": PRESSURE * BAR,
                "speed": 4.0,
                "duration": 5e-3,
                "passes": passes,
                "period": 1.0,
            },
            "ice": {"temperature": ZERO_CELSIUS - 4.0, "motion": "sliding"},
            "numerics": {"tolerance": TOLERANCE},
        }
    )


def main() -> None:
    """Print both tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="100 points once, 10 passes")
    quick = parser.parse_args().quick
    points, repeats, passes = (100, 1, 10) if quick else (POINTS, REPEATS, PASSES)
    kinds = {
        "film law": random_conditions(points, dry=False),
        "dry shear": random_conditions(points, dry=True),
        "dry shear, films freeze": random_conditions(points, dry=True, refreeze="film"),
    }
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in kinds}
    steps: dict[str, float] = {}
    for _ in range(repeats):
        for name, conditions in kinds.items():
            found, *seconds = clocked(partial(simulate, conditions, tolerance=TOLERANCE))
            times[name].append((seconds[0], seconds[1]))
            steps[name] = float((found.steps + found.rejected).mean())
    medians = {name: [median(part) for part in zip(*of, strict=True)] for name, of in times.items()}
    first = medians["film law"]
    table(
        (f"{points} points", "processor, s", "by the clock, s", "times the film law", "steps each"),
        (
            (name, f"{processor:.2f}", f"{clock:.2f}", f"{processor / first[0]:.2f}",
             f"{steps[name]:.1f}")
            for name, (processor, clock) in medians.items()
        ),
    )  # fmt: skip
    print()
    scene = scene_of(passes)
    (_, entries), processor, clock = clocked(lambda: point_history(scene))
    table(
        ("passes", "processor, s", "by the clock, s", "steps", "ms of the processor per step"),
        [
            (passes, f"{processor:.1f}", f"{clock:.1f}", entries["steps"],
             f"{1e3 * processor / entries['steps']:.3f}")
        ],
    )  # fmt: skip


if __name__ == "__main__":
    main()
