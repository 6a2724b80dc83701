"""What a result depends on, as one short word: the scene and the versions that compute it."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib import metadata
from pathlib import Path

import iceslide_fem
from iceslide_fem.scene import Scene

LENGTH = 16  # hexadecimal digits


def fingerprint(scene: Scene) -> str:
    """Hash of `scene` (its name apart), of its files' content and of the versions.

    Two scenes with the same fingerprint have the same result. DOLFINx counts where it is used.
    """
    content = scene.as_dict()
    del content["name"]
    content["version"] = iceslide_fem.__version__
    for (table, key), path in scene.files.items():
        content[table][key] = _file_hash(path)
    if scene.model != "point":
        content["dolfinx"] = _dolfinx_version()
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


def _file_hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@cache
def _dolfinx_version() -> str:
    """Version of the installed DOLFINx, without importing it: that would start MPI."""
    for name in ("fenics-dolfinx", "dolfinx-solver-real"):  # Debian's package, the PyPI wheel
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return "none"
