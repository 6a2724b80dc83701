"""C functions that are compiled as forms are: once, for this machine's processor."""

from __future__ import annotations

import ctypes
import functools
import hashlib
import sysconfig
from collections.abc import Sequence
from importlib import util
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics.compat import COMPILED, COMPILER_FLAGS
from iceslide_fem.fenics.jit import compiled_into
from iceslide_fem.parallel import from_root

# Prototypes of our own: those of ctypes.pythonapi are shared with whoever sets them.
_NAME_OF = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(
    ("PyCapsule_GetName", ctypes.pythonapi)
)
_POINTER_OF = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(
    ("PyCapsule_GetPointer", ctypes.pythonapi)
)


def compiled(sources: Sequence[Path], comm: Any, libraries: Sequence[str] = ()) -> Any:
    """cffi's module of the functions in C `sources`, which are one program in this order, and
    declared in the header beside the first; it is linked with `libraries`. Collective.

    `lib` of it has them, `ffi` their types.
    """
    header = sources[0].with_suffix(".h").read_text(encoding="utf-8")
    parts = (f'#line 1 "{path.name}"\n{path.read_text(encoding="utf-8")}' for path in sources)
    text = "\n".join([header, *parts])
    words = "\n".join([text, *COMPILER_FLAGS, *libraries])
    name = f"{sources[0].stem}_{hashlib.sha256(words.encode()).hexdigest()[:16]}"
    library = COMPILED / f"{name}{sysconfig.get_config_var('EXT_SUFFIX')}"

    def make() -> None:
        if not library.is_file():
            _make(library, header, text, libraries)

    from_root(lambda: compiled_into(COMPILED, make), comm)
    return _loaded(library)


def ints(values: NDArray[Any]) -> NDArray[np.int32]:
    """Whole numbers as C's int has them: PETSc's have 64 bits where it is built so.

    Raises OverflowError where one does not fit.
    """
    if values.dtype == np.int32:
        return values
    bounds = np.iinfo(np.int32)
    if values.size and not bounds.min <= values.min() <= values.max() <= bounds.max:
        raise OverflowError(f"{values.max()} is no 32-bit integer: the problem is too large")
    return values.astype(np.int32)


def address(module: Any, name: str) -> int:
    """Of a function in `scipy.linalg.cython_blas` or `cython_lapack`, for compiled code."""
    capsule = module.__pyx_capi__[name]
    return int(_POINTER_OF(capsule, _NAME_OF(capsule)))


def _make(library: Path, header: str, text: str, libraries: Sequence[str]) -> None:
    import cffi  # which DOLFINx brings: it compiles its forms with it

    builder = cffi.FFI()
    builder.cdef(header)
    name, links = library.name.split(".")[0], list(libraries)
    builder.set_source(name, text, extra_compile_args=COMPILER_FLAGS, libraries=links)
    builder.compile(tmpdir=str(library.parent))


@functools.cache
def _loaded(library: Path) -> Any:
    spec = util.spec_from_file_location(library.name.split(".")[0], library)
    if spec is None or spec.loader is None:
        raise ImportError(f"{library} is no module")
    module = util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
