"""FFCx's just-in-time compilation: one process at a time, silent, with equal names on all ranks."""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import cffi
import ffcx.codegeneration.jit as ffcx_jit

from iceslide_fem.fenics.cache import sole_compiler
from iceslide_fem.runtime.errors import SceneError

_Result = TypeVar("_Result")
_Task = TypeVar("_Task", bound=Callable[..., Any])
# DOLFINx's messages if the first rank cannot compile: on that rank, and on the others.
_FIRST_FAILS = "Failed just-in-time compilation of form: "
_OTHERS_FAIL = f"{_FIRST_FAILS}Compilation failed on root node."
_FORMS = "the finite element forms"


def compile_alone(
    folder: Path, unchanged: Callable[[list[Any]], contextlib.AbstractContextManager[None]]
) -> None:
    """Make FFCx compile into `folder` under a lock, and leave its objects `unchanged`.

    The lock is local: no rank waits for another rank while it holds it.
    """
    _leave_out_unreadable_settings(folder)
    for name in ("compile_forms", "compile_elements", "compile_expressions"):
        task = getattr(ffcx_jit, name, None)  # not all of them in every version
        if task is not None:
            setattr(ffcx_jit, name, _alone(task, folder, unchanged))


def _leave_out_unreadable_settings(folder: Path) -> None:
    """Let DOLFINx and FFCx read user settings from `folder` if their own place is unreadable.

    They handle missing settings, but not a HOME that belongs to another user.
    """
    settings = os.environ.get("XDG_CONFIG_HOME") or os.path.expanduser("~/.config")
    try:
        os.stat(settings)
    except PermissionError:
        os.environ["XDG_CONFIG_HOME"] = str(folder)
    except OSError:
        pass


def _alone(
    task: _Task,
    folder: Path,
    unchanged: Callable[[list[Any]], contextlib.AbstractContextManager[None]],
) -> _Task:
    @functools.wraps(task)
    def sole(objects: list[Any], *args: Any, **options: Any) -> Any:
        with unchanged(objects):
            return compiled_into(folder, lambda: task(objects, *args, **options))

    return sole  # type: ignore[return-value]


def compiled_into(folder: Path, task: Callable[[], _Result]) -> _Result:
    """Result of a `task` that compiles C into `folder`, under the folder's lock.

    Raises SceneError if there is no C compiler, or it fails.
    """
    with sole_compiler(folder), _without_log(), _compiler_output() as said:
        try:
            return task()
        except cffi.VerificationError:
            raise SceneError(_why_not(said)) from None


def failing_in_one_sentence(task: _Task) -> _Task:
    """Convert DOLFINx's error of a failed compiler to SceneError on all ranks."""

    @functools.wraps(task)
    def plain(*args: Any, **options: Any) -> Any:
        try:
            return task(*args, **options)
        except RuntimeError as error:
            reason = str(error).removeprefix(_FIRST_FAILS)
            if str(error) != _OTHERS_FAIL and not reason.startswith(_FORMS):
                raise
            raise SceneError(reason) from None

    return plain  # type: ignore[return-value]


@contextlib.contextmanager
def _without_log() -> Iterator[None]:
    """Suppress the log of FFCx and cffi on the screen; cffi sets the root logger to INFO."""
    root, disabled = logging.getLogger(), logging.root.manager.disable
    level = root.level
    logging.disable(logging.INFO)
    try:
        yield
    finally:
        logging.disable(disabled)
        root.setLevel(level)


@contextlib.contextmanager
def _compiler_output() -> Iterator[BinaryIO]:
    """Redirect the output of this process and its children to a file."""
    with tempfile.TemporaryFile() as said:
        streams = [stream for stream in (sys.__stdout__, sys.__stderr__) if stream is not None]
        for stream in streams:
            stream.flush()
        with contextlib.ExitStack() as restored:
            for number in (1, 2):
                with contextlib.suppress(OSError):  # no standard output
                    kept = os.dup(number)
                    restored.callback(os.close, kept)
                    restored.callback(os.dup2, kept, number)
                    os.dup2(said.fileno(), number)
            try:
                yield said
            finally:
                for stream in streams:
                    stream.flush()


def _why_not(said: BinaryIO) -> str:
    """Reason of a compiler's failure, from its output `said`."""
    compiler = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()[0]
    cure = "install one (Debian: apt install gcc python3-dev), or name it by the variable CC"
    if shutil.which(compiler) is None:
        return f'{_FORMS} need a C compiler, and "{compiler}" is not there: {cure}'
    said.seek(0)
    lines = said.read().decode(errors="replace").splitlines()
    reason = next((line.strip() for line in lines if "error" in line.lower()), "it gives no reason")
    return f'{_FORMS} cannot be compiled by "{compiler}": {reason}'
