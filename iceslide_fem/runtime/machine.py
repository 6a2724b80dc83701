"""What the machine has."""

from __future__ import annotations

from pathlib import Path

import psutil


def memory_of_machine() -> float:
    """Bytes that processes here may have: the machine's, or less where its system allots less."""
    memory = float(psutil.virtual_memory().total)
    try:
        return min(memory, float(Path("/sys/fs/cgroup/memory.max").read_text()))
    except (OSError, ValueError):  # no such limit
        return memory
