"""Keys of dry rubber on ice: its shear strength over the ice's surface temperature.

A number tau_0 gives tau_0 min(1, (T_m + delta - T) / Delta); otherwise it is a table.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from iceslide_fem.runtime.units import readable
from iceslide_fem.scene.rows import Rows, RowsOf, check_falls
from iceslide_fem.scene.units import Quantity

DRY_STRESS = RowsOf(
    "ice temperature",
    Quantity("K", "-80 degC", "0.01 degC"),
    Quantity("Pa", "1 Pa", "1 GPa"),
    "0 Pa",
)
SOFTENING = Quantity("K", "0.01 K", "200 K")
RESIDUAL = Quantity("K", "0 K", "200 K")
USUAL_RESIDUAL = 0.5  # K
THINNEST = 1e-9  # m, initial height of water films


class DryShear(NamedTuple):
    """Input data of dry rubber on ice: keys of a scene's film, or options of a command.

    stress: tau_b (Pa), a number or rows [T (K), tau_b], None without a limit of the film's shear;
    softening, residual: fall of a number with temperature, K.
    """

    stress: float | Rows | None = None
    softening: float | None = None
    residual: float = USUAL_RESIDUAL

    @property
    def softens(self) -> bool:
        """Whether the stress depends on temperature."""
        if isinstance(self.stress, tuple):
            return self.stress[-1][1] < self.stress[0][1]
        return self.softening is not None and self.residual < self.softening

    def check(self, thinnest: float, named: Callable[[str], str]) -> None:
        """Raise ValueError if these contradict each other or the initial film.

        thinnest: its least height, m; named: function from keys to names that a user types.
        """
        rows, stress = isinstance(self.stress, tuple), named("dry_stress")
        given = self.softening is not None, self.residual != USUAL_RESIDUAL
        for key, is_given in zip(("dry_softening", "dry_residual"), given, strict=True):
            if is_given and (rows or self.stress is None):
                reason = f"rows of {stress}" if rows else f"no {stress}"
                raise ValueError(
                    f"{named(key)} and {reason} contradict each other: it says how a number of "
                    f"dry_stress falls; allowed: {stress} as a number"
                )
        if isinstance(self.stress, tuple):
            check_falls(self.stress, stress, "ice gets softer as it gets warmer; allowed: stresses")
            if self.stress[0][1] == 0.0:
                raise ValueError(
                    f"{stress} is 0 in all rows; allowed: more than 0 where ice is coldest"
                )
        if thinnest < THINNEST and self.stress is None:
            raise ValueError(
                f"{named('initial_height')} = {readable(thinnest, 'm')} is out of range; allowed: "
                f"1 nm to 10 um, or from 0 on with {stress}, which limits the shear of thin films"
            )
