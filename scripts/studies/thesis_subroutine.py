"""The thesis's friction subroutine as printed, and with its slips undone one by one.

Runs cases/laws/thesis_subroutine_1bar and _5bar on the point rung, at 5 bar with k of three
readings, and prints mu at 0.8 ms, its peak behind 0.05 ms, mu at 7 ms and when the free volume
is full.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from iceslide_fem.run.point import point_history
from iceslide_fem.scene import load_scene
from scripts.studies.common import ROOT, options, table

READINGS: dict[str, dict[str, int]] = {
    "as printed": {},
    "p of the scene": {"press": -1},
    "p of the scene, brackets": {"press": -1, "brackets": 1},
    "p of the scene, brackets, xx set": {"press": -1, "brackets": 1, "xx_set": 1},
    "brackets": {"brackets": 1},
    "brackets, xx set": {"brackets": 1, "xx_set": 1},
}


def main() -> None:
    options(__doc__).parse_args()

    def rows() -> Iterator[list[object]]:
        for bar, ks in ((1, (0.266,)), (5, (0.105, 0.405, 0.605))):
            path = ROOT / "cases" / "laws" / f"thesis_subroutine_{bar}bar.toml"
            for name, changes in READINGS.items():
                for k in ks:
                    if bar == 1 and "press" in changes:
                        continue
                    sets = [f"friction.parameters.k={k}"]
                    for key, value in changes.items():
                        sets.append(
                            f"friction.parameters.{key}={bar * 1e5 if value < 0 else value}"
                        )
                    found, _ = point_history(load_scene(path, sets))
                    time = np.array([row.time_s for row in found])
                    mu = np.array([row.mu for row in found])
                    full = np.array([row._asdict()["law_Hss_m"] for row in found])
                    H_V = 2.86e-6 if bar == 1 else 0.56e-6
                    late = time > 0.05e-3
                    peak = int(np.argmax(np.where(late, mu, 0.0)))
                    filled = time[full >= H_V]
                    yield [
                        f"{bar} bar", name, k, f"{np.interp(0.8e-3, time, mu):.4f}",
                        f"{mu[peak]:.3f} at {1e3 * time[peak]:.2f} ms", f"{mu[-1]:.4f}",
                        f"{1e3 * filled[0]:.3f} ms" if filled.size else "never",
                    ]  # fmt: skip

    table(["scene", "reading", "k", "mu at 0.8 ms", "peak", "mu at 7 ms", "full at"], rows())


if __name__ == "__main__":
    main()
