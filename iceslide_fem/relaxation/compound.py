"""A viscoelastic compound: Prony series, and its shift with temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.relaxation.shift import AnyShift, NoShift
from iceslide_fem.runtime.arrays import Array


@dataclass(frozen=True)
class Relaxation:
    """`prony` at the reference temperature of `shift`.

    measured: coldest and warmest measured temperature (K), None if they are not known.
    """

    prony: Prony
    shift: AnyShift = NoShift()
    measured: tuple[float, float] | None = None

    def reduced(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """t / a_T (s) of times (s) at temperatures (K), shapes that broadcast."""
        return np.asarray(np.asarray(time, dtype=float) / self.shift(temperature))

    def compliance(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """E_0 J at times (s) after a step of stress at a temperature (K)."""
        return self.prony.creep.compliance(self.reduced(time, temperature))

    def modulus(self, time: ArrayLike, temperature: ArrayLike) -> Array:
        """E / E_0 at times (s) after a step of strain at a temperature (K)."""
        return self.prony.modulus(self.reduced(time, temperature))
