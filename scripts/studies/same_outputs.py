"""Whether the outputs are the same to the last digit as they were: tables of all cases and of the
preprocessors, against those that an earlier tree has left in a folder.

    python -m scripts.studies.same_outputs FOLDER

What the folder does not hold yet is written there: call it first before a change, then after. Cases
run as slices and as blocks at a tolerance of 1e-2, points as points, on one and on two processes.
`--quick` is a moment of one slice and one preprocessor. Ends with 1 if anything differs.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from pathlib import Path
from shutil import copyfile
from subprocess import PIPE, CalledProcessError
from typing import NamedTuple

from scripts.studies.command_runs import MOMENT
from scripts.studies.common import (
    ROOT,
    case,
    fault,
    iceslide_words,
    on_ranks,
    options,
    silently,
    table,
)

HEAD = ("outputs", "processes", "same", "differ")
TABLES = ("*.csv", "*.toml")
TREAD = ("--gaussian", "120mm,2bar,30mm", "--speed", "20km/h", "--temperature=-4degC")
PREPROCESSORS = {
    "footprint": ("footprint", *TREAD),
    "footprint_dry": ("footprint", *TREAD, "--dry-stress", "0.2MPa"),
    "footprint_wet": ("footprint", *TREAD, "--water", "20um", "--lug", "6mm"),
    "wheel": ("wheel", *TREAD, "--slip", "0:1:21"),
    "wheel_abs": ("wheel", *TREAD, "--abs"),
    "roughness": ("roughness", "cases/surfaces/compound_B.toml"),
    "rubber": ("rubber", "cases/rubber/synthetic_dma.csv"),
}


class Outputs(NamedTuple):
    """What is computed: its name, the words of a command without those of ranks, and processes."""

    name: str
    words: Sequence[str]
    ranks: int

    def differences(self, kept: Path) -> tuple[object, ...]:
        """A row of the table. Files that `kept` does not hold are put there."""
        with tempfile.TemporaryDirectory() as folder:
            try:
                silently(
                    on_ranks([*self.words, "--out", folder, "--force"], self.ranks),
                    stderr=PIPE,
                )
            except CalledProcessError as error:
                return self.name, self.ranks, 0, fault(error.stderr.decode())
            here = kept / f"{self.name}_{self.ranks}"
            here.mkdir(parents=True, exist_ok=True)
            found = [path for pattern in TABLES for path in sorted(Path(folder).glob(pattern))]
            missing = {path.name for path in here.iterdir()} - {path.name for path in found}
            differ = [f"no {name}" for name in sorted(missing)]
            for path in found:
                earlier = here / path.name
                if not earlier.exists():
                    copyfile(path, earlier)
                elif path.read_bytes() != earlier.read_bytes():
                    differ.append(path.name)
        return self.name, self.ranks, len(found) - len(differ), ", ".join(differ)


def case_outputs(quick: bool) -> Iterator[Outputs]:
    """Of the cases: those on one process first."""
    names = (
        ["thesis_1bar"] if quick else sorted(path.stem for path in (ROOT / "cases").glob("*.toml"))
    )
    moment = [word for change in MOMENT for word in ("--set", change)] if quick else []
    for ranks in (1,) if quick else (1, 2):
        for name in names:
            models = ("point",) if case(name).model == "point" else ("slice", "block")
            for model in models[:1] if quick else models:
                changes = ("--set", f"model={model}", "--set", "numerics.tolerance=1e-2", *moment)
                words = iceslide_words("run", f"cases/{name}.toml", *changes, "--no-report")
                yield Outputs(f"{name}_{model}", words, ranks)


def preprocessor_outputs(quick: bool) -> Iterator[Outputs]:
    """Of the preprocessors."""
    for name, words in list(PREPROCESSORS.items())[: 1 if quick else None]:
        yield Outputs(name, iceslide_words(*words), 1)


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("folder", type=Path, help="of the outputs of an earlier tree")
    parser.add_argument("--quick", action="store_true", help="a moment of one slice")
    parser.add_argument("--only", nargs="+", help="outputs whose name holds one of these")
    asked = parser.parse_args()
    every = [*preprocessor_outputs(asked.quick), *case_outputs(asked.quick)]
    if asked.only:
        every = [one for one in every if any(part in one.name for part in asked.only)]
    rows = []

    def shown(at_a_time: int, ranks: int) -> Iterator[tuple[object, ...]]:
        with ThreadPoolExecutor(at_a_time) as pool:
            for row in pool.map(
                lambda one: one.differences(asked.folder.resolve()),
                [one for one in every if one.ranks == ranks],
            ):
                rows.append(row)
                yield row

    cores = cpu_count() or 1
    table(HEAD, (row for ranks in (1, 2) for row in shown(max(1, cores // ranks), ranks)))
    sys.exit(any(row[-1] for row in rows))


if __name__ == "__main__":
    main()
