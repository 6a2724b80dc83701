"""PETSc's objects of a run, freed when it ends.

petsc4py destroys a matrix or a solver that Python has deleted only in `PETSc.garbage_cleanup`,
which is collective, with the communicator on which the object is: that of its mesh. A mesh has
none of its objects destroyed after itself, so meshes stay until then.
"""

from __future__ import annotations

import gc
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from petsc4py import PETSc

from iceslide_fem.runtime.errors import IceslideError

_meshes: list[list[Any]] = []  # of the runs that go on, the innermost last


def keep_until_freed(mesh: Any) -> None:
    """Keep a new `mesh` of DOLFINx until the run that makes it has freed its objects."""
    if _meshes:
        _meshes[-1].append(mesh)


@contextmanager
def freed_at_end() -> Iterator[None]:
    """Free the meshes that are made within, and PETSc's objects on them, at the end. Collective.

    Names of the caller must not hold them then. An error of ours loses the variables of its frames.
    """
    meshes: list[Any] = []
    _meshes.append(meshes)
    try:
        yield
    except IceslideError as error:
        _forget_frames(error)
        _free(meshes)
        raise
    else:
        _free(meshes)
    finally:
        _meshes.pop()


def _forget_frames(error: BaseException | None) -> None:
    while error is not None:
        traceback.clear_frames(error.__traceback__)
        error = error.__cause__ or error.__context__


def _free(meshes: list[Any]) -> None:
    gc.collect()  # forms, solvers and closures hold each other
    for mesh in meshes:
        PETSc.garbage_cleanup(mesh.comm)
    meshes.clear()
