"""Cores and memory of the machine."""

from __future__ import annotations

import os
from pathlib import Path

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
