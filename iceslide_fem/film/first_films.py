"""Films before they are sheared: the height variable and internal variables (`loads`)."""

from __future__ import annotations

import numpy as np

from iceslide_fem.film.limiting_shear import LimitingShear
from iceslide_fem.film.viscosity import VariableViscosity
from iceslide_fem.runtime.arrays import Array


def films_of(
    height: Array,
    temperature: Array,
    undercooling: Array,
    speed: Array,
    water: VariableViscosity | None,
    limit: LimitingShear | None,
    lug: float | None = None,
) -> tuple[Array, Array]:
    """ln h, or ln(h + s), and internal variables of films of the `height` (m), (n,).

    temperature: of the film, K; undercooling: of the ice below T_m, K; speed: of slip, m/s; lug: B
    with voids that carry, m.
    """
    log_viscosity = np.zeros_like(height) if water is None else water(temperature)
    rows: list[Array] = []
    if limit is not None:
        here = limit if water is None else limit.at_viscosity(np.exp(log_viscosity))
        rows = list(here.internal(height, speed, limit.at_slip(speed)(undercooling)))
        rows[0] = rows[0] + log_viscosity
    elif water is not None or lug is not None:
        rows = [log_viscosity]
    if water is not None:
        rows.append(log_viscosity)
    if lug is not None:
        rows += [np.zeros_like(height), np.full_like(height, lug)]
    log_height = np.log(height) if limit is None else limit.log_height(height)
    return log_height, np.array(rows).reshape(len(rows), height.size)
