"""The thesis's friction subroutine as printed, and with its slips undone one by one.

Runs cases/laws/thesis_subroutine_1bar and _5bar on the point level, at 5 bar with k of three
readings, and prints mu at 0.8 ms, its peak behind 0.05 ms, mu at 7 ms and when the free volume
is full. With --slices the same scenes as slices, where points have the local pressure and speed, or
what the block does not hold.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from scripts.studies.common import case, options, table

READINGS: dict[str, dict[str, int]] = {
    "as printed": {},
    "p of the scene": {"press": -1},
    "p of the scene, brackets": {"press": -1, "brackets": 1},
    "p of the scene, brackets, xx set": {"press": -1, "brackets": 1, "xx_set": 1},
    "brackets": {"brackets": 1},
    "brackets, xx set": {"brackets": 1, "xx_set": 1},
}


SLICES = {
    1: ((0.266,), ("as printed", "brackets", "brackets, xx set")),
    5: ((0.405, 0.605), ("as printed", "p of the scene", "p of the scene, brackets")),
}
ON_SLICES = ("model=slice", "numerics.refinement=0.5", "numerics.max_step=1us")


def scene_of(bar: int, name: str, k: float, *more: str) -> Scene:
    """The scene of a reading, with more changes."""
    given = {key: bar * 1e5 if value < 0 else value for key, value in READINGS[name].items()}
    changes = [f"friction.parameters.{key}={value}" for key, value in {"k": k, **given}.items()]
    return case(f"laws/thesis_subroutine_{bar}bar", *changes, *more)


def cells(bar: int, name: str, k: float, time: Array, mu: Array) -> list[object]:
    """What both tables begin with, to mu at the end."""
    late = np.where(time > 0.05e-3, mu, 0.0)
    peak = int(np.argmax(late))
    return [
        f"{bar} bar", name, k, f"{np.interp(0.8e-3, time, mu):.4f}",
        f"{late[peak]:.3f} at {1e3 * time[peak]:.2f} ms", f"{mu[-1]:.4f}",
    ]  # fmt: skip


def slices(quick: bool) -> Iterator[list[object]]:
    """Rows of the scenes on slices."""
    from scripts.studies.blocks import slid  # finite elements, which points do not need

    for bar, (ks, names) in SLICES.items():
        for name in names[:2] if quick else names:
            for k in ks[:1] if quick else ks:
                more = ["load.duration=0.1ms", "numerics.max_step=5us"] if quick else []
                try:
                    found = slid(scene_of(bar, name, k, *ON_SLICES, *more))
                except SimulationStopped as reason:
                    told = str(reason).partition(";")[0]
                    yield [f"{bar} bar", name, k, told, "", "", ""]
                    continue
                yield [*cells(bar, name, k, found.time, found.mu), f"{found.mean:.4f}"]


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--slices", action="store_true", help="as slices, ten minutes")
    parser.add_argument("--quick", action="store_true", help="slices of 0.1 ms")
    arguments = parser.parse_args()
    if arguments.slices or arguments.quick:
        names = ["scene", "reading", "k", "mu at 0.8 ms", "peak", "mu at 7 ms", "mean"]
        table(names, slices(arguments.quick))
        return

    def rows() -> Iterator[list[object]]:
        for bar, ks in ((1, (0.266,)), (5, (0.105, 0.405, 0.605))):
            for name, changes in READINGS.items():
                for k in ks:
                    if bar == 1 and "press" in changes:
                        continue
                    found, _ = point_history(scene_of(bar, name, k))
                    time = np.array([row.time_s for row in found])
                    mu = np.array([row.mu for row in found])
                    full = np.array([row._asdict()["law_Hss_m"] for row in found])
                    H_V = 2.86e-6 if bar == 1 else 0.56e-6
                    filled = time[full >= H_V]
                    full_at = f"{1e3 * filled[0]:.3f} ms" if filled.size else "never"
                    yield [*cells(bar, name, k, time, mu), full_at]

    table(["scene", "reading", "k", "mu at 0.8 ms", "peak", "mu at 7 ms", "full at"], rows())


if __name__ == "__main__":
    main()
