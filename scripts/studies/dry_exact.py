"""Dry shear, freezing and passes at a point against exact solutions, and the same ice again.

Dry contact that warms without melting (k 0.4, 0.3 MPa over 10 K, 2 bar, -4 degC); water that
freezes after 5 ms of a constant friction power, whose films are so viscous that they shear as dry
contact; ice before the next pass, 160 kW/m2 for 5 ms in every 7 ms; and mean mu of a block of 20 mm
at 4 m/s on the generated surface of compound B, once a second and 7 ms apart. --quick takes few
passes.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from iceslide_fem import reference
from iceslide_fem.film.passes import Passes, column_for, next_start, simulate_passes
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.point_conditions import Loading
from iceslide_fem.scene.contact_file import read_contact_table
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.course import Course
from iceslide_fem.scene.materials import BOTTOMLESS, MELTING_TEMPERATURE
from iceslide_fem.scene.shear_strength import ShearStrength
from scripts.studies.common import options, table

TOLERANCE = 1e-3
SURFACE = Path(__file__).parents[2] / "cases" / "surfaces" / "compound_B.csv"
K, SPEED, PRESSURE, TIME = 0.4, 4.0, 2e5, 5e-3
WARMING = (4.0, 1e-3), (4.0, 5e-3), (0.1, 0.2), (0.01, 2.0)  # m/s, s
FREEZING = (160e3, 4.0), (230e3, 4.0), (320e3, 10.0)  # W/m2, K
END = 20e-3  # s


def constant(flux: float, celsius: float, duration: float) -> Conditions:
    """A point with a constant friction power (W/m2) at SPEED, whatever its film."""
    strength = ShearStrength.softening(flux / (K * SPEED), np.inf, 0.5)
    return Conditions.of(
        strength, "film", pressure=PRESSURE, speed=SPEED, k=K, D=1e-2, H_V=1e-2,
        temperature=MELTING_TEMPERATURE + celsius, initial_height=0.0, duration=duration,
        viscosity=10.0,
    )  # fmt: skip


def warming() -> Iterator[tuple[str, ...]]:
    """Rows of dry contact without melting."""
    strength = ShearStrength.softening(3e5, 10.0, 0.0)
    for speed, time in WARMING:
        point = Conditions.of(
            strength, pressure=PRESSURE, speed=speed, k=K, D=50e-6, H_V=5e-6, duration=time,
            temperature=MELTING_TEMPERATURE - 4.0, initial_height=0.0,
        )  # fmt: skip
        found = simulate(point, tolerance=TOLERANCE)
        given = np.array([time]), PRESSURE, speed, K, 3e5, 10.0, -4.0
        mu, mean, _ = (float(part[0]) for part in reference.dry_softening_friction(*given))
        yield (
            f"{speed:g}", f"{time:g}", f"{mu:.6f}", f"{found.mu_end[0] / mu - 1.0:+.1e}",
            f"{mean:.6f}", f"{found.mu_mean[0] / mean - 1.0:+.1e}",
        )  # fmt: skip


def freezing() -> Iterator[tuple[str, ...]]:
    """Rows of water that freezes when friction stops after TIME."""
    for flux, cold in FREEZING:
        point, heights = constant(flux, -cold, END), [(0.0, 0.0)]
        stop = Course((0.0, TIME, TIME + 1e-7, END), (SPEED, SPEED, 0.0, 0.0), END)
        loading = Loading(Course((), (PRESSURE,), END), stop, ConstantContact(K, 1e-2, 1e-2))

        def observe(record, heights=heights):  # type: ignore[no-untyped-def]
            if record.good[0]:
                height = record.loads.height(record.step.state.log_height)[0]
                heights.append((float(record.time[0] + record.dt[0]), float(height)))

        found = simulate(point, tolerance=TOLERANCE, loading=loading, observe=observe)
        time, height = np.array(heights).T
        onset = np.pi / 4.0 * (point.solid.effusivity * cold / flux) ** 2
        at = np.linspace(TIME, END, 200001)
        gone = at[np.argmax(reference.refrozen_height(flux, onset, TIME, at) < 0.0)] - TIME
        own = time[(time > TIME) & (height == 0.0)][0] - TIME
        most = float(reference.refrozen_height(flux, onset, TIME, TIME))
        there = float(np.interp(TIME, time, height))
        yield (
            f"{flux / 1e3:g}", f"{cold:g}", f"{1e3 * onset:.4f}",
            f"{found.melt_onset[0] / onset - 1.0:+.1e}", f"{1e9 * most:.2f}",
            f"{there / most - 1.0:+.1e}", f"{1e3 * gone:.4f}", f"{own / gone - 1.0:+.1e}",
        )  # fmt: skip


def warmed() -> Iterator[tuple[object, ...]]:
    """Rows of the surface's rise before the next pass, 7 ms apart."""
    point, passes = constant(160e3, -80.0, TIME), Passes(10, 7e-3, "drain")
    ice = column_for(point, passes, TOLERANCE, BOTTOMLESS)
    found = simulate_passes(point, passes, ice, tolerance=TOLERANCE)
    for number, one in enumerate(found, start=1):
        if number in (1, 2, 3, 10):
            heat = next_start(one.state, point, ice, passes).ice
            rise = float(ice.surface_temperature(heat)[0] - point.temperature[0])
            exact = float(reference.rise_before_pass(160e3, TIME, passes.period, number))
            yield number, f"{exact:.4f}", f"{rise:.4f}", f"{rise / exact - 1.0:+.2%}"


def again(passes: Passes, numbers: tuple[int, ...]) -> tuple[str, ...]:
    """A row of mean mu of these passes."""
    k, D, H_V, _ = read_contact_table(SURFACE, "the table")(PRESSURE)
    point = Conditions.of(
        pressure=PRESSURE, speed=SPEED, k=k, D=D, H_V=H_V, duration=TIME,
        temperature=MELTING_TEMPERATURE - 4.0, initial_height=70e-9,
    )  # fmt: skip
    ice = column_for(point, passes, TOLERANCE, BOTTOMLESS)
    means = [one.mu_mean[0] for one in simulate_passes(point, passes, ice, tolerance=TOLERANCE)]
    return (
        f"{passes.period:g}", passes.between, ", ".join(map(str, numbers)),
        ", ".join(f"{means[number - 1]:.4f}" for number in numbers),
    )  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="few passes")
    many = (1, 2, 3) if parser.parse_args().quick else (1, 10, 50, 100)
    table(("m/s", "s", "mu, exact", "off by", "mean mu, exact", "off by"), warming())
    print()
    table(
        ("kW/m2", "K", "melts, ms", "off by", "height, nm", "off by", "frozen after, ms", "off by"),
        freezing(),
    )
    print()
    table(("after pass, 7 ms apart", "exact rise, K", "here, K", "difference"), warmed())
    print()
    rows = [again(Passes(many[-1], 1.0, "freeze"), many)]
    rows += [again(Passes(4, 7e-3, between), (1, 2, 3, 4)) for between in ("drain", "keep")]
    table(("period, s", "between", "passes", "mean mu"), rows)


if __name__ == "__main__":
    main()
