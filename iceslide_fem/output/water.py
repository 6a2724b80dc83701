"""Columns of the water in load-bearing voids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from iceslide_fem.film.integrators import InterfaceState, Step
from iceslide_fem.laws.protocol import InterfaceLaw
from iceslide_fem.runtime.arrays import Array

if TYPE_CHECKING:  # a point needs no DOLFINx
    from iceslide_fem.coupling.ledger import Ledger
    from iceslide_fem.coupling.sliding import Sliding

MEANS = "water_height_m", "water_borne_fraction"
AMOUNTS = "water_brought_m3", "water_in_sipes_m3", "water_pushed_out_m3"


def water_names(law: InterfaceLaw) -> tuple[str, ...]:
    """Names of the columns; empty if voids do not bear load."""
    return (*MEANS, *AMOUNTS) if law.wet is not None else ()


def water_columns(sliding: Sliding, ledger: Ledger, water: Array) -> dict[str, float]:
    """Columns of a block at the present time; `water`: height (m) at its points. Collective.

    They are the mean water height in contact (m), the fraction of the normal force that water
    bears, and amounts of the ledger (m3).
    """
    block, loads = sliding.block, sliding.current.loads
    law = block.law
    if law.wet is None:
        return {}
    touching = loads.touching
    solid = law.contact_pressure(loads.pressure, water, sliding.current.interface.age)
    borne = loads.pressure - solid
    area, force, height, carried = (
        block.total(values, touching)
        for values in (np.ones_like(water), loads.pressure, water, borne)
    )
    means = height / max(area, 1e-300), carried / max(force, 1e-300)
    amounts = ledger.brought_water, ledger.sipe_water(), ledger.pushed_out_water
    return dict(zip(water_names(law), (*means, *amounts), strict=True))


class PointWater:
    """The same for a point that represents a block of this `area` (m2), step by step.

    All outflow is pushed out, because a point has no sipes, and what lags behind the ice where it
    enters.
    """

    def __init__(self, law: InterfaceLaw, area: float) -> None:
        self._law, self._area = law, area
        self._brought = self.pushed_out = 0.0

    def columns(
        self, state: InterfaceState, pressure: float, step: Step | None
    ) -> dict[str, float]:
        """The columns in a `state` under `pressure` (Pa); step: the last one, None at t = 0."""
        law = self._law
        if law.wet is None:
            return {}
        water = float(law.water_height(state)[0])
        if step is None:  # the voids take in a layer as deep as that on the ice
            self._brought = self._area * water
            self.pushed_out = self._brought - self._area * float(state.squeezed_height[0])
        else:
            self.pushed_out += self._area * float(step.flowed_out[0])
        solid = law.contact_pressure(np.array([pressure]), state.squeezed_height, state.age)
        means = water, 1.0 - float(solid[0]) / pressure
        amounts = self._brought, 0.0, self.pushed_out
        return dict(zip(water_names(law), (*means, *amounts), strict=True))
