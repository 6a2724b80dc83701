"""The page of a wheel: friction, sliding, melting and saturated fractions over slip."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from iceslide_fem.postprocess.report.page import Cell, Chart, Page, Section, Table, Text
from iceslide_fem.postprocess.report.page import Curve as Line
from iceslide_fem.postprocess.report.words import versions_of
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.output import MEMBER_HEAD, lines, member_cells
from iceslide_fem.runtime.errors import SceneError

ABOUT_ERROR = (
    "The film law was advanced with a relative error of {:g} of mu per pixel; the slip ratio of "
    "the peak is one of those that were asked for."
)
LEFT_OUT = (
    "The brush: no carcass, no camber, no relaxation length, one sliding velocity over the whole "
    "patch, pressures that slip does not change. What slides does so with the speed of the wheel: "
    "a bristle in series with a film that melts has no motion of its own "
    "(docs/explanation/wheel.md)."
)
# Charts: anchor, title, description, label of y, column, factor.
CHARTS = (
    ("mu", "Friction over slip", "Friction along the wheel.", "mu", "mu", 1.0),
    ("sliding", "What slides", "The rest sticks to the ice.", "% of the contact",
     "sliding_fraction", 100.0),
    ("melting", "Where ice melts", "Below what slides.", "% of the contact",
     "melting_fraction", 100.0),
    ("saturated", "Where free volume is full of water", "Below what slides.", "% of the contact",
     "saturated_fraction", 100.0),
    ("height", "Height of the film", "Mean where rubber slides.", "nm", "mean_film_m", 1e9),
    ("temperature", "Temperature of the ice's surface", "Mean where rubber slides.", "°C",
     "mean_temperature_C", 1.0),
)  # fmt: skip
ACROSS = (
    ("across", "Side force over slip", "Friction across the wheel.", "mu across", "mu_across", 1.0),
    ("trail", "Trail of the side force", "Behind the middle of the patch.", "mm", "trail_m", 1e3),
)


def page_of_wheel(folder: Path, summary: Mapping[str, Any]) -> Page:
    """The page of the wheel in `folder`. Raises SceneError if its files are damaged."""
    try:
        case, members = summary["case"], summary["curves"]
        rows = [[Cell(name), Cell(text)] for name, text in lines(summary)]
        found = [[Cell(text) for text in member_cells(member)] for member in members]
        charts = CHARTS + (ACROSS if case["slip_angle"] else ())
        warnings = [
            Text(f"{sentence[:1].upper()}{sentence[1:]}.", "warning")
            for sentence in summary["warnings"]
        ]
        chosen = [[Cell(key), Cell(str(v))] for key, v in case.items() if v is not None]
        return Page(
            title=f"{Path(summary['source']).stem}: a wheel on ice",
            summary=_what(case, members),
            sections=[
                Section("results", "Results", [
                    Table("Friction over slip", MEMBER_HEAD, found),
                    *_stops(summary["stops"]),
                    Table("The wheel", ["", ""], rows),
                    Text(ABOUT_ERROR.format(case["tolerance"])),
                ]),
                Section("warnings", "Warnings", warnings or [Text("There was no warning.")]),
                Section("curves", "Curves", _charts(folder, charts)),
                Section("neglected", "What the model leaves out", [Text(LEFT_OUT)]),
                Section("again", "Run it again", [
                    Text(_command(case), "code"),
                    Table("All options, SI units", ["option", "value"], chosen),
                    versions_of({"": summary}),
                ]),
            ],
        )  # fmt: skip
    except (AttributeError, KeyError, OSError, TypeError, ValueError) as error:
        raise SceneError(f"{folder} holds no whole wheel ({error})") from None


def _what(case: Mapping[str, Any], members: list[Mapping[str, Any]]) -> str:
    low, high = case["slip"][0], case["slip"][-1]
    angle = case["slip_angle"]
    turned = f" and a slip angle of {np.degrees(angle):.3g}°" if angle else ""
    first = member_cells(members[0])
    family = f", {len(members)} curves" if len(members) > 1 else ""
    return (
        f"Slip ratios from {low:g} to {high:g}{turned}{family}: 1 is a locked wheel, 0 one that "
        f"rolls freely. At {first[0]} km/h on ice at {first[1]} °C mu is {first[2]} at most, at a "
        f"slip ratio of {first[3]}; locked it is {first[4]}."
    )


def _stops(stops: Mapping[str, Mapping[str, float]]) -> list[Table]:
    """Table of the stops of a quarter car, if they were computed."""
    rows = [
        [name, *(f"{stop[key]:.4g}" for key in ("distance_m", "time_s", "deceleration_m_s2"))]
        for name, stop in stops.items()
    ]
    head = ["brake", "distance (m)", "time (s)", "deceleration (m/s²)"]
    cells = [[Cell(text) for text in row] for row in rows]
    return [Table("A quarter car brakes (stops.png)", head, cells)] if rows else []


def _charts(folder: Path, charts: tuple[tuple[str, str, str, str, str, float], ...]) -> list[Chart]:
    data = pd.read_csv(folder / "mu_slip.csv", float_precision="round_trip")
    members = list(data.groupby(["speed_m_s", "temperature_C"], sort=False))
    drawn = []
    for name, title, says, label, column, factor in charts:
        curves = [
            Line(
                f"{3.6 * speed:.4g} km/h, {celsius:.4g} °C",
                rows["slip"].to_numpy(), factor * rows[column].to_numpy(), look,
            )
            for look, ((speed, celsius), rows) in enumerate(members)
        ]  # fmt: skip
        if any(np.isfinite(np.asarray(curve.y)).any() for curve in curves):
            drawn.append(Chart(name, title, says, "slip ratio (1: locked)", label, curves))
    return drawn


def _command(case: Mapping[str, Any]) -> str:
    """The command of a case, with its non-default options."""
    usual = WheelCase.model_fields
    image = case["image"]
    words = ["iceslide wheel" + (f" {shlex.quote(str(image))}" if image else "")]
    given = {key: v for key, v in case.items() if key != "image" and v is not None}
    for key, values in given.pop("vary").items():
        words.append(f"    --vary {key}={','.join(f'{value:.10g}' for value in values)}")
    if stiffness := given.pop("stiffness", None):
        words.append(f"    --stiffness {stiffness[0]:g}{stiffness[1]}")
    for key, value in given.items():
        default = usual[key].default
        value = tuple(value) if isinstance(value, list) else value
        if value == default:
            continue
        text = ",".join(f"{v:.10g}" for v in value) if isinstance(value, tuple) else str(value)
        option = f"    --{key.replace('_', '-')}"
        words.append(option if value is True else f"{option} {shlex.quote(text)}")
    return " \\\n".join(words)
