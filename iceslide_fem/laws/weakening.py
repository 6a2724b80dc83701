"""Velocity-weakening friction: scenes whose motion does not exist or cannot be resolved.

Let the shear fall with the slip speed, tau' = d tau / d v < 0. A disturbance of wave number k on
elastic rubber without inertia then grows at the rate G k / |tau'|. Short waves grow fastest, so no
mesh and no step can resolve them. With inertia, shear waves carry energy away if |tau'| is below
sqrt(rho G); above that the result is the same (J. R. Rice, N. Lapusta, K. Ranjith, J. Mech. Phys.
Solids 49 (2001) 1865). Steady sliding at constant speed starts on its solution and stays there. A
changing speed disturbs it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from iceslide_fem.laws.user_law import UserLaw
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import readable
from iceslide_fem.scene import Scene

# Pressure at an edge of a sheared block over the mean pressure (docs/reference/laws.md).
EDGE = 8.0
SPEEDS = 60  # number of speeds at which the shear is evaluated
SLOWEST = 1e-3  # m/s, smallest of these above 0


def check_weakening(scene: Scene, law: UserLaw) -> None:
    """Raise SceneError if the `law` falls with the slip speed more than a block can follow."""
    if scene.model == "point" or scene.load.speeds.is_constant:
        return
    fall, where = _steepest_fall(scene, law)
    G, density = scene.mooney_rivlin.shear_modulus, scene.rubber.density
    most = sqrt(density * G) / EDGE if scene.rubber.inertia else 0.0
    if fall <= most:
        return
    allowed = readable(sqrt(density * G) / EDGE, "Pa*s/m")
    fate = "sticks and slips faster than any step" if most else "without inertia has no motion then"
    raise SceneError(
        f"the friction of {law.name} falls with the slip speed, by up to "
        f"{readable(fall, 'Pa*s/m')} at {readable(where, 'm/s')}, and load.speed changes: a block "
        f"{fate}; allowed: a constant load.speed, friction that does not fall, or rubber.inertia = "
        f"true and a fall of at most {allowed} (docs/reference/laws.md)"
    )


def _steepest_fall(scene: Scene, law: UserLaw) -> tuple[float, float]:
    """Largest -d tau / d v (Pa s/m) up to the highest speed of the scene, and the speed (m/s)."""
    fastest = max(scene.load.speeds.largest, 2.0 * SLOWEST)
    speeds = np.append(0.0, np.geomspace(SLOWEST, fastest, SPEEDS - 1))
    pressure = np.full(SPEEDS, scene.load.pressures.largest)
    fall, where = 0.0, 0.0
    for temperature in (scene.ice.temperature, scene.ice.melting_temperature):
        internal, warm = law.initial(1.0, SPEEDS)[2], np.full(SPEEDS, temperature)
        shear = law.shear(pressure, speeds, internal, warm)[0]
        falls = -np.diff(shear) / np.diff(speeds)
        if np.isfinite(falls).all() and falls.max() > max(fall, 1e-9 * pressure[0]):
            fall, where = float(falls.max()), float(speeds[1:][falls.argmax()])
    return fall, where
