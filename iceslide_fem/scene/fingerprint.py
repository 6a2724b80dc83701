"""Hashes of all that a result depends on: the scene, and the program that computes it."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from functools import cache, reduce
from importlib import metadata
from pathlib import Path

import numpy as np

import iceslide_fem
from iceslide_fem.scene import Scene
from iceslide_fem.scene.cases import DATA
from iceslide_fem.scene.input_file import companions

LENGTH = 16  # hexadecimal digits


def scene_hash(scene: Scene) -> str:
    """Hash of `scene` (without name and output) and of its files, with the files that they need."""
    content = scene.as_dict()
    del content["name"], content["output"]
    for (table, key), path in scene.files.items():
        digests = [
            hashlib.sha256(file.read_bytes()).hexdigest() for file in (path, *companions(path))
        ]
        reduce(dict.__getitem__, table.split("."), content)[key] = " ".join(digests)
    if ":" in scene.friction.law:
        path, name = scene.friction.law_file
        content["friction"]["law"] = f"{hashlib.sha256(path.read_bytes()).hexdigest()}:{name}"
    return _hash(content)


def fingerprint(scene: Scene) -> str:
    """Hash of `scene`, its files, the versions that compute it and this program's sources.

    Two scenes with the same fingerprint have the same result. DOLFINx is included if it is used.
    """
    content = {
        "scene": scene_hash(scene),
        "version": iceslide_fem.__version__,
        "sources": sources_hash(),
    }
    if scene.model != "point":
        content["dolfinx"] = _dolfinx_version()
    return _hash(content)


def versions() -> dict[str, str]:
    """Versions of this program, its sources, NumPy and Python, for summaries."""
    return {
        "iceslide_fem": iceslide_fem.__version__,
        "sources": sources_hash(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def versions_in_words(known: Mapping[str, str]) -> str:
    """Program names and versions in one line."""
    return ", ".join(f"{name} {version}" for name, version in known.items())


@cache
def sources_hash() -> str:
    """Hash of the sources of this package at the first call."""
    folder = Path(iceslide_fem.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        if path.relative_to(folder).parts[0] in DATA:
            continue
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:LENGTH]


def _hash(content: object) -> str:
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:LENGTH]


@cache
def _dolfinx_version() -> str:
    """Version of the installed DOLFINx, without importing it: that would start MPI."""
    for name in ("fenics-dolfinx", "dolfinx-solver-real"):  # Debian's package, the PyPI wheel
        try:
            return metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return "none"
