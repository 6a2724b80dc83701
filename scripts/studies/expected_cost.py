"""What `iceslide info` expects of runs of several kinds, and what they take: steps and seconds.

Seconds are the processor's, of one process with its start.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from iceslide_fem.workflow.planning.cost import estimate
from scripts.studies.common import ROOT, case, options, processor_seconds, run_words, table


class Kind(NamedTuple):
    """Runs of one kind: a case, what all of them change, and what each changes."""

    case: str
    changes: Sequence[str]
    variants: Sequence[Sequence[str]]


PLAIN = [[f"numerics.tolerance={tolerance}"] for tolerance in ("1e-2", "1e-3")]
SIPES = ["rubber.sipe_width=0.4mm", "rubber.sipe_depth=6mm", "rubber.length=20mm",
         "rubber.width=10mm", "rubber.height=8mm"]  # fmt: skip
KINDS = {
    "slice": Kind("thesis_1bar", ["model=slice"], PLAIN),
    "block": Kind("thesis_1bar", [], PLAIN[:1]),
    "sliding slice": Kind("tread_block", [], [[], ["load.pressure=4bar"]]),
    "slice with upright sipes": Kind(
        "thesis_1bar", ["model=slice", *SIPES],
        [["rubber.sipes=2"], ["rubber.sipes=4"], ["rubber.sipes=4", "numerics.tolerance=1e-2"]],
    ),
    "sliding slice with sipes": Kind(
        "siped_tread", [],
        [["rubber.sipes=2"], ["rubber.sipes=4"], ["rubber.sipes=6"],
         ["rubber.sipes=4", "ice.temperature=-10degC"],
         ["rubber.sipes=4", "ice.temperature=-2degC"]],
    ),
    "the same, finer": Kind(
        "siped_tread", ["numerics.tolerance=1e-3", "numerics.refinement=1"],
        [["rubber.sipes=0"], ["rubber.sipes=2"], ["rubber.sipes=4"],
         ["rubber.sipes=2", "rubber.edge_radius=0"], ["rubber.sipes=4", "rubber.edge_radius=0"]],
    ),
    "block with sipes": Kind("siped_block", [], [["numerics.refinement=0.35"]]),
    "slice with relaxation": Kind(
        "thesis_1bar",
        ["model=slice", "rubber.prony=[[0.2, 1e-4], [0.1, 1e-3]]", "rubber.modulus_is=long-term"],
        PLAIN[:1],
    ),
    "wet slice": Kind("wet_slick", ["model=slice"], [[]]),
    "slice from CAD": Kind("cad_tread", [], [[]]),
}  # fmt: skip


def rows(names: Sequence[str], quick: bool) -> Iterator[Any]:
    """Expected and taken steps and seconds of each run."""
    for name in names:
        kind = KINDS[name]
        for variant in kind.variants[:1] if quick else kind.variants:
            changes = [*kind.changes, *variant, *(["load.duration=0.1ms"] if quick else [])]
            scene = case(kind.case, *changes)
            expected = estimate(scene)
            with tempfile.TemporaryDirectory() as folder:
                file = ROOT / "cases" / f"{kind.case}.toml"
                words = run_words(file, Path(folder) / "run", *changes, more=["--no-report"])
                seconds = processor_seconds(words, stderr=subprocess.DEVNULL)
                history = (Path(folder) / "run" / "history.csv").read_text(encoding="utf-8")
            steps = history.count("\n") - 2
            yield (
                name, " ".join(variant), expected.steps, steps, f"{expected.time:.0f}",
                f"{seconds:.0f}", f"{seconds / expected.time:.1f}",
            )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--quick", action="store_true", help="one plain slice, for a moment")
    given: argparse.Namespace = parser.parse_args()
    names = ["slice"] if given.quick else given.kinds
    head = ("kind", "changes", "steps expected", "steps", "s expected", "s", "ratio")
    table(head, rows(names, given.quick))


if __name__ == "__main__":
    main()
