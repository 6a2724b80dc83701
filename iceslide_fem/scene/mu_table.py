"""mu as a table over the ice's temperature and the slip speed, read from a file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iceslide_fem.runtime.tables.columns import Wanted, read_columns
from iceslide_fem.runtime.units import ZERO_CELSIUS

if TYPE_CHECKING:  # takes long to import, and only tables need it
    from scipy.interpolate import RegularGridInterpolator

COLUMNS = (
    Wanted("temperature", "K", ("T",)),
    Wanted("speed", "m/s", ("v", "speed_m_s")),
    Wanted("mu", ""),
)
LARGEST = 10.0  # mu


def read_table(path: Path) -> RegularGridInterpolator:
    """mu from a table with the columns temperature_C, speed_m_per_s and mu.

    The table has all combinations of temperatures and speeds. Raises SceneError.
    """
    from scipy.interpolate import RegularGridInterpolator

    table, found = read_columns(path, "friction.table", COLUMNS, [each.name for each in COLUMNS])
    values = np.column_stack([found[column.name] for column in COLUMNS])
    allowed = np.isfinite(values)
    allowed[:, 2] &= (values[:, 2] >= 0.0) & (values[:, 2] <= LARGEST)
    if not allowed.all():
        row, i = np.argwhere(~allowed)[0]
        table.refuse(
            f"row {row + 1} (line {table.lines[row].number}): {COLUMNS[i].heading} = "
            f"{values[row, i]:g}; needs finite numbers, and mu of 0 to {LARGEST:g}"
        )
    values[:, 0] -= ZERO_CELSIUS
    axes = [np.unique(values[:, i]) for i in (0, 1)]
    order = np.lexsort((values[:, 1], values[:, 0]))
    full = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    if not np.array_equal(values[order][:, :2], full):
        table.refuse("needs every combination of its temperatures and speeds once")
    # An axis with one value gets a second point, because interpolation needs two.
    mu = values[order][:, 2].reshape([axis.size for axis in axes])
    for i, axis in enumerate(axes):
        if axis.size == 1:
            axes[i], mu = np.array([axis[0], axis[0] + 1.0]), np.repeat(mu, 2, axis=i)
    return RegularGridInterpolator(axes, mu)
