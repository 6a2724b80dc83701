"""The surface of compound B, and what pressing rough surfaces costs.

`compounds`: k, D and H_V of compounds A, B and C on the surface found for B, drawn for B; the
tables of cases/surfaces, which --update-tables makes anew. Those of A and C are predictions.
`fit`: a search for generated surfaces with the parameters published for B, by differential
evolution over rms slope, Hurst exponent, roll-off over shortest wave and skewness; the scale, by
which D and H_V grow alike, follows by itself. Once for each reading of k at 5 bar and choice of
what is fitted, by either definition of k and D (the thesis's with two pixels to the shortest wave,
as its mesh has). `cost`: processor seconds of one thread over pixels, beside tamaas and
ContactMechanics where they are installed, and seconds and memory of the command on a measured map.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from scipy.optimize import differential_evolution

from iceslide_fem.postprocess.report.png import figure_of
from iceslide_fem.preprocess.roughness.case import RoughnessCase
from iceslide_fem.preprocess.roughness.charts import charts
from iceslide_fem.preprocess.roughness.generate import SurfaceSpec, generate
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.preprocess.roughness.parameters import Definition
from iceslide_fem.preprocess.roughness.survey import Survey, parameters, survey
from iceslide_fem.preprocess.roughness.survey import table as csv_text
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import IceslideError
from iceslide_fem.scene.materials import BAR, CONTACT_TABLES, YOUNGS_MODULUS
from iceslide_fem.surfaces.surface import Surface
from scripts.studies.common import ROOT, draw, iceslide_words, options, picture_options, table

SURFACES = ROOT / "cases" / "surfaces"
REMARKS = {
    "A": "# predicted: compound A with the surface of compound_B.toml",
    "B": "# compound B with the surface of compound_B.toml",
    "C": "# predicted: compound C with the surface of compound_B.toml",
}


def compounds(given: argparse.Namespace) -> None:
    """Print and draw the parameters of B, and write the tables of all where it is asked for."""
    realisations = "1" if given.quick else "8"

    def surveyed(name: str, pressures: str) -> Survey:
        asked = {"surface": str(SURFACES / "compound_B.toml"), "compound": name}
        counted = {"realisations": realisations, "pressures": pressures}
        return survey(RoughnessCase.of(asked | counted))

    if given.update_tables:
        for name, remark in REMARKS.items():
            text = csv_text(surveyed(name, "0.02bar:20bar:19"))
            (SURFACES / f"compound_{name}.csv").write_text(f"{remark}\n{text}", encoding="utf-8")
    found = surveyed("B", "0.2bar:20bar:12")
    head, *rows = (line.split(",") for line in csv_text(found).splitlines() if line[:1] != "#")
    table(head, rows)
    parts = charts(found.case, [found])
    for name in ("contact", "parameters"):
        draw(figure_of(parts[name]), given.pictures / f"roughness_{name}.png")


# --- which generated surface has the contact parameters that are published for compound B?

B = CONTACT_TABLES["B"]
MODULUS = YOUNGS_MODULUS["B"] / 0.75
PRESSURES = np.array([1.0, 5.0]) * BAR
SHORTEST = 35e-6  # before scaling
PIXELS_PER_WAVE: dict[Definition, int] = {"hydrodynamic": 5, "thesis": 2}
WAVES: dict[Definition, int] = {
    "hydrodynamic": 20,
    "thesis": 28,
}  # of the shortest wave along a side
BOUNDS = [(0.15, 0.6), (0.0, 1.0), (1.2, 8.0), (-1.8, 0.8)]
FAILED = 10.0


class Target(NamedTuple):
    """What is fitted: k at 5 bar, and the weights of k, D and H_V at (1 bar, 5 bar)."""

    name: str
    k_5bar: float
    weight: Array


NO_D = np.array([[1.0, 1.0], [0.0, 0.0], [1.0, 1.0]])
ONE_D = np.array([[1.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
TARGETS = [
    Target("k, H_V", 0.605, NO_D),
    Target("k, H_V", 0.505, NO_D),
    Target("k, H_V", 0.405, NO_D),
    Target("k, H_V, D at 1 bar", 0.605, ONE_D),
]


def surface_of(values: Array, definition: Definition) -> SurfaceSpec:
    """The unscaled surface with slope, Hurst exponent, roll-off and skewness in `values`."""
    slope, hurst, ratio, skewness = (float(value) for value in values)
    return SurfaceSpec(
        rms_slope=slope,
        hurst=hurst,
        rolloff=ratio * SHORTEST,
        shortest_wave=SHORTEST,
        skewness=skewness,
        size=WAVES[definition] * SHORTEST,
        pixels=WAVES[definition] * PIXELS_PER_WAVE[definition],
    )


def found(values: Array, definition: Definition, realisations: int) -> Array:
    """k, D, H_V (rows) at 1 and 5 bar of the unscaled surface, mean over realisations."""
    spec = surface_of(values, definition)
    each = [
        np.array(parameters(generate(spec, number), MODULUS, PRESSURES, definition)[:3])
        for number in range(realisations)
    ]
    return np.asarray(np.mean(each, axis=0))


def misfit(target: Target, parameters_found: Array) -> tuple[Array, float]:
    """Logarithmic differences after the best scaling of the surface, and that scale."""
    wanted = np.array([[B.k.values[0], target.k_5bar], B.D.values, B.H_V.values])
    difference = np.log(parameters_found / wanted)
    lengths = target.weight[1:]
    scale = -float((lengths * difference[1:]).sum() / lengths.sum())
    difference[1:] += scale
    return difference, float(np.exp(scale))


def rms(target: Target, difference: Array) -> float:
    """Root of the weighted mean square."""
    return float(np.sqrt((target.weight * difference**2).sum() / target.weight.sum()))


def best(target: Target, definition: Definition, generations: int, realisations: int) -> Array:
    """The four numbers of the surface that fits best."""

    def cost(values: Array) -> float:
        try:
            return rms(target, misfit(target, found(values, definition, realisations))[0])
        except IceslideError:  # its skewness cannot be had
            return FAILED

    result = differential_evolution(
        cost, BOUNDS, maxiter=generations, popsize=6, seed=1, polish=False, init="sobol"
    )
    return np.asarray(result.x)


def fit(given: argparse.Namespace) -> None:
    """Print the surfaces that fit best, and their misfits."""
    generations, realisations, shown = (1, 1, 1) if given.quick else (15, 3, 8)

    def rows() -> Iterator[tuple[object, ...]]:
        for definition in [given.definition] if given.definition else list(PIXELS_PER_WAVE):
            for target in TARGETS[:1] if given.quick else TARGETS:
                values = best(target, definition, generations, realisations)
                fitted = found(values, definition, shown)
                difference, scale = misfit(target, fitted)
                fitted[1:] *= scale
                slope, hurst, ratio, skewness = values
                height = generate(surface_of(values, definition)).heights.std()
                yield (
                    definition, target.name, target.k_5bar, f"{rms(target, difference):.1%}",
                    *("{:.3g}, {:.3g}".format(*row) for row in fitted * [[1], [1e6], [1e6]]),
                    f"{1e6 * scale * height:.2f}", f"{slope:.2f}", f"{hurst:.2f}",
                    *(f"{1e6 * scale * wave * SHORTEST:.1f}" for wave in (ratio, 1.0)),
                    f"{skewness:.2f}",
                )  # fmt: skip

    head = ("definition", "fitted", "k at 5 bar", "rms misfit", "k", "D, um", "H_V, um")
    of_surface = ("rms height, um", "rms slope", "Hurst", "roll-off, um", "shortest wave, um")
    table((*head, *of_surface, "skewness"), rows())


# --- seconds and memory

LIKE_B = {
    "rms_height": 5.8e-6, "hurst": 0.2, "rolloff": 175e-6, "shortest_wave": 35e-6, "skewness": -1.2,
}  # fmt: skip
FIVE = np.array([0.5, 1.0, 2.0, 3.5, 5.0]) * BAR
# Processor seconds and memory (kB) of a command. A large process would count its own memory.
MEASURED = """
import json, resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, check=True)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(json.dumps([used.ru_utime + used.ru_stime, used.ru_maxrss]))
"""
Found = list[tuple[float, float]]  # fraction of pixels that touch, mean gap (m)


def ours(surface: Surface, pressures: Array) -> Found:
    """Our own solver."""
    contacts = press(surface.heights, surface.pixel, MODULUS, pressures.tolist())
    return [(float((c.pressure > 0).mean()), float(c.gap.mean())) for c in contacts]


def tamaas(surface: Surface, pressures: Array) -> Found:
    """Polonsky and Keer's method of tamaas."""
    import tamaas as tm

    tm.set_log_level(tm.LogLevel.warning)
    model = tm.ModelFactory.createModel(
        tm.model_type.basic_2d, list(surface.size), list(surface.heights.shape)
    )
    model.E, model.nu = MODULUS, 0.0
    kind = tm.PolonskyKeerRey.pressure
    solver = tm.PolonskyKeerRey(model, surface.heights.copy(), 1e-9, kind, kind)
    solver.max_iter = 10000
    found = []
    for p in pressures:
        solver.solve(p)
        found.append(
            _share_and_gap(surface, np.array(model.traction), np.array(model.displacement))
        )
    return found


def contact_mechanics(surface: Surface, pressures: Array) -> Found:
    """The constrained conjugate gradients of ContactMechanics."""
    from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
    from SurfaceTopography import Topography

    shape, area = surface.heights.shape, surface.size[0] * surface.size[1]
    substrate = PeriodicFFTElasticHalfSpace(shape, MODULUS, surface.size)
    system = make_system(substrate=substrate, surface=Topography(surface.heights, surface.size))
    found = []
    for p in pressures:
        result = system.minimize_proxy(external_force=p * area, pentol=1e-12, maxiter=10000)
        if not result.success:
            raise RuntimeError(result.message)
        force = np.abs(np.asarray(substrate.force))
        found.append(_share_and_gap(surface, force, np.asarray(system.disp)))
    return found


def _share_and_gap(surface: Surface, pressure: Array, displacement: Array) -> tuple[float, float]:
    touching, gap = pressure > 0, displacement - surface.heights
    return float(touching.mean()), float((gap - gap[touching].mean()).clip(0.0).mean())


PROGRAMS: dict[str, Callable[[Surface, Array], Found]] = {
    "this program": ours,
    "tamaas": tamaas,
    "ContactMechanics": contact_mechanics,
}


def seconds_of_programs(given: argparse.Namespace) -> Iterator[tuple[object, ...]]:
    """Rows of five pressures, by pixels and program."""
    for pixels in (64, 128) if given.quick else (128, 256, 512, 1024, 2048):
        if pixels > given.largest:
            return
        spec = SurfaceSpec.model_validate(LIKE_B | {"size": pixels * 4e-6, "pixels": pixels})
        surface = generate(spec)
        for name, program in PROGRAMS.items():
            if program is not ours and (pixels > 512 or not importlib.util.find_spec(name)):
                continue
            begun = process_time()
            contacts = program(surface, FIVE)
            spent = process_time() - begun
            k = ", ".join(f"{contacts[i][0]:.5f}" for i in (0, 1, 4))
            H = ", ".join(f"{1e6 * contacts[i][1]:.5f}" for i in (0, 1, 4))
            yield f"{pixels} x {pixels}", name, f"{spent:.2f}", k, H


def of_command(given: argparse.Namespace) -> Iterator[tuple[object, ...]]:
    """Rows of the command on a map of an instrument: two sizes, whose difference is per pixel."""
    before: tuple[int, float] | None = None
    for pixels in (128, 512) if given.quick else (512, 1024):
        surface = generate(
            SurfaceSpec.model_validate(LIKE_B | {"size": pixels * 2e-6, "pixels": pixels})
        )
        with tempfile.TemporaryDirectory() as folder:
            np.save(Path(folder, "map.npy"), surface.heights)
            words = ["roughness", f"{folder}/map.npy", "--pixel", "2um", "--shortest-wave", "8um"]
            words += ["--pressures", "0.5bar:5bar:5", "--out", f"{folder}/out"]
            measured = [sys.executable, "-c", MEASURED, *iceslide_words(*words)]
            done = subprocess.run(measured, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(words)} has not ended: {done.stderr}")
        seconds, kilobytes = json.loads(done.stdout)
        memory = 1024.0 * kilobytes
        per_pixel = "" if before is None else (memory - before[1]) / (pixels**2 - before[0])
        before = pixels**2, memory
        shown = f"{per_pixel:.0f}" if per_pixel else ""
        yield f"{pixels} x {pixels}", f"{seconds:.1f}", f"{memory / 1e6:.0f}", shown


def cost(given: argparse.Namespace) -> None:
    """Print seconds of the solvers, then seconds and memory of the command."""
    head = ("pixels", "program", "seconds, five pressures", "k_raw at 0.5, 1, 5 bar", "H_V, um")
    table(head, seconds_of_programs(given))
    print()
    table(("map of the command", "s", "MB", "bytes for each more pixel"), of_command(given))


QUESTIONS = {"compounds": compounds, "fit": fit, "cost": cost}


def main() -> None:
    """Print the tables and draw the pictures."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="small maps, few surfaces")
    parser.add_argument("--questions", nargs="+", choices=list(QUESTIONS), default=list(QUESTIONS))
    parser.add_argument("--update-tables", action="store_true", help="write cases/surfaces anew")
    parser.add_argument("--definition", choices=list(PIXELS_PER_WAVE), help="of fit; else both")
    parser.add_argument("--largest", type=int, default=2048, help="pixels a side, of cost")
    picture_options(parser)
    given = parser.parse_args()
    for name in given.questions:
        QUESTIONS[name](given)


if __name__ == "__main__":
    main()
