"""How a command is started: its rank before MPI is imported, and its signals."""

from __future__ import annotations

import contextlib
import functools
import gc
import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import psutil


def available_cores() -> int:
    """Number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # on Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_of_machine() -> float:
    """Memory available to processes, bytes: that of the machine, or a lower system limit."""
    memory = float(psutil.virtual_memory().total)
    try:
        return min(memory, float(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no such limit
        return memory


SECONDS_TO_BE_HEARD = 1.0
# Ctrl-C; what queues send before a time limit or at an end; what a terminal that closes sends.
_STOPS = "SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGHUP"


def stop_signals() -> list[signal.Signals]:
    """Signals that ask this thread to stop: none but in the main thread, and none that the caller
    ignores, as nohup does SIGHUP.
    """
    if threading.current_thread() is not threading.main_thread():
        return []
    there = [signal.Signals[name] for name in _STOPS if hasattr(signal, name)]
    return [number for number in there if signal.getsignal(number) is not signal.SIG_IGN]


@contextlib.contextmanager
def termination_as_interrupt() -> Iterator[None]:
    """Convert stop signals to KeyboardInterrupt, so child processes end."""

    def interrupt(*_: object) -> NoReturn:
        raise KeyboardInterrupt

    before = {number: signal.signal(number, interrupt) for number in stop_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def imports_that_stay() -> Iterator[None]:
    """Exclude imported modules from garbage collection: they live as long as the process.

    Their collection takes a tenth of a short command. Use it once per process, because garbage of
    that time is also kept.
    """
    if gc.get_freeze_count() or not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        gc.enable()


_RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")  # set by Open MPI, MPICH, Slurm
_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")


def started_by_mpirun() -> bool:
    """Whether mpirun has started this process."""
    # Children of a process that started MPI itself inherit PMIX_RANK.
    tasks = int(os.environ.get("SLURM_STEP_NUM_TASKS", "1")) if "PMIX_RANK" in os.environ else 1
    return tasks > 1 or any(name in os.environ for name in _SIZES)


def rank() -> int:
    """Rank of this process from mpirun's environment, without importing MPI."""
    return next((int(os.environ[name]) for name in _RANKS if name in os.environ), 0)


def stop_all_ranks(exit_code: int) -> None:
    """End all ranks, if there are others: they would wait for ever for this failed rank.

    It waits until mpirun has forwarded the output, which it would otherwise drop.
    """
    if "mpi4py.MPI" in sys.modules:
        from mpi4py import MPI

        if MPI.COMM_WORLD.size > 1:
            sys.stderr.flush()
            time.sleep(SECONDS_TO_BE_HEARD)
            MPI.COMM_WORLD.Abort(exit_code)


# One thread per process; else BLAS and OpenMP take all cores in each process. No binding; else two
# simultaneous runs share the first cores.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS")
_BINDING = ("OMPI_MCA_hwloc_base_binding_policy", "PRTE_MCA_hwloc_default_binding_policy")


def module_words(module: str, *words: str) -> list[str]:
    """Command that runs a module of this program with `words`.

    Without -P a gmsh.py, say, in the working directory would be imported in place of gmsh.
    """
    return [sys.executable, "-P", "-m", module, *words]


def mpirun() -> str | None:
    """mpirun of this Python's environment (the wheel brings one), else the system's."""
    here = str(Path(sys.executable).parent)
    return shutil.which("mpirun", path=here + os.pathsep + os.environ.get("PATH", ""))


def environment_of_one() -> dict[str, str]:
    """Environment of one of several simultaneous processes."""
    return os.environ | dict.fromkeys(_ONE_THREAD, "1") | dict.fromkeys(_BINDING, "none")


def on_one_process(command: Callable[..., None]) -> Callable[..., None]:
    """Decorator: run a command on rank 0 only."""

    @functools.wraps(command)
    def alone(*args: Any, **options: Any) -> None:
        if rank() == 0:
            command(*args, **options)

    return alone
