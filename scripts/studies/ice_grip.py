"""The ice grip index of a compound and a pattern, and what steps, tables and starts do to it.

`index`: `iceslide compare` on cases/tyres at four temperatures, with its seconds. `settings`:
decelerations and ratios at -4 degC with finer tables, pixels and tolerance. `starts`: the ratio of
compounds by the start of the stop, and its means over phases. `wet`: two patterns, with grooves of
4 and 8 mm, on wet ice near melting.
`bands`: the band of a ratio to first order beside that of samples, for points. Another program's
values at -4 degC, on its finest table and for one start at 25 km/h: reference 1.3622 (thresholds)
and 2.4947 m/s2 (ideal), A over it 1.1388 and 1.1781, B 0.9470 and 0.9284; A by thresholds over 25
starts 1.0963.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from iceslide_fem.inference.compare.candidates import Candidate, read_candidates
from iceslide_fem.inference.compare.command import COMPARE
from iceslide_fem.preprocess.footprint.reading import read_source
from iceslide_fem.preprocess.wheel.braking import brake
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
from iceslide_fem.preprocess.wheel.slip_table import SMALLEST, SlipTable, slip_table
from iceslide_fem.preprocess.wheel.stops import TOLERANCE, stops_on
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.preprocess.work import run
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.distribution import BAND, read_distribution
from iceslide_fem.scene.variation import with_values
from scripts.studies.common import ROOT, case, options, table

TYRES = ROOT / "cases" / "tyres"
FILES = TYRES / "reference.toml", [TYRES / "candidates.toml"]
STOP = {
    "abs": True, "speed": "25km/h", "measure": "20km/h:5km/h", "end_speed": "5km/h",
}  # fmt: skip
KMH = 3.6
TOP = 30.0 / KMH  # m/s, of tables
SETTINGS = {  # speeds, slip ratios, pixels over those of the file, tolerance
    "default": (16, 41, 1, 1e-2),
    "tolerance 1e-3": (16, 41, 1, 1e-3),
    "80 pixels": (16, 41, 2, 1e-2),
    "32 speeds": (32, 41, 1, 1e-2),
    "81 slip ratios": (16, 81, 1, 1e-2),
    "all of them": (32, 81, 2, 1e-3),
}
STARTS = 49
SPREADS = {"film.dry_stress": "~10%", "film.dry_softening": "~5%", "ice.temperature": "+-0.5K"}


def tables_of(setting: tuple[int, int, int, float]) -> dict[str, tuple[Candidate, SlipTable]]:
    """The table of every candidate."""
    speeds, slips, pixels, tolerance = setting
    found = {}
    for one in read_candidates(*FILES, STOP):
        assert one.wheel is not None
        wheel = one.wheel.model_copy(update={"tolerance": tolerance})
        footprint = read_source(wheel).pressure_map
        finer = replace(
            footprint, pressure=np.repeat(footprint.pressure, pixels, axis=1),
            dx=footprint.dx / pixels,
        )  # fmt: skip
        below = below_wheel(wheel, finer, stiffness_of(wheel, finer))
        axes = (
            np.geomspace(wheel.end_speed, TOP, speeds),
            np.concatenate([[0.0], np.geomspace(SMALLEST, 1.0, slips - 1)]),
        )
        found[one.name] = one, slip_table(finer, *axes, *below)
    return found


def settings(names: Sequence[str]) -> Iterator[tuple[object, ...]]:
    """Decelerations of the reference, and ratios, at each setting: one start, and phases."""
    for name in names:
        begun = time.perf_counter()
        stops = {
            key: stops_on(one.wheel, mu, 1.0)
            for key, (one, mu) in tables_of(SETTINGS[name]).items()
            if one.wheel is not None
        }
        first, *others = stops.values()
        seconds = time.perf_counter() - begun
        values = [first.decelerations("threshold")[0], first.deceleration("ideal")]
        for each in others:
            values += [
                each.decelerations("threshold")[0] / first.decelerations("threshold")[0],
                each.deceleration("threshold") / first.deceleration("threshold"),
                each.deceleration("ideal") / first.deceleration("ideal"),
            ]
        yield (name, *(f"{value:.4f}" for value in values), f"{seconds:.1f}")


def starts() -> Iterator[tuple[object, ...]]:
    """A over the reference by thresholds: from single starts, and means of 8 of them."""
    found = tables_of(SETTINGS["default"])
    speeds = np.linspace(24.0, 30.0, STARTS) / KMH
    measured = 20.0 / KMH, 5.0 / KMH
    values = {}
    for name in ("reference", "A"):
        one, mu = found[name]
        assert one.wheel is not None
        rest = (
            one.wheel.end_speed,
            one.wheel.car(1.0),
            one.wheel.brakes,
            one.wheel.control,
            TOLERANCE,
        )
        values[name] = np.array([brake(mu, float(v), *rest).between(*measured) for v in speeds])
    single = values["A"] / values["reference"]
    whole = values["A"].mean() / values["reference"].mean()
    means = {
        name: stops_on(one.wheel, mu, 1.0).deceleration("threshold")
        for name, (one, mu) in found.items()
        if one.wheel is not None
    }
    of_phases = means["A"] / means["reference"]
    yield "one start, least and most", f"{single.min():.4f} to {single.max():.4f}"
    yield f"mean of {STARTS} starts from 24 to 30 km/h", f"{whole:.4f}"
    yield "8 phases of a cycle, the default", f"{of_phases:.4f}"


def index(
    temperature: str, more: dict[str, object], files: tuple[Path, list[Path]] = FILES
) -> Iterator[tuple[object, ...]]:
    """`iceslide compare`: its rows."""
    with tempfile.TemporaryDirectory() as folder:
        given = {
            "source": files[0], "others": tuple(files[1]), "temperature": temperature,
            "stop": "25km/h", "measure": "20km/h:5km/h", **more,
        }  # fmt: skip
        done = run(COMPARE, given, Path(folder) / "compare")
    for place in done.figures["conditions"]:
        for name, one in place["candidates"].items():
            inputs = one["ratio_inputs"]
            if one["ratio"] is None:
                yield place["name"], name, "none", "", "", "", ""
                continue
            braked = one.get("deceleration_threshold")
            yield (
                place["name"], name, "none" if braked is None else f"{braked:.4f}",
                f"{one['deceleration_ideal']:.4f}", f"{one['ratio']:.4f}",
                f"{one['ratio_numerical'] / one['ratio']:.2%}",
                "" if inputs is None else f"{inputs / one['ratio']:.2%}",
            )  # fmt: skip
    for said in (*done.figures["sentences"], *done.figures["rules"]):
        print(said)
    print(f"{done.figures['wall_s']:.1f} s")


def patterns(folder: Path) -> tuple[Path, list[Path]]:
    """Files of the reference with grooves of 4 mm, and of a variation with 8 mm."""
    text = FILES[0].read_text(encoding="utf-8").replace(' = "even', f' = "{TYRES}/even')
    text = text.replace('"../surfaces', f'"{TYRES}/../surfaces')
    first, other = folder / "narrow.toml", folder / "more.toml"
    first.write_text(text + 'pitch = "28 mm"\ngroove = "4 mm"\n', encoding="utf-8")
    other.write_text('[variations.wide]\ngroove = "8 mm"\n', encoding="utf-8")
    return first, [other]


def bands() -> Iterator[tuple[object, ...]]:
    """Half widths of 95 % bands of two compounds and of their ratio: first order, and samples."""
    scenes = [case("cold_point")]
    scenes.append(with_values(scenes[0], {"film.dry_stress": 0.55e6}))
    inputs = [[read_distribution(one, key, text) for key, text in SPREADS.items()]
              for one in scenes]  # fmt: skip
    drawn = qmc.Sobol(len(SPREADS), seed=9).random_base2(12)
    samples: list[Array] = []
    slopes: list[Array] = []
    for scene, spreads in zip(scenes, inputs, strict=True):
        columns = [one.at(drawn[:, i]) for i, one in enumerate(spreads)]
        keys = [one.parameter.key for one in spreads]
        some = [
            with_values(scene, dict(zip(keys, map(float, row), strict=True)))
            for row in np.column_stack(columns)
        ]
        samples.append(np.log(friction(some).mu_mean[:, 0]))
        moved = [
            with_values(scene, {key: end})
            for key, one in zip(keys, spreads, strict=True)
            for end in one.sides
        ]
        slopes.append(0.5 * np.diff(np.log(friction(moved).mu_mean[:, 0]).reshape(-1, 2))[:, 0])
    for name, logs, slope in (
        ("0.45 MPa", samples[0], slopes[0]),
        ("0.55 MPa", samples[1], slopes[1]),
        ("ratio, inputs shared", samples[1] - samples[0], slopes[1] - slopes[0]),
    ):
        low, high = np.quantile(logs, (0.025, 0.975))
        yield name, f"{BAND * np.linalg.norm(slope):.2%}", f"{0.5 * (high - low):.2%}"


def main() -> None:
    parser = options(__doc__)
    asked = ("index", "settings", "starts", "wet", "bands")
    parser.add_argument("--questions", nargs="+", choices=asked, default=["index"])
    parser.add_argument("--quick", action="store_true", help="one temperature, default settings")
    given: argparse.Namespace = parser.parse_args()
    head = ("condition", "tyre", "thresholds, m/s2", "ideal, m/s2", "ratio", "steps", "inputs")
    if "index" in given.questions:
        table(head, list(index("-4degC" if given.quick else "-12degC,-8degC,-4degC,-1degC", {})))
    if "wet" in given.questions:
        waters = "0um" if given.quick else "0um,20um,50um"
        # Control by thresholds keeps a wheel on water at slips where there is no friction.
        more: dict[str, object] = {"water": waters, "output": "deceleration_ideal"}
        with tempfile.TemporaryDirectory() as folder:
            files = patterns(Path(folder))
            found = list(index("-5degC" if given.quick else "-5degC,-2degC", more, files))
        table(head, found)
    if "settings" in given.questions:
        head_of_settings = (
            "table", "reference, thresholds", "ideal", "A, one start", "phases", "ideal",
            "B, one start", "phases", "ideal", "s",
        )  # fmt: skip
        names = ["default"] if given.quick else list(SETTINGS)
        table(head_of_settings, settings(names))
    if "starts" in given.questions:
        table(("starts", "A over the reference"), list(starts()))
    if "bands" in given.questions:
        table(("what", "first order", "4096 samples"), list(bands()))


if __name__ == "__main__":
    main()
