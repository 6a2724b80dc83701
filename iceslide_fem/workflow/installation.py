"""Check of the installation part by part, with advice on missing parts.

Libraries that may crash a process are checked in separate processes.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from iceslide_fem.fenics.cache import cache_folder
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.runtime.launch import available_cores, mpirun

OLDEST_PYTHON = (3, 11)
SECONDS = 120.0  # time limit of a process that checks one library
DOLFINX = (
    "install Debian's python3-dolfinx (scripts/setup), or pip install 'iceslide_fem[wheel]' on "
    "Python 3.12 or newer; points need neither"
)
GMSH = "import gmsh; print(gmsh.__version__)"
DRAWING = """
import pyvista, vtk
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere())
plotter.screenshot(None, return_img=True)
print("pyvista", pyvista.__version__ + ",", "VTK", vtk.vtkVersion.GetVTKVersion())
"""


class Part(NamedTuple):
    """A part: what was found, whether it works, whether slices and blocks need it, advice."""

    name: str
    found: str
    works: bool
    needed: bool
    cure: str = ""


class Answer(NamedTuple):
    """Whether a process succeeded, and its last line or the reason of failure."""

    works: bool
    text: str


def parts() -> list[Part]:
    """All parts, in the order shown. Missing parts never raise an error."""
    with ThreadPoolExecutor() as pool:
        probe = pool.submit(answer, "-m", "iceslide_fem.fenics.probe")
        gmsh = pool.submit(answer, "-c", GMSH)
        drawing = pool.submit(answer, "-c", DRAWING)
        finite_elements = _finite_elements(probe.result())
        return [
            _python(),
            *finite_elements,
            _mpirun(),
            _compiler(),
            _cache(),
            _gmsh(gmsh.result()),
            _drawing(drawing.result()),
        ]


def can_run(found: list[Part]) -> bool:
    """Whether slices and blocks can be run."""
    return all(part.works for part in found if part.needed)


def answer(*words: str) -> Answer:
    """Output of Python, started with `words` in a separate process."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", *words],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=SECONDS,
        )
    except subprocess.TimeoutExpired:
        return Answer(False, f"no answer within {SECONDS:g} s")
    except OSError as error:
        return Answer(False, str(error))
    said = done.stdout if done.returncode == 0 else done.stderr
    lines = said.strip().splitlines() or [f"ended with {done.returncode}"]
    return Answer(done.returncode == 0, lines[-1])


def _python() -> Part:
    works = sys.version_info >= OLDEST_PYTHON
    oldest = ".".join(map(str, OLDEST_PYTHON))
    found = f"{platform.python_version()} in {sys.prefix}"
    return Part("Python", found, works, True, f"install Python {oldest} or newer")


def _finite_elements(probe: Answer) -> list[Part]:
    """DOLFINx, PETSc, its packages and MPI, from the JSON of their probe."""
    try:
        answered = json.loads(probe.text)
        found, errors = answered["found"], answered["errors"]
    except (ValueError, LookupError, TypeError):
        found, errors = {}, dict.fromkeys(("dolfinx", "petsc", "mpi"), probe.text)

    def part(name: str, key: str, cure: str) -> Part:
        text = found.get(key)
        return Part(name, text or str(errors.get(key)), text is not None, True, cure)

    solvers = found.get("solvers") or ""
    return [
        part("DOLFINx", "dolfinx", DOLFINX),
        part("PETSc", "petsc", "it comes with DOLFINx: " + DOLFINX),
        Part(
            "PETSc's packages",
            solvers or "none",
            "mumps" in solvers,
            True,
            "install a PETSc with MUMPS, as Debian's and the wheel are: blocks are solved by it",
        ),
        part("MPI", "mpi", "it comes with DOLFINx: " + DOLFINX),
    ]


def _mpirun() -> Part:
    path, cores = mpirun(), available_cores()
    found = f"{path}, {cores} core{'s' * (cores > 1)}" if path else f"not found, {cores} cores"
    cure = "install Open MPI's programs for runs on several processes (Debian: openmpi-bin)"
    return Part("mpirun", found, path is not None, False, cure)


def _compiler() -> Part:
    words = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()
    path = shutil.which(words[0])
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    cure = "install one with Python's headers (Debian: apt install gcc python3-dev)"
    if path is None:
        return Part("C compiler", f"{words[0]} not found", False, True, cure)
    found = path if header.is_file() else f"{path}, without {header}"
    return Part("C compiler", found, header.is_file(), True, cure)


def _cache() -> Part:
    cure = "name a folder that can be written by the variable ICESLIDE_CACHE"
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        writable = os.access(folder, os.W_OK)
    except (IceslideError, OSError) as error:
        return Part("cache", str(error), False, True, cure)
    size = 0
    for path in folder.rglob("*"):
        with contextlib.suppress(OSError):  # gone in the meantime
            size += path.stat().st_size
    found = f"{folder}, {size / 1e6:.0f} MB" + ("" if writable else ", not writable")
    return Part("cache", found, writable, True, cure)


def _gmsh(said: Answer) -> Part:
    cure = (
        "pip install gmsh, and the libraries it loads (Debian: libglu1-mesa libxft2 libxinerama1)"
    )
    return Part("gmsh", said.text, said.works, True, cure)


def _drawing(said: Answer) -> Part:
    screen = "a display" if os.environ.get("DISPLAY") else "off-screen"
    cure = "pip install pyvista vtk, and install OpenGL (Debian: libegl1 libgl1 libgl1-mesa-dri)"
    found = f"{said.text}, draws {screen}" if said.works else said.text
    return Part("pyvista, VTK", found, said.works, False, cure)
