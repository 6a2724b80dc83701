"""Errors shown to the user, each in one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class IceslideError(Exception):
    """Base of errors shown as one sentence; `exit_code` is that of the command.

    found: what a command has found in spite of it, for `--json`; None for nothing.
    """

    exit_code = 1

    def __init__(self, sentence: str = "", found: Mapping[str, Any] | None = None) -> None:
        """An error of that sentence."""
        super().__init__(sentence)
        self.found = found

    def __str__(self) -> str:
        """The sentence on one line, without line ends and control characters of names in it."""
        text = super().__str__()
        return "".join(letter if letter.isprintable() else " " for letter in text)


class SceneError(IceslideError):
    """The input is invalid; nothing was started or written."""

    exit_code = 2


class SimulationStopped(IceslideError):
    """A run stopped for a physical or numerical reason, given in the message."""

    exit_code = 3


class OutputError(IceslideError):
    """A file cannot be written (for example, the disk is full); raised on the writing rank."""

    exit_code = 3


class Interrupted(IceslideError):
    """A run was stopped on request, with a checkpoint."""

    exit_code = 4


class NotConverged(ArithmeticError):
    """An iteration did not converge (equilibrium, temperature); a shorter step may help."""
