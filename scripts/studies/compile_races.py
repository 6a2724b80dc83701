"""Programs that compile the same forms at the same time, into an empty folder, on a busy machine.

In every round two programs on two processes and one on one process start together, on meshes that
DOLFINx makes itself. Printed: how many failed, and how many modules the folder then has: the same
in every round, if every process calls a form by the same name.

    python -m scripts.studies.compile_races [--rounds 10] [--load 2]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from time import monotonic

from scripts.studies.common import on_ranks, options, table

PROGRAM = """
from dolfinx.mesh import CellType, create_unit_cube, create_unit_square
from iceslide_fem.fenics.compat import MPI, expression, form, scalar_space, ufl, vector_space
for mesh in (create_unit_square(MPI.COMM_WORLD, 4, 3), create_unit_cube(MPI.COMM_WORLD, 2, 2, 2)):
    x = ufl.SpatialCoordinate(mesh)
    for degree in (1, 2):
        space = scalar_space(mesh, degree)
        u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
        form(u * v * ufl.dx)
        form(ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
        form(x[0] * v * ufl.ds)
        expression(x[0] ** 2, space)
    form(ufl.inner(ufl.TestFunction(vector_space(mesh, 2)), x) * ufl.dx)
"""
BUSY = "while True: pass"
LIMIT = 300.0  # s


def one_round(folder: Path, ranks: Sequence[int]) -> tuple[list[str], int]:
    """What programs on so many `ranks` each, beside each other, have failed of; modules compiled.

    `folder` is the cache that they share.
    """
    environment = os.environ | {"ICESLIDE_CACHE": str(folder)}
    words = [on_ranks([sys.executable, "-c", PROGRAM], count) for count in ranks]
    started = [
        subprocess.Popen(each, env=environment, stderr=subprocess.PIPE, text=True) for each in words
    ]
    failures = []
    for process in started:
        try:
            said = process.communicate(timeout=LIMIT)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            failures.append("waits for ever")
        else:
            if process.returncode:
                failures.append(said.strip().splitlines()[-1])
    return failures, len([*folder.glob("forms-*/*.sealed")])


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--load", type=int, default=2, help="processes that keep cores busy")
    given = parser.parse_args()
    with ExitStack() as busy:
        for _ in range(given.load):
            process = subprocess.Popen([sys.executable, "-c", BUSY])
            busy.callback(process.wait)
            busy.callback(process.kill)

        def row(number: int) -> tuple[object, ...]:
            begun = monotonic()
            with tempfile.TemporaryDirectory() as folder:
                failures, modules = one_round(Path(folder), (2, 2, 1))
            said = "; ".join(sorted(set(failures))) or "none"
            return number, said, modules, f"{monotonic() - begun:.0f}"

        table(("round", "failures", "modules", "s"), map(row, range(1, given.rounds + 1)))


if __name__ == "__main__":
    main()
