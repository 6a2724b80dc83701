"""Processor seconds of the rubber's mesh and the ice's grid.

Each is measured in processes of its own, whose compiled forms are there: `thesis_1bar` as a slice
and as a block; the median of --repeats. --against TREE measures another checkout of the program
beside it, and prints the difference.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from statistics import median

from scripts.studies import common

MODELS = ("slice", "block")
# Where the two functions are differs between versions of the program, and so does what they make.
MEASURED = """
import sys
from time import process_time
from mpi4py import MPI
import dolfinx, gmsh
try:
    from iceslide_fem.fenics.compat import MPI
    from iceslide_fem.mesh import ice
    from iceslide_fem.mesh.rubber import rubber_mesh
    ice_mesh = getattr(ice, "ice_mesh", lambda scene, _: ice.ice_lines(scene))
except ImportError:
    from iceslide_fem.meshing import ice_mesh, rubber_mesh
from iceslide_fem.scene import load_scene
scene = load_scene(sys.argv[1], ["model=" + sys.argv[2]])
seconds = []
for build in (rubber_mesh, ice_mesh):
    started = process_time()
    build(scene, MPI.COMM_SELF)
    seconds.append(process_time() - started)
print(*seconds)
"""


def measured(tree: Path, model: str, cache: Path) -> list[float]:
    """Processor seconds of rubber and ice."""
    for mesh in cache.glob("*.msh"):  # that another version keeps
        mesh.unlink()
    environment = os.environ | {"PYTHONPATH": str(tree), "ICESLIDE_CACHE": str(cache)}
    words = [sys.executable, "-c", MEASURED, str(tree / "cases" / "thesis_1bar.toml"), model]
    done = subprocess.run(
        words, check=True, cwd=cache, env=environment, capture_output=True, text=True
    )
    return [float(word) for word in done.stdout.split()]


def medians(tree: Path, model: str, repeats: int) -> list[float]:
    """Medians of `measured` over processes, after one that compiles."""
    with tempfile.TemporaryDirectory() as folder:
        measured(tree, model, Path(folder))
        runs = [measured(tree, model, Path(folder)) for _ in range(repeats)]
    return [median(values) for values in zip(*runs, strict=True)]


def main() -> None:
    """Print the table."""
    parser = common.options(__doc__)
    parser.add_argument("--against", type=Path, metavar="TREE", help="another checkout")
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()

    def rows() -> Iterable[list[object]]:
        for model in MODELS:
            now = medians(common.ROOT, model, asked.repeats)
            yield [model, "this", *(f"{value:.3f}" for value in now)]
            if asked.against:
                other = medians(asked.against.resolve(), model, asked.repeats)
                yield [model, "other", *(f"{value:.3f}" for value in other)]
                apart = (a - b for a, b in zip(now, other, strict=True))
                yield [model, "longer by", *(f"{value:+.3f}" for value in apart)]

    common.table(["model", "program", "rubber, s", "ice, s"], rows())


if __name__ == "__main__":
    main()
