"""Installed parts of DOLFINx, PETSc and MPI, as JSON: python -m iceslide_fem.fenics.probe

It runs as a separate process, because an unsuitable library may crash it. Every entry is a string,
or null for a part that cannot be imported; `errors` has the reason.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
from collections.abc import Callable
from pathlib import Path

SOLVERS = ("mumps", "suitesparse", "superlu_dist", "hypre")  # packages that PETSc may have


def probe() -> dict[str, dict[str, str | None]]:
    """`found`: version and place of each part by its name; `errors`: why others are missing."""
    os.environ.setdefault("HWLOC_HIDE_ERRORS", "2")
    with contextlib.suppress(ImportError):
        importlib.import_module("dolfinx_solver")  # the wheel loads its own MPI first
    found: dict[str, str | None] = {}
    errors: dict[str, str | None] = {}
    for name, describe in (("mpi", _mpi), ("petsc", _petsc), ("dolfinx", _dolfinx)):
        found[name] = None
        try:
            found[name] = describe()
        except Exception as error:  # an unsuitable library may raise anything
            errors[name] = f"{type(error).__name__}: {error}"
        if name == "petsc":
            found["solvers"] = None if found["petsc"] is None else _solvers()
    return {"found": found, "errors": errors}


def _mpi() -> str:
    from mpi4py import MPI

    said = str(MPI.Get_library_version()).strip("\0").splitlines()[0].partition(",")[0]
    return " ".join(said.split())


def _petsc() -> str:
    from petsc4py import PETSc

    return ".".join(map(str, PETSc.Sys.getVersion()))


def _solvers() -> str:
    from petsc4py import PETSc

    has: Callable[[str], bool] = PETSc.Sys.hasExternalPackage
    return ", ".join(name for name in SOLVERS if has(name))


def _dolfinx() -> str:
    import dolfinx

    return f"{dolfinx.__version__} in {Path(dolfinx.__file__).parent}"


if __name__ == "__main__":
    print(json.dumps(probe()))
