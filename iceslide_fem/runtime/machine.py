"""What the machine has."""

from __future__ import annotations

import os
from pathlib import Path

import psutil


def available_cores() -> int:
    """How many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):  # on Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def memory_of_machine() -> float:
    """Bytes that processes here may have: the machine's, or less where its system allots less."""
    memory = float(psutil.virtual_memory().total)
    try:
        return min(memory, float(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no such limit
        return memory
