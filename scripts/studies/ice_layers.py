"""Are the layers below the ice's surface fine enough, whatever the duration? 10 us to 1 s.

Errors of mu(t) at one point with the layers that ice has, in all their modes and in as few as
`continuum` ice is given at a tolerance, against a much finer column: ice that is rubbed for the
duration, attached or on its way below the block. Speed and ice temperature are such that it melts
after a quarter of the time or less and the film then grows by half, where heat matters most (0.3 to
30 m/s, compound B at 1 bar). Then slices on ice that passes: continuum against columns. With
--slices.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np

from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.interface.build import CONDENSED
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import (
    CONTACT_TABLES,
    ICE_DIFFUSIVITY,
    ICE_EFFUSIVITY,
    MELTING_ENTHALPY,
    MELTING_TEMPERATURE,
    WATER_VISCOSITY,
)
from scripts.studies.blocks import slid
from scripts.studies.common import options, table

PRESSURE, INITIAL_HEIGHT = 1e5, 70e-9
DURATIONS = (1e-5, 1e-4, 1e-3, 7e-3, 0.1, 1.0)


def melting(duration: float) -> tuple[Conditions, float]:
    """Conditions under which the film and its heat matter within `duration` (s); the speed."""
    k, D, H_V, _ = (float(part) for part in CONTACT_TABLES["B"](PRESSURE))
    viscous = k * WATER_VISCOSITY
    speed = 1.5 * INITIAL_HEIGHT * sqrt(MELTING_ENTHALPY / (viscous * duration))
    speed = min(max(speed, 0.3), 30.0)
    flux = viscous * speed**2 / INITIAL_HEIGHT
    rise = min(2.0 * flux * sqrt(0.25 * duration / pi) / ICE_EFFUSIVITY, 40.0)
    here = Conditions.of(pressure=PRESSURE, speed=speed, temperature=MELTING_TEMPERATURE - rise,
                         k=k, D=D, H_V=H_V, initial_height=INITIAL_HEIGHT,
                         duration=duration)  # fmt: skip
    return here, speed


def errors(here: Conditions, ice: Column, tolerance: float) -> tuple[float, float]:
    """Largest and mean relative error of mu(t) above `ice`."""
    duration = float(here.duration[0])
    times = duration * np.linspace(0.02, 0.999, 200)
    fine = Column(here.temperature, duration, first_layer=0.003, ratio=1.15, depth=6.0)
    exact, found = (simulate(here, one, tolerance, times=times) for one in (fine, ice))
    largest = np.abs(found.samples / exact.samples - 1.0).max()
    return float(largest), float(abs(found.mu_mean[0] / exact.mu_mean[0] - 1.0))


def layers() -> None:
    """Errors over duration, of all modes and of those at the scene's tolerance."""
    rows = []
    for duration in DURATIONS:
        here, speed = melting(duration)
        thermal = sqrt(ICE_DIFFUSIVITY * duration)
        row = [f"{duration:g}", f"{speed:.2g}", f"{1e6 * thermal:.3g}"]
        whole = Column(here.temperature, duration)
        parts = [whole.condensed(CONDENSED * tolerance) for tolerance in (1e-2, 1e-3, 1e-4)]
        for ice in (whole, *parts):
            largest, mean = errors(here, ice, 1e-5)
            row.append(f"{ice.rates.size}: {largest:.1e}, {mean:.1e}")
        rows.append(row)
    head = ["duration (s)", "speed (m/s)", "thermal layer (um)", "all modes"]
    table([*head, "tolerance 1e-2", "1e-3", "1e-4"], rows)


def slices() -> None:
    """Slices on ice that passes: continuum against columns, mean of mu over two transits."""
    rows = []
    for length, speed in ((1e-3, 30.0), (1e-3, 3.0), (20e-3, 4.0)):
        means = []
        for heat in ("column", "continuum"):
            data: dict[str, Any] = {
                "name": "layers",
                "model": "slice",
                "rubber": {"compound": "B", "length": length, "height": 0.1 * length},
                "load": {"pressure": PRESSURE, "speed": speed, "duration": 2.0 * length / speed},
                "ice": {"motion": "sliding", "heat": heat, "temperature": "-0.5 degC"},
                "numerics": {"tolerance": 1e-2},
            }
            means.append(slid(scene_from_dict(data)).mean)
        transit = f"{1e3 * length / speed:.3g}"
        difference = f"{means[1] / means[0] - 1.0:.2%}"
        values = (f"{mean:.4f}" for mean in means)
        rows.append((f"{1e3 * length:g}", f"{speed:g}", transit, *values, difference))
    table(
        ("length (mm)", "speed (m/s)", "transit (ms)", "columns", "continuum", "difference"), rows
    )


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    parser.add_argument("--slices", action="store_true", help="only the slices, a minute")
    if parser.parse_args().slices:
        slices()
    else:
        layers()


if __name__ == "__main__":
    main()
