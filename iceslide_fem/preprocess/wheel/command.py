"""`iceslide wheel`: read, determine the tread's stiffness, compute, write; and words about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from iceslide_fem.postprocess.report.page import Cell, Chart, Table
from iceslide_fem.preprocess.footprint.reading import ReadFootprint, read_source
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import contact_of_case
from iceslide_fem.preprocess.wheel.charts import charts_of
from iceslide_fem.preprocess.wheel.friction import Curve, curves
from iceslide_fem.preprocess.wheel.output import columns, stop_columns, stop_figures, summary
from iceslide_fem.preprocess.wheel.stops import Stops, stops_on, table_of_stop
from iceslide_fem.preprocess.wheel.tread import TreadStiffness, stiffness_of
from iceslide_fem.preprocess.work import Preprocessor, Words, csv_text
from iceslide_fem.runs.verdict import in_words
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.terminal import LongTask
from iceslide_fem.scene.materials import BAR

SLIPPING, STOPS = "mu_slip.csv", "stops.csv"
ABOUT_ERROR = (
    "The film law was advanced with a relative error of {:g} of mu per pixel; the slip ratio of "
    "the peak is one of those that were asked for."
)
LEFT_OUT = (
    "The brush: no camber, no relaxation length, one sliding velocity over the whole "
    "patch, pressures that slip does not change. What slides does so with the speed of the wheel: "
    "a bristle in series with a film that melts has no motion of its own "
    '(page "A wheel, and braking").'
)
NO_CARCASS = " The carcass does not give way."
MEMBER_HEAD = (
    "speed (km/h)", "ice (°C)", "peak mu", "at slip", "locked mu", "peak / locked", "slope at 0"
)  # fmt: skip
OF_A_STOP = "distance_m", "time_s", "deceleration_m_s2", "measured_deceleration_m_s2"
STOP_HEAD = ("brake", "distance (m)", "time (s)", "deceleration (m/s²)", "measured (m/s²)")


class Wheel(NamedTuple):
    """A computed wheel: its footprint, tread, friction over slip, and stops or None."""

    read: ReadFootprint
    stiffness: TreadStiffness
    curves: list[Curve]
    stops: Stops | None


def compute(case: WheelCase) -> Wheel:
    """The wheel of a case. Raises SceneError, SimulationStopped."""
    read = read_source(case)
    contact_of_case(case.members[0], read.pressure_map.contact_length)
    with LongTask(1.0) as shown:
        stiffness = stiffness_of(case, read.pressure_map, lambda words: shown.show(0.0, words))
        found = curves(
            case,
            read.pressure_map,
            stiffness,
            lambda part: shown.show(part, f"{part:.0%} of the slip ratios"),
        )
        stops = None
        if case.abs:
            table = table_of_stop(case, read.pressure_map, stiffness)
            stops = stops_on(case, table, read.pressure_map.load)
    return Wheel(read, stiffness, found, stops)


def figures_of(case: WheelCase, found: Wheel) -> dict[str, Any]:
    """All figures of a wheel and its stops."""
    figures = summary(case, found.read, found.stiffness, found.curves)
    return figures | {"stops": {} if found.stops is None else stop_figures(found.stops)}


def write(case: WheelCase, found: Wheel, out: Path) -> None:
    """Write mu_slip.csv, and of stops stops.csv."""
    slipping = columns(found.curves, found.read.pressure_map.load)
    replace_file(out / SLIPPING, csv_text(slipping, 8))
    if found.stops is not None:
        replace_file(out / STOPS, csv_text(stop_columns(found.stops.by_control)))


def charts(case: WheelCase, found: Wheel) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures."""
    slipping = pd.DataFrame(columns(found.curves, found.read.pressure_map.load))
    stops = found.stops and pd.DataFrame(stop_columns(found.stops.by_control))
    return charts_of(slipping, stops)


def words(figures: Mapping[str, Any]) -> Words:
    """What terminal and page say of a wheel."""
    members = [[Cell(text) for text in member_cells(member)] for member in figures["curves"]]
    stops = [
        [Cell(name), *(Cell(f"{stop[key]:.4g}") for key in OF_A_STOP)]
        for name, stop in figures["stops"].items()
    ]
    tables = [Table("Friction over slip", MEMBER_HEAD, members)]
    return Words(
        title=f"{Path(figures['source']).stem}: a wheel on ice",
        summary=_summary(figures["case"], figures["curves"]),
        lines=_lines(figures),
        left_out=LEFT_OUT + NO_CARCASS * (figures["case"]["carcass"] is None),
        tables=[*tables, *([Table(_stop_caption(figures), STOP_HEAD, stops)] if stops else [])],
        remarks=[ABOUT_ERROR.format(figures["case"]["tolerance"])],
        verdict=_verdict(figures),
    )


def _stop_caption(figures: Mapping[str, Any]) -> str:
    """Of the table of stops: between which speeds they are measured, and how often."""
    stop = figures["stops"]["threshold"]
    first, last = (3.6 * speed for speed in stop["measured_between_m_s"])
    return (
        f"A quarter car brakes; measured between {first:.4g} and {last:.4g} km/h, by thresholds "
        f"the mean of {stop['phases']} starts"
    )


def _verdict(figures: Mapping[str, Any]) -> str:
    """What the peak of mu is worth, or that of the locked wheel."""
    first, tolerance = figures["curves"][0], figures["case"]["tolerance"]
    for key, what in (("peak_mu", "Peak mu"), ("locked_mu", "mu of the locked wheel")):
        if first[key] is not None:
            return in_words(what, first[key], tolerance, "film, per pixel")
    return ""


def _summary(case: Mapping[str, Any], members: Sequence[Mapping[str, Any]]) -> str:
    low, high, angle = case["slip"][0], case["slip"][-1], case["slip_angle"]
    turned = f" and a slip angle of {np.degrees(angle):.3g}°" if angle else ""
    first = member_cells(members[0])
    family = f", {len(members)} curves" if len(members) > 1 else ""
    return (
        f"Slip ratios from {low:g} to {high:g}{turned}{family}: 1 is a locked wheel, 0 one that "
        f"rolls freely. At {first[0]} km/h on ice at {first[1]} °C mu is {first[2]} at most, at a "
        f"slip ratio of {first[3]}; locked it is {first[4]}."
    )


def _lines(figures: Mapping[str, Any]) -> list[tuple[str, str]]:
    wheel = figures["wheel"]
    mass = [("mass of the quarter car", f"{wheel['mass_kg']:.4g} kg")] if "mass_kg" in wheel else []
    carcass = [
        ("of the carcass in series", f"{value:.4g} Pa/m")
        for value in (figures["case"]["carcass"],)
        if value is not None
    ]
    over = [
        (f"of both over the patch, {speed} km/h, {celsius} °C", f"{value:.4g} Pa/m")
        for member in figures["curves"]
        if (value := member.get("patch_stiffness_Pa_per_m")) is not None
        for speed, celsius, *_ in (member_cells(member),)
    ]
    passes = [("last of so many passes", f"{wheel['passes']}")]
    return [
        *passes * (wheel["passes"] > 1),
        ("contact length", f"{1e3 * wheel['contact_length_m']:.4g} mm"),
        ("load", f"{wheel['load_N']:.5g} N" + " per metre of width" * wheel["one_line"]),
        *mass,
        ("mean pressure", f"{wheel['mean_pressure_Pa'] / BAR:.4g} bar"),
        ("shear stiffness of the tread", f"{wheel['stiffness_Pa_per_m']:.4g} Pa/m"),
        ("which is from", wheel["stiffness_from"]),
        *carcass,
        *over,
        ("seconds", f"{figures['wall_s']:.1f}"),
    ]


def member_cells(member: Mapping[str, Any]) -> list[str]:
    """A row below `MEMBER_HEAD`; "-" for values not computed."""
    keys = ("peak_mu", "slip_at_peak", "locked_mu", "peak_over_locked", "slope_at_0")
    texts = ["-" if member[key] is None else f"{member[key]:.4g}" for key in keys]
    return [f"{3.6 * member['speed_m_s']:.4g}", f"{member['temperature_C']:.4g}", *texts]


WHEEL = Preprocessor("wheel", WheelCase, compute, figures_of, write, charts, words, ending="_wheel")
