"""The picture of friction over slip, the whole family in one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from iceslide_fem.preprocess.wheel.curve import Curve

DPI = 120


def draw(title: str, found: Sequence[Curve], out: Path) -> None:
    """Write mu_slip.png to `out`."""
    mu_slip(title, found).savefig(out / "mu_slip.png", dpi=DPI)


def mu_slip(title: str, found: Sequence[Curve]) -> Figure:
    """mu over the slip ratio; the peak and the locked wheel are marked."""
    figure = Figure(figsize=(7.5, 4.8), layout="constrained")
    axes = figure.subplots()
    for number, curve in enumerate(found):
        colour = f"C{number % 10}"
        slip, mu = ([getattr(p, name) for p in curve.points] for name in ("slip", "mu"))
        axes.plot(slip, mu, ".-", color=colour, lw=1.2, ms=4, label=curve.name)
        if (peak := curve.peak) is not None:
            axes.plot(peak.slip, peak.mu, "^", color=colour, ms=8)
        if (locked := curve.locked) is not None:
            axes.plot(locked.slip, locked.mu, "s", color=colour, ms=7)
    alone = found[0] if len(found) == 1 else None
    if alone is not None and alone.peak is not None:
        peak = alone.peak
        axes.annotate(
            f"peak {peak.mu:.3g} at {peak.slip:.3g}", (peak.slip, peak.mu), (8, 6),
            textcoords="offset points",
        )  # fmt: skip
    if alone is not None and alone.locked is not None:
        axes.annotate(
            f"locked {alone.locked.mu:.3g}", (1.0, alone.locked.mu), (4, -20),
            textcoords="offset points", ha="right",
        )  # fmt: skip
    for marker, name in (("^", "peak"), ("s", "locked wheel")):
        axes.plot([], [], marker, color="0.4", label=name)
    lowest = min(point.mu for curve in found for point in curve.points)
    axes.set(title=title, xlabel="slip ratio S (1: locked)", ylabel="friction coefficient μ")
    axes.axhline(0.0, color="0.6", lw=0.8)
    if lowest >= 0.0:
        axes.set_ylim(bottom=0.0)
    axes.margins(y=0.12)
    axes.grid(True, alpha=0.2)
    axes.legend(fontsize=8)
    return figure
