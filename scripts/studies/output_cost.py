"""What writing a run's outputs costs: fraction of its processor time, and sizes.

The thesis's scene at 1 bar as slice and as block, with all fields that are written by default and
with values at the contact points, too. Shares are of one run on one process, press included.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time
from typing import get_args

from iceslide_fem.coupling.ledger import Ledger
from iceslide_fem.coupling.state import AcceptedStep
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.output.block_fields import BlockFields
from iceslide_fem.output.fields import Fields
from iceslide_fem.output.history import slide_row
from iceslide_fem.output.table import HistoryRow, Table
from iceslide_fem.rubber.build import build_block
from iceslide_fem.runs.schedule import FieldTimes
from iceslide_fem.scene import Scene
from iceslide_fem.scene.output import FIELDS
from scripts.studies.blocks import at_speed
from scripts.studies.common import case, options, table

MB = 1e6


def cost(scene: Scene, folder: Path) -> list[list[str]]:
    """Rows of the table: the history and every series of fields of a run of `scene`."""
    started = process_time()
    block = build_block(scene, MPI.COMM_SELF)
    sliding = at_speed(block)
    ledger = Ledger(sliding)
    series = {name: BlockFields(sliding, names) for name, names in _series().items()}
    files = {name: Fields(folder / name, MPI.COMM_SELF) for name in series}
    seconds = dict.fromkeys(("history", *series), 0.0)
    due = FieldTimes(scene.output.times, scene.load.duration, None)
    with Table(folder / "history.csv", HistoryRow, 0) as history:

        def look(accepted: AcceptedStep | None) -> None:
            before = process_time()
            history.row(slide_row(sliding, ledger, accepted))
            seconds["history"] += process_time() - before
            if not due(sliding.current.time):
                return
            for name, fields in series.items():
                before = process_time()
                files[name].write(sliding.current.time, fields.grids(accepted))
                seconds[name] += process_time() - before

        look(None)
        for accepted in sliding.steps():
            ledger.add(accepted)
            look(accepted)
    contact_points = seconds["contact_points"]
    whole = process_time() - started - contact_points  # as by default
    default = sum(seconds.values()) - contact_points
    rows = []
    for name, spent in seconds.items():
        times = len(files[name].written) if name in files else 1
        place = folder / name if name in files else folder / "history.csv"
        parts = list(place.iterdir()) if place.is_dir() else [place]
        size = sum(part.stat().st_size for part in parts if part.is_file())
        if size:  # else there is none in this scene
            sizes = [f"{size / MB:.2f}", f"{size / times / 1e3:.0f}"]
            rows.append([scene.model, f"`{name}`", f"{spent / whole:.2%}", *sizes])
    total = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    total -= sum(file.stat().st_size for file in (folder / "contact_points").iterdir())
    rows.append([scene.model, "all by default", f"{default / whole:.2%}", f"{total / MB:.2f}", ""])
    return rows


def _series() -> dict[str, list[str]]:
    """What is written into one series each, by its file's name."""
    names = [name for name in get_args(FIELDS) if name not in ("rubber", "stress")]
    return {"rubber": ["rubber", "stress"], **{name: [name] for name in names}}


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="tolerance 1e-2, coarse, 1 ms")
    parser.add_argument("--case", default="thesis_1bar", help="a scene of the folder cases")
    parser.add_argument("--model", action="append", help="slice or block; else both")
    chosen = parser.parse_args()
    quick = ["numerics.tolerance=1e-2", "numerics.refinement=0.5", "load.duration=1ms"]

    def rows() -> list[list[str]]:
        found = []
        for model in chosen.model or ["slice", "block"]:
            scene = case(chosen.case, f"model={model}", *(quick if chosen.quick else []))
            with tempfile.TemporaryDirectory() as folder:
                found += cost(scene, Path(folder))
        return found

    table(["model", "what", "fraction of time", "MB", "kB per time"], rows())


if __name__ == "__main__":
    main()
