"""Start PETSc with its options before any import of it, with a clear message if it is missing.

PETSc reads options such as `-log_view` at its start. It reports later ones as unused.
"""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
from collections.abc import Sequence
from typing import Any

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.launch import started_by_mpirun


def start_mpi() -> Any:
    """mpi4py's module `MPI`, which starts MPI. Raises ImportError without it."""
    # Else Open MPI's hwloc prints a warning in containers without /sys.
    os.environ.setdefault("HWLOC_HIDE_ERRORS", "2")
    if not started_by_mpirun():  # one process needs no network; a search for one takes long
        os.environ.setdefault("OMPI_MCA_pml", "ob1")
    with contextlib.suppress(ModuleNotFoundError):
        # the PyPI wheel has to load its own MPI before anything else does
        importlib.import_module("dolfinx_solver")
    return importlib.import_module("mpi4py.MPI")


def start_petsc(options: Sequence[str] = (), comm: Any = None) -> None:
    """Start MPI and PETSc with `options`, words as on PETSc's command line.

    Collective over `comm`, or over all ranks without it.

    If PETSc is already running (a second run from Python), the options apply from now on. Raises
    SceneError if DOLFINx is not installed.
    """
    try:
        start_mpi()
        if "petsc4py.PETSc" not in sys.modules:
            importlib.import_module("petsc4py").init(["iceslide", *options], comm=comm)
        else:
            from petsc4py import PETSc

            if any(word.startswith("-log_view") for word in options):
                PETSc.Log.begin()
            PETSc.Options().insertString(" ".join(options))
        importlib.import_module("dolfinx")
    except ImportError as error:
        raise SceneError(
            f"a slice or a block needs DOLFINx, which this Python does not have ({error}): install "
            "Debian's python3-dolfinx (scripts/setup), or pip install 'iceslide_fem[wheel]' on "
            'Python 3.12 or newer; model = "point" needs neither'
        ) from None


def options_without_effect(options: Sequence[str]) -> list[str]:
    """Those of the `options` that PETSc has not used so far, for example misspelt ones."""
    from petsc4py import PETSc

    asked = ctypes.CDLL(PETSc.__file__).PetscOptionsUsed  # petsc4py has it since 3.19 only
    names = [word for word in options if word.startswith("-") and not _is_number(word)]
    return [name for name in names if not _asked_for(asked, name)]


def _asked_for(asked: ctypes._NamedFuncPointer, name: str) -> bool:
    answer = ctypes.c_int(0)
    asked(None, name.lstrip("-").encode(), ctypes.byref(answer))
    return bool(answer.value & 1)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
