"""Friction under loads that go in time: the cases load_step, friction_tester and braking_wheel.

As a table, and as one picture of pressure, speed and mu.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from iceslide_fem.materials import BAR
from iceslide_fem.results import Run, read_run
from iceslide_fem.simulate import run
from scripts.studies.common import case, draw, options, picture_options, table

CASES = ("load_step", "friction_tester", "braking_wheel")
TITLES = ("a step in load", "a friction tester's protocol", "a wheel that brakes")


def row(made: Run) -> tuple[str, ...]:
    """Cells of the table."""
    summary = made.summary
    imbalance = f"{abs(summary['energy_imbalance']):.1e}"
    mu = (f"{summary[name]:.3f}" for name in ("mu_peak", "mu_mean", "mu_end"))
    peak = f"{1e3 * summary['mu_peak_time_s']:.2f}"
    return made.scene["name"], *mu, peak, str(summary["steps"]), imbalance


def curves(runs: list[Run]) -> Figure:
    """Pressure, speed and mu of the runs, one column each."""
    figure = Figure(figsize=(11.5, 6.5), layout="constrained")
    panels = figure.subplots(3, len(runs), sharex="col", height_ratios=[1.0, 1.0, 2.0])
    quantities = (
        ("nominal_pressure_Pa", 1.0 / BAR, "$p$ (bar)", "0.3"),
        ("speed_m_per_s", 1.0, "$v$ (m/s)", "0.3"),
        ("mu", 1.0, r"$\mu$ (1)", "#0072B2"),
    )
    for column, made, title in zip(panels.T, runs, TITLES, strict=False):
        for panel, (name, unit, label, colour) in zip(column, quantities, strict=True):
            values = unit * made.history[name]
            panel.plot(1e3 * made.history["time_s"], values, color=colour)
            panel.set_ylim(0.0, 1.15 * values.max())
            panel.set_ylabel(label)
            panel.grid(alpha=0.25)
            panel.spines[["top", "right"]].set_visible(False)
        column[0].set_title(title)
        column[-1].set_xlabel("sliding time (ms)")
    return figure


def main() -> None:
    """Run the cases, print the table, draw the picture."""
    parser = options(__doc__)
    parser.add_argument("--runs", type=Path, default=Path("results/studies/loads"))
    parser.add_argument("--quick", action="store_true", help="the first case alone, coarse")
    picture_options(parser)
    arguments = parser.parse_args()
    quick = ("numerics.refinement=0.5", "numerics.tolerance=3e-2") if arguments.quick else ()
    runs = []
    for name in CASES[:1] if arguments.quick else CASES:
        run(case(name, *quick), arguments.runs / name, force=True)
        runs.append(read_run(arguments.runs / name))
    head = ("case", "peak mu", "mean", "end", "peak at, ms", "steps", "energy missing, share")
    table(head, [row(made) for made in runs])
    draw(curves(runs), arguments.pictures / "loads.png")


if __name__ == "__main__":
    main()
