"""PETSc's solvers of the heat equation on the ice's mesh, and ranks: seconds, and mu(t).

Whole runs of the thesis's block at 1 bar with ice.heat = "mesh", at a tolerance of 1e-2, for 4 ms:
conjugate gradients with several preconditioners (options `-heat_...`), on several numbers of ranks;
below them continuum ice. Rows give the wall seconds and the largest difference of mu(t) from that
of the first row of meshed ice, relative to its mean. --quick runs a moment on coarse meshes
with a half of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from scripts.studies.command_runs import MOMENT, Found, found, moved
from scripts.studies.common import options, table

BLOCK = "model=block", "numerics.tolerance=1e-2", "load.duration=4ms"
MELTING = "ice.temperature=-0.5degC"  # in that moment, too
HEAD = ("ice", "preconditioner", "ranks", "unknowns", "steps", "wall s", "largest of mu(t)", "mean")
SOLVERS = {  # PETSc's options by what they are called here
    "the diagonal": "",
    "blocks, incomplete Cholesky": "-heat_pc_type bjacobi -heat_sub_pc_type icc",
    "overlapping blocks": "-heat_pc_type asm -heat_pc_asm_type basic -heat_pc_asm_overlap 1 "
    "-heat_sub_pc_type icc",
    "hypre": "-heat_pc_type hypre",
    "GAMG": "-heat_pc_type gamg",
    "Cholesky (MUMPS)": "-heat_pc_type cholesky -heat_pc_factor_mat_solver_type mumps",
}
SLOW = ("GAMG",)  # more than ten times as slow as the diagonal: tried where --solvers asks for it


def rows(
    names: Sequence[str], ranks: Sequence[int], moment: Sequence[str]
) -> Iterator[tuple[object, ...]]:
    """Continuum ice, and meshed ice with each solver of these names, on every number of ranks."""
    exact: Found | None = None
    cases = [("mesh", name, SOLVERS[name]) for name in names]
    for heat, name, solver in [*cases, ("continuum", "", "")]:
        for number in ranks:
            changes = (*BLOCK, f"ice.heat={heat}", *moment)
            run = found("thesis_1bar", changes, number, *solver.split())
            exact = exact or run
            summary = run.summary
            yield (
                heat, name, number, summary["dofs"], summary["steps"], f"{summary['wall_s']:.3g}",
                *moved(run, exact),
            )  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a moment on coarse meshes, one rank")
    parser.add_argument("--ranks", nargs="+", type=int, default=[1, 2])
    usual = tuple(name for name in SOLVERS if name not in SLOW)
    parser.add_argument("--solvers", nargs="+", choices=tuple(SOLVERS), default=usual)
    arguments = parser.parse_args()
    if arguments.quick:
        table(HEAD, rows(tuple(SOLVERS)[::2], [1], (*MOMENT, MELTING)))
    else:
        table(HEAD, rows(arguments.solvers, arguments.ranks, ()))


if __name__ == "__main__":
    main()
