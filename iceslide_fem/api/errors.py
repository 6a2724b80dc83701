"""Errors of commands in the words of Python: options are arguments there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene.command_options import CommandOptions, renamed

_RESTART = re.compile(r"\biceslide run --restart ([^\s;,)]+)")
_COMMAND = re.compile(r"\biceslide (?=[a-z]+\b)")
_ARGUMENTS = {"--force": "force=True", "--set": "overrides"}


@contextmanager
def in_python(options: type[CommandOptions] | None = None) -> Iterator[None]:
    """Context manager and decorator: errors within name arguments and functions.

    options: of the command that does the work, whose arguments have the names of the fields.
    """
    try:
        yield
    except IceslideError as error:
        error.args = (_in_python(str(error), names_of(options)),)
        raise


def names_of(options: type[CommandOptions] | None) -> dict[str, str]:
    """What a user of the command types -> the argument in Python."""
    names = dict(_ARGUMENTS)
    for key, field in options.model_fields.items() if options else ():
        label = str(field.alias)
        if not label.startswith("--"):  # a file: "DATA.csv" is `data`
            names[label] = label.partition(".")[0].lower()
        else:
            names[label] = f"{key}=True" if field.annotation is bool else key
    return names


def _in_python(sentence: str, names: dict[str, str]) -> str:
    sentence = _RESTART.sub(r'run(scene, "\1", restart=True)', sentence)
    for label in (name for name in names if not name.startswith("--")):
        sentence = re.sub(rf"(?<![\w./]){re.escape(label)}(?![\w/])", names[label], sentence)
    sentence = renamed(sentence, lambda name: names.get(name, name[2:].replace("-", "_")))
    return _COMMAND.sub("iceslide_fem.", sentence)
