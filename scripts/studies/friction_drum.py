"""A block over the same ice of a drum, turn by turn: friction and temperatures over 50 passes.

The case `friction_drum`, with what becomes of water between passes varied, and in rows of blocks of
the same number, one block's length and 8 mm apart. Then how exact passes are: the rise of a
half-space's surface before the next pass, under a flux of 160 kW/m2 for 5 ms in every second,
against the exact series; and water that freezes on ice 4 K below melting, against the closed form
2 e dT sqrt(t / pi) / (rho L), and that of a surface which moves as the water freezes. --quick: five
passes.
"""

from __future__ import annotations

from collections.abc import Mapping

import matplotlib.ticker
import numpy as np
from matplotlib.figure import Figure

from iceslide_fem import reference
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.passes import Passes, column_for, frozen, next_start, simulate_passes
from iceslide_fem.film.point_conditions import Conditions
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.output.table import PassRow
from iceslide_fem.postprocess.report.png import BLUE, GREEN, ORANGE, PURPLE
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import BOTTOMLESS, MELTING_TEMPERATURE
from scripts.studies.common import case, draw, options, picture_options, table

SHOWN = (1, 2, 3, 10, 50)
NAMES = {
    "freeze": "water freezes",
    "drain": "water is gone",
    "liquid": "water stays liquid",
    "rows": "rows of blocks, 7 ms apart",
}
FLUX, TIME, PERIOD = 160e3, 5e-3, 1.0  # W/m2, s, s
COLD = 4.0  # K below melting
RESTS = (1e-4, 1e-3, 1e-2, 0.1)  # s


def passes_of(between: str, number: int) -> list[PassRow]:
    """The passes of the case, or of rows of blocks."""
    found: list[PassRow] = []
    if between == "rows":
        scene = case("friction_drum")
        load = scene.load.model_copy(update={"passes": 1, "period": None})
        rubber = scene.rubber.model_copy(update={"rows": number, "row_pitch": 28e-3})
        scene = scene.model_copy(update={"load": load, "rubber": rubber})
    else:
        water = [f"film.between={between}"]
        if between == "liquid":
            water = ["film.between=keep", "film.refreeze=nothing"]
        scene = case("friction_drum", f"load.passes={number}", *water)
    point_history(scene, found.append)
    return found


def column(passes: list[PassRow], name: str) -> Array:
    """A column of passes."""
    return np.array([getattr(one, name) for one in passes])


def picture(found: Mapping[str, list[PassRow]]) -> Figure:
    """Friction with every `between`, and temperatures where water freezes."""
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    friction, temperatures = figure.subplots(1, 2)
    colours = dict(zip(NAMES, (BLUE, GREEN, ORANGE, PURPLE), strict=True))
    for between, passes in found.items():
        number, mu = column(passes, "pass_"), column(passes, "mu_mean")
        look = {"color": colours[between], "linewidth": 2, "label": NAMES[between]}
        friction.plot(number, mu, "--" if between == "drain" else "-", **look)
    friction.set(title="Mean friction coefficient of each pass", ylabel="mean μ (1)")
    friction.set_ylim(bottom=0.0)
    passes = found["freeze"]
    for name, label, colour in (
        ("surface_start_C", "surface of the ice as a pass begins", PURPLE),
        ("base_C", "base of the ice, on aluminium", GREEN),
    ):
        temperatures.plot(
            column(passes, "pass_"), column(passes, name), color=colour, linewidth=2, label=label
        )
    temperatures.set(title="Temperatures where water freezes", ylabel="T (°C)")
    for panel in (friction, temperatures):
        panel.set_xlabel("pass")
        panel.xaxis.set_major_locator(
            matplotlib.ticker.MaxNLocator(integer=True, steps=[1, 2, 5, 10])
        )
        panel.grid(alpha=0.25)
        panel.legend(loc="center right", bbox_to_anchor=(1.0, 0.42), frameon=False)
    return figure


def rises(number: int) -> Array:
    """Of the surface (K) before every next pass, under a constant flux.

    Water so viscous that it rubs as dry contact makes the flux, and drains.
    """
    k, speed, cold = 0.4, 4.0, 80.0
    conditions = Conditions.of(
        strength=ShearStrength.softening(FLUX / (k * speed), np.inf, 0.5), pressure=2e5,
        speed=speed, temperature=MELTING_TEMPERATURE - cold, k=k, D=1e-2, H_V=1e-2,
        initial_height=0.0, duration=TIME, viscosity=10.0,
    )  # fmt: skip
    passes = Passes(number, PERIOD, "drain")
    ice = column_for(conditions, passes, 1e-3, BOTTOMLESS)
    found = []
    for one in simulate_passes(conditions, passes, ice, tolerance=1e-3):
        heat = next_start(one.state, conditions, ice, passes, 0.0, TIME).ice
        found.append(float(ice.surface_temperature(heat)[0]) - MELTING_TEMPERATURE + cold)
    return np.array(found)


def full(passes: list[PassRow]) -> str:
    """In which pass the squeezed-out water has filled the roughness, as far as it stays."""
    free = float(case("friction_drum").contact_parameters(2e5).H_V)
    number = next((one.pass_ for one in passes if one.squeezed_height_m > 0.999 * free), None)
    when = "is not filled" if number is None else f"is full in pass {number}"
    return f"the roughness, H_V = {1e6 * free:.2f} um, {when}"


def print_exactness(numbers: tuple[int, ...]) -> None:
    """Both tables of exact solutions."""
    found = rises(numbers[-1])
    rows: list[tuple[object, ...]] = []
    for number in numbers:
        exact = float(reference.rise_before_pass(FLUX, TIME, PERIOD, number))
        here = found[number - 1]
        rows.append((number, f"{exact:.4f}", f"{here:.4f}", f"{here / exact - 1.0:+.2%}"))
    print()
    table(("after pass", "exact rise, K", "here, K", "difference"), rows)
    ice = Column(MELTING_TEMPERATURE - COLD, np.array([1e-4, 1.0]))
    rest, water = np.array(RESTS), np.full(len(RESTS), 1e-3)
    _, left, _ = frozen(ice.initial(rest.size), water, rest, ice)
    frozen_rows = []
    for time, own in zip(RESTS, water - left, strict=True):
        fixed, moving = (float(reference.frozen_onto(COLD, time, moves)) for moves in (False, True))
        frozen_rows.append(
            (f"{1e3 * time:g}", f"{1e6 * fixed:.3f}", f"{1e6 * own:.3f}",
             f"{own / fixed - 1:+.1%}", f"{moving / fixed - 1:+.1%}")
        )  # fmt: skip
    head = "rest, ms", "exact, µm of water frozen", "here", "difference", "surface that moves"
    print()
    table(head, frozen_rows)


def main() -> None:
    """Print the tables and draw the picture."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="five passes")
    picture_options(parser)
    chosen = parser.parse_args()
    number = 5 if chosen.quick else SHOWN[-1]
    found = {between: passes_of(between, number) for between in NAMES}
    head = (
        "pass", "mean mu", "peak mu", "mu at the end", "ice melts after, ms",
        "surface before, degC", "base after, degC", "film after, nm",
    )  # fmt: skip
    shown = [one for one in SHOWN if one <= number]
    table(
        head,
        (
            (
                one.pass_, f"{one.mu_mean:.4f}", f"{one.mu_peak:.4f}", f"{one.mu_end:.4f}",
                f"{1e3 * one.melt_onset_s:.3f}", f"{one.surface_start_C:.3f}",
                f"{one.base_C:.3f}", f"{1e9 * one.film_height_m:.1f}",
            )
            for one in (found["freeze"][index - 1] for index in shown)
        ),
    )  # fmt: skip
    print()
    table(
        ("mean mu of pass", *map(str, shown)),
        (
            (NAMES[between], *(f"{passes[index - 1].mu_mean:.4f}" for index in shown))
            for between, passes in found.items()
        ),
    )
    for between in ("liquid", "rows"):
        print(f"\n{NAMES[between]}: {full(found[between])}")
    print_exactness((1, 3) if chosen.quick else (1, 10, 100))
    draw(picture(found), chosen.pictures / "friction_drum.png")


if __name__ == "__main__":
    main()
