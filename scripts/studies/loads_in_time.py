"""Friction under loads that go in time: the cases load_step, friction_tester and braking_wheel.

As a table, and as one picture of pressure, speed and mu. With --least what the friction coefficient
changes against which energies and curves of a plate that starts or rests are measured
(`coupling.limits.StepLimits.least_friction`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure

from iceslide_fem.coupling.energy import Energies
from iceslide_fem.coupling.step_error import LIMITS
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mechanics.block import build_block
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.materials import BAR
from iceslide_fem.simulate import run
from scripts.studies.blocks import at_speed
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
    heights = [1.0, 1.0, 2.0]
    panels = figure.subplots(3, len(runs), sharex="col", height_ratios=heights, squeeze=False)
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


# Plates that start from rest and come to it, and a load that falls and rises without sliding much.
RESTS = {
    "starts": {"load.speed": "[[0, 0], [5e-4, 3], [1e-3, 3]]"},
    "stops": {"load.speed": "[[2e-4, 3], [6e-4, 0], [1e-3, 0]]"},
    "is pressed": {
        "load.speed": "[[0, 1e-3], [1e-3, 1e-3]]",
        "load.pressure": "[[0, 1e5], [5e-4, 3e5], [1e-3, 1e5]]",
    },
    "rests, is pressed, starts": {
        "load.speed": "[[6e-4, 0], [1e-3, 3]]",
        "load.pressure": "[[0, 1e5], [5e-4, 3e5]]",
    },
}
LEAST = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)


def least_friction(quick: bool) -> Iterator[list[object]]:
    """Rows: steps, and what energy is missing, with several values of the least friction."""
    coarse = ["model=slice", "ice.heat=column", "load.duration=1ms", "numerics.refinement=0.5"]
    coarse += ["numerics.tolerance=1e-2"]
    for name, loads in list(RESTS.items())[: 1 if quick else None]:
        changes = [f"{key}={value}" for key, value in loads.items()]
        scene = case("thesis_1bar", *coarse, *changes)
        for least in LEAST[1:4:2] if quick else LEAST:
            limits = replace(LIMITS, least_friction=least)
            sliding = at_speed(build_block(scene, MPI.COMM_SELF), limits)
            energies: list[Energies] = []
            rejected = 0
            try:
                for accepted in sliding.steps():
                    energies.append(accepted.energies)
                    rejected += accepted.rejected
            except SimulationStopped as reason:
                ends, share = str(reason).partition(";")[0], ""
            else:
                whole = Energies(*map(sum, zip(*energies, strict=True)))
                moved = sum(abs(one.friction_work) + abs(one.load_work) for one in energies)
                missing = sum(abs(one.missing) for one in energies)
                ends = f"{1e6 * whole.friction_work:.3g}"
                share = f"{whole.missing / moved:+.1e} | {missing / moved:.1e}"
            yield [name, f"{least:g}", len(energies), rejected, ends, share]


def main() -> None:
    """Run the cases, print the table, draw the picture."""
    parser = options(__doc__)
    parser.add_argument("--runs", type=Path, default=Path("results/studies/loads"))
    parser.add_argument("--quick", action="store_true", help="the first case alone, coarse")
    picture_options(parser)
    parser.add_argument("--least", action="store_true", help="only the least friction, minutes")
    arguments = parser.parse_args()
    if arguments.least:
        shares = "missing at the end | missing in steps, fractions of all work"
        names = ["a plate that", "least mu", "steps", "rejected", "friction work, µJ", shares]
        table(names, least_friction(arguments.quick))
        return
    quick = ("numerics.refinement=0.5", "numerics.tolerance=3e-2") if arguments.quick else ()
    runs = []
    for name in CASES[:1] if arguments.quick else CASES:
        run(case(name, *quick), arguments.runs / name, force=True)
        runs.append(read_run(arguments.runs / name))
    head = ("case", "peak mu", "mean", "end", "peak at, ms", "steps", "energy missing, fraction")
    table(head, [row(made) for made in runs])
    draw(curves(runs), arguments.pictures / "loads.png")


if __name__ == "__main__":
    main()
