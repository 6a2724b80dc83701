"""Module 3: dry, mixed and wet areas, friction by (4.7) to (4.9), the heat balance (3.4) to (3.8).

Numbers as the thesis has them: A in (4.7) to (4.9) is the area of the pixel's own class, d the
depth of heat penetration, which the source of the model tuned to its measurements.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.film.doubts import IN_DOUBT, LARGEST_FRICTION
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE, TABLE_1_RUBBER
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.scene.materials import WATER_CONDUCTIVITY

MIXED_FROM, WET_FROM = -2.0, 0.0  # degC


class State(IntEnum):
    """State of a pixel: dry below -2 degC, wet from 0 degC on, mixed between."""

    NO_CONTACT = 0
    DRY = 1
    MIXED = 2
    WET = 3


STATES = (State.DRY, State.MIXED, State.WET)


class Conductivities(NamedTuple):
    """Conductivity of each body, W/(m K). The thesis prints none for water: the project's."""

    ice: float = TABLE_1_ICE.conductivity
    tread: float = TABLE_1_RUBBER.conductivity
    water: float = WATER_CONDUCTIVITY

    def of_ice_and_water(self) -> dict[State, float]:
        """What conducts beside the tread, by state: ice; ice and water; water."""
        return {
            State.DRY: self.ice,
            State.MIXED: self.ice + self.water,
            State.WET: self.water,
        }


def classify(temperature: Array, contact: Mask) -> NDArray[np.uint8]:
    """`State` of every pixel by its temperature (degC).

    (4.8) prints the lower bound of the mixed range as 2 degC; it is -2 degC. 0 degC itself, left
    out by (4.8) and (4.9), is wet.
    """
    state = State.DRY + np.digitize(temperature, [MIXED_FROM, WET_FROM])
    return np.where(contact, state, State.NO_CONTACT).astype(np.uint8)


PRINTED = Conductivities()


class SlidingLine(NamedTuple):
    """What (3.4) needs of the tyre: mean pressure p_av (Pa), speed V (m/s) and slip ratio S."""

    mean_pressure: float
    speed: float
    slip: float

    @property
    def power(self) -> float:
        """p_av V S (W/m2): friction power over mu."""
        return self.mean_pressure * self.speed * self.slip


def friction_map(
    state: NDArray[np.uint8],
    rise: Array,
    depth: float,
    sliding: SlidingLine,
    conductivities: Conductivities = PRINTED,
    tread_rise: Array | None = None,
) -> Array:
    """mu = K / d A dT / (p_av V S A_tot) per pixel, (4.7) to (4.9); 0 outside of the contact.

    `rise` dT (K), `depth` d (m); K is the state's conductivity, A the area of all pixels in that
    state and A_tot that of the contact, so that A / A_tot is the state's share of the contact.
    The right sides are printed without brackets around their last four factors. `tread_rise` (K):
    that of the tread, if it was not as cold as the ice.
    """
    mu = np.zeros_like(rise)
    contact = np.count_nonzero(state)
    above = rise if tread_rise is None else tread_rise
    for each, conductivity in conductivities.of_ice_and_water().items():
        here = state == each
        share = np.count_nonzero(here) / contact
        heat = conductivity * rise[here] + conductivities.tread * above[here]
        mu[here] = share / depth * heat / sliding.power
    return mu


class HeatBalance(NamedTuple):
    """Heat flows of the whole contact in W, and the mean friction they balance, (3.4) to (3.8)."""

    ice: float
    tread: float
    water: float
    mu: float


def heat_balance(
    state: NDArray[np.uint8],
    rise: Array,
    depth: float,
    pixel_area: float,
    sliding: SlidingLine,
    conductivities: Conductivities = PRINTED,
    tread_rise: Array | None = None,
) -> HeatBalance:
    """Solve (3.8), q_generated = q_ice + q_tread + q_water, for the mean friction mu_av of (3.4).

    q = k / d A dT for ice (3.5) on dry and mixed areas, tread (3.6) on all, water (3.7) on mixed
    and wet ones, with A dT summed over the pixels. (3.8) itself is lost in print; this is how the
    text describes it and what (4.7) to (4.9) use. `tread_rise` (K) as for `friction_map`.
    """
    dry, mixed, wet = (float(rise[state == each].sum()) * pixel_area / depth for each in STATES)
    above = rise if tread_rise is None else tread_rise
    area = pixel_area * np.count_nonzero(state)
    ice = conductivities.ice * (dry + mixed)
    tread = conductivities.tread * float(above[state > 0].sum()) * pixel_area / depth
    water = conductivities.water * (mixed + wet)
    return HeatBalance(ice, tread, water, (ice + tread + water) / (sliding.power * area))


def doubts(friction: float, sliding: SlidingLine) -> list[str]:
    """A sentence, without its full stop, if the mean friction of (4.7) to (4.9) is none."""
    if friction <= LARGEST_FRICTION:
        return []
    return [
        f"mu by (4.7) to (4.9) is {friction:.4g}: {IN_DOUBT}. The heat through the depth d is "
        f"divided by p V S = {sliding.power:.3g} W/m2, and a slip that small makes next to none"
    ]
