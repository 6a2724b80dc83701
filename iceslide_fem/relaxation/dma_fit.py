"""From a DMA table to a viscoelastic compound: shifts, shift law, Prony series, and errors."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from iceslide_fem.relaxation.dma import Dma, read_dma
from iceslide_fem.relaxation.master_curve import arrhenius, free, shifts, wlf
from iceslide_fem.relaxation.prony import Relaxation
from iceslide_fem.relaxation.prony_fit import MOST_ARMS, fit
from iceslide_fem.relaxation.shift import AnyShift, NoShift, Shift, ShiftTable
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import celsius

ROOM = 293.15  # K; the nearest isotherm is the default reference
WORST = 0.5  # largest accepted root mean square error of ln E' or ln tan delta
# Ranges of C1 and C2 (K) in a scene.
LARGEST_C1, SMALLEST_C2, LARGEST_C2 = 1e3, 0.1, 1e4
Law = Literal["wlf", "arrhenius", "table"]  # of a fitted shift; a table has each isotherm's own


class Misfit(NamedTuple):
    """Errors of a series relative to the measurement, as logarithms.

    storage, tan_delta: root mean squares; largest: largest error, of `quantity` in `row`. Of
    relaxation storage is that of the relaxation modulus, and there is no tan delta.
    """

    storage: float
    tan_delta: float | None
    largest: float
    quantity: str
    row: int


@dataclass(frozen=True)
class Characterised:
    """A compound from its DMA.

    instantaneous: modulus, Pa; factors: a_T of each isotherm before the fit of the law, without
    their mean distance to it, None if the law was given; flows: whether the data alone give no
    long-term modulus; determined: whether the isotherms determine the constants of the law.
    """

    dma: Dma
    relaxation: Relaxation
    instantaneous: float
    factors: Array | None
    flows: bool
    determined: bool = True

    @property
    def reduced(self) -> Array:
        """Reduced frequencies, times a_T (rad/s), of every row."""
        return self.dma.frequency * self.relaxation.shift(self.dma.temperature)

    @property
    def misfit(self) -> Misfit:
        """Errors of the series with the shift law, as a scene uses them."""
        dma, prony = self.dma, self.relaxation.prony
        if dma.tan_delta is None:
            storage = np.log(self.instantaneous * prony.modulus(1.0 / self.reduced) / dma.storage)
            errors = {f"{dma.of}(t)": storage}
        else:
            found = self.instantaneous * prony.dynamic(self.reduced)
            tan_delta = np.log(found.imag / found.real / dma.tan_delta)
            errors = {f"{dma.of}'": np.log(found.real / dma.storage), "tan delta": tan_delta}
        means = [float(np.sqrt(np.mean(each**2))) for each in errors.values()]
        quantity = max(errors, key=lambda name: np.abs(errors[name]).max())
        row = int(np.abs(errors[quantity]).argmax())
        largest = float(errors[quantity][row])
        return Misfit(means[0], means[1] if len(means) > 1 else None, largest, quantity, row)


def characterised(
    dma: Dma,
    said: str,
    shift: Shift | ShiftTable | None = None,
    reference: float | None = None,
    arrhenius_below: float | None = None,
    law: Law = "wlf",
    most_arms: int = MOST_ARMS,
) -> Characterised:
    """The compound that was measured.

    shift: given, else fitted by `law` if there are several temperatures; reference: K, by default
    that of `shift`, else the isotherm nearest to 20 degC; arrhenius_below: K; said: name of the
    table in messages. Raises SceneError.
    """
    isotherms = dma.isotherms
    if len(isotherms) == 1 and shift is None:
        return _with(dma, NoShift(), None, said, most_arms)
    if shift is not None:
        moved = shift if reference is None else shift.moved(reference)
        _check_constants(moved, isotherms, said)
        return _with(dma, moved, None, said, most_arms)
    near = float(isotherms[np.abs(isotherms - ROOM).argmin()])
    reference = near if reference is None else reference
    if arrhenius_below is not None and reference < arrhenius_below:
        raise SceneError(
            f"{said}: the reference, {celsius(reference)}, is colder than the "
            f"{celsius(arrhenius_below)} below which times follow an activation energy; allowed: a "
            "warmer reference"
        )
    logs = shifts(dma, said)
    found: Shift | ShiftTable
    determined = True
    if law == "wlf":
        found, determined = wlf(isotherms, logs, reference, arrhenius_below, said)
        _check_constants(found, isotherms, said)
    else:
        found = (arrhenius if law == "arrhenius" else free)(isotherms, logs, reference, said)
    offset = np.mean(logs - np.log(found(isotherms)))
    fitted = _with(dma, found, np.exp(logs - offset), said, most_arms)
    return replace(fitted, determined=determined)


def _with(
    dma: Dma, shift: AnyShift, factors: Array | None, said: str, most_arms: int
) -> Characterised:
    """The series with a shift; raises SceneError if no series fits."""
    reduced = dma.frequency * shift(dma.temperature)
    prony, instantaneous, flows = fit(reduced, dma.storage, dma.loss, most_arms)
    ends = float(dma.isotherms[0]), float(dma.isotherms[-1])
    found = Characterised(dma, Relaxation(prony, shift, ends), instantaneous, factors, flows)
    off = max(found.misfit.storage, found.misfit.tan_delta or 0.0)
    if off > WORST:
        raise SceneError(
            f"{said}: no Prony series describes its moduli; the best one is off by "
            f"{off:.2g} in their logarithms (root mean square), allowed: {WORST:g}"
        )
    return found


def _check_constants(shift: Shift | ShiftTable, isotherms: Array, said: str) -> None:
    """Raise SceneError if the constants of WLF are out of range in a scene."""
    if isinstance(shift, ShiftTable):
        return
    if not np.isfinite(shift(isotherms)).all():
        raise SceneError(
            f"{said}: the WLF shift has no value at {celsius(isotherms[0])}, its coldest isotherm, "
            f"as cold as reference - C2 = {celsius(shift.reference - shift.C2)} or colder"
        )
    if not (0.0 < shift.C1 <= LARGEST_C1 and SMALLEST_C2 <= shift.C2 <= LARGEST_C2):
        raise SceneError(
            f"{said}: the WLF shift at {celsius(shift.reference)} would have C1 = "
            f"{shift.C1:.4g} and C2 = {shift.C2:.4g} K; allowed: C1 up to {LARGEST_C1:g}, C2 of "
            f"{SMALLEST_C2:g} to {LARGEST_C2:g} K (another reference)"
        )


def measured_in(path: Path, said: str, shift: Shift | ShiftTable | None = None) -> Characterised:
    """The compound of the DMA table at `path`, cached by the file's content.

    Raises SceneError.
    """
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:  # the reader reports it
        digest = ""
    return _measured(path, digest, said, shift)


@lru_cache(maxsize=64)
def _measured(
    path: Path, digest: str, said: str, shift: Shift | ShiftTable | None
) -> Characterised:
    return characterised(read_dma(path, said), f"{said} {path}", shift)
