"""Which kernels OpenBLAS takes: by what the processor can do, where it would go by its name."""

from __future__ import annotations

import os
import platform
from pathlib import Path

# What kernels of OpenBLAS need, the fastest first.
_KERNELS = {
    "SkylakeX": {"avx512f", "avx512cd", "avx512dq", "avx512bw", "avx512vl"},
    "Haswell": {"avx2", "fma"},
}


def choose_kernels(cpuinfo: Path = Path("/proc/cpuinfo")) -> None:
    """Set OPENBLAS_CORETYPE for this process and its children on x86, unless it is set already.

    OpenBLAS reads it when it is loaded: NumPy, if it is loaded before, keeps its own choice. By
    itself OpenBLAS goes by a processor's name, and on one that is newer than itself takes kernels
    of 2004, without AVX: MUMPS's factors take twice the time.
    """
    if platform.machine() not in ("x86_64", "AMD64"):
        return
    try:
        with cpuinfo.open(encoding="utf-8", errors="replace") as rows:
            flags = next((row for row in rows if row.startswith("flags")), "")
    except OSError:  # not Linux, where OpenBLAS is left to find them
        return
    has = set(flags.partition(":")[2].split())
    kernels = next((name for name, needs in _KERNELS.items() if needs <= has), None)
    if kernels:
        os.environ.setdefault("OPENBLAS_CORETYPE", kernels)
