"""The tab of the wheel: what `iceslide wheel` computes, on fewer pixels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from iceslide_fem.app.form import Texts, chosen
from iceslide_fem.app.tab import Tab, slider_of
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.reading import ReadFootprint, read_source
from iceslide_fem.preprocess.wheel import friction
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import Curve
from iceslide_fem.preprocess.wheel.output import summary
from iceslide_fem.preprocess.wheel.quarter_car import QuarterCar
from iceslide_fem.preprocess.wheel.stops import stops_on, table_of_stop
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR, COMPOUNDS

KMH = 1.0 / 3.6  # m/s
T_0 = ZERO_CELSIUS
CELLS = 20  # along the patch
TOLERANCE = 2e-2  # of the films; the cells dominate the error of the curve
# Slip ratios, denser at low slip, where dry contact has its peak.
SLIPS = ",".join(f"{(i / 20) ** 2:.4g}" for i in range(21))
EVEN = 5.0  # m, standard deviation of a Gaussian that is uniform over any patch
STIFFNESS = COMPOUNDS["B"].shear_modulus / 8e-3  # Pa/m, G / H of a slick tread of 8 mm
OF_BLOCKS = ("pitch", "groove")
OF_STOPS = ("end_speed", "mass")
POINTS = 300  # of the history of a stop
SHAPES = ("even", "gaussian")  # of the pressure along the patch
STARTS: dict[str, Sequence[float]] = {
    "gaussian": (0.12, 2.0 * BAR, 0.03),
    "stiffness": (STIFFNESS,),
    "pitch": (0.028,),
    "groove": (0.008,),
    "dry_stress": (0.0,),
    "dry_softening": (10.0,),
    "mass": (QuarterCar().mass,),
}
_slider = partial(slider_of, WheelCase, STARTS)
TAB = Tab(
    name="wheel",
    case=WheelCase,
    starts=STARTS,
    needed=("gaussian", "dry_softening", *OF_BLOCKS),
    sliders=(
        _slider("speed", "V, speed", "km/h", KMH, 2.0, 150.0),
        _slider("temperature", "T₀, ice temperature", "degC", 1.0, -30.0, -0.1, False, T_0),
        _slider("gaussian.1", "largest pressure", "bar", BAR, 0.2, 20.0),
        _slider("gaussian.0", "length of the patch", "mm", 1e-3, 20.0, 300.0, False),
        _slider("gaussian.2", "standard deviation of the Gaussian", "mm", 1e-3, 10.0, 200.0),
        _slider("stiffness", "shear stiffness of the tread", "MPa/m", 1e6, 1.0, 1000.0),
        _slider("pitch", "pitch of the blocks", "mm", 1e-3, 10.0, 100.0, False),
        _slider("groove", "groove between two", "mm", 1e-3, 1.0, 20.0, False),
        _slider("initial_height", "h₀, first film height", "nm", 1e-9, 5.0, 1000.0, zero=True),
        _slider("dry_stress", "dry contact: stress, or 0", "bar", BAR, 0.1, 20.0, zero=True),
        _slider("dry_softening", "dry contact: softens over", "K", 1.0, 0.5, 50.0),
        _slider("dry_residual", "dry contact: 0 above melting by", "K", 1.0, 0.0, 10.0, False),
        _slider("end_speed", "speed at which a stop ends", "km/h", KMH, 1.0, 100.0),
        _slider("mass", "mass that the wheel carries", "kg", 1.0, 50.0, 3000.0),
    ),
    texts=(),
    choices=(
        ("shape", "pressure along the patch", SHAPES),
        ("tread", "tread", ("slick", "blocks")),
        ("abs", "braking to a stop (takes seconds)", ("no", "yes")),
    ),
    only={
        "gaussian.2": ("shape", ("gaussian",)),
        **dict.fromkeys(OF_BLOCKS, ("tread", ("blocks",))),
        **dict.fromkeys(OF_STOPS, ("abs", ("yes",))),
    },
)


def curves(texts: Texts) -> dict[str, Any]:
    """All content of the tab but its stops. Raises SceneError, SimulationStopped.

    series over the slip ratio: mu; sliding, melting, saturated: fractions of the contact;
    temperature (degC) and film (nm) of sliding contact, None without any; notes: warnings.
    """
    given = options(texts)
    case = WheelCase.of(given)
    read, curve = computed(case)
    figures = summary(case, read, stiffness_of(case, read.pressure_map), [curve])
    (found,) = figures["curves"]
    points = curve.points
    shown = "stop_distance_m" if case.abs else "mu"
    return {
        "notes": [TAB.worded(note) for note in figures["warnings"]],
        "series": {
            "slip": [point.slip for point in points],
            "mu": [point.mu for point in points],
            "sliding": [point.sliding for point in points],
            "melting": [point.melting for point in points],
            "saturated": [point.saturated for point in points],
            "temperature": [_number(point.temperature - ZERO_CELSIUS) for point in points],
            "film": [_number(1e9 * point.film_height) for point in points],
        },
        "numbers": {
            "peak_slip": found["slip_at_peak"],
            "mu_peak": found["peak_mu"],
            "mu_locked": found["locked_mu"],
        },
        "values": TAB.values(case),
        **TAB.snippets(given, case, f"found['{shown}'].to_series()"),
    }


def stops(texts: Texts) -> dict[str, Any]:
    """The stops of the tab, if its `abs` is yes, by control. Raises SceneError, SimulationStopped.

    distance (m), time (s), deceleration (m/s2) between the speeds `measured` (km/h), and over the
    way (m) the speed (km/h); ends: first and last speed, km/h.
    """
    case = WheelCase.of(options(texts))
    read = coarse(case)
    stiffness = stiffness_of(case, read.pressure_map)
    table = table_of_stop(quick(case), read.pressure_map, stiffness)
    found = stops_on(case, table, read.pressure_map.load)
    return {
        "ends": [case.speed / KMH, case.end_speed / KMH],
        "measured": [speed / KMH for speed in found.measured],
        "controls": {
            name: {
                "distance": stop.distance,
                "time": stop.time,
                "deceleration": found.deceleration(name),
                "way": _some(stop.history.distance),
                "speed": _some(stop.history.speed / KMH),
            }
            for name, stop in found.by_control.items()
        },
    }


def options(texts: Texts) -> dict[str, Any]:
    """Options of the command for the texts of the fields, with a given stiffness."""
    shape = {"gaussian.2": repr(EVEN)} if chosen(texts, "shape", SHAPES) == "even" else {}
    return {"stiffness": f"{STIFFNESS!r} Pa/m"} | TAB.options({**texts, **shape}) | {"slip": SLIPS}


def computed(case: WheelCase, cells: int = CELLS) -> tuple[ReadFootprint, Curve]:
    """The footprint of a case, as so many `cells` along it, and friction on it."""
    read = coarse(case, cells)
    stiffness = stiffness_of(case, read.pressure_map)
    (curve,) = friction.curves(quick(case), read.pressure_map, stiffness)
    return read, curve


def coarse(case: WheelCase, cells: int = CELLS) -> ReadFootprint:
    """The footprint of a case, as so many `cells` along it."""
    read = read_source(case)
    line = read.pressure_map
    pixels = line.pressure.reshape(1, cells, -1)
    mean = PressureMap(pixels.mean(axis=2), line.dx * pixels.shape[2], line.dy)
    return read._replace(pressure_map=mean)


def quick(case: WheelCase) -> WheelCase:
    """The case with the tolerance of the page."""
    return case.model_copy(update={"tolerance": TOLERANCE})


def _some(column: Array) -> list[float]:
    """At most `POINTS` values of a column of a history, with its ends."""
    places = np.linspace(0, len(column) - 1, min(POINTS, len(column))).round().astype(int)
    return [float(value) for value in np.asarray(column)[places]]


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
