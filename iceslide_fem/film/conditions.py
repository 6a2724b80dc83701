"""What a scene says of a point: its conditions, the rubber above it, how it is integrated."""

from __future__ import annotations

from typing import Any

import numpy as np

from iceslide_fem.film.integrators import INTEGRATORS
from iceslide_fem.film.point import Conditions
from iceslide_fem.film.rubber_heat import INSULATED, Insulated, RubberColumns
from iceslide_fem.scene import Scene

# Steps of a run whose integrator has no error estimate, unless numerics.max_step is given.
FIXED_STEPS = 2000


def simulation_settings(scene: Scene) -> dict[str, Any]:
    """Ice model, tolerance, integrator and steps of `scene`, as arguments of `point.simulate`."""
    numerics = scene.numerics
    if not INTEGRATORS[numerics.film_integrator].estimate:
        fixed, largest = numerics.max_step or scene.load.duration / FIXED_STEPS, np.inf
    else:
        fixed, largest = None, numerics.max_step or np.inf
    return {
        "ice": scene.ice.heat,
        "tolerance": numerics.tolerance,
        "integrator": numerics.film_integrator,
        "fixed_step": fixed,
        "max_step": largest,
    }


def rubber_columns(scene: Scene) -> RubberColumns | Insulated:
    """The rubber above the scene's contact points as heat sees it; as warm as the ice at first."""
    if not scene.rubber.heat:
        return INSULATED
    return RubberColumns(
        scene.ice.temperature,
        scene.load.duration,
        scene.rubber.density,
        scene.film.conductance,
    )


def scene_conditions(scene: Scene) -> Conditions:
    """The one condition of `scene`: its nominal pressure and what follows from it."""
    k, D, H_V, _ = scene.contact_parameters(scene.load.pressure)
    return Conditions.of(
        pressure=scene.load.pressure,
        speed=scene.load.speed,
        temperature=scene.ice.temperature,
        k=k,
        D=D,
        H_V=H_V,
        initial_height=scene.film.initial_height,
        duration=scene.load.duration,
    )
