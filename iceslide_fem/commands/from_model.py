"""Options of a command, one for each field of a model of `CommandOptions`."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import typer
from pydantic.fields import FieldInfo

from iceslide_fem.commands.report import NoReport
from iceslide_fem.runtime.options import Force, folder_option
from iceslide_fem.scene.command_options import CommandOptions, scene_keys
from iceslide_fem.scene.fields import default_text, number_of
from iceslide_fem.scene.variation import FIELDS


def command(
    case: type[CommandOptions],
    work: Callable[[dict[str, Any], Path | None, bool, bool], Mapping[str, Any]],
    text: str,
    folder: str,
) -> Callable[..., Mapping[str, Any]]:
    """A function for typer with an option for each field of `case`, and where to write.

    work: is called with the given options, texts by the names of fields, the folder (None: not
    given), --force and --no-report, and returns the result; text: the command's help; folder: of
    the default folder.
    """

    def run(**given: Any) -> Mapping[str, Any]:
        out, force, no_report = (given.pop(name) for name in ("out", "force", "no_report"))
        values = {key: value for key, value in given.items() if value not in (None, False, [])}
        return work(values, out, force, no_report)

    fields, kinds = case.model_fields, case.__mro__
    owner = {key: next(one for one in kinds if key in one.__annotations__) for key in fields}
    in_groups = sorted(fields, key=lambda key: kinds.index(owner[key]))
    parameters = [_parameter(key, fields[key], str(owner[key].group)) for key in in_groups]  # type: ignore[attr-defined]
    where: Any = Annotated[Path | None, folder_option(f"Where to write; else {folder}.")]
    parameters += [
        _keyword("out", where, None),
        _keyword("force", Force, False),
        _keyword("no_report", NoReport, False),
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__doc__ = text
    return run


def _parameter(key: str, field: FieldInfo, group: str) -> inspect.Parameter:
    about = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    keys = scene_keys(field)
    meant = FIELDS[keys[0]] if len(keys) == 1 else field
    default = default_text(meant if field.default == meant.default else field)
    metavar = str(about.get("metavar") or _metavar(meant))
    words, label = field.description or "", str(field.alias)
    if field.annotation is bool:
        return _keyword(
            key, Annotated[bool, typer.Option(label, help=words, rich_help_panel=group)], False
        )
    if shown := about.get("shown") or default:
        words += f" [dim]\\[default: {shown}][/dim]"
    look: Any = {"metavar": metavar, "help": words, "show_default": False}
    if not label.startswith("--"):
        several = get_origin(field.annotation) is tuple
        one: Any = list[Path] if several else Path
        kind: Any = one if field.is_required() else one | None
        start = inspect.Parameter.empty if field.is_required() else None
        return _keyword(key, Annotated[kind, typer.Argument(**look)], start)
    kind = list[str] | None if field.default == {} else str | None
    return _keyword(key, Annotated[kind, typer.Option(label, rich_help_panel=group, **look)], None)


def _keyword(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(name, keyword, default=default, annotation=annotation)


def _metavar(field: FieldInfo) -> str:
    """What a field takes: its unit, choices, a file, a whole number, or a text."""
    quantity, parts = number_of(field), [field.annotation, *get_args(field.annotation)]
    if quantity is not None:
        return (
            "T"
            if quantity.unit == "K" and "degC" in str(quantity)
            else quantity.unit.upper() or "X"
        )
    for part in parts:
        if get_origin(part) is Literal:
            return "|".join(map(str, get_args(part)))
    if int in parts:
        return "N"
    return "FILE" if any(_is_path(part) for part in parts) else "TEXT"


def _is_path(part: Any) -> bool:
    inner = get_args(part)[0] if get_origin(part) is Annotated else part
    return inner is Path or (get_origin(part) in (Union, UnionType) and Path in get_args(part))
