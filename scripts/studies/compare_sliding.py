"""mu(t) of the thesis's own scene, a 1 mm block on fresh ice, against the LS-DYNA points.

Film on the rubber or on the ice, without and with heat in the rubber, and for several conductances
between film and bodies, as slices. Prints the tables that docs/validation/published.md quotes and
draws its second picture. Runs are kept in a folder and made only once; a scene that has changed is
run again.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import brentq

from iceslide_fem.film.conditions import scene_conditions
from iceslide_fem.postprocess.results import Run, differences
from iceslide_fem.reference import squeezing_rise
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import Scene
from iceslide_fem.scene.materials import ICE_EFFUSIVITY, MELTING_TEMPERATURE, rubber_solid
from iceslide_fem.simulate import kept_run
from scripts.studies.common import ROOT, case, draw, options, picture_options, table

# The thesis's LS-DYNA runs: s, mu (docs/validation/published.md).
PUBLISHED = {
    "thesis_sliding_1bar": [(2.5e-3, 0.51)],
    "thesis_sliding_5bar": [(0.8e-3, 0.12), (7e-3, 0.04)],
}
ATTACHED = ["ice.motion=attached"]
ON_RUBBER, ON_ICE = ["film.carrier=rubber"], ["film.carrier=ice"]
HEAT = ["rubber.heat=true"]
VARIANTS = [  # label, what it changes in the case, colour and line
    ("film on the rubber", ON_RUBBER, "C3", "-"),
    ("film on the rubber, heat in the rubber", [*ON_RUBBER, *HEAT], "C1", "--"),
    ("film on the ice", ON_ICE, "C0", "-"),
    ("film on the ice, heat in the rubber", [*ON_ICE, *HEAT], "C9", "--"),
    ("attached ice", ATTACHED, "k", "-"),
    ("attached ice, heat in the rubber", [*ATTACHED, *HEAT], "C7", "--"),
]
# W/(m2 K), instead of 2 k_w / h, which is 1e7 and more.
CONDUCTANCES = [  # conductance, further changes, label, colour and line
    ("1e5", [], "", "C4", "-"),
    ("5e4", [], "", "C6", "-"),
    ("5e4", ["film.pressure=nominal"], ", nominal pressure", "C6", ":"),
    ("3e4", [], "", "C5", "-"),
    ("1e4", [], "", "C8", "-"),
]
TIMES = np.array([0.8e-3, 2.5e-3, 7e-3])
# Ice that melts below the block.
WARM = ["load.speed=6", "ice.temperature=-1degC", "load.duration=0.3ms"]


def finished(name: str, changes: list[str], folder: Path) -> Run:
    """The run of a case as a slice with some changes, from the folder or made now."""
    return kept_run(case(name, "model=slice", *changes), folder / "_".join([name, *changes]))


def short(name: str) -> str:
    """The case without what all of them have in common."""
    return name.removeprefix("thesis_sliding_")


def figures(made: Run) -> str:
    """One row: peak and its time, mu at TIMES, mean, first melting, fractions of heat, cost."""
    summary, history = made.summary, made.history
    onset = summary["melt_onset_s"]
    shares = [history[f"{name}_J"][-1] / history["friction_work_J"][-1]
              for name in ("ice_heat", "rubber_heat", "latent_heat")]  # fmt: skip
    return (
        f"{summary['mu_peak']:6.3f} {1e3 * summary['mu_peak_time_s']:6.2f} "
        + " ".join(f"{made.at('mu', time):7.4f}" for time in TIMES)
        + f" {summary['mu_mean']:7.4f} "
        + ("     -" if onset is None else f"{1e3 * onset:6.2f}")
        + " ".join(f" {share:6.1%}" for share in shares)
        + f" {summary['energy_imbalance']:8.1e} {summary['steps']:5d} {summary['wall_s']:5.0f}"
    )


def tolerances(folder: Path) -> None:
    """What a tolerance of 1e-3 instead of 1e-2 changes where ice melts below the block."""

    def rows() -> Iterator[tuple[str, ...]]:
        for label, changes, _, _ in VARIANTS[:4]:
            every = [*WARM, *changes]
            coarse, fine = (
                finished("thesis_sliding_5bar", [*every, f"numerics.tolerance={value}"], folder)
                for value in ("1e-2", "1e-3")
            )
            means = [run.summary["mu_mean"] for run in (coarse, fine)]
            largest = np.abs(differences(coarse, fine, 500)).max()
            change = f"{means[0] / means[1] - 1.0:+.2%}"
            yield label, *(f"{mean:.4f}" for mean in means), f"{largest:.2%}", change

    table(("films and heat", "mean mu at 1e-2", "at 1e-3", "largest", "of the mean"), rows())


def onset_by_rubber(scene: Scene, share: float) -> tuple[float, float]:
    """Time (s) at which rubber alone that takes `share` of the friction heat is at T_m, and mu.

    Duhamel's integral of the film that is squeezed out at the nominal pressure.
    """
    here = scene_conditions(scene)
    loads = here.loads()
    viscous, squeeze = float(loads.viscous[0]), float(loads.squeeze_rate[0])
    effusivity = rubber_solid(scene.rubber.density).effusivity
    height = scene.film.initial_height

    def lack(time: float) -> float:
        on_ice = float(squeezing_rise(viscous, scene.load.speed, height, squeeze, time))
        rise = share * on_ice * ICE_EFFUSIVITY / effusivity
        return rise - (MELTING_TEMPERATURE - scene.ice.temperature)

    time = brentq(lack, 1e-7, 1.0)
    mu = viscous / (height * scene.load.pressure) * np.sqrt(1.0 + 2.0 * squeeze * height**2 * time)
    return time, float(mu)


def decorate(axis: Axes, name: str, scene: Scene, title: str) -> None:
    """Published points, title and axes of one panel."""
    for number, (time, mu) in enumerate(PUBLISHED[name]):
        axis.plot(1e3 * time, mu, "o", color="C2", clip_on=False, zorder=3,
                  label=None if number else "LS-DYNA, published")  # fmt: skip
    load = scene.load
    axis.set_title(f"{load.pressure / 1e5:g} bar, {load.speed:g} m/s, −4 °C: {title}")
    axis.set_xlabel("sliding time (ms)")
    axis.set_ylabel("friction coefficient μ (1)")
    axis.set_xlim(0, 1e3 * load.duration)
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)


def main() -> None:
    parser = options(__doc__)
    parser.add_argument(
        "--quick", action="store_true", help="1 bar, 0.3 ms, only carriers and heat"
    )
    parser.add_argument(
        "--tolerances", action="store_true", help="only 1e-2 against 1e-3, 5 bar, 6 m/s, -1 degC"
    )
    picture_options(parser)
    parser.add_argument("--runs", type=Path, default=ROOT / "results" / "sliding")
    arguments = parser.parse_args()
    if arguments.tolerances:
        tolerances(arguments.runs)
        return
    cases = list(PUBLISHED)[: 1 if arguments.quick else None]
    sets = [("film and heat", VARIANTS)]
    if not arguments.quick:
        conducting = [
            (f"heat in the rubber, G = {float(value):.0e} W/(m² K){more}",
             [*ON_RUBBER, *HEAT, *changes, f"film.conductance={value}"], colour, line)
            for value, changes, more, colour, line in CONDUCTANCES
        ]  # fmt: skip
        sets.append(("film on the rubber", [*VARIANTS[1:2], *conducting]))
    figure = Figure(figsize=(6.2 * len(sets), 4.6 * len(cases) + 1.0), layout="constrained")
    axes = np.reshape(figure.subplots(len(cases), len(sets)), (len(cases), len(sets)))
    print(f"{'case':5} {'variant':61} {'peak':>6} {'at ms':>6} "
          + " ".join(f"{1e3 * time:>4g} ms" for time in TIMES)
          + f" {'mean':>7} {'melts':>6} {'ice':>6} {'rubber':>7} {'latent':>6} "
          f"{'missing':>8} {'steps':>5} {'s':>5}")  # fmt: skip
    for row, name in zip(axes, cases, strict=True):
        scene = case(name)
        for axis, (title, variants) in zip(row, sets, strict=True):
            for label, changes, colour, line in variants:
                if arguments.quick:
                    changes = [*changes, "load.duration=0.3ms"]
                try:
                    made = finished(name, changes, arguments.runs)
                except SimulationStopped as reason:
                    print(f"{short(name):5} {label:61} {reason}", flush=True)
                    continue
                axis.plot(1e3 * made.history["time_s"], made.history["mu"],
                          color=colour, linestyle=line, linewidth=1.8, label=label)  # fmt: skip
                print(f"{short(name):5} {label:61} {figures(made)}", flush=True)
            decorate(axis, name, scene, title)
    for axis in axes[0]:
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, 1.52), fontsize="small")
    draw(figure, arguments.pictures / "sliding.png", 100)

    print("\nrubber alone decides, nominal pressure: fraction of the heat, onset, mu then")
    for name in cases:
        scene = case(name)
        for share in (0.2, 0.3, 0.4, 0.5):
            time, mu = onset_by_rubber(scene, share)
            print(f"{short(name):5} {share:4.0%} {1e3 * time:6.2f} ms {mu:6.3f}")


if __name__ == "__main__":
    main()
