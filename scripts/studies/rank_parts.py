"""How evenly the ranks share a block: the most of a rank over the mean of all.

Start it on any number of processes, also on more than there are cores, because nothing is timed:
`mpirun -n 8 --oversubscribe python -m scripts.studies.rank_parts`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import Block, build_block
from scripts.studies.command_runs import CASES
from scripts.studies.common import case, options, table

HEAD = ("case", "ranks", "cells", "unknowns", "contact points", "cells: most of mean",
        "unknowns: most of mean", "contact points: most of mean")  # fmt: skip
SIPED = {"siped_tread": ("model=block",)}


def parts(block: Block) -> tuple[int, int, int]:
    """Cells, unknowns and contact points of this rank."""
    mesh, space = block.rubber.mesh, block.rubber.space
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    unknowns = space.dofmap.index_map.size_local * space.dofmap.index_map_bs
    return cells, unknowns, block.surface.n_points


def rows(names: Sequence[str], comm: MPI.Comm) -> Iterator[tuple[object, ...]]:
    """Of each case on the ranks of `comm`. Collective."""
    known = CASES | SIPED
    for name in names:
        block = build_block(case(name, "model=block", *known[name]), comm)
        found = np.array(comm.allgather(parts(block)))
        share = found.max(axis=0) / found.mean(axis=0)
        yield name, comm.size, *found.sum(axis=0), *(f"{one:.2f}" for one in share)


def main() -> None:
    parser = options(__doc__)
    known = tuple(CASES | SIPED)
    parser.add_argument("--cases", nargs="+", choices=known, default=known)
    arguments = parser.parse_args()
    found = list(rows(arguments.cases, MPI.COMM_WORLD))
    if MPI.COMM_WORLD.rank == 0:
        table(HEAD, found)


if __name__ == "__main__":
    main()
