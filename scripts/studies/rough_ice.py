"""Rough ice: what hysteresis is worth, where it fails, and what it does to measured stops.

`worth`: mu_h over the rms height and the shortest wave of the ice, for the rubber of the case
`rough_ice`. `cost`: seconds of one condition, and of a wheel's curve with and without it.
`stops`: the cars of `measured_friction` on ice of 0 to 10 um, with and without each effect; nothing
is fitted to them. `smooth`: mu over slip beside a public Magic Formula for smooth ice.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from iceslide_fem.film.hysteresis import hysteresis_of
from iceslide_fem.preprocess.wheel.command import WHEEL
from iceslide_fem.preprocess.work import run
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import Scene, as_toml
from iceslide_fem.surfaces.rough_ice import sliding
from scripts.studies.common import case, options, table
from scripts.studies.measured_friction import PATCH, STOPS, WIDTH, G, Stops

HEIGHTS = 1.0, 3.0, 10.0  # um, rms
WAVES = 100.0, 35.0, 10.0, 2.0, 0.2  # um, shortest
CONDITIONS = ((1e-3, -20.0), (1e-2, -20.0), (1.0, -5.0), (10.0, -5.0))  # m/s, degC
PRESSURE = 2e5
WITHIN = 1.5
# Found for published bands of friction by an earlier search, second hand: dry stress, softening,
# speed and width of its bell at -20 degC, activation energy.
BELL = (
    "film.dry_stress=0.665MPa", "film.dry_softening=14.1K", "film.dry_speed=6.3mm/s",
    "film.dry_width=5.27", 'film.dry_shift={reference="-20 degC", activation_energy="189 kJ/mol"}',
)  # fmt: skip
FAR = "ice.roughness.shortest=35um"
# Waves of the surface file cases/surfaces/compound_B.toml.
OF_RUBBER = (
    "rubber.roughness.rms=4.95um", "rubber.roughness.hurst=0.99",
    "rubber.roughness.longest=91.7um", "rubber.roughness.shortest=11.6um",
)  # fmt: skip
EFFECTS: Mapping[str, tuple[str, ...]] = {
    "dry and film": ("ice.roughness.rms=0um",),
    "1 um": ("ice.roughness.rms=1um",),
    "3 um": ("ice.roughness.rms=3um",),
    "10 um": ("ice.roughness.rms=10um",),
    "10 um, waves to 35 um": ("ice.roughness.rms=10um", FAR),
    "3 um, both rough": ("ice.roughness.rms=3um", *OF_RUBBER),
    "10 um, both rough": ("ice.roughness.rms=10um", *OF_RUBBER),
    "over speed": ("ice.roughness.rms=0um", *BELL),
    "3 um, over speed": ("ice.roughness.rms=3um", *BELL),
}
# A Magic Formula for smooth ice that is passed on without its source: peak, its slip, slope at 0.
PUBLIC = 0.172, 0.054, 9.5
CARCASS = 132e6  # Pa/m, with which the slope of ours is that of the public set


def worth() -> Iterator[tuple[object, ...]]:
    """mu_h by conditions, rms heights and shortest waves."""
    for speed, celsius in CONDITIONS:
        for height in HEIGHTS:
            cells = []
            for wave in WAVES:
                changes = [f"ice.roughness.rms={height}um", f"ice.roughness.shortest={wave}um"]
                law = hysteresis_of(case("rough_ice", *changes))
                assert law is not None
                reduced = speed * law.shift(ZERO_CELSIUS + celsius)
                cells.append(f"{sliding(law.ice, law.rubber, reduced, PRESSURE).mu[0]:.4f}")
            yield (f"{speed:g}", f"{celsius:g}", f"{height:g}", *cells)


def cost() -> Iterator[tuple[object, ...]]:
    """Seconds of one condition, of the law's table, and of a wheel's curve."""
    scene = case("rough_ice")
    law = hysteresis_of(scene)
    assert law is not None
    speed = law.shift(scene.rubber_temperature)
    yield "one condition, ms", f"{1e3 * best(lambda: sliding(law.ice, law.rubber, speed, 2e5)):.2f}"

    def made() -> None:
        vars(law).pop("_table", None)
        law.shear(np.array([2e5]), np.array([1.0]), 268.0)

    yield "the law's table, ms", f"{1e3 * best(made):.0f}"
    seconds = {}
    for name in ("dry and film", "3 um", "3 um, both rough"):
        scene = case("rough_ice", *EFFECTS[name])
        with tempfile.TemporaryDirectory() as folder:
            given = wheel_options(Path(folder), scene, {"speed": "20km/h", "temperature": "-5degC"})
            out = Path(folder) / "wheel"
            seconds[name] = best(partial(run, WHEEL, given, out, True))
        yield f"a wheel's curve, {name}, s", f"{seconds[name]:.2f}"
    for name in ("3 um", "3 um, both rough"):
        yield f"ratio, {name}", f"{seconds[name] / seconds['dry and film']:.2f}"


def best(work: Any) -> float:
    """Least seconds of five calls, after a first one."""
    found = []
    for _ in range(6):
        begun = perf_counter()
        work()
        found.append(perf_counter() - begun)
    return min(found[1:])


def wheel_options(folder: Path, scene: Scene, more: Mapping[str, Any]) -> dict[str, Any]:
    """Options of a slick of 130 mm under 3 bar on the ice of a scene."""
    line, file = folder / "line.csv", folder / "scene.toml"
    cells = "".join(f"{WIDTH * (i + 0.5):.6g},3e5\n" for i in range(round(PATCH / WIDTH)))
    line.write_text("x_m,pressure_Pa\n" + cells)
    file.write_text(as_toml(scene.as_dict()))
    return {"line": str(line), "scene": str(file), "stiffness": "68.25MPa/m"} | dict(more)


def stops(of: Sequence[Stops], names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Measured and computed friction of stops, at the peak and locked, by effect."""
    met: dict[str, list[int]] = {name: [0, 0] for name in names}
    for one in of:
        cells = []
        for name in names:
            peak, locked = stop(one, EFFECTS[name])
            cells += [f"{peak:.3f}", f"{locked:.3f}"]
            for i, mu in enumerate((peak, locked)):
                met[name][i] += one.middle / WITHIN <= mu <= one.middle * WITHIN
        yield (one.what, f"{one.celsius:g}", f"{one.middle:.3f}", *cells)
    counts = [f"{count} of {len(of)}" for pair in met.values() for count in pair]
    yield (f"within {WITHIN:g}", "", "", *counts)


def stop(one: Stops, changes: tuple[str, ...]) -> tuple[float, float]:
    """Mean friction of a stop, at the peak and locked."""
    scene = case("rough_ice", "film.initial_height=0nm", *changes)
    first, last = one.first / 3.6, max(one.last, 1.0) / 3.6
    with tempfile.TemporaryDirectory() as folder:
        more = {
            "speed": f"{one.first}km/h", "abs": True, "end_speed": f"{max(one.last, 1.0)}km/h",
            "temperature": f"{one.celsius}degC",
        }  # fmt: skip
        given = wheel_options(Path(folder), scene, more)
        found = run(WHEEL, given, Path(folder) / "wheel").figures["stops"]
    ideal = next(name for name in found if "peak" in name or "ideal" in name)
    peak, locked = (
        (first**2 - last**2) / (2.0 * G * found[name]["distance_m"]) for name in (ideal, "locked")
    )
    return peak, locked


def smooth() -> Iterator[tuple[object, ...]]:
    """Peak of mu over slip, its slip, and the slope at 0: the public set, ours, with a carcass."""
    yield ("a public set for smooth ice", *(f"{value:g}" for value in PUBLIC))
    scene = case("rough_ice", *EFFECTS["dry and film"])
    slips = ",".join(f"{slip:.4g}" for slip in [0.002, *np.geomspace(0.005, 0.4, 40)])
    for name, more in (("rigid carcass", {}), ("carcass in series", {"carcass": f"{CARCASS}Pa/m"})):
        with tempfile.TemporaryDirectory() as folder:
            asked = {"speed": "30km/h", "temperature": "-4degC", "slip": slips, **more}
            given = wheel_options(Path(folder), scene, asked)
            curve = run(WHEEL, given, Path(folder) / "wheel").found.curves[0]
        top = curve.peak
        assert top is not None
        yield (name, f"{top.mu:.3f}", f"{top.slip:.3g}", f"{curve.slope:.3g}")


def main() -> None:
    """Print the tables."""
    parser = options(__doc__)
    known = ("worth", "cost", "stops", "smooth")
    parser.add_argument("--questions", nargs="+", choices=known, default=list(known))
    parser.add_argument("--quick", action="store_true", help="two stops and effects")
    given: argparse.Namespace = parser.parse_args()
    if "worth" in given.questions:
        table(["m/s", "°C", "rms, um", *(f"waves to {wave:g} um" for wave in WAVES)], list(worth()))
    if "cost" in given.questions:
        table(["part", "seconds"], list(cost()))
    if "smooth" in given.questions:
        table(["wheel, slick", "peak of mu", "at slip", "slope at 0"], list(smooth()))
    if "stops" in given.questions:
        of, names = (STOPS[:2], [*EFFECTS][:2]) if given.quick else (STOPS, [*EFFECTS])
        ends = [f"{name}{end}" for name in names for end in (", peak", ", locked")]
        table(["tyres, test", "ice, °C", "measured mu", *ends], list(stops(of, names)))


if __name__ == "__main__":
    main()
