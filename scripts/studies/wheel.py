"""Friction over slip of a wheel: exact brushes, the film law, what it costs, cells and phases.

Coulomb's friction on the brush against Fiala's closed forms; the film law at the sliding speed S V
of a slick tread; seconds; how the curve converges with cells across the patch and with the phases
of a tread pattern; the shear stiffness of blocks by finite elements; and what a locked wheel was
measured to have, second hand, beside what is predicted before.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from iceslide_fem.preprocess.footprint.film_options import FilmOptions
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.block_shear import block_stiffness
from iceslide_fem.preprocess.wheel.brush import Ends, Pattern, Rolling, ends_of, tractions
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import friction
from iceslide_fem.preprocess.wheel.tread import Tread
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from scripts.studies.common import ROOT, draw, options, picture_options, table, timed

SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
LENGTH, WIDTH, PRESSURE, SPEED, COLD = 0.12, 0.16, 2.0 * BAR, 20.0 / 3.6, 269.15
SLIPS = (0.01, 0.05, 0.2, 0.3, 0.5, 1.0)
FILM = (0.0139, 0.0694, 0.2367, 0.1919, 0.1594, 0.0872)  # by another program, at w = S V
STIFF, HEIGHT = 1e12, 8e-3  # Pa/m; m
ROUND = np.linspace(0.0, 1.0, 21)
LOAD, HALF, C_P = 3e3, 0.06, 6.825e6  # N, m, N/m2: the parabola's


def fiala(mu_static: float, mu_sliding: float, slip: float) -> float:
    """F / F_z of a parabolic pressure: sticking up to lambda of the patch, sliding behind."""
    sigma = slip / (1.0 - slip)
    lam = max(1.0 - 2.0 * C_P * HALF**2 / (3.0 * mu_static * LOAD) * sigma, 0.0)
    sticks = 2.0 * C_P * HALF**2 * sigma * lam**2 / LOAD
    return sticks + mu_sliding * (1.0 - lam) ** 2 * (1.0 + 2.0 * lam)


def uniform(mu: float, pressure: float, stiffness: float, slip: float) -> float:
    """F / (mu F_z) of an even pressure: sticking over mu p / (c sigma), at most the patch."""
    sticks = mu * pressure * (1.0 - slip) / (stiffness * slip)
    if sticks > LENGTH:
        return 0.5 * LENGTH / sticks
    return 1.0 - 0.5 * sticks / LENGTH


def coulomb(
    pressure: Array, dx: float, stiffness: float, mu: tuple[float, float], slip: float
) -> float:
    """F / F_z of one line (nx,) by the brush; mu: static and sliding."""
    line = pressure[None]
    ends = ends_of(line, line > 0.0)
    static, sliding = (Ends(one * ends.first, one * ends.last) for one in mu)
    rise = np.array([stiffness * dx * Rolling(1.0, slip).stretch])
    return float(tractions(rise, line > 0.0, static, sliding).stress.sum() / line.sum())


def exact_brushes(cells: int) -> None:
    """Coulomb's friction against closed forms."""
    dx = 2.0 * HALF / cells
    x = (np.arange(cells) + 0.5) * dx - HALF
    parabola = np.asarray(
        0.75 * LOAD / HALF * (1.0 - (x / HALF) ** 2), dtype=float
    )  # N/m: of the whole width
    rows = []
    for mu, slips in (((0.2, 0.2), (0.005, 0.01, 0.02, 0.03, 0.035)),
                      ((0.25, 0.2), (0.005, 0.01, 0.02, 0.03, 0.03167))):  # fmt: skip
        for slip in slips:
            found, exact = coulomb(parabola, dx, C_P, mu, slip), fiala(*mu, slip)
            name = f"parabola, mu {mu[0]:g}, {mu[1]:g}"
            rows.append((name, slip, f"{found:.6f}", f"{exact:.6f}", f"{found / exact - 1:+.1e}"))
    even = np.full(cells, 2.5 * BAR)
    for slip in (0.002, 0.005, 0.01, 0.02, 0.1):
        found = coulomb(even, dx, 68.25e6, (0.2, 0.2), slip) / 0.2
        exact = uniform(0.2, 2.5 * BAR, 68.25e6, slip)
        line = (
            "even, F / (mu F_z)",
            slip,
            f"{found:.6f}",
            f"{exact:.6f}",
            f"{found / exact - 1:+.1e}",
        )
        rows.append(line)
    print(f"\nCoulomb's friction on the brush, {cells} cells, against closed forms\n")
    table(["pressure", "S", "F / F_z", "exact", "off by"], rows)


def film_contact(speed: float = SPEED, temperature: float = COLD, **keys: object) -> FilmContact:
    """The film law on the surface found for compound B, or with other options of the film."""
    given = FilmOptions.of({"contact": SURFACE, "temperature": temperature, **keys})
    return FilmContact(given.ride_at(speed, 0.0), given.contact_of, given.tolerance)


def patch(pressure: float, cells: int, lines: int = 1) -> PressureMap:
    """An even pressure (Pa) over 120 x 160 mm."""
    return PressureMap(np.full((lines, cells), pressure), LENGTH / cells, WIDTH / lines)


def mu_of(footprint: PressureMap, slips: ArrayLike, tread: Tread, contact: FilmContact) -> Array:
    """mu at the slip ratios."""
    rolls = [Rolling(float(contact.ride.speed), float(slip)) for slip in np.asarray(slips)]
    return np.array([point.mu for point in friction(footprint, rolls, tread, contact)])


def film_law(cells: int) -> None:
    """The slick tread of the other program, stiff, and with the stiffness of a tread."""
    soft = COMPOUNDS["B"].shear_modulus / HEIGHT
    found = [mu_of(patch(PRESSURE, cells), SLIPS, Tread(c), film_contact()) for c in (STIFF, soft)]
    print(f"\nFilm law, slick 120 mm, 2 bar, 20 km/h, -4 degC, {cells} cells; c in Pa/m\n")
    table(
        ["S", "another program", f"c = {STIFF:.0e}", "off by", f"c = G / H = {soft:.3g}"],
        [
            (slip, given, f"{stiff:.4f}", f"{stiff / given - 1:+.2%}", f"{mu:.4f}")
            for slip, given, stiff, mu in zip(SLIPS, FILM, *found, strict=True)
        ],
    )


def seconds(lines: int) -> None:
    """Processor seconds of 21 slip ratios of a line and of a picture."""
    tread, contact = Tread(COMPOUNDS["B"].shear_modulus / HEIGHT), film_contact()
    rows = []
    for name, count in (("a line", 1), (f"a picture, 120 x {lines} pixels of 1 mm", lines)):
        footprint = patch(PRESSURE, 120, count)
        _, spent = timed(partial(mu_of, footprint, ROUND, tread, contact), 1)
        rows.append((name, f"{spent:.2f} s"))
    print("\n21 slip ratios, one process\n")
    table(["footprint", "seconds"], rows)


def cells_across(finest: int) -> None:
    """Largest difference of mu(S) over all S, relative to its peak, by cells along the patch."""
    dry = {"dry_stress": 0.45e6, "dry_softening": 13.5, "initial_height": 0.0}
    tread = Tread(COMPOUNDS["B"].shear_modulus / HEIGHT)
    shapes = {
        "even": lambda x: np.full_like(x, PRESSURE),
        "parabola": lambda x: 1.5 * PRESSURE * (1.0 - (2.0 * x - 1.0) ** 2),
    }
    rows = []
    for law, keys in (("film", {}), ("dry and film", dry)):
        for name, shape in shapes.items():
            curves = {}
            for cells in (15, 30, 60, 120, finest):
                x = (np.arange(cells) + 0.5) / cells
                line = PressureMap(shape(x)[None], LENGTH / cells, 1.0)
                curves[cells] = mu_of(line, ROUND, tread, film_contact(**keys))
            best = curves.pop(finest)
            off = [np.abs(mu - best).max() / best.max() for mu in curves.values()]
            rows.append((law, name, *(f"{each:.2%}" for each in off)))
    print(f"\nCells along the patch: largest error of mu(S) over its peak, against {finest}\n")
    table(["law", "pressure", "15", "30", "60", "120"], rows)


def phases(most: int) -> None:
    """The same by phases of a pattern of 20 mm blocks and 8 mm grooves."""
    contact, curves = film_contact(), {}
    for count in (2, 3, 4, 5, 6, 8, 12, most):
        tread = Tread(COMPOUNDS["B"].shear_modulus / HEIGHT, Pattern(28e-3, 8e-3, count))
        curves[count] = mu_of(patch(PRESSURE, 120), ROUND[1:], tread, contact)
    best = curves.pop(most)
    print(f"\nPhases of a pattern, blocks of 20 mm, grooves of 8 mm, against {most}\n")
    table(
        ["phases", "largest error of mu(S) over its peak", "of the locked wheel"],
        [
            (n, f"{np.abs(mu - best).max() / best.max():.2%}", f"{mu[-1] / best[-1] - 1:+.2%}")
            for n, mu in curves.items()
        ],
    )


def blocks() -> None:
    """Shear stiffness of blocks by finite elements over G / H."""
    rubber = COMPOUNDS["B"]
    flat = rubber.shear_modulus / HEIGHT
    print(f"\nShear stiffness of a block {1e3 * HEIGHT:g} mm high, G / H = {flat:.4g} Pa/m\n")
    table(
        ["length (mm)", "c (Pa/m)", "c H / G"],
        [
            (f"{1e3 * L:g}", f"{c:.4g}", f"{c / flat:.4f}")
            for L in (8e-3, 20e-3, 60e-3, 200e-3)
            for c in [block_stiffness(rubber, L, HEIGHT)]
        ],
    )


def against_measured() -> None:
    """A locked wheel at -6 degC: predicted, and then what was measured, second hand."""
    tread, cold = Tread(COMPOUNDS["B"].shear_modulus / HEIGHT), ZERO_CELSIUS - 6.0
    dry = {"dry_stress": 0.45e6, "dry_softening": 13.5, "initial_height": 0.0}
    rows = []
    for kmh in (20.0, 30.0, 50.0):
        for law, keys in (("film", {}), ("dry and film", dry)):
            contact = film_contact(kmh / 3.6, cold, **keys)
            mu = mu_of(patch(PRESSURE, 120), ROUND, tread, contact)
            at = int(mu.argmax())
            rows.append((f"{kmh:g}", law, f"{mu[at]:.3f}", f"{ROUND[at]:.2f}", f"{mu[-1]:.3f}"))
    print("\nPredicted at -6 degC, slick tread, 2 bar, 120 mm\n")
    table(["km/h", "law", "peak mu", "at S", "locked mu"], rows)
    print("\nSecond hand, from no source that could be read: locked 0.10, braking 0.09, -6 degC.")


def picture(folder: Path) -> None:
    """Film law beside dry and film, at three temperatures."""
    slips = np.concatenate([[0.0], np.geomspace(0.005, 1.0, 40)])
    dry = {"dry_stress": 0.45e6, "dry_softening": 13.5, "initial_height": 0.0}
    tread = Tread(COMPOUNDS["B"].shear_modulus / HEIGHT)
    figure = Figure(figsize=(9.5, 4.2), layout="constrained")
    for axes, (law, keys) in zip(
        figure.subplots(1, 2), (("film", {}), ("dry and film", dry)), strict=True
    ):
        for celsius in (-10.0, -4.0, -1.0):
            contact = film_contact(SPEED, ZERO_CELSIUS + celsius, **keys)
            mu = mu_of(patch(PRESSURE, 120), slips, tread, contact)
            axes.plot(slips, mu, label=f"{celsius:g} °C")
        axes.set(title=law, xlabel="slip ratio S (1: locked)", ylabel="friction coefficient μ")
        axes.set_ylim(bottom=0.0)
        axes.grid(True, alpha=0.2)
        axes.legend(title="ice")
    figure.suptitle("A slick tread of 8 mm, 120 mm long, 2 bar, 20 km/h")
    draw(figure, folder / "wheel_mu_slip.png")


def main() -> None:
    """Print all tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer cells, no finite elements")
    picture_options(parser)
    given = parser.parse_args()
    exact_brushes(1200)
    film_law(120 if given.quick else 480)
    seconds(16 if given.quick else 160)
    if not given.quick:
        cells_across(960)
        phases(48)
        blocks()
        picture(given.pictures)
    against_measured()


if __name__ == "__main__":
    main()
