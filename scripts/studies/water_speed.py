"""What it does to the friction of a tread block how fast the squeezed-out water moves below it.

Runs cases/tread_block and siped_block over 200 mm of ice with `film.water_speed` 1
(with the ice), 0.5 (Couette) and 0 (with the rubber), at 2 and at 5 bar, and prints mu after 20
and 200 mm, where voids are full, and where the squeezed-out water is at the end.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.simulate import run
from scripts.studies.common import case, options, table

WAY = 0.2  # m
COLUMNS = ("squeezed", "below", "left")


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--pressures", default="2bar,5bar", help="nominal pressures")
    parser.add_argument("--cases", default="tread_block,siped_block", help="names of cases")
    parser.add_argument("--shares", default="1,0.5,0", help="of film.water_speed")
    parser.add_argument("--set", action="append", default=[], help="another change of the scenes")
    arguments = parser.parse_args()

    def rows() -> Iterator[list[str]]:
        with tempfile.TemporaryDirectory() as folder:
            for name in arguments.cases.split(","):
                for pressure in arguments.pressures.split(","):
                    for share in arguments.shares.split(","):
                        scene = case(
                            name, f"load.pressure={pressure}", f"film.water_speed={share}",
                            "load.duration=50ms", "output.times=0", *arguments.set,
                        )  # fmt: skip
                        try:
                            run(scene, Path(folder), force=True, pictures=False)
                        except SimulationStopped as reason:
                            yield [name, pressure, share, str(reason)]
                            continue
                        found = read_run(Path(folder)).history
                        water = [1e9 * found[f"water_{where}_m3"] for where in COLUMNS]
                        passed = [
                            np.searchsorted(found["slip_m"], x) for x in (0.02, 0.1, WAY - 1e-9)
                        ]
                        balance = np.abs(water[0] - water[1] - water[2]).max() / water[0][-1]
                        yield [
                            name, pressure, share,
                            *(f"{found['mu'][i]:.4f}" for i in passed),
                            f"{1e6 * found['squeezed_height_m'][-1]:.3f}",
                            f"{found['saturated_fraction'][-1]:.0%}",
                            *(f"{one[-1]:.3f}" for one in water),
                            f"{balance:.0e}",
                        ]  # fmt: skip

    table(
        ["case", "pressure", "water_speed", "mu at 20 mm", "100 mm", "200 mm", "mean H_s (um)",
         "full", "squeezed (mm3)", "below", "left", "missing"],
        rows(),
    )  # fmt: skip


if __name__ == "__main__":
    main()
