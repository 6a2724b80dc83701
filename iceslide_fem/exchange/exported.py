"""What a wheel's folder is exported as: its Magic Formula, or its table as a unit."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.exchange.fmu import write_fmu
from iceslide_fem.exchange.magic_formula import MagicFormula, fitted, tyre_property_file
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
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
    """The case of the results of `iceslide wheel` in a folder, straight on, without a family.

    Raises SceneError.
    """
    file = folder / "summary.json"
    check_regular(file, "the summary of the wheel")
    try:
        command = str(json.loads(file.read_bytes())["command"])
    except (OSError, ValueError, KeyError, TypeError):
        command = ""
    if not command.startswith("iceslide wheel"):
        raise SceneError(f"{folder} holds no results of iceslide wheel")
    return WheelCase.of_command(command).model_copy(update={"vary": {}, "slip_angle": 0.0})


def formulas_of(case: WheelCase, load: float | None) -> Formulas:
    """The Magic Formulas of a wheel, at its speed and load. Raises SceneError, SimulationStopped.

    load: N, needed for a line, which has no width.
    """
    read = read_source(case)
    if load is None and case.one_line and case.mass is None:
        raise SceneError("one line has no load; give --load, such as 3432N")
    braked = [Rolling(case.speed, float(slip)) for slip in SLIPS]
    turned = [Rolling(case.speed, 0.0, float(angle)) for angle in ANGLES]
    (member,) = case.members
    below = below_wheel(member, read.pressure_map, stiffness_of(case, read.pressure_map))
    points = friction(read.pressure_map, [*braked, *turned], *below)
    mu = [one.mu for one in points[: SLIPS.size]]
    mu_across = [one.mu_across for one in points[SLIPS.size :]]
    of_case = case.car(read.pressure_map.load).wheel_load
    return Formulas(
        _curve(SLIPS, mu), _curve(np.tan(ANGLES), mu_across), of_case if load is None else load
    )


def _curve(x: Array, mu: Sequence[float]) -> Curve:
    """Friction over x, and its formula."""
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
    table = table_of_stop(case, read.pressure_map, stiffness_of(case, read.pressure_map))
    about = f"{source} on ice at {celsius(case.temperatures[0])}"
    write_fmu(path, table, about)
