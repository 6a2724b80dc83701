"""Charts of hysteresis: over speed, along the waves, and over the shortest wave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from iceslide_fem.postprocess.report.page import Chart, Curve, HeatMap
from iceslide_fem.preprocess.hysteresis.case import HysteresisCase
from iceslide_fem.preprocess.hysteresis.survey import Found, spectrum_columns
from iceslide_fem.runtime.units import celsius
from iceslide_fem.scene.materials import BAR

WAVE = "wave length (µm)"
MOST_CURVES = 8


def charts(case: HysteresisCase, found: Found) -> Mapping[str, Sequence[Chart | HeatMap]]:
    """Charts by the names of pictures."""
    return {
        "speed": [_over_speed(found)],
        "waves": _along_waves(found),
        "cut_off": [_over_cut_off(found)],
    }


def _over_speed(found: Found) -> Chart:
    """mu_h over speed for all temperatures and pressures."""
    _, T, p = found.conditions[1:].T
    pairs = sorted(set(zip(T.tolist(), p.tolist(), strict=True)))[:MOST_CURVES]
    curves = []
    for look, (kelvin, pressure) in enumerate(pairs):
        rows = 1 + np.flatnonzero((T == kelvin) & (p == pressure))
        name = f"{celsius(kelvin)}, {pressure / BAR:.3g} bar"
        curves.append(Curve(name, found.conditions[rows, 0], found.mu[rows], look, rows.size == 1))
    low, high = float(found.mu[1:].min()), float(found.mu[1:].max())
    said = f"From {low:.3g} to {high:.3g}. Film and dry shear are not in it."
    x, y = "sliding speed (m/s)", "mu_h (1)"
    return Chart("speed", "Hysteresis over speed", said, x, y, curves, logarithmic="x")


def _along_waves(found: Found) -> list[Chart | HeatMap]:
    """The spectrum, what is in contact, and what each wave gives, at the scene's condition."""
    of_waves = spectrum_columns(found)
    wave = 1e6 * of_waves["wave_m"]
    half = float(np.interp(0.5 * found.mu[0], of_waves["mu_hysteresis_to_q"], np.log(wave)))
    spectrum = [Curve("ice", wave, of_waves["C_m4"])]
    rms = 1e6 * found.law.ice.rms
    said = f"rms height {rms:.3g} µm, rms slope {found.law.ice.slope:.3g}"
    share = [Curve("fraction in contact", wave, of_waves["contact_fraction"])]
    part = [
        Curve("d mu_h / d ln q", wave, of_waves["dmu_dlnq"]),
        Curve("mu_h of all longer waves", wave, of_waves["mu_hysteresis_to_q"], 1),
    ]
    touching = f"{found.contact_fraction[0]:.3g} of the area touches on all waves"
    return [
        Chart("spectrum", "Power spectrum of the ice", said, WAVE, "C (m⁴)", spectrum,
              logarithmic="xy"),
        Chart("contact", "Contact on waves down to a length", touching, WAVE, "P (1)", share,
              logarithmic="xy"),
        Chart("friction", "Where hysteresis comes from",
              f"Half of it from waves longer than {np.exp(half):.3g} µm.", WAVE, "mu_h (1)", part,
              logarithmic="x"),
    ]  # fmt: skip


def _over_cut_off(found: Found) -> Chart:
    """mu_h over the shortest wave."""
    waves = [1e6 * one.shortest for one in found.cut_offs]
    mu = [one.mu for one in found.cut_offs]
    own = 1e6 * found.law.ice.shortest
    said = f"The scene's shortest wave is {own:.3g} µm. Nothing in the theory says where waves end."
    curves = [
        Curve("mu_h", waves, mu),
        Curve("the scene's", [own], [float(found.mu[0])], 1, True),
    ]
    title, x = "What the shortest wave does", "shortest wave (µm)"
    return Chart("cut-off", title, said, x, "mu_h (1)", curves, logarithmic="xy")
