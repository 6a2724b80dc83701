"""The Magic Formula of a curve of friction over slip, fitted, and its tyre property file.

    y(x) = D sin(C arctan(B X - E (B X - arctan(B X)))) + S_V,   X = x + S_H

(H. B. Pacejka, *Tire and Vehicle Dynamics*, 2nd edition, eq. 4.6). Coefficients have the names of
MF 5.2, for one load: P?X1 of the longitudinal force over the slip kappa = -S, P?Y1 of the lateral
one over tan(alpha).
"""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np

from iceslide_fem.runtime.arrays import Array

SHAPES, CURVATURES = (1.2, 1.6, 2.0), (-8.0, 0.0, 0.8)  # C and E where fits start
LOW = (1e-2, 0.5, 1e-6, -1e3)  # B, C, D, E
HIGH = (1e4, 3.0, 5.0, 1.0)
LARGEST_SHIFTS = (0.1, 0.2)  # of x; of y over its largest value
SHARP = 4.0  # exponent of deviations in the second fit, which lowers the largest one
SAID = 0.02  # largest error over the peak that is not worth a warning
VERTICAL_SLOPE = 1e-9  # keeps a root differentiable


class MagicFormula(NamedTuple):
    """Coefficients of one curve; error: largest deviation from what it was fitted to, over its
    largest value.
    """

    B: float
    C: float
    D: float
    E: float
    SH: float = 0.0
    SV: float = 0.0
    error: float = 0.0

    def __call__(self, x: Array) -> Array:
        """y at x, the same shape."""
        return _formula(np.array(self[:6]), np.asarray(x, dtype=float))

    @property
    def slope(self) -> float:
        """K = B C D, dy/dx at X = 0."""
        return self.B * self.C * self.D


def _formula(p: Array, x: Array) -> Array:
    B, C, D, E = p[:4]
    shift, lift = p[4:] if p.size > 4 else (0.0, 0.0)
    inner = B * (x + shift)
    return np.asarray(D * np.sin(C * np.arctan(inner - E * (inner - np.arctan(inner)))) + lift)


def fitted(x: Array, y: Array) -> MagicFormula:
    """The formula nearest to y (n,) at x (n,), both 0 or more, with or without shifts.

    Least squares from several starts, then of the deviations to the power `SHARP`.
    """
    from scipy.optimize import least_squares

    top = float(y.max())

    def off(p: Array) -> Array:
        return np.asarray((_formula(p, x) - y) / top)

    def sharply(p: Array) -> Array:
        return np.asarray((np.abs(off(p)) + VERTICAL_SLOPE) ** (SHARP / 2.0))

    found: list[MagicFormula] = []
    shifts = (LARGEST_SHIFTS[0], LARGEST_SHIFTS[1] * top)
    rises = int(np.argmax(x > 0.0))
    for count, C, E in product((4, 6), SHAPES, CURVATURES):
        low = np.array([*LOW, *(-each for each in shifts)])[:count]
        high = np.array([*HIGH, *shifts])[:count]
        B = max(y[rises] / x[rises], 1.0) / (C * top)
        p = np.clip(np.array([B, C, top, E, 0.0, 0.0])[:count], low, high)
        for deviations in (off, sharply):
            inside = np.clip(p, low + 1e-9, high - 1e-9)
            p = least_squares(deviations, inside, bounds=(low, high), x_scale="jac", max_nfev=400).x
            error = float(np.abs(off(p)).max())
            found.append(MagicFormula(*map(float, p))._replace(error=error))
    return min(found, key=lambda one: one.error)


def tyre_property_file(
    along: MagicFormula,
    across: MagicFormula | None,
    load: float,
    radius: float,
    speed: float,
    about: list[str],
) -> str:
    """A .tir file of MF 5.2 for pure slip at one `load` (N), with comments `about`.

    radius: of the wheel, m; speed: of the vehicle at which it was computed, m/s. The sign of the
    longitudinal slip is that of kappa, positive under drive; lateral force is negative at a
    positive slip angle.
    """
    lines = [f"! {line}" for line in about]
    sections: dict[str, dict[str, float | str]] = {
        "UNITS": {
            "LENGTH": "'meter'", "FORCE": "'newton'", "ANGLE": "'radians'", "MASS": "'kg'",
            "TIME": "'second'",
        },
        "MODEL": {
            "PROPERTY_FILE_FORMAT": "'MF-TYRE'", "FITTYP": 6, "USE_MODE": 4 if across else 1,
            "VXLOW": 1, "LONGVL": speed, "TYRESIDE": "'LEFT'",
        },
        "DIMENSION": {"UNLOADED_RADIUS": radius},
        "VERTICAL": {"FNOMIN": load},
        "LONG_SLIP_RANGE": {"KPUMIN": -1, "KPUMAX": 1},
        "SCALING_COEFFICIENTS": {
            **dict.fromkeys(("LFZO", "LCX", "LMUX", "LEX", "LKX", "LHX", "LVX"), 1),
            **(dict.fromkeys(("LCY", "LMUY", "LEY", "LKY", "LHY", "LVY"), 1) if across else {}),
        },
        "LONGITUDINAL_COEFFICIENTS": {
            "PCX1": along.C, "PDX1": along.D, "PEX1": along.E, "PKX1": along.slope,
            "PHX1": -along.SH, "PVX1": -along.SV,
        },
    }  # fmt: skip
    if across is not None:
        sections["LATERAL_COEFFICIENTS"] = {
            "PCY1": across.C, "PDY1": across.D, "PEY1": across.E,
            "PKY1": -across.slope, "PKY2": 1, "PHY1": across.SH, "PVY1": -across.SV,
        }  # fmt: skip
    for name, entries in sections.items():
        lines += ["", f"[{name}]"]
        for key, value in entries.items():
            text = value if isinstance(value, str) else f"{value:.10g}"
            lines.append(f"{key:<24}= {text}")
    return "\n".join(lines) + "\n"
