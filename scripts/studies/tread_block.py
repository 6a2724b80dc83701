"""The tread block on fresh ice: mu(x) from leading to trailing edge, against the point's average.

Runs cases/tread_block and cases/siped_block as slices until they are steady, prints where the ice
melts and fills, the pressure at the leading edge and the mean of mu against that of a point that is
under the block for as long; with --fine also against a run twice as fine. Draws a picture.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import trapezoid

from iceslide_fem.film.conditions import scene_conditions
from iceslide_fem.film.point import simulate
from iceslide_fem.postprocess.results.snapshots import PRESSURE, read_interface, times
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene import Scene
from iceslide_fem.simulate import run
from scripts.studies.common import case, draw, options, picture_options

MM, BAR = 1e3, 1e-5


class Profile(NamedTuple):
    """Contact facets from the leading to the trailing edge: distance from the leading one (m)."""

    distance: Array
    width: Array
    pressure: Array
    shear: Array
    height: Array
    temperature: Array
    melted: Array
    saturated: Array


def profile(directory: Path) -> Profile:
    """The last fields of a run, touching facets only."""
    interface = read_interface(directory, len(times(directory)) - 1)
    x = interface.corners[:, :, 0]
    touching = interface.touching
    order = np.argsort(-x.mean(axis=1)[touching])
    names = [
        PRESSURE,
        "friction stress (Pa)",
        "film height (m)",
        "surface temperature (degC)",
        "melted (1)",
        "saturated (1)",
    ]
    columns = [interface.values[name][touching][order] for name in names]
    leading = x[touching].max()
    centre = x.mean(axis=1)[touching][order]
    return Profile(leading - centre, np.ptp(x, axis=1)[touching][order], *columns)


def point_of(scene: Scene, times_s: Array) -> Array:
    """mu(t) of a point under the nominal pressure."""
    here = scene_conditions(scene)._replace(duration=times_s[-1:])
    return simulate(here, "column", tolerance=1e-5, times=times_s).samples[:, 0]


def first(distance: Array, flag: Array) -> str:
    some = flag > 0.0
    return f"{MM * distance[some].min():.2f} mm" if some.any() else "nowhere"


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--fine", action="store_true", help="run twice as fine, too")
    parser.add_argument("--model", choices=("slice", "block"), default="slice")
    picture_options(parser)
    arguments = parser.parse_args()
    figure = Figure(figsize=(7.5, 9.0), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, colour in (("tread_block", "#0072b2"), ("siped_block", "#d55e00")):
            scene = case(name, f"model={arguments.model}")
            out = Path(folder) / name
            summary = run(scene, out)
            found = profile(out)
            highest = found.pressure.argmax()
            print(f"{name}: mu {summary['mu_end']:.4f} when steady, {summary['wall_s']:.1f} s, "
                  f"{summary['dofs']} unknowns, {summary['steps']} steps, "
                  f"energy imbalance {summary['energy_imbalance']:.2%}")  # fmt: skip
            print(f"  largest pressure {BAR * found.pressure[highest]:.2f} bar, "
                  f"{MM * found.distance[highest]:.2f} mm from the front")  # fmt: skip
            print(f"  melts {first(found.distance, found.melted)} from the front, "
                  f"saturates: {first(found.distance, found.saturated)}")  # fmt: skip
            if arguments.fine:
                fine = ["numerics.refinement=2", "numerics.tolerance=2e-3"]
                finer = run(case(name, f"model={arguments.model}", *fine), out, force=True)
                print(f"  against {finer['mu_end']:.4f} with {finer['dofs']} unknowns and "
                      f"{finer['steps']} steps ({finer['wall_s']:.0f} s): "
                      f"{summary['mu_end'] / finer['mu_end'] - 1:+.2%} at the end, "
                      f"{summary['mu_mean'] / finer['mu_mean'] - 1:+.2%} in the mean")  # fmt: skip
            local = found.shear / found.pressure
            for panel, values in zip(
                panels,
                (BAR * found.pressure, local, 1e9 * found.height, found.temperature),
                strict=True,
            ):
                panel.plot(MM * found.distance, values, ".-", color=colour, label=name, ms=4)
            if name == "tread_block":
                transit = scene.rubber.length / scene.load.speed
                ages = np.linspace(0.0, transit, 401)
                mu = point_of(scene, ages)
                panels[1].plot(
                    MM * scene.load.speed * ages, mu, "k--", lw=1, label="point of that age"
                )
                average = float(trapezoid(mu, ages) / transit)
                print(f"  a point at the nominal pressure, mean over {1e3 * transit:.0f} ms: "
                      f"{average:.4f} ({summary['mu_end'] / average - 1:+.1%})")  # fmt: skip
    panels[1].set_ylim(0.0, 0.7)
    for panel, label in zip(
        panels,
        ("contact pressure (bar)", r"local $\tau/p$ (1)", "film height (nm)", "ice surface (°C)"),
        strict=True,
    ):
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[1].legend(frameon=False)
    panels[-1].set_xlabel("distance behind the leading edge (mm)")
    panels[0].set_title("A 20 mm tread block on ice at -4 °C, 2 bar, 4 m/s, when steady")
    draw(figure, arguments.pictures / "tread_block_profile.png")


if __name__ == "__main__":
    main()
