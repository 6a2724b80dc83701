"""Friction regime of a scene with dry shear: dry contact, mixed, or viscous film.

The regime number is N = eta v / (h tau_b), the viscous shear stress of the film over the dry shear
strength (see `film.limiting_shear`).
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.limiting_shear import SHEAR_STRENGTH
from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene import Scene
from iceslide_fem.scene.shear_strength import ShearStrength
from iceslide_fem.workflow.planning.cost import point_rows
from iceslide_fem.workflow.planning.row import Row

# A contact is dry above the first number N, and viscous below the second one.
DRY, VISCOUS = 10.0, 0.1


def regime(scene: Scene, strength: ShearStrength) -> list[Row]:
    """tau_b on cold and on melting ice, and N at the start and at the end of a point."""
    undercooling = scene.ice.melting_temperature - scene.ice.temperature
    cold, warm = (float(strength(np.array([depth]))[0]) for depth in (undercooling, 0.0))
    rows = point_rows(scene)
    first, last = rows[0], rows[-1]
    speed = scene.load.speeds.first or scene.load.speeds.mean
    numbers = [
        _number(scene.viscosity * v, row.film_height_m, getattr(row, SHEAR_STRENGTH))
        for v, row in ((speed, first), (last.speed_m_per_s, last))
    ]
    onset = next((row.time_s for row in rows if row.melted_fraction > 0.0), None)
    melts = "never" if onset is None else readable(onset, "s")
    return [
        Row("dry", "stress on cold ice", readable(cold, "Pa"), "τ_b at the ice's temperature"),
        Row("dry", "stress on melting ice", readable(warm, "Pa"), "τ_b at the melting point"),
        Row("dry", "regime at t = 0", _named(numbers[0]), "N = η v / (h τ_b), dry over viscous"),
        Row("dry", "regime at the end", _named(numbers[1]), "of a point at the nominal pressure"),
        Row("dry", "melts after", melts, "of a point at the nominal pressure"),
        Row(
            "dry",
            "surface at the end",
            f"{last.surface_temperature_C:.3g} degC",
            f"it began at {scene.ice.temperature - ZERO_CELSIUS:.3g} degC",
        ),
    ]


def _number(drag: float, height: float, strength: float) -> float:
    """N of eta v (Pa m), h (m) and tau_b (Pa); infinite without a film."""
    return drag / (height * strength) if height * strength > 0.0 else np.inf


def _named(number: float) -> str:
    name = "dry" if number > DRY else "viscous" if number < VISCOUS else "limited"
    return f"{name}, N = {number:.2g}" if np.isfinite(number) else f"{name}, no film"
