"""What the rubber's inertia changes: mu(t) and its mean with `rubber.inertia` and without.

Runs the tread block, the same with sipes, and the 1 mm sample as slices. Prints the largest
departure of mu(t) from the quasi-static run and when it is, that over the last quarter, the change
of the mean, the period of the swing, and what it costs; beside them the estimate by `ladder`.
With --fine also the tread block with inertia on a mesh twice as fine at a fifth of the tolerance.
Draws mu(t). Runs are kept in a folder and made only once.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from iceslide_fem.postprocess.results import Run, differences
from iceslide_fem.runs.simplifications import simplifications
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.simulate import kept_run
from scripts.studies.common import RESULTS, case, draw, options, picture_options, table

CASES = {  # name: changes of the case, beside the model
    "tread_block": [],
    "siped_block": [],
    "thesis_1bar": ["ice.heat=column", "numerics.tolerance=1e-2"],
}
DYNAMIC = "rubber.inertia=true"
FINE = ("numerics.refinement=2", "numerics.tolerance=2e-3")
COUNT = 2000  # times at which mu(t) is compared
COLOURS = ("#0072b2", "#d55e00", "#009e73")
HEAD = (
    "case", "estimate", "largest departure", "at ms", "in the last quarter", "mean mu",
    "with inertia", "change", "period, ms", "steps", "Newton", "s",
)  # fmt: skip


def made(name: str, folder: Path, *changes: str) -> Run:
    """The run of a case as a slice with some changes, from the folder or made now."""
    every = ["model=slice", *CASES[name], *changes]
    return kept_run(case(name, *every), folder / "_".join([name, *every]))


def period(change: Array, times: Array) -> float:
    """Mean period (s) of a swing around its mean, from where it rises through that; NaN if once."""
    velocity_error = change - change.mean()
    rises = times[1:][(velocity_error[1:] > 0.0) & (velocity_error[:-1] <= 0.0)]
    return float(np.diff(rises).mean()) if rises.size > 1 else np.nan


def row(name: str, still: Run, moving: Run) -> tuple[str, ...]:
    """One row of the table."""
    change = differences(moving, still, COUNT)
    times = np.linspace(0.0, still.history["time_s"][-1], COUNT)
    worst, half, late = np.abs(change).argmax(), COUNT // 2, 3 * COUNT // 4
    means = [run.summary["mu_mean"] for run in (still, moving)]
    work = [
        " -> ".join(form.format(run.summary[key]) for run in (still, moving))
        for key, form in (("steps", "{}"), ("newton_iterations", "{}"), ("wall_s", "{:.1f}"))
    ]
    return (
        name,
        f"{simplifications(case(name, *CASES[name])).inertia.effect:.2f}",
        f"{change[worst]:+.1%}",
        f"{1e3 * times[worst]:.2f}",
        f"{np.abs(change[late:]).max():.1%}",
        *(f"{mean:.4f}" for mean in means),
        f"{means[1] / means[0] - 1.0:+.2%}",
        f"{1e3 * period(change[half:], times[half:]):.2f}",
        *work,
    )


def main() -> None:
    """Print the table and draw the picture."""
    parser = options(__doc__)
    parser.add_argument("--fine", action="store_true", help="the error of the run with inertia")
    parser.add_argument("--runs", type=Path, default=RESULTS / "inertia")
    picture_options(parser)
    arguments = parser.parse_args()
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    rows = []
    for name, colour in zip(CASES, COLOURS, strict=True):
        still, moving = (made(name, arguments.runs, *more) for more in ((), (DYNAMIC,)))
        rows.append(row(name, still, moving))
        times = np.linspace(0.0, still.history["time_s"][-1], COUNT)
        lower.plot(1e3 * times, 1e2 * differences(moving, still, COUNT), color=colour, label=name)
        if name == "thesis_1bar":
            continue
        for run, style, label in ((still, "--", "quasi-static"), (moving, "-", "with inertia")):
            time, mu = 1e3 * run.history["time_s"], run.history["mu"]
            upper.plot(time, mu, style, color=colour, lw=1.4, label=f"{name}, {label}")
    table(HEAD, rows)
    if arguments.fine:
        coarse, fine = (made("tread_block", arguments.runs, DYNAMIC, *m) for m in ((), FINE))
        change = differences(coarse, fine, COUNT)
        mean = coarse.summary["mu_mean"] / fine.summary["mu_mean"] - 1.0
        print(
            f"\ntread_block with inertia against {' '.join(FINE)} ({fine.summary['steps']} steps, "
            f"{fine.summary['dofs']} unknowns, {fine.summary['wall_s']:.0f} s): mu(t) "
            f"{np.abs(change).max():.2%} at most, {np.sqrt(np.mean(change**2)):.2%} rms, "
            f"mean {mean:+.2%}"
        )
    upper.set(ylabel="friction coefficient μ (1)", ylim=(0.0, None))
    lower.set(xlabel="sliding time (ms)", ylabel="departure by inertia (%)")
    for panel in (upper, lower):
        panel.grid(alpha=0.3)
        panel.set_xlim(left=0.0)
        panel.legend(frameon=False, fontsize=8)
    draw(figure, arguments.pictures / "inertia.png")


if __name__ == "__main__":
    main()
