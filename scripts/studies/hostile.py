"""Scenes at and beyond the edges of every range: what becomes of them.

Points, slices and coarse blocks, on attached ice and on ice that slides with either carrier, then
points and slices drawn at random: on wet ice, and with components of the film law together. Each is
refused well (one sentence), finished well
(finite, mu > 0 below constant loads, all water accounted for, energies that close to 1 % or a
warning), stopped with its cause (a sentence; how many of these by the study's time limit is said),
or wrong: anything else, also no answer in time. Time is the processor's, so that what else runs on
the machine does not count. Prints the counts, and every wrong scene. What became of each is kept in
results/studies/hostile.jsonl as it comes, from where --go-on takes it. --quick runs every fortieth,
--wet those on wet ice alone, --components those of components.
"""

from __future__ import annotations

import csv
import itertools
import json
import math
import multiprocessing
import random
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic, process_time
from typing import Any, NamedTuple

import psutil

from iceslide_fem.coupling.step_error import LIMITS
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.scene import parsed, put, scene_from_dict
from scripts.studies.common import RESULTS, ROOT, options, table
from scripts.studies.component_changes import component_changes
from scripts.studies.wet_changes import wet_changes

TIME_LIMIT = 10.0  # s of the processor that a slice or block may take: numerics.time_limit
PATIENCE = 20.0  # s that its process may take longer, for one step, or to find that it can't run
LOOK = 5.0  # s between two looks at a process
IDLE = 300.0  # s after which a process that has done nothing hangs
LARGEST_IMBALANCE, LARGEST_LEAK, ROUNDING = 0.01, 1e-6, 1e-9
NO_FRICTION = 1e-6
BORNE = "water_borne_fraction"  # a column of runs with voids that carry
# Of water: where it comes from, and where it is.
LEDGER = ("brought", "squeezed"), ("below", "left", "in_sipes", "pushed_out")
OUTCOMES = ("refused well", "finished well", "stopped with its cause", "wrong")

KINEMATICS = {
    "attached": [],
    "films on the ice": ["ice.motion=sliding", "film.carrier=ice"],
    "films on the rubber": ["ice.motion=sliding", "film.carrier=rubber"],
}
# One change each, or several that belong together: ends of the stated ranges and beyond them.
OF_ALL = """
    load.pressure=0.01bar; load.pressure=0.2bar; load.pressure=5bar; load.pressure=10bar
    load.pressure=100bar; load.speed=1e-6; load.speed=1mm/s; load.speed=30; load.speed=40
    load.speed=100; load.duration=1us; load.duration=1s; ice.temperature=-80degC
    ice.temperature=-40degC; ice.temperature=-0.1degC; ice.temperature=-0.001degC
    film.initial_height=1nm; film.initial_height=1um; film.initial_height=10um
    film.k=1e-6 film.D=29um film.H_V=2.86um; film.k=1 film.D=29um film.H_V=2.86um
    film.k=0.266 film.D=0.01um film.H_V=2.86um; film.k=0.266 film.D=10mm film.H_V=2.86um
    film.k=0.266 film.D=29um film.H_V=1nm; film.k=0.266 film.D=29um film.H_V=10mm
    film.k=0.266; rubber.heat=true; rubber.heat=true film.conductance=10
    rubber.heat=true film.conductance=1e9; numerics.tolerance=0.1; ice.heat=half-space
    numerics.film_integrator=sdirk3; numerics.film_integrator=implicit-euler
    numerics.film_integrator=explicit-euler; numerics.max_step=1us
    load.pressure=0.2bar load.speed=30; load.pressure=5bar load.speed=30
    load.pressure=10bar load.speed=1mm/s; load.speed=30 ice.temperature=-0.1degC
"""
OF_RUBBER = """
    rubber.length=10um; rubber.length=50mm; rubber.length=1; rubber.height=10um; rubber.height=3mm
    rubber.height=10mm; rubber.height=10mm load.pressure=0.2bar; rubber.width=10um
    rubber.sipes=1 rubber.sipe_width=0.1mm rubber.sipe_depth=0.5mm
    rubber.sipes=8 rubber.sipe_width=0.05mm rubber.sipe_depth=0.9mm
    rubber.sipes=1 rubber.sipe_depth=5mm; rubber.inertia=true
    rubber.inertia=true load.speed=1mm/s; rubber.inertia=true load.pressure=5bar
    load.static_friction=0; load.static_friction=2; ice.heat=continuum
    ice.heat=continuum load.pressure=0.2bar load.speed=30 ice.temperature=-0.1degC
    ice.heat=continuum ice.margin=1; ice.cell=0.1um; ice.cell=10mm; ice.trail=1
    numerics.penalty=0.001MPa/mm; numerics.penalty=1e6MPa/mm; numerics.shear_ramp_pressure=1Pa
    numerics.shear_ramp_pressure=10bar; film.pressure=nominal; numerics.max_step=1ns
    C10=0.05MPa nu=0.49; C10=0.05MPa nu=0.49 load.pressure=5bar; C10=1000MPa nu=0.3
    C10=0.2MPa nu=0; C10=0.2MPa nu=0 load.pressure=5bar; C10=0.2MPa nu=0.4995 load.pressure=5bar
    C10=0 nu=0.49
"""
OF_BLOCKS = """
    load.pressure=5bar; load.speed=30; load.speed=1mm/s; rubber.height=5mm; rubber.inertia=true
    film.k=0.266 film.D=0.01um film.H_V=2.86um; C10=0.05MPa nu=0.49; load.pressure=100bar
    ice.temperature=-0.001degC; rubber.heat=true; ice.heat=continuum; load.duration=1us
"""
# Several that might be a trap together; one after the other on the kinematics above.
COMBINED = """
    load.pressure=0.2bar load.speed=15; load.pressure=0.05bar load.speed=30; load.duration=1ns
    load.pressure=0.5bar load.speed=30; load.pressure=0.3bar load.speed=25; load.speed=1e4
    numerics.tolerance=0.1; numerics.tolerance=0.05; numerics.tolerance=0.03 load.pressure=5bar
    numerics.tolerance=1e-5 load.duration=10us; film.k=0.9 film.D=1mm film.H_V=50nm
    film.k=0.9 film.D=1mm film.H_V=50nm load.pressure=5bar load.speed=30; film.water_speed=0
    film.water_speed=0 load.pressure=5bar load.speed=30
    rubber.heat=true ice.temperature=-0.1degC load.speed=30; rubber.heat=true rubber.inertia=true
    rubber.inertia=true load.speed=30; rubber.inertia=true numerics.tolerance=0.1
    rubber.inertia=true rubber.height=5mm; rubber.inertia=true C10=0.05MPa nu=0.49
    rubber.inertia=true load.pressure=0.2bar load.speed=30
    rubber.height=0.05mm load.pressure=5bar
    rubber.length=5mm rubber.height=0.2mm load.pressure=5bar
    rubber.length=0.2mm rubber.height=0.6mm
    rubber.sipes=1 rubber.sipe_width=0.9mm rubber.sipe_depth=0.5mm
    rubber.sipes=1 rubber.sipe_width=1.1mm
    rubber.sipes=3 rubber.sipe_width=0.02mm rubber.sipe_depth=0.5mm load.pressure=5bar
    ice.heat=continuum rubber.heat=true; ice.heat=continuum load.duration=1us
    ice.heat=continuum load.pressure=0.2bar load.speed=20; film.pressure=nominal load.speed=30
    film.pressure=nominal load.pressure=0.2bar load.speed=30; film.initial_height=0.1nm
    numerics.shear_ramp_pressure=0.2bar load.pressure=0.2bar load.speed=30
    numerics.film_integrator=explicit-euler numerics.max_step=1ms
    load.static_friction=2 load.pressure=5bar
    numerics.film_integrator=implicit-euler load.pressure=0.2bar load.speed=30
    ice.temperature=0degC; C10=0.05MPa nu=0.49 load.pressure=0.2bar load.speed=30
    C10=0.2MPa nu=0.49 load.speed=30
"""
KEPT = RESULTS / "hostile.jsonl"
SURFACE = ROOT / "cases" / "surfaces" / "compound_B.csv"
RANDOM = 60  # combinations of two of these
WET = "film.voids=carry"  # in the names of scenes on wet ice


class Outcome(NamedTuple):
    """What became of a scene: one of `OUTCOMES`, and its sentence, or what is wrong."""

    kind: str
    words: str


def scenes() -> Iterator[tuple[str, dict[str, Any]]]:
    """Names and tables of all scenes."""
    changes = {
        "point": _changes(OF_ALL),
        "slice": _changes(OF_ALL) + _changes(OF_RUBBER),
        "block": _changes(OF_BLOCKS),
    }
    for model, kinematics in itertools.product(changes, KINEMATICS):
        if model == "point" and kinematics != "attached":
            continue
        for change in changes[model]:
            yield _scene(model, kinematics, change)
    for change, kinematics in zip(_changes(COMBINED), itertools.cycle(KINEMATICS), strict=False):
        yield _scene("slice", kinematics, change)
    draw = random.Random(1)
    for _ in range(RANDOM):
        two = [word for change in draw.sample(changes["slice"], 2) for word in change]
        yield _scene("slice", draw.choice(list(KINEMATICS)), two)
    for drawn in itertools.chain(wet_changes(), component_changes()):
        yield _scene(*drawn)


def outcome(tables: dict[str, Any], pictures: bool = False) -> Outcome:
    """Run a scene in this process; `pictures`: draw its report, too."""
    from iceslide_fem.runs.schedule import Schedule
    from iceslide_fem.simulate import run

    with tempfile.TemporaryDirectory() as folder, redirect_stdout(StringIO()):
        try:
            with redirect_stderr(StringIO()):
                by_processor = Schedule(clock=process_time)
                scene = scene_from_dict(tables)
                summary = run(scene, folder, schedule=by_processor, pictures=pictures)
        except SceneError as refusal:
            return _sentence("refused well", str(refusal))
        except SimulationStopped as stop:
            faults = _faults(Path(folder))
            if faults:
                return Outcome("wrong", f"{faults}, then stopped: {stop}")
            return _sentence("stopped with its cause", str(stop))
        except Exception:
            return Outcome("wrong", traceback.format_exc().strip().splitlines()[-1])
        faults = _faults(Path(folder))
        return (
            Outcome("wrong", faults)
            if faults
            else Outcome("finished well", f"mean mu {summary['mu_mean']:.4g}")
        )


def outcomes(
    chosen: list[tuple[str, dict[str, Any]]], processes: int, pictures: bool = False
) -> Iterator[Outcome]:
    """Outcomes of scenes, which `processes` work on; one that gives no answer is ended."""
    workers: list[_Worker] = [_Worker() for _ in range(processes)]

    def one(scene: tuple[str, dict[str, Any]]) -> Outcome:
        worker = workers.pop()
        try:
            return worker(scene[1], pictures)
        finally:
            workers.append(worker)

    with ThreadPoolExecutor(processes) as pool:
        yield from pool.map(one, chosen)
    for worker in workers:
        worker.end()


class _Worker:
    """A process that runs scenes, begun anew after one that has not come back."""

    def __init__(self) -> None:
        self._begin()

    def __call__(self, tables: dict[str, Any], pictures: bool) -> Outcome:
        self._pipe.send((tables, pictures))
        try:
            if self._answers():
                return Outcome(*self._pipe.recv())
            words = "no answer in time"
        except EOFError:
            words = "the process has died"
        self.end()
        self._begin()
        return Outcome("wrong", words)

    def _answers(self) -> bool:
        """Whether it answers within its time of the processor, and does not sit idle."""
        start = used = self._used()
        worked = monotonic()
        while not self._pipe.poll(LOOK):
            before, used = used, self._used()
            if used > before:
                worked = monotonic()
            if used - start > TIME_LIMIT + PATIENCE or monotonic() - worked > IDLE:
                return False
        return True

    def _used(self) -> float:
        """Time of the processor that it has had, s."""
        try:
            times = psutil.Process(self._process.pid).cpu_times()
        except psutil.NoSuchProcess:
            raise EOFError from None
        return float(times.user + times.system)

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()

    def _begin(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()


def _serve(pipe: Connection) -> None:
    while True:
        pipe.send(tuple(outcome(*pipe.recv())))


def _changes(text: str) -> list[list[str]]:
    """Lists of changes from a text in which they are divided by semicolons and line ends."""
    return [part.split() for line in text.splitlines() for part in line.split(";") if part.strip()]


def _scene(model: str, kinematics: str, changes: list[str]) -> tuple[str, dict[str, Any]]:
    """A small, coarse scene with `changes`; C10 and nu stand for a compound of one's own, `surface`
    for k, D and H_V of a generated one.
    """
    tables: dict[str, Any] = {"name": "hostile", "model": model, "rubber": {"compound": "B"}}
    start = ["load.pressure=1bar", "load.speed=3", "load.duration=0.5ms", "numerics.tolerance=1e-2"]
    if model != "point":
        start += ["numerics.refinement=0.25", f"numerics.time_limit={TIME_LIMIT}"]
    for change in [*start, *KINEMATICS[kinematics], *changes]:
        key, _, text = change.partition("=")
        if key == "surface":
            put(tables, "film.contact", str(SURFACE))
        elif key in ("C10", "nu"):
            own = {"C01": 0.0, "nu": 0.49, **tables["rubber"]}
            own.pop("compound", None)
            tables["rubber"] = own | {key: parsed(text)}
            tables["film"] = {"k": 0.266, "D": 29e-6, "H_V": 2.86e-6} | tables.get("film", {})
        else:
            put(tables, key, parsed(text))
    return f"{model}, {kinematics}: {' '.join(changes)}", tables


def _sentence(kind: str, words: str) -> Outcome:
    """The outcome with its sentence, or wrong if that is none."""
    good = words and "\n" not in words and "nan" not in words.lower().split()
    return Outcome(kind, words) if good else Outcome("wrong", f"no sentence: {words!r}")


def _faults(folder: Path) -> str:
    """What is wrong with the results in `folder`, in words; nothing if there are none."""
    if not (folder / "summary.json").is_file():
        return ""
    with open(folder / "history.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    values = [{key: float(value) for key, value in row.items()} for row in rows]
    if not all(math.isfinite(value) for row in values for value in row.values()):
        return "values that are not finite"
    if fault := _fault_of_mu(values) or _fault_of_water(values):
        return fault
    summary = json.loads((folder / "summary.json").read_text())
    imbalance = summary["energy_imbalance"]
    warned = any("energies do not close" in warning for warning in summary["warnings"])
    if not abs(imbalance) <= LARGEST_IMBALANCE and not warned:
        return f"energies off by {imbalance:.3g} without a warning"
    return ""


def _fault_of_mu(rows: list[dict[str, float]]) -> str:
    """What is wrong with friction over time, in words.

    Where loads go in time, rubber that springs back may push the block, with no more than has
    sheared it, or than counts as none. On deep water it springs back below constant loads, too.
    """
    constant = len({(row["nominal_pressure_Pa"], row["speed_m_per_s"]) for row in rows}) == 1
    largest = LIMITS.least_friction
    for row in rows:
        if row["mu"] <= -NO_FRICTION if constant else row["mu"] < -largest:
            return f"mu = {row['mu']:.3g}"
        largest = max(largest, row["mu"])
    return ""


def _fault_of_water(rows: list[dict[str, float]]) -> str:
    """What is wrong with the water, in words; all of it is somewhere."""
    for row in rows:
        if row["squeezed_height_m"] < 0.0:
            return f"{row['squeezed_height_m']:.3g} m of squeezed-out water"
        if BORNE not in row:
            continue
        if row["water_height_m"] < 0.0 or not -ROUNDING <= row[BORNE] <= 1.0 + ROUNDING:
            return f"{row['water_height_m']:.3g} m of water bear {row[BORNE]:.3g} of the load"
        came, is_there = (sum(row[f"water_{name}_m3"] for name in names) for names in LEDGER)
        most = max(abs(row[f"water_{name}_m3"]) for name in itertools.chain(*LEDGER))
        if abs(came - is_there) > LARGEST_LEAK * most:
            return f"{came - is_there:.3g} of {came:.3g} m3 of water are nowhere"
    return ""


def _kept() -> dict[str, Outcome]:
    """Outcomes by the names of scenes, from an earlier call."""
    if not KEPT.is_file():
        return {}
    rows = [json.loads(line) for line in KEPT.read_text().splitlines()]
    return {name: Outcome(kind, words) for name, kind, words in rows}


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="every fortieth scene")
    parser.add_argument("--wet", action="store_true", help="those on wet ice alone")
    parser.add_argument("--components", action="store_true", help="those of components alone")
    parser.add_argument("--all", action="store_true", help="print every scene and its sentence")
    parser.add_argument("--go-on", action="store_true", help="take what is kept of an earlier call")
    parser.add_argument("--pictures", action="store_true", help="let every run draw its report")
    parser.add_argument("-j", "--processes", type=int, default=2)
    arguments = parser.parse_args()
    chosen = [scene for scene in scenes() if WET in scene[0] or not arguments.wet]
    if arguments.components:
        chosen = [_scene(*drawn) for drawn in component_changes()]
    chosen = chosen[:: 40 if arguments.quick else 1]
    found = _kept() if arguments.go_on else {}
    left = [scene for scene in chosen if scene[0] not in found]
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    with open(KEPT, "a" if arguments.go_on else "w") as keep:
        results = outcomes(left, arguments.processes, arguments.pictures)
        for (name, _), result in zip(left, results, strict=True):
            found[name] = result
            print(json.dumps([name, *result]), file=keep, flush=True)
    found = {name: found[name] for name, _ in chosen}
    for name, result in found.items():
        if result.kind == "wrong" or arguments.all:
            print(f"{result.kind}: {name}\n    {result.words}", flush=True)
    counts = Counter(kind for kind, _ in found.values())
    late = sum("numerics.time_limit" in words for _, words in found.values())
    print(f"{late} of those that stopped did so after {TIME_LIMIT:g} s of the processor.")
    table(("scenes", *OUTCOMES), [(len(chosen), *(counts[kind] for kind in OUTCOMES))])


if __name__ == "__main__":
    main()
