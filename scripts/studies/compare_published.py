"""mu(t) of point, slice and block, local and nominal film pressure, against published points.

Prints the tables that docs/validation/published.md quotes and draws its first picture. Runs are
kept in a folder and made only once; a scene that has changed is run again.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import meshio
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iceslide_fem.postprocess.results import Run, field_files
from iceslide_fem.runtime.arrays import Mask
from iceslide_fem.scene.materials import BAR
from iceslide_fem.simulate import kept_run
from scripts.studies.common import ROOT, case, draw, options, picture_options, table

TOLERANCE = "numerics.tolerance=3e-3"
# The thesis: its LS-DYNA runs, and Klapproth et al. 2016 as printed there. Label, s, mu, and where
# the label goes (points from there). Of the paper's peak the thesis says "about" 0.55: a line.
PUBLISHED: dict[str, list[tuple[str, float | None, float, tuple[int, int]]]] = {
    "thesis_1bar": [("LS-DYNA, peak", 2.5e-3, 0.51, (-8, 8))],
    "thesis_5bar": [("LS-DYNA", 0.8e-3, 0.12, (6, -70)), ("LS-DYNA", 7e-3, 0.04, (-8, 8))],
    "paper_1bar": [("Klapproth et al., peak", None, 0.55, (6, 4))],
    "paper_5bar": [],
}
VARIANTS = [  # label, what it changes in the case, colour and line
    ("point, conduction", ["model=point", "ice.heat=column"], "k", "-"),
    ("point, closed-form flux", ["model=point", "ice.heat=half-space"], "k", ":"),
    ("slice, local pressure", ["model=slice"], "C0", "-"),
    ("slice, nominal pressure", ["model=slice", "film.pressure=nominal"], "C0", "--"),
    ("block, local pressure", ["model=block"], "C3", "-"),
    ("block, nominal pressure", ["model=block", "film.pressure=nominal"], "C3", "--"),
]
# One thing at a time, in the slice of thesis_1bar.
EFFECTS = [
    ("as it is", []),
    ("ice: columns", ["ice.heat=column"]),
    ("ice: 0.3 mm beside it", ["ice.margin=0.3mm"]),
    ("0.5 mm tall", ["rubber.height=0.5mm"]),
    ("0.2 mm tall", ["rubber.height=0.2mm"]),
    ("4 m/s", ["load.speed=4m/s"]),
]
TIMES = np.array([0.8e-3, 2.5e-3, 5e-3, 7e-3])
HEAD = (
    "peak", "at, ms", *(f"{1e3 * time:g} ms" for time in TIMES), "mean", "melts, ms", "full, ms",
    "contact", "leading, bar", "trailing, bar", "outside",
)  # fmt: skip


def finished(name: str, changes: list[str], folder: Path) -> Run:
    """The run of a case with some changes, from the folder or made now."""
    scene = case(name, *changes, TOLERANCE)
    return kept_run(scene, folder / "_".join([name, *changes]).replace("/", ""))


def figures(made: Run) -> Iterator[str]:
    """One row of the tables.

    Peak, its time, mu at TIMES, mean; first melting and saturation (ms); at the peak the fraction
    of the nominal area in contact and the mean pressure (bar) in the leading and the trailing fifth
    of its length; fraction of the contact outside the table of k, D, H_V at the end.
    """
    summary, end = made.summary, made.history["time_s"][-1]

    def ms(time: float | None) -> str:
        return "" if time is None else f"{1e3 * time:.2f}"

    yield f"{summary['mu_peak']:.3f}"
    yield ms(summary["mu_peak_time_s"])
    for time in TIMES:
        yield f"{made.at('mu', time):.4f}" if time <= end * (1 + 1e-9) else ""
    yield f"{summary['mu_mean']:.4f}"
    yield ms(summary["melt_onset_s"])
    yield ms(summary["saturation_s"])
    yield f"{made.at('contact_fraction', summary['mu_peak_time_s']):.3f}"
    yield from fifths(made)
    yield f"{summary.get('outside_table_fraction', 0.0):.2f}"


def fifths(made: Run) -> tuple[str, str]:
    """Mean pressure (bar) in the leading and in the trailing fifth of the contact at the peak."""
    files = field_files(made.directory, "interface")
    if not files:
        return "", ""
    _, path = min(files, key=lambda file: abs(file[0] - made.summary["mu_peak_time_s"]))
    read = meshio.read(path)
    corners, pressure = read.points[read.cells[0].data], read.cell_data["contact pressure (Pa)"][0]
    x, y = corners[..., 0], corners[..., 1]
    if made.scene["model"] == "slice":
        area = np.ptp(x, axis=1)
    else:
        area = 0.5 * np.abs((x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1))
    touching, middle = pressure > 0.0, x.mean(axis=1)
    low, high = middle[touching].min(), middle[touching].max()
    leading = touching & (middle > high - 0.2 * (high - low))
    trailing = touching & (middle < low + 0.2 * (high - low))

    def mean(part: Mask) -> str:
        return f"{np.average(pressure[part], weights=area[part]) / BAR:.2f}"

    return mean(leading), mean(trailing)


def decorate(axis: Axes, name: str, made: Run) -> None:
    """Published points, title and axes of one panel."""
    for label, time, value, offset in PUBLISHED[name]:
        if time is None:
            axis.axhline(value, color="C2", linewidth=1)
        else:
            axis.plot(1e3 * time, value, "o", color="C2", clip_on=False, zorder=3)
        axis.annotate(f"{label} {value}", (1e3 * (time or 0.0), value), offset,
                      textcoords="offset points", color="C2",
                      ha="right" if offset[0] < 0 else "left",
                      arrowprops={"arrowstyle": "-", "color": "C2", "lw": 0.7})  # fmt: skip
    load = made.scene["load"]
    axis.set_title(f"{name}: {load['pressure'] / 1e5:g} bar, {load['speed']:g} m/s, −4 °C")
    axis.set_xlabel("sliding time (ms)")
    axis.set_ylabel("friction coefficient μ (1)")
    axis.set_xlim(0, 1e3 * load["duration"])
    axis.set_ylim(0, 0.62 if load["pressure"] < 2e5 else 0.2)
    axis.grid(alpha=0.3)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="1 bar, without the blocks")
    picture_options(parser)
    parser.add_argument("--runs", type=Path, default=ROOT / "results" / "published")
    arguments = parser.parse_args()
    cases = list(PUBLISHED)[: 1 if arguments.quick else None]
    variants = VARIANTS[: 4 if arguments.quick else None]
    figure = Figure(figsize=(12, 4.4 * ((len(cases) + 1) // 2) + 0.6), layout="constrained")
    axes = np.atleast_1d(figure.subplots((len(cases) + 1) // 2, min(2, len(cases)))).ravel()

    def rows() -> Iterator[tuple[object, ...]]:
        for axis, name in zip(axes, cases, strict=True):
            for label, changes, colour, line in variants:
                made = finished(name, changes, arguments.runs)
                axis.plot(1e3 * made.history["time_s"], made.history["mu"],
                          color=colour, linestyle=line, label=label)  # fmt: skip
                yield name, label, *figures(made), made.summary["steps"]
            decorate(axis, name, made)

    table(("case", "variant", *HEAD, "steps"), rows())
    lines, labels = axes[0].get_legend_handles_labels()
    figure.legend(lines, labels, loc="outside upper center", ncols=3)
    draw(figure, arguments.pictures / "published.png", 100)

    print()
    made = (
        (label, *figures(finished("thesis_1bar", ["model=slice", *changes], arguments.runs)))
        for label, changes in EFFECTS
    )
    table(("thesis_1bar, slice", *HEAD), made)


if __name__ == "__main__":
    main()
