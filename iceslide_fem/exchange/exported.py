"""What a wheel's folder is exported as: its Magic Formula, or its table as a unit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.exchange.fmu import write_fmu
from iceslide_fem.exchange.magic_formula import MagicFormula, fitted, tyre_property_file
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import contact_of_case
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.stops import table_of_stop
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_regular, check_writable, replace_file
from iceslide_fem.runtime.units import celsius

SLIPS = np.concatenate([[0.0], np.geomspace(2e-3, 1.0, 60)])  # of a fit along the wheel
ANGLES = np.radians([0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0])  # across


class Curve(NamedTuple):
    """Friction over slip: S along the wheel, tan(alpha) across it, and its formula."""

    slip: Array
    mu: Array
    formula: MagicFormula


class Formulas(NamedTuple):
    """Curves along and across a wheel, and the load (N) of its file."""

    along: Curve
    across: Curve
    load: float


def wheel_in(folder: Path) -> WheelCase:
    """The case of the results of `iceslide wheel` in a folder. Raises SceneError."""
    file = folder / "summary.json"
    check_regular(file, "the summary of the wheel")
    try:
        command = str(json.loads(file.read_bytes())["command"])
    except (OSError, ValueError, KeyError, TypeError):
        command = ""
    if not command.startswith("iceslide wheel"):
        raise SceneError(f"{folder} holds no results of iceslide wheel")
    return WheelCase.of_command(command)


def formulas_of(case: WheelCase, load: float | None) -> Formulas:
    """The Magic Formulas of a wheel, at its speed and load. Raises SceneError, SimulationStopped.

    load: N, needed for a line, which has no width.
    """
    read = read_source(case)
    if load is None and case.one_line and case.mass is None:
        raise SceneError("one line has no load; give --load, such as 3432N")
    straight = case.model_copy(update={"vary": {}, "slip_angle": 0.0})
    along = _curve(straight, read.pressure_map, [(float(s), 0.0) for s in SLIPS], SLIPS)
    pairs = [(0.0, float(angle)) for angle in ANGLES]
    across = _curve(straight, read.pressure_map, pairs, np.tan(ANGLES))
    of_case = straight.car(read.pressure_map.load).wheel_load
    return Formulas(along, across, of_case if load is None else load)


def _curve(
    case: WheelCase, footprint: PressureMap, places: list[tuple[float, float]], x: Array
) -> Curve:
    """mu at slip ratios and slip angles (rad), and its formula over x."""
    tread = stiffness_of(case, footprint).tread(case.pattern, case.temperatures[0])
    contact = contact_of_case(case, footprint.contact_length)
    mu = []
    for angle in dict.fromkeys(angle for _, angle in places):
        turned = case.model_copy(update={"slip_angle": angle})
        rolls = [turned.rolling(slip) for slip, at in places if at == angle]
        found = friction(footprint, rolls, tread, contact)
        mu += [one.mu if angle == 0.0 else one.mu_across for one in found]
    values = np.abs(np.array(mu))
    return Curve(x, values, fitted(x, values))


def write_tir(case: WheelCase, found: Formulas, path: Path, source: Path) -> None:
    """Write the tyre property file of a wheel; source: its folder. Raises OutputError."""
    about = [
        f"Friction of {source} on ice at {celsius(case.temperatures[0])}, by iceslide_fem",
        f"fitted at {case.speed:.4g} m/s and {found.load:.6g} N: one load, pure slip",
        f"largest error over the peak: along {found.along.formula.error:.2%}, across "
        f"{found.across.formula.error:.2%}",
    ]
    text = tyre_property_file(
        found.along.formula, found.across.formula, found.load, case.wheel_radius, case.speed, about
    )
    replace_file(path, text)


def write_unit(case: WheelCase, path: Path, source: Path) -> None:
    """Write the functional mock-up unit of a wheel. Raises SceneError, SimulationStopped,
    OutputError.
    """
    check_writable(path.parent)
    read = read_source(case)
    straight = case.model_copy(update={"vary": {}, "slip_angle": 0.0})
    table = table_of_stop(straight, read.pressure_map, stiffness_of(straight, read.pressure_map))
    about = f"{source} on ice at {celsius(straight.temperatures[0])}"
    write_fmu(path, table, about)
