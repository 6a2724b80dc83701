"""The mesh of a CAD file, made in a process of its own and kept while the file is the same."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import environment_of_one
from iceslide_fem.scene.rubber import BREP, Rubber

MILLIMETRE = 1e-3
SAME = 1e-4  # of the height: tolerance of a chord's middle
LONGEST = 600.0  # s that meshing may take


@dataclass(frozen=True)
class Options:
    """What makes a mesh of a file: lengths in m, `unit` that of the file in m; the others as the
    keys `rubber.step_...`.
    """

    path: str
    dim: int
    refinement: float
    unit: float
    up: str
    along: str
    plane: float | None
    gap: float | None
    heal: float
    cells: str


class Drawn(NamedTuple):
    """A tread, and the axis of its file that points to the plate, with the reason; middles of its
    chords of round faces (n, d), m, and the way from each to the face.
    """

    tagged: TaggedMesh
    up: tuple[str, str]
    middles: Array
    bulges: Array


def options_of(rubber: Rubber, dim: int, refinement: float) -> Options:
    """Those of a scene's rubber."""
    assert rubber.step is not None
    unit = rubber.step_unit if rubber.step.suffix.lower() == BREP else MILLIMETRE
    return Options(
        str(rubber.step), dim, refinement, unit, rubber.step_up, rubber.step_along,
        rubber.step_plane, rubber.step_gap, rubber.step_heal, rubber.step_cells,
    )  # fmt: skip


def tread(rubber: Rubber, dim: int, refinement: float) -> TaggedMesh:
    """The mesh of `rubber.step`, of dimension `dim`, with named facets. Raises SceneError."""
    return _drawn(rubber, dim, refinement).tagged


def up_of(rubber: Rubber, dim: int, refinement: float) -> tuple[str, str]:
    """The axis of the file that points to the plate, and why. Raises SceneError."""
    return _drawn(rubber, dim, refinement).up


def on_faces(rubber: Rubber, dim: int, refinement: float, points: Array) -> Array:
    """Surface points (..., d), m, with the middles of chords moved to the round faces of the CAD.

    Raises SceneError.
    """
    drawn, moved = _drawn(rubber, dim, refinement), points.reshape(-1, dim).copy()
    if len(drawn.middles):
        near = SAME * float(np.ptp(drawn.tagged.points[:, -1]))
        distance, nearest = cKDTree(drawn.middles).query(moved)
        there = distance < near
        moved[there] += drawn.bulges[nearest[there]]
    return moved.reshape(points.shape)


def _drawn(rubber: Rubber, dim: int, refinement: float) -> Drawn:
    options = options_of(rubber, dim, refinement)
    path = Path(options.path)
    return _meshed(options, path.stat().st_mtime_ns if path.exists() else 0)


@lru_cache(maxsize=4)  # a scene asks for its mesh several times
def _meshed(options: Options, _stamp: int) -> Drawn:
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "mesh.npz"
        words = [sys.executable, "-m", "iceslide_fem.mesh.cad.worker", json.dumps(asdict(options))]
        try:
            done = subprocess.run(
                [*words, str(result)], capture_output=True, text=True, timeout=LONGEST,
                env=environment_of_one(), check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise SceneError(
                f"rubber.step {options.path} is not meshed after {LONGEST:g} s; allowed: a smaller "
                "numerics.refinement, or a file without details that do not matter"
            ) from None
        if done.returncode == 2 and result.exists():
            raise SceneError(f"rubber.step {options.path} {result.read_text(encoding='utf-8')}")
        if done.returncode or not result.exists():
            raise SceneError(
                f"rubber.step {options.path} makes the CAD kernel crash; allowed: a file that it "
                "reads, for instance saved anew as STEP AP214"
            )
        with np.load(result) as found:
            facets = {
                name.removeprefix("facets_"): found[name]
                for name in found.files
                if name.startswith("facets_")
            }
            kind, axis, why = (str(word) for word in found["words"])
            tagged = TaggedMesh(found["points"], kind, found["cells"], facets, "rubber")
            return Drawn(tagged, (axis, why), found["middles"], found["bulges"])
