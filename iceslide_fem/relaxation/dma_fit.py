"""From a DMA table to a viscoelastic compound: shifts, shift law, Prony series, and errors."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.relaxation.compound import Relaxation
from iceslide_fem.relaxation.dma import Dma, read_dma
from iceslide_fem.relaxation.master_curve import law, shifts
from iceslide_fem.relaxation.prony_fit import fit
from iceslide_fem.relaxation.shift import NoShift, Shift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS

ROOM = 293.15  # K; the nearest isotherm is the default reference
WORST = 0.5  # largest accepted root mean square error of ln E' or ln tan delta
# Ranges of C1 and C2 (K) in a scene.
LARGEST_C1, SMALLEST_C2, LARGEST_C2 = 1e3, 0.1, 1e4


class Misfit(NamedTuple):
    """Errors of a series relative to the measurement, as logarithms.

    storage, tan_delta: root mean squares; largest: largest error, of `quantity` in `row`.
    """

    storage: float
    tan_delta: float
    largest: float
    quantity: str
    row: int


@dataclass(frozen=True)
class Characterised:
    """A compound from its DMA.

    instantaneous: modulus, Pa; factors: a_T of each isotherm before the fit of the law, without
    their mean distance to it, None if the law was given; flows: whether the data alone give no
    long-term modulus.
    """

    dma: Dma
    relaxation: Relaxation
    instantaneous: float
    factors: Array | None
    flows: bool

    @property
    def reduced(self) -> Array:
        """Reduced frequencies, times a_T (rad/s), of every row."""
        return self.dma.frequency * self.relaxation.shift(self.dma.temperature)

    @property
    def misfit(self) -> Misfit:
        """Errors of the series with the shift law, as a scene uses them."""
        found = self.instantaneous * self.relaxation.prony.dynamic(self.reduced)
        storage = np.log(found.real / self.dma.storage)
        tan_delta = np.log(found.imag / found.real / self.dma.tan_delta)
        rows = int(np.abs(storage).argmax()), int(np.abs(tan_delta).argmax())
        first = abs(storage[rows[0]]) >= abs(tan_delta[rows[1]])
        return Misfit(
            float(np.sqrt(np.mean(storage**2))),
            float(np.sqrt(np.mean(tan_delta**2))),
            float(storage[rows[0]] if first else tan_delta[rows[1]]),
            f"{self.dma.of}'" if first else "tan delta",
            rows[0] if first else rows[1],
        )


def characterised(
    dma: Dma,
    said: str,
    shift: Shift | None = None,
    reference: float | None = None,
    arrhenius_below: float | None = None,
) -> Characterised:
    """The compound that was measured.

    shift: given, else fitted if there are several temperatures; reference: K, by default that of
    `shift`, else the isotherm nearest to 20 degC; arrhenius_below: K; said: name of the table in
    messages. Raises SceneError.
    """
    isotherms = dma.isotherms
    if len(isotherms) == 1 and shift is None:
        return _with(dma, NoShift(), None, said)
    if shift is not None:
        moved = shift if reference is None else shift.moved(reference)
        return _with(dma, _allowed(moved, isotherms, said), None, said)
    near = float(isotherms[np.abs(isotherms - ROOM).argmin()])
    reference = near if reference is None else reference
    if arrhenius_below is not None and reference < arrhenius_below:
        raise SceneError(
            f"{said}: the reference, {reference - ZERO_CELSIUS:.4g} degC, is colder than the "
            f"{arrhenius_below - ZERO_CELSIUS:.4g} degC below which times follow an activation "
            "energy; allowed: a warmer reference"
        )
    logs = shifts(dma, said)
    found = _allowed(law(isotherms, logs, reference, arrhenius_below, said), isotherms, said)
    offset = np.mean(logs - np.log(found(isotherms)))
    return _with(dma, found, np.exp(logs - offset), said)


def _with(dma: Dma, shift: Shift | NoShift, factors: Array | None, said: str) -> Characterised:
    """The series with a shift; raises SceneError if no series fits."""
    prony, instantaneous, flows = fit(dma.frequency * shift(dma.temperature), dma.storage, dma.loss)
    found = Characterised(dma, Relaxation(prony, shift), instantaneous, factors, flows)
    off = max(found.misfit.storage, found.misfit.tan_delta)
    if off > WORST:
        raise SceneError(
            f"{said}: no Prony series describes its moduli; the best one is off by "
            f"{off:.2g} in their logarithms (root mean square), allowed: {WORST:g}"
        )
    return found


def _allowed(shift: Shift, isotherms: Array, said: str) -> Shift:
    """The shift; raises SceneError if it is out of range in a scene."""
    if not np.isfinite(shift(isotherms)).all():
        raise SceneError(
            f"{said}: the WLF shift has no value at {isotherms[0] - ZERO_CELSIUS:.4g} degC, its "
            "coldest isotherm, as cold as reference - C2 = "
            f"{shift.reference - shift.C2 - ZERO_CELSIUS:.4g} degC or colder"
        )
    if not (0.0 < shift.C1 <= LARGEST_C1 and SMALLEST_C2 <= shift.C2 <= LARGEST_C2):
        raise SceneError(
            f"{said}: the WLF shift at {shift.reference - ZERO_CELSIUS:.4g} degC would have C1 = "
            f"{shift.C1:.4g} and C2 = {shift.C2:.4g} K; allowed: C1 up to {LARGEST_C1:g}, C2 of "
            f"{SMALLEST_C2:g} to {LARGEST_C2:g} K (another reference)"
        )
    return shift


def relaxation_of(path: Path, said: str, shift: Shift | None = None) -> Relaxation:
    """The compound of the DMA table at `path`, cached by the file's content.

    Raises SceneError.
    """
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:  # the reader reports it
        digest = ""
    return _relaxation(path, digest, said, shift)


@lru_cache(maxsize=64)
def _relaxation(path: Path, digest: str, said: str, shift: Shift | None) -> Relaxation:
    return characterised(read_dma(path, said), f"{said} {path}", shift).relaxation
