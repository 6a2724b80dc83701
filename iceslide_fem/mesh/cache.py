"""Generated meshes on disk, found again by what they were made from."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from iceslide_fem.fenics.cache import cache_folder
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.named_cells import rubber_file
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.errors import SceneError

_BUILDER = 5  # raise it when the same parameters shall give another mesh


def cached(body: str, dim: int, parameters: Any, build: Callable[[], TaggedMesh]) -> TaggedMesh:
    """The mesh of `body` that `build` makes from `parameters`, read from the cache if it is there.

    `parameters` is anything that JSON can hold. A cache that can't be written is not used.
    """
    content = json.dumps([_BUILDER, body, dim, parameters], sort_keys=True)
    path = cache_folder() / f"{body}-{hashlib.sha256(content.encode()).hexdigest()[:24]}.msh"
    with contextlib.suppress(SceneError):  # it may be damaged: then it is built anew
        if path.is_file():
            return gmsh_model.load(rubber_file(path, dim, body))
    tagged = build()
    with contextlib.suppress(OSError, SceneError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:  # readers see whole files only
            unfinished = Path(folder) / path.name
            gmsh_model.save(tagged, unfinished)
            gmsh_model.load(
                rubber_file(unfinished, dim, body)
            )  # gmsh does not say if the disk was full
            os.replace(unfinished, path)
    return tagged
