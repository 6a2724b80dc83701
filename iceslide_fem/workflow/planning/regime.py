"""Friction regime of a scene with dry shear: dry contact, mixed, or viscous film.

The regime number is N = eta v / (h tau_b), the viscous shear stress of the film over the dry shear
strength (see `film.limiting_shear`).
"""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.conditions import exposure
from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.film.limiting_shear import SHEAR_STRENGTH
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.film.strength_over_speed import at_speed, speed_law
from iceslide_fem.runtime.units import ZERO_CELSIUS, readable
from iceslide_fem.scene import Scene
from iceslide_fem.workflow.planning.cost import point_rows
from iceslide_fem.workflow.planning.passes import Row


def aged_contact(scene: Scene) -> list[Row]:
    """k at the end of contact under the nominal pressure, and the creep compliance."""
    if (age := contact_age(scene)) is None:
        return []
    passes = scene.ice.motion == "sliding" and scene.film.carrier == "ice"
    time = exposure(scene) if passes else scene.load.duration
    at = np.array([time]), np.array([scene.ice.temperature])
    k = float(age.under_constant(np.array([scene.load.pressures.first]), *at).k[0])
    compliance = float(age.relaxation.compliance(*at)[0])
    modulus = readable(3.0 * scene.mooney_rivlin.shear_modulus, "Pa")
    return [
        Row("film", "k at the end", f"{k:.3g}", f"of contact that is {readable(time, 's')} old"),
        Row("film", "compliance at the end", f"{compliance:.3g}", f"E_0 J, E_0 = {modulus}"),
    ]


def relaxation_rows(scene: Scene) -> list[Row]:
    """Young's modulus at the end of the run and after infinite time; empty for elastic rubber."""
    relaxation = scene.rubber.relaxation
    if relaxation is None:
        return []
    modulus, temperature = scene.mooney_rivlin, scene.rubber_temperature
    fractions = (
        float(relaxation.modulus(scene.load.duration, temperature)),
        (relaxation.prony.long_term),
    )
    end, long_term = (
        readable(modulus.stiffer(fraction).youngs_modulus, "Pa") for fraction in fractions
    )
    shift = float(relaxation.shift(temperature))
    at = f"{temperature - ZERO_CELSIUS:.3g} °C: relaxation times are {shift:.3g} times those given"
    return [
        Row("rubber", "modulus at the end", end, f"E(t), of a strain held since t = 0 at {at}"),
        Row("rubber", "long-term modulus", long_term, "E after infinite time; above at t = 0"),
    ]


# A contact is dry above the first number N, and viscous below the second one.
DRY, VISCOUS = 10.0, 0.1


def regime(scene: Scene, strength: ShearStrength, speed: float) -> list[Row]:
    """tau_b on cold and on melting ice at a `speed` (m/s), and N at the start and at the end of a
    point.
    """
    undercooling = scene.ice.melting_temperature - scene.ice.temperature
    tau_b = at_speed(strength, speed_law(scene), np.array([speed]))
    cold, warm = (float(tau_b(np.array([depth]))[0]) for depth in (undercooling, 0.0))
    rows = point_rows(scene)
    first, last = rows[0], rows[-1]
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
