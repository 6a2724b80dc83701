"""The dry stress of rubber on ice, calibrated on some bands of published mu, predicts the others.

tau_0 and Delta of `film.dry_stress` are calibrated on three bands at 0.65 m/s by least squares of
ln mu against each band's geometric middle. The other bands are predicted, and printed, before any
of them is compared. All bands are second hand: they are reported in a review that is read here in
part only, or in an abstract.

delta is not calibrated but 0.5 K. With 0 the strength would vanish at the melting point, friction
would bring the ice ever closer to it, and melting would never begin.
Delta is bounded by the coldest band of the three: the strength of colder ice does not enter them,
so it is taken as constant there.

What bands do not say is assumed: compound B on the surface of compound_B.toml, a block of 20 mm
that passes ice, which rubs for 20 mm / v, slow speeds too, and films that begin without water.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from iceslide_fem.film.point import Conditions, PointResult, simulate
from iceslide_fem.film.shear_strength import ShearStrength
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.contact_table import read_contact_table
from iceslide_fem.scene.materials import BAR
from scripts.studies.common import ROOT, options, table

LENGTH = 20e-3  # m, of a tread block
LONGEST = 1e3  # s, of points: contact below 20 um/s is taken to last as long
TOLERANCE = 1e-2
RESIDUAL = 0.5  # K, delta
FACTOR = 2.0  # of the geometric middle, within which a band is met
H0 = 70e-9  # m, where the film law has no dry stress
CONTACT = read_contact_table(ROOT / "cases" / "surfaces" / "compound_B.csv", "table")


class DryShear(NamedTuple):
    """tau_0 (Pa) and Delta (K) of tau_b = tau_0 min(1, (T_m + delta - T) / Delta)."""

    stress: float
    softening: float

    @property
    def strength(self) -> ShearStrength:
        """tau_b over the temperature."""
        return ShearStrength.softening(self.stress, self.softening, RESIDUAL)

    def __str__(self) -> str:
        """As in a scene."""
        return f"{1e-6 * self.stress:.2f} MPa, {self.softening:.1f} K"


FIRST = DryShear(0.33e6, 10.0)  # where least squares begin: another calibration on these bands
# What this study finds, rounded: on the three bands, and on all of them.
CALIBRATED, OF_ALL = DryShear(0.45e6, 13.5), DryShear(0.18e6, 1.4)
SHORTEST = 1.0  # K, of Delta


class Band(NamedTuple):
    """Published mu between `low` and `high` at all conditions; `assumed`: what is not said."""

    source: str
    low: float
    high: float
    bar: Sequence[float]
    speed: Sequence[float]  # m/s
    celsius: Sequence[float]
    assumed: str = ""

    @property
    def middle(self) -> float:
        """The geometric middle."""
        return float(np.sqrt(self.low * self.high))

    @property
    def conditions(self) -> str:
        """In words."""
        units = ((self.speed, "m/s"), (self.celsius, "°C"), (self.bar, "bar"))
        words = [
            (f"{one[0]:g} to {one[-1]:g}" if len(one) > 1 else f"{one[0]:g}") + f" {unit}"
            for one, unit in units
        ]
        return ", ".join(words) + (f"; assumed: {self.assumed}" if self.assumed else "")

    def mu(self, dry: DryShear) -> Array:
        """Mean mu of the model at all combinations of the conditions."""
        bar, speed, celsius = np.array(list(product(self.bar, self.speed, self.celsius))).T
        return passing(bar, speed, celsius, dry).mu_mean


REVIEW = "review, second hand"
PRESSURES = (1.5, 2.0, 3.0, 4.5)
FOR_CALIBRATION = (
    Band(REVIEW, 0.14, 0.37, PRESSURES, (0.65,), (-5.0,)),
    Band(REVIEW, 0.22, 0.53, PRESSURES, (0.65,), (-10.0,)),
    Band(REVIEW, 0.37, 0.73, PRESSURES, (0.65,), (-13.0,)),
)
BRAKING = (5.0, 10.0, 20.0)  # m/s, of cars
PREDICTED = (
    *(  # "near 0.3": a factor of two either side
        Band(REVIEW, 0.15, 0.6, (2.0,), (speed,), (celsius,), "bar")
        for speed, celsius in ((3e-3, -33.0), (3e-3, -1.0), (0.1, -15.0), (2.6, -33.0), (2.6, -1.0))
    ),
    Band(REVIEW, 0.4, 0.8, (2.0,), (1e-3,), (-32.0,), "bar, and half of the largest as the least"),
    Band(
        "SAE 960959, abstract, second hand", 0.05, 0.2, (2.0,), BRAKING, (-10.0, -5.0, -2.0),
        "bar, m/s, °C, and a factor of two either side of 0.10",
    ),
    Band(
        "SAE 960652, abstract, second hand", 0.045, 0.18, (2.0,), BRAKING, (-6.0,),
        "bar, m/s, and a factor of two either side of 0.09",
    ),
)  # fmt: skip


def passing(
    bar: ArrayLike, speed: ArrayLike, celsius: ArrayLike, dry: DryShear | None = None
) -> PointResult:
    """Points of ice that passes a block of `LENGTH`; bar, m/s, degC. Arguments broadcast.

    With dry shear films begin without water, without it with `H0`.
    """
    pressure = np.asarray(bar, dtype=float) * BAR
    k, D, H_V, _ = CONTACT(pressure)
    duration = np.minimum(LENGTH / np.asarray(speed, dtype=float), LONGEST)
    here = Conditions.of(
        strength=dry and dry.strength,
        pressure=pressure, speed=speed, temperature=ZERO_CELSIUS + np.asarray(celsius),
        k=k, D=D, H_V=H_V, initial_height=0.0 if dry else H0, duration=duration,
    )  # fmt: skip
    return simulate(here, tolerance=TOLERANCE)


def calibrated(bands: Sequence[Band], coldest: float) -> tuple[DryShear, float]:
    """tau_0 and Delta, at most `coldest` (K), by least squares, and the rms of ln(mu / middle)."""

    def off(logarithms: Array) -> Array:
        dry = DryShear(*np.exp(logarithms))
        return np.array([np.log(band.mu(dry) / band.middle).mean() for band in bands])

    limits = np.log([[1e4, SHORTEST], [1e7, coldest]])
    found = least_squares(off, np.log(FIRST), bounds=tuple(limits), diff_step=1e-2)
    return DryShear(*np.exp(found.x)), float(np.sqrt(np.mean(found.fun**2)))


def deepest(bands: Sequence[Band]) -> float:
    """The largest T_m + delta - T (K) of bands: tau_b of colder ice does not enter them."""
    return RESIDUAL - min(min(band.celsius) for band in bands)


def rounded(dry: DryShear) -> DryShear:
    """To 10 kPa and 0.1 K."""
    return DryShear(round(dry.stress, -4), round(dry.softening, 1))


def geometric(mu: Array) -> float:
    """The geometric mean."""
    return float(np.exp(np.log(mu).mean()))


def span(mu: Array) -> str:
    """The least and the largest mu of a band's conditions."""
    return f"{mu.min():.3f} to {mu.max():.3f}" if mu.size > 1 else ""


def predict(bands: Sequence[Band], dry: DryShear) -> None:
    """Print what the model gives under the conditions of bands."""
    found = [band.mu(dry) for band in bands]
    rows = zip(bands, found, strict=True)
    head = ("conditions", "predicted mu", "over the conditions")
    table(head, ((band.conditions, f"{geometric(mu):.3f}", span(mu)) for band, mu in rows))


def compare(bands: Sequence[Band], dry: DryShear) -> None:
    """Print the model's mu beside that of the bands, and how many are met."""
    rows = []
    for band in bands:
        every = band.mu(dry)
        mu = geometric(every)
        off = mu / band.middle
        met = "met" if 1.0 / FACTOR <= off <= FACTOR else "missed"
        where, _, _ = band.conditions.partition(";")
        numbers = (f"{band.low:g}", f"{band.high:g}", f"{mu:.3f}", span(every), f"{off:.2f}")
        rows.append((where, band.source, *numbers, met))
    head = ("band", "source", "low", "high", "model mu", "over the conditions",
            "over the middle", f"within a factor of {FACTOR:g}")  # fmt: skip
    table(head, rows)
    print(f"Met: {sum(row[-1] == 'met' for row in rows)} of {len(rows)}.")


def main() -> None:
    """Calibrate, predict, compare."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="two sets instead of three")
    given = parser.parse_args()
    reference = float(passing(2.0, 4.0, -4.0).mu_mean[0])
    print(f"Film law alone, 20 mm, 2 bar, 4 m/s, -4 degC: mean mu {reference:.3f}.")

    exact, rms = calibrated(FOR_CALIBRATION, deepest(FOR_CALIBRATION))
    dry = rounded(exact)
    print(
        f"Calibrated on {len(FOR_CALIBRATION)} bands: tau_0 = {1e-6 * exact.stress:.3f} MPa, "
        f"Delta = {exact.softening:.2f} K (delta {RESIDUAL:g} K), rms of ln mu {rms:.3f}; "
        f"rounded: {dry}."
    )
    slope = exact.stress / exact.softening
    other, cold = DryShear(slope * 40.0, 40.0), PREDICTED[5]
    offs = [np.log(band.mu(other) / band.middle).mean() for band in FOR_CALIBRATION]
    print(
        f"What they do not fix: with {other} (the same tau_0 / Delta) the rms is "
        f"{float(np.sqrt(np.mean(np.square(offs)))):.3f}, and mu at {cold.celsius[0]:g} degC "
        f"{geometric(cold.mu(other)):.2f} instead of {geometric(cold.mu(dry)):.2f}."
    )
    print(f"\nPrediction of the other bands with {dry}, before they are compared:")
    predict(PREDICTED, dry)
    every = (*FOR_CALIBRATION, *PREDICTED)
    print(f"\nAll bands with {dry}; the first {len(FOR_CALIBRATION)} are what it is calibrated on:")
    compare(every, dry)
    if not given.quick:
        print(f"\nAll bands with {FIRST}, another calibration on such bands:")
        compare(every, FIRST)
    best, rms = calibrated(every, deepest(every))
    print(f"\nAll bands with {rounded(best)}, calibrated on all of them, rms of ln mu {rms:.3f}:")
    compare(every, rounded(best))


if __name__ == "__main__":
    main()
