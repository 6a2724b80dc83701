"""What `iceslide rubber` finds again of a known compound, from a synthetic DMA table with noise.

The compound is made up: a continuous spectrum of times between a glassy modulus of 300 MPa and a
rubbery one of 3 MPa, shifted by the universal WLF constants about -50 degC (17.44, 51.6 K), at 0.1
to 100 Hz from -40 to 60 degC. E(t) is compared over the times that the table covers. In the
last row isotherms below -15 degC follow 200 kJ/mol instead. --update-case
writes cases/rubber/synthetic_dma.csv anew, which the pictures show.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from iceslide_fem.postprocess.report.png import figure_of
from iceslide_fem.preprocess.rubber.case import RubberCase
from iceslide_fem.preprocess.rubber.charts import charts
from iceslide_fem.preprocess.rubber.compound import compound
from iceslide_fem.relaxation.dma import read_dma
from iceslide_fem.relaxation.dma_fit import characterised
from iceslide_fem.relaxation.prony import Prony
from iceslide_fem.relaxation.shift import Shift
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from scripts.studies.common import ROOT, draw, options, picture_options, table

GLASSY, RUBBERY = 300e6, 3e6  # Pa
CASE = ROOT / "cases" / "rubber" / "synthetic_dma.csv"
REFERENCE = 293.15  # K
UNIVERSAL = Shift(17.44, 51.6, 223.15).moved(REFERENCE)
COLD = Shift(17.44, 51.6, 223.15, 258.15, 200e3).moved(REFERENCE)
HERTZ, CELSIUS = np.logspace(-1.0, 2.0, 13), np.arange(-40.0, 61.0, 10.0)
NOISES = (0.0, 0.01, 0.02, 0.05)
REMARK = """\
# Synthetic: computed from a made-up spectrum with noise of 1 %, by scripts.studies.dma_fit.
# No rubber has been measured for it.
"""


def made_up() -> Prony:
    """The compound: 60 arms of a smooth spectrum, by far more than are fitted."""
    times = np.logspace(-11.0, 3.0, 60)
    weights = np.exp(-(((np.log10(times) + 6.0) / 2.5) ** 2))
    fractions = (1.0 - RUBBERY / GLASSY) * weights / weights.sum()
    return Prony(tuple(fractions.tolist()), tuple(times.tolist()))


def text(noise: float, seed: int, shift: Shift = UNIVERSAL) -> str:
    """A DMA table of it, with relative noise of both moduli."""
    rng, prony, rows = np.random.default_rng(seed), made_up(), []
    for celsius in CELSIUS:
        reduced = 2.0 * np.pi * HERTZ * shift(ZERO_CELSIUS + celsius)
        moduli = GLASSY * prony.dynamic(reduced)
        storage, loss = (
            part * np.exp(noise * rng.standard_normal(part.size))
            for part in (moduli.real, moduli.imag)
        )
        rows += [
            f"{hertz:.5g},{celsius:g},{one:.5g},{other:.5g}"
            for hertz, one, other in zip(HERTZ, storage, loss, strict=True)
        ]
    head = "frequency_Hz,temperature_C,storage_modulus_Pa,loss_modulus_Pa"
    return "\n".join([head, *rows]) + "\n"


def found(path: Path, shift: Shift, below: float | None = None) -> tuple[str, ...]:
    """What comes back, as the cells of a row."""
    result = characterised(read_dma(path, "the table"), "the table", None, REFERENCE, below)
    reduced, law = result.reduced, result.relaxation.shift
    assert isinstance(law, Shift) and result.misfit.tan_delta is not None  # of a DMA table
    times = np.geomspace(1.0 / reduced.max(), 1.0 / reduced.min(), 500)
    exact: Array = GLASSY * made_up().modulus(times)
    off = result.instantaneous * result.relaxation.prony.modulus(times) / exact - 1.0
    isotherms = ZERO_CELSIUS + CELSIUS
    decades = np.log10(law(isotherms) / shift(isotherms))
    misfit, tan_delta = result.misfit, result.misfit.tan_delta
    energy = f"{law.activation_energy / 1e3:.1f}" if law.activation_energy else "-"
    return (
        f"{law.C1:.3f}", f"{law.C2:.2f}", energy, f"{np.abs(decades).max():.3f}",
        str(len(result.relaxation.prony.times)), f"{100 * np.abs(off).max():.2f} %",
        f"{100 * misfit.storage:.2f} %", f"{100 * tan_delta:.2f} %",
    )  # fmt: skip


def rows(folder: Path) -> Iterator[tuple[str, ...]]:
    """All tables, one row each."""
    path = folder / "table.csv"
    for noise in NOISES:
        path.write_text(text(noise, seed=1), encoding="utf-8")
        yield f"{100 * noise:g} %", *found(path, UNIVERSAL)
    path.write_text(text(0.01, seed=1, shift=COLD), encoding="utf-8")
    yield "1 %, 200 kJ/mol below -15 degC", *found(path, COLD, COLD.arrhenius_below)


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--update-case", action="store_true", help=f"write {CASE.name} anew")
    picture_options(parser)
    given = parser.parse_args()
    if given.update_case:
        CASE.write_text(REMARK + text(0.01, seed=0), encoding="utf-8")
    print(f"given: C1 {UNIVERSAL.C1:.4f}, C2 {UNIVERSAL.C2:.1f} K at 20 degC")
    head = (
        "noise", "C1", "C2, K", "kJ/mol", "log10 a_T off by up to", "arms", "E(t) off by up to",
        "rms of E'", "rms of tan delta",
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        table(head, rows(Path(folder)))
    case = RubberCase.of({"source": CASE})
    shown = compound(case)
    parts = charts(case, shown)["master_curve"]
    draw(figure_of(parts), given.pictures / "rubber_master_curve.png")


if __name__ == "__main__":
    main()
