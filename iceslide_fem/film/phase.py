"""Which water freezes in a stage, and what feeds the flux of the ice below it.

Where there is liquid water the ice's surface is at the melting point T_m. Four modes
(`film.refreeze`):

    "nothing"   the heat that friction does not give is given by nobody; water stays liquid
    "film"      the film freezes until it is gone
    "all"       the film freezes first, then the squeezed-out water: one balance of all the flux
    "area"      each water has a balance of its own, by its part of the area

By area, with the part of the ice's flux that films feed

    a_c = 1 - (1 - k) min(1, W / H_V(p_c))                                 (1)

because the ice below full voids is wet, and that below empty ones is not:

    film    rho L m_h = q_a - a_c q_ice - q_r                              (2)
    voids   rho L m_W = q_w - (1 - a_c) q_ice                              (3)

q_a: friction heat of the asperities; q_r: heat into the rubber; q_w: heat of the sheared water in
the voids. When the film is gone the water in the voids feeds the rest.

Where rubber has left the ice nothing slides. The water feeds all of the flux there, and then the
film, unless shear is viscous. Water on ice that no rubber has met is the scene's, and stays.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from iceslide_fem.film.law import Surface
from iceslide_fem.runtime.arrays import Array, Mask

Refreeze = Literal["nothing", "film", "all", "area"]


class Phase(NamedTuple):
    """Freezing in a stage; scalars or arrays (n,).

    stored: water that freezes when the film is gone, m; share: a_c of (1); films: where films
    freeze.
    """

    stored: Array | float = 0.0
    share: Array | float = 1.0
    films: Mask | bool = True

    def of_film(self, ice: Surface) -> Array:
        """Flux (W/m2) that films at T_m feed, a_c q_ice + q_r."""
        if isinstance(self.share, float) and self.share == 1.0:
            return ice.melted_flux
        return np.asarray(self.share * (ice.melted_flux - ice.into_rubber) + ice.into_rubber)

    def of_voids(self, ice: Surface) -> Array:
        """Flux (W/m2) that water in the voids feeds at T_m, (1 - a_c) q_ice."""
        return np.asarray((1.0 - self.share) * (ice.melted_flux - ice.into_rubber))
