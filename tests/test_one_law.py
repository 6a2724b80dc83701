"""Components of the film law together, against a reference of their own.

The reference is implicit Euler in short steps: heat by convolution of half-spaces, every unknown by
bracketing. Nothing of the program is in it but the table of k, D and H_V.
"""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import brentq

from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.contact_table import read_contact_table

pytestmark = pytest.mark.quick

FILE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
TABLE = read_contact_table(FILE, "the surface")
P, V, B, T_0, T_M, TIME = 2e5, 4.0, 20e-3, 263.15, 273.15, 4e-3
ICE, RUBBER, LATENT, G = (2.25, 916.0, 2220.0), (0.3, 1100.0, 1800.0), 330e3 * 916.0, 1e7
STRESS, SOFTENING, RESIDUAL, FIRST, WATER = 0.4e6, 13.5, 0.5, 70e-9, 10e-6
ETA = [[253.15, 4e-3], [263.15, 2.6e-3], [273.15, 1.8e-3]]
ARMS = ((0.3, 1e-4), (0.3, 1e-2))  # of the instantaneous modulus
C10, C01 = 0.1662e6, 0.1068e6
COMPONENTS = {
    "wet": {"ice.water": WATER},
    "dry": {
        "film.dry_stress": STRESS, "film.dry_softening": SOFTENING, "film.initial_height": 0.0,
    },
    "age": {"rubber.prony": ARMS, "rubber.modulus_is": "instantaneous", "film.contact_age": True},
    "heat": {
        "rubber.heat": True, "film.conductance": G, "rubber.conductivity": RUBBER[0],
        "rubber.density": RUBBER[1], "rubber.heat_capacity": RUBBER[2],
    },
    "viscosity": {"water.viscosity": ETA},
}  # fmt: skip


def scene(names, **changes):
    tables = {
        "name": "one", "model": "point",
        "rubber": {"C10": C10, "C01": C01, "nu": 0.49, "length": B, "width": B, "height": 10e-3},
        "load": {"pressure": P, "speed": V, "duration": TIME}, "ice": {"temperature": T_0},
        "film": {"contact": str(FILE), "voids": "carry"}, "water": {},
        "numerics": {"tolerance": 1e-3},
    }  # fmt: skip
    for key, value in itertools.chain(*(COMPONENTS[name].items() for name in names)):
        table, name = key.split(".")
        tables[table][name] = value
    for table, values in changes.items():
        tables[table] |= values
    return scene_from_dict(tables)


def softness(time):
    """E_0 J of `ARMS`, by quadrature of J's own integral equation: E * dJ = 1."""
    t = np.concatenate([[0.0], np.geomspace(1e-7, time, 400)]) if time > 0.0 else np.zeros(1)
    creep = np.ones(t.size)

    def relaxed(s):
        return 1.0 - sum(g * (1.0 - np.exp(-s / tau)) for g, tau in ARMS)

    for n in range(1, t.size):
        middle = 0.5 * (t[1 : n + 1] + t[:n])
        weight = relaxed(t[n] - middle)
        known = relaxed(t[n]) + weight[:-1] @ np.diff(creep[:n])
        creep[n] = creep[n - 1] + (1.0 - known) / weight[-1]
    return creep[-1]


class Body:
    """A half-space under a flux that is constant in each step."""

    def __init__(self, material):
        self._effusivity, self._ends, self._fluxes = np.sqrt(np.prod(material)), [0.0], []

    def begins(self, end):
        """Temperature rise at `end` by earlier fluxes, and that per flux of the new step."""
        since = np.sqrt(end - np.array(self._ends))
        steps = 2.0 / (np.sqrt(np.pi) * self._effusivity)
        known = steps * float(np.array(self._fluxes) @ (since[:-1] - since[1:]))
        return known, steps * since[-1]

    def ends(self, end, flux):
        self._ends.append(end)
        self._fluxes.append(flux)


def reference(names, steps=700):
    """Times, mu, and h, W (m) at the end."""
    wet, dry, heat = "wet" in names, "dry" in names, "heat" in names
    h, W, mu = 0.0 if dry else FIRST, WATER if wet else 0.0, []
    ice, rubber, drag = Body(ICE), Body(RUBBER), 0.0 if not heat else 1.0 / G
    times = np.append(0.0, np.geomspace(1e-9, TIME, steps))
    kelvin, eta_at = np.array(ETA).T
    age = np.geomspace(1e-8, TIME, 60)
    softer = np.array([softness(t) for t in age]) if "age" in names else np.ones(60)

    def viscosity(T):
        return float(np.interp(T, kelvin, eta_at)) if "viscosity" in names else 1.8e-3

    def strength(T):
        return STRESS * min(1.0, (T_M + RESIDUAL - T) / SOFTENING) if dry else np.inf

    for start, end in itertools.pairwise(times):
        dt, soft = end - start, float(np.interp(np.log(end), np.log(age), softer))
        (known, R), (above, R_r) = ice.begins(end), rubber.begins(end)

        def fluxes(T, known=known, R=R, above=above, R_r=R_r):
            into_rubber = (T - T_0 - above) / (R_r + drag) if heat else 0.0
            return (T - T_0 - known) / (R + drag), into_rubber

        def contact(water, soft=soft):
            solid = P
            if water > 0.0 and float(TABLE(P * soft).H_V) < water:

                def over(log):
                    at = np.exp(log)
                    edge = TABLE.pressure[0]
                    if at < edge:  # H_V continues on a straight line, k falls with the pressure
                        x, y = np.log(TABLE.pressure[:2]), np.log(TABLE.H_V.values[:2])
                        held = y[0] + (y[1] - y[0]) / (x[1] - x[0]) * (log - x[0])
                    else:
                        held = np.log(float(TABLE(at).H_V))
                    return held - np.log(water)

                solid = np.exp(brentq(over, -40.0, np.log(P * soft), xtol=1e-13)) / soft
            k, D, H_V, _ = (float(one) for one in TABLE(solid * soft))
            k *= min(1.0, solid * soft / TABLE.pressure[0])
            filled = 1.0 if solid < P else min(1.0, water / H_V)
            return solid, max(k, 1e-12), D, filled

        def at(T, water, phase, h=h, W=W, dt=dt):
            """Film and water of a stage at T, and what is missing of each."""
            eta, tau_b = viscosity(T), strength(T)
            solid, k, D, filled = contact(water)
            q_i, q_r = fluxes(T)
            borne = P - solid
            thick = borne / P * eta * V / water if borne > 0.0 else 0.0
            share = 1.0 - (1.0 - k) * filled if phase else 1.0
            K3 = 8.0 * solid / (3.0 * eta * D**2)

            def shear(height):
                return k / (1.0 / tau_b + height / (eta * V))

            own = 0.0 if phase else thick * V

            def film(height):
                melts = shear(height) * V + own - share * q_i - q_r if T == T_M else 0.0
                if not phase:
                    melts = max(melts, 0.0)
                return height - h - dt * (melts / LATENT - K3 * height**3)

            low = 0.0 if dry else 1e-13
            if film(low) >= 0.0:
                height, missing = low, LATENT * film(low) / dt
            else:
                height, missing = brentq(film, low, max(3.0 * h, 1e-6), xtol=1e-18), 0.0
            if not phase:
                missing = 0.0
            tau = shear(height) + thick
            gained = K3 * height**3
            if phase:
                gained += (thick * V - (1.0 - share) * q_i - missing) / LATENT
            left = water - W - dt * (gained - borne * water**3 / (eta * B**2))
            return height, left, tau, tau * V - q_i - q_r

        def stage(T, phase, W=W):
            """The stage whose water is that which is left."""
            if not phase and at(T, W, phase)[1] == 0.0:
                water = W
            else:
                water = brentq(lambda w: at(T, w, phase)[1], 1e-16, 10.0 * WATER, xtol=1e-17)
            return water, at(T, water, phase)

        T = T_M
        if wet:
            water, found = stage(T, True)
        else:
            water, found = stage(T, False)
            if found[3] < 0.0:  # friction does not melt the ice
                T = brentq(lambda T: stage(T, False)[1][3], T_0 - 1.0, T_M - 1e-12, xtol=1e-11)
                water, found = stage(T, False)
        h, W = found[0], water
        mu.append(found[2] / P)
        q_i, q_r = fluxes(T)
        ice.ends(end, q_i)
        rubber.ends(end, q_r)
    return times[1:], np.array(mu), h, W


PAIRS = [(one,) for one in COMPONENTS] + list(itertools.combinations(COMPONENTS, 2))


def extrapolated(names):
    """The reference without the error of its steps, which is of first order."""
    (times, *fine), (before, *coarse) = reference(names, 700), reference(names, 350)
    coarse[0] = np.interp(times, before, coarse[0])
    mu, height, water = (2.0 * one - other for one, other in zip(fine, coarse, strict=True))
    return times, mu, height, water


@pytest.mark.parametrize("names", [*PAIRS, tuple(COMPONENTS)], ids="+".join)
def test_components_together_are_the_reference(names):
    """Cold rubber freezes films of wet ice to a molecule in 10 us, if no strength limits mu."""
    rows, found = point_history(scene(names))
    times, mu, height, water = extrapolated(names)
    here = np.interp(times, [row.time_s for row in rows], [row.mu for row in rows])
    freezes = {"wet", "heat"} <= {*names} and "dry" not in names
    late = times > (1e-4 if freezes else 2e-5)
    off = np.abs(here[late] / mu[late] - 1.0)
    assert off.mean() < 4e-3 and off.max() < 5e-2  # at the kink where ice begins to melt
    mean = float(trapezoid(mu, times) + mu[0] * times[0]) / TIME
    assert found["mu_mean"] == pytest.approx(mean, rel=2e-2 if freezes else 5e-3)
    assert rows[-1].squeezed_height_m == pytest.approx(water, rel=5e-3)
    assert rows[-1].film_height_m == pytest.approx(height, rel=5e-3, abs=2e-10)
