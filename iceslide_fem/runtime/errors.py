"""What can go wrong for a person at the keyboard, each said in one sentence."""

from __future__ import annotations


class IceslideError(Exception):
    """Base of the errors that are shown as one sentence; `exit_code` ends the command."""

    exit_code = 1

    def __str__(self) -> str:
        """The sentence on one line: a name in it may hold line ends or a terminal's commands."""
        text = super().__str__()
        return "".join(letter if letter.isprintable() else " " for letter in text)


class SceneError(IceslideError):
    """The input is wrong: nothing has been started or written."""

    exit_code = 2


class SimulationStopped(IceslideError):
    """A run could not go on for a physical or numerical reason, which the message names."""

    exit_code = 3


class OutputError(IceslideError):
    """A file cannot be written (the disk is full, say); raised on the rank that writes it."""

    exit_code = 3


class Interrupted(IceslideError):
    """A run was asked to stop, and has left a checkpoint."""

    exit_code = 4


class NotConverged(ArithmeticError):
    """An iteration found nothing (equilibrium, temperature); a shorter step may help."""
