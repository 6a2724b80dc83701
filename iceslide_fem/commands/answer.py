"""What every command with a result has: `--json`, the result as one object, and `--quiet`."""

from __future__ import annotations

import functools
import inspect
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack, redirect_stdout
from typing import Annotated, Any

import typer

from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.runtime.terminal import without_progress

Json = Annotated[
    bool,
    typer.Option(
        "--json", help="Print the result as one JSON object, and words on standard error."
    ),
]
Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Show no progress, and with --json the object alone."),
]
_OPTIONS = {"as_json": Json, "quiet": Quiet}


def answering(command: Callable[..., Mapping[str, Any]]) -> Callable[..., None]:
    """The `command` with `--json` and `--quiet`: what it returns is the object.

    A command that stops after it has found something gives that in the error's `found`.
    """

    @functools.wraps(command)
    def answered(*, as_json: bool, quiet: bool, **given: Any) -> None:
        screen = sys.stdout
        with ExitStack() as stack:
            if quiet:
                stack.enter_context(without_progress())
            if as_json:
                words = stack.enter_context(open(os.devnull, "w")) if quiet else sys.stderr
                stack.enter_context(redirect_stdout(words))
            try:
                found = command(**given)
            except IceslideError as error:
                if as_json and error.found is not None:
                    print(_as_json(error.found), file=screen)
                raise
        if as_json:
            print(_as_json(found), file=screen)

    own = inspect.signature(command, eval_str=True)
    keyword = inspect.Parameter.KEYWORD_ONLY
    more = [
        inspect.Parameter(name, keyword, default=False, annotation=kind)
        for name, kind in _OPTIONS.items()
    ]
    answered.__signature__ = own.replace(  # type: ignore[attr-defined]
        parameters=[*own.parameters.values(), *more], return_annotation=None
    )
    return answered


def _as_json(found: Mapping[str, Any]) -> str:
    """An object as text; NaN, infinity and what did not happen are null."""
    from pydantic_core import to_json  # takes long to import, and --help does without

    return to_json(found, inf_nan_mode="null", fallback=lambda array: array.tolist()).decode()
