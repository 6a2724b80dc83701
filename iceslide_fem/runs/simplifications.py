"""A-priori estimates of the errors of simplified model levels.

Each simplification of the model hierarchy has a dimensionless number, and an estimate of the
relative change of mu(t). For uneven pressure the film law gives the estimate: the point model is
evaluated at the pressures of the expected profile. Estimates are upper bounds or first-order terms;
tests compare them with runs of the levels.
"""

from __future__ import annotations

from functools import lru_cache
from math import pi, sqrt, tanh
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.conditions import conditions_at
from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.film.integrators import InterfaceState
from iceslide_fem.film.point import Span, Steps, ice_below, integrate, simulate
from iceslide_fem.film.point_conditions import RANGES, Loading
from iceslide_fem.film.rubber_heat import INSULATED
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.laws.points import LawDrive
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.laws.table import law_of
from iceslide_fem.runs.point_pass import LONGEST_STEP
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.curve import Curve
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene import Scene
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import Ground

TIMES = 200  # number of times at which mu(t) is compared
PLACES = 12  # Gauss points along the block
ACCURACY = 1e-2  # tolerance of the evaluated point model; estimates have two digits
NO_FRICTION = 1e-6  # friction coefficient that counts as 0
LIFTED = 1e-3  # fraction of the nominal pressure at a lifted edge


class Simplification(NamedTuple):
    """A simplification, its dimensionless number, and its relative change of mu(t)."""

    name: str
    number: float
    formula: str
    effect: float


class Simplifications(NamedTuple):
    """All simplifications; every level makes the last one."""

    closed_form: Simplification
    compression: Simplification
    confinement: Simplification
    bending: Simplification
    plane_strain: Simplification
    sideways: Simplification
    inertia: Simplification

    @property
    def uniform_pressure(self) -> float:
        """Relative change of mu(t) by uneven pressure, which a point neglects."""
        return self.compression.effect + self.confinement.effect + self.bending.effect


def made(scene: Scene) -> list[Simplification]:
    """The simplifications that the scene's model makes; raises as `simplifications`."""
    point, block = scene.model == "point", scene.model == "block"
    makes = [
        scene.ice.heat == "half-space",
        point,
        point,
        point,
        not block and not point,
        scene.ice.heat not in ("continuum", "mesh"),
        not scene.rubber.inertia,
    ]
    return [one for one, this in zip(simplifications(scene), makes, strict=True) if this]


def model_doubts(scene: Scene) -> list[str]:
    """Warning, without full stop, of simplifications that change mu by more than the tolerance."""
    try:
        large = [one for one in made(scene) if one.effect > scene.numerics.tolerance]
    except IceslideError:  # a law that fails in these estimates has its own message in the run
        return []
    if not large:
        return []
    listed = ", ".join(f"{one.name} (up to {100.0 * one.effect:.2g} %)" for one in large)
    return [
        f"the model simplifies what may move mu by more than the tolerance: {listed}, as estimated "
        "before the run. A finer model does not: iceslide ladder measures it"
    ]


@lru_cache(maxsize=16)
def simplifications(scene: Scene) -> Simplifications:
    """Estimates for `scene`, for any model. Takes some tenths of a second, once.

    Loads that change in time are replaced by their means. Raises SimulationStopped if the law fails
    in a step, SceneError if it is invalid.
    """
    rubber, load, constants = scene.rubber, scene.load, scene.mooney_rivlin
    L, W, H, v = rubber.length, rubber.width, rubber.height, load.speeds.mean
    nu, K, G = constants.poissons_ratio, constants.bulk_modulus, constants.shear_modulus
    sliding = scene.ice.motion == "sliding"
    heated = min(load.duration, L / v) if sliding else load.duration
    times = np.linspace(0.0, heated, TIMES)

    places, weights = np.polynomial.legendre.leggauss(PLACES)
    weights = 0.5 * weights
    # Confined rubber has a higher pressure in the middle: p'' = -const below a bonded layer that
    # slips on ice, limited by its compressibility.
    limit = sqrt(3.0 * G / K) * L / (2.0 * H)
    squeezed = (
        (L / (4.0 * H)) ** 2 * max(nu, 0.0) / (1.0 - nu) * 3.0 * (limit - tanh(limit)) / limit**3
    )
    parabola = squeezed / (1.0 + squeezed) * (1.5 * (1.0 - places**2) - 1.0)
    together = _friction(scene, np.concatenate([[1.0], 1.0 + parabola]), heated, times)
    alone, confined = together[:, 0], together[:, 1:]

    mu = alone / load.pressures.mean
    closed = alone if sliding else _friction(scene, np.ones(1), heated, times, "half-space")[:, 0]
    closed_form = _largest(closed, alone)

    strain = load.pressures.largest / constants.youngs_modulus

    # A parallel plate takes half of the moment tau H, the pressure on the ice takes the rest.
    tilt = 3.0 * float(mu.max()) * H / L
    bent = 1.0 + tilt * places
    lifted, bent = bent <= LIFTED, np.maximum(bent, LIFTED)
    bending = _friction(scene, bent / (weights @ bent), heated, times)
    bending[:, lifted] = 0.0

    confinement_effect = _largest(confined @ weights, alone)
    bending_effect = _largest(bending @ weights, alone)
    uneven = strain + confinement_effect + bending_effect
    # Lateral heat loss at the edges of a warm patch, over the heat downwards.
    fraction = sqrt(pi * scene.ice.solid.diffusivity * heated) * (1.0 / L + 1.0 / W)
    exchanged = 1.0
    if not sliding and scene.ice.margin == 0.0:  # insulated sides: no lateral loss
        exchanged = float(np.max(np.std(bending / alone[:, None], axis=1))) + strain
    slope = float(np.max(np.abs(np.gradient(np.log(mu), times))))
    # First order: the kink of mu(t) at melt onset makes the block oscillate.
    inertia = 2.0 * H * sqrt(rubber.density / G) * slope / pi
    return Simplifications(
        Simplification("closed-form flux", closed_form, "point with it against point", closed_form),
        Simplification("compression", strain, "p / E", strain),
        Simplification("confinement", squeezed, "(L / 4H)² ν / (1 - ν)", confinement_effect),
        Simplification("bending", tilt, "3 μ H / L", bending_effect),
        Simplification("plane strain", H / W, "H / W", min(1.0, H / W) * uneven),
        Simplification(
            "columns of ice", fraction, "√(π α t) (1/L + 1/W)", fraction * min(1.0, exchanged)
        ),
        Simplification("quasi-static rubber", inertia, "2 H √(ρ/G) max|d ln μ/dt| / π", inertia),
    )


def _friction(
    scene: Scene, fractions: Array, duration: float, times: Array, ice: str | Ground | None = None
) -> Array:
    """Friction stress (Pa) at `times` (s) below `fractions` of the nominal pressure: (times, n).

    `ice` as of `simulate`, by default columns on the scene's ground.
    """
    ice = scene.ice.ground if ice is None else ice
    nominal = scene.load.pressures.mean
    pressure = fractions * nominal
    law = law_of(scene)
    if not law.has_film or law.wet is not None:
        return _friction_without_film(scene, law, pressure, duration, times, ice)
    acting = pressure if scene.film.pressure == "local" else np.full_like(fractions, nominal)
    acting = np.clip(acting, *RANGES["pressure"][:2])  # at a nearly lifted edge
    age = contact_age(scene)
    conditions = conditions_at(scene, acting, scene.load.speeds.mean, duration)
    found = simulate(
        conditions,
        ice,
        ACCURACY,
        times=times,
        loading=None if age is None else Loading(None, None, scene.contact_parameters, age),
        water=scene.water.table,
    )
    return np.asarray(found.samples * acting)


def _friction_without_film(
    scene: Scene,
    law: InterfaceLaw,
    pressure: Array,
    duration: float,
    times: Array,
    ice: str | Ground,
) -> Array:
    """The same under a law without a film, at least with the coefficient `NO_FRICTION`."""
    n, cold = pressure.size, np.full(pressure.size, scene.ice.temperature)
    one, speed = (Course(Curve.of(value), duration) for value in (1.0, scene.load.speeds.mean))
    drive = LawDrive(law, one, speed, pressure)
    below = ice_below(ice, scene.ice.temperature, duration, scene.ice.solid)
    log_height, water, internal = law.initial(scene.initial_height, n)
    heats = below.initial(n), INSULATED.initial(n)
    start = InterfaceState(log_height, water, *heats, internal, law.untouched(n))
    T_m = np.full(n, scene.ice.melting_temperature)
    span = Span(np.full(n, duration), cold, T_m, scene.ice.solid)
    steps = Steps(ACCURACY, INTEGRATORS["sdirk2"], longest=LONGEST_STEP * duration)
    found = integrate(drive, start, span, below, INSULATED, steps, times)
    return np.asarray(np.maximum(found.samples, NO_FRICTION) * pressure)


def _largest(mu: Array, exact: Array) -> float:
    return float(np.max(np.abs(mu / exact - 1.0)))
