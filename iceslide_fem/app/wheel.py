"""The tab of the wheel: its fields, and friction over slip."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from iceslide_fem.app.film_case import slider_of
from iceslide_fem.app.form import Texts
from iceslide_fem.app.snippets import api_lines
from iceslide_fem.app.wheel_case import WheelLine
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.friction import Curve, SlipPoint, friction
from iceslide_fem.preprocess.wheel.output import little_melting
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR

KMH = 1.0 / 3.6  # m/s
T_0 = ZERO_CELSIUS
_slider = partial(slider_of, WheelLine)
SLIDERS = (
    _slider("speed", "V, speed", "km/h", KMH, 2.0, 150.0),
    _slider("ice_temperature", "T₀, ice temperature", "degC", 1.0, -30.0, -0.1, False, T_0),
    _slider("pressure", "largest pressure", "bar", BAR, 0.2, 20.0),
    _slider("length", "length of the patch", "mm", 1e-3, 20.0, 300.0, False),
    _slider("sigma", "standard deviation of the Gaussian", "mm", 1e-3, 10.0, 200.0),
    _slider("stiffness", "shear stiffness of the tread", "MPa/m", 1e6, 1.0, 1000.0),
    _slider("pitch", "pitch of the blocks", "mm", 1e-3, 10.0, 100.0, False),
    _slider("groove", "groove between two", "mm", 1e-3, 1.0, 20.0, False),
    _slider("initial_height", "h₀, first film height", "nm", 1e-9, 5.0, 1000.0, zero=True),
    _slider("dry_stress", "dry contact: stress, or 0", "bar", BAR, 0.1, 20.0, zero=True),
    _slider("dry_softening", "dry contact: softens over", "K", 1.0, 0.5, 50.0),
    _slider("dry_residual", "dry contact: 0 above melting by", "K", 1.0, 0.0, 10.0, False),
)
OF_GAUSSIAN = ("sigma",)
OF_BLOCKS = ("pitch", "groove")


def described() -> dict[str, Any]:
    """Data of the fields for the page; only: choices with which a field has an effect."""
    return {
        "sliders": [slider.described() for slider in SLIDERS],
        "texts": [],
        "choices": [
            ("profile", "pressure along the patch", ("even", "gaussian")),
            ("tread", "tread", ("slick", "blocks")),
        ],
        "empty": [],
        "only": {
            **{key: ("profile", ["gaussian"]) for key in OF_GAUSSIAN},
            **{key: ("tread", ["blocks"]) for key in OF_BLOCKS},
        },
    }


def curves(texts: Texts) -> dict[str, Any]:
    """All content of the tab. Raises SceneError, SimulationStopped.

    series over the slip ratio: mu; sliding, melting, saturated: fractions of the contact;
    temperature (degC) and film (nm) of sliding contact, None without any; notes: warnings.
    """
    case = WheelLine.of(texts)
    points = friction(case.footprint(), *case.wheel)
    peak, locked = max(points, key=lambda point: point.mu), points[-1]
    return {
        "notes": _doubts(case, points),
        "series": {
            "slip": [point.slip for point in points],
            "mu": [point.mu for point in points],
            "sliding": [point.sliding for point in points],
            "melting": [point.melting for point in points],
            "saturated": [point.saturated for point in points],
            "temperature": [_number(point.temperature - ZERO_CELSIUS) for point in points],
            "film": [_number(1e9 * point.film_height) for point in points],
        },
        "numbers": {"peak_slip": peak.slip, "mu_peak": peak.mu, "mu_locked": locked.mu},
        "values": {slider.key: getattr(case, slider.key) for slider in SLIDERS},
        "python": api_lines("wheel", case.options, "found['mu'].to_series()"),
        "command": WheelCase.of(case.options).as_command("wheel"),
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _doubts(case: WheelLine, points: list[SlipPoint]) -> list[str]:
    """Warning of slip ratios with little melting under a law without dry friction."""
    if case.dry_shear.stress is not None:
        return []
    return little_melting([Curve(case.speed, case.ice_temperature, points, 0.0)])
