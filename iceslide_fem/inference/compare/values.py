"""Friction or deceleration of candidates under conditions, and what its steps and inputs mean."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iceslide_fem.inference.compare.candidates import Candidate
from iceslide_fem.inference.compare.inputs import Inputs, Slopes
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.braking import CONTROLS
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.peak import peak_and_locked
from iceslide_fem.preprocess.wheel.stops import deceleration_on, table_of_stop
from iceslide_fem.preprocess.wheel.tread import stiffness_of
from iceslide_fem.runs.many_points import OUTPUTS as OF_POINTS
from iceslide_fem.runs.many_points import friction
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.launch import available_cores
from iceslide_fem.scene import Scene
from iceslide_fem.scene.variation import with_values
from iceslide_fem.workflow.planning.cost import foreseen
from iceslide_fem.workflow.sweep.processes import compute_all
from iceslide_fem.workflow.sweep.table import DONE

LOOSER = 2.0  # tolerance of the coarser computation over that of the other
COARSER = 1.4  # cells of a slice or block, over the others
ARRAYS = dict[str, Array]
Grid = Sequence[Sequence[Candidate]]
Tell = Callable[[float, str], None]


class Values(NamedTuple):
    """Outputs by name, (candidates, conditions), NaN where the computation failed; the same of a
    coarser computation; slopes: what uncertain inputs mean; failures: sentences; doubts: warnings
    of each candidate's computations, with its name.
    """

    fine: ARRAYS
    coarse: ARRAYS
    slopes: Slopes
    failures: Sequence[str]
    doubts: Sequence[tuple[str, str]] = ()


def values_of_scenes(
    grid: Grid, names: Sequence[Sequence[str]], inputs: Inputs, output: str, folder: Path
) -> Values:
    """Of scenes, each on its level; names: of runs, which are written to `folder`.

    Slopes are those of points. Raises SimulationStopped if all runs of the reference fail.
    """
    shape = len(grid), len(grid[0])
    scenes = [one.scene for row in grid for one in row]
    of_all = [name for row in names for name in row]
    fine, why, doubts = _scenes(scenes, of_all, folder)
    coarse, _, _ = _scenes(
        [_coarser(one) for one in scenes], [f"{n}_coarse" for n in of_all], folder
    )
    slopes = np.zeros((*shape, len(inputs.keys)))
    for place in range(shape[1]):
        sides = list(inputs.sides([row[place].scene for row in grid]))
        if sides:
            points = [one.scene.model_copy(update={"model": "point"}) for one in sides]
            logs = np.log(getattr(friction(points), output)[:, 0])
            for side, log in zip(sides, logs, strict=True):
                slopes[side.number, place, inputs.keys.index(side.key)] += 0.5 * side.sign * log
    parts = [{key: one.reshape(shape) for key, one in each.items()} for each in (fine, coarse)]
    return Values(parts[0], parts[1], Slopes(inputs, slopes), why, doubts)


def _coarser(scene: Scene) -> Scene:
    numerics = scene.numerics
    values = {"numerics.tolerance": min(LOOSER * numerics.tolerance, 0.1)}
    if scene.model != "point":
        values["numerics.refinement"] = numerics.refinement / COARSER
    return with_values(scene, values)


def _scenes(
    scenes: Sequence[Scene], names: Sequence[str], folder: Path
) -> tuple[ARRAYS, list[str], list[tuple[str, str]]]:
    """Outputs of scenes by name, (n,), why some failed, and warnings with the scenes' names."""
    found = {key: np.full(len(scenes), np.nan) for key in OF_POINTS}
    why, doubts = [], []
    points = [number for number, scene in enumerate(scenes) if scene.model == "point"]
    if points:
        mu = friction([scenes[number] for number in points])
        for key in OF_POINTS:
            found[key][points] = getattr(mu, key)[:, 0]
        why += [f"{names[points[at]]}: {reason}" for (at, _), reason in mu.failures.items()]
        for at in points:
            doubts += [(names[at], note) for note in foreseen(scenes[at])]
    others = {name: number for number, name in enumerate(names) if number not in points}
    outcomes = compute_all(folder, {name: scenes[number] for name, number in others.items()})
    for name, outcome in outcomes.items():
        if outcome.status != DONE:
            why.append(f"{name}: {outcome.reason}")
            continue
        for key in OF_POINTS:
            found[key][others[name]] = outcome.summary[key]
        doubts += [(name, str(warning)) for warning in outcome.summary["warnings"]]
    return found, why, doubts


class Job(NamedTuple):
    """A wheel to compute: its case, footprint, and a factor on its tread's stiffness.

    every: n-th of the speeds and slip ratios; controls: of a stop.
    """

    case: WheelCase
    footprint: PressureMap
    factor: float = 1.0
    every: int = 1
    controls: Sequence[str] = CONTROLS

    def __call__(self) -> tuple[dict[str, float], list[str]]:
        """Its outputs, and why it does not have others."""
        case, footprint = self.case, self.footprint
        stiffness = stiffness_of(case, footprint)
        stiffness = stiffness._replace(value=self.factor * stiffness.value)
        load = footprint.load
        if self.every > 1:
            case = case.model_copy(update={"tolerance": min(LOOSER * case.tolerance, 0.1)})
            footprint = _halved(footprint)
        try:
            if not case.abs:
                return peak_and_locked(case, footprint, stiffness, self.every), []
            table = table_of_stop(case, footprint, stiffness, self.every)
        except SimulationStopped as error:
            return {}, [str(error)]
        found, why = {}, []
        for control in self.controls:
            try:
                value = deceleration_on(case, table, load, control)
                found[f"deceleration_{control}"] = value
            except SimulationStopped as error:
                why.append(f"control {control}: {error}")
        return found, why


def _halved(footprint: PressureMap) -> PressureMap:
    """The footprint on pixels of twice the length."""
    pressure = footprint.pressure
    even = np.pad(pressure, ((0, 0), (0, pressure.shape[1] % 2)))
    return replace(footprint, pressure=0.5 * (even[:, ::2] + even[:, 1::2]), dx=2.0 * footprint.dx)


def values_of_wheels(
    grid: Grid, maps: Sequence[PressureMap], inputs: Inputs, output: str, tell: Tell
) -> Values:
    """Of wheels on their footprints `maps`, and their stops.

    Slopes are of the coarser computation, those of a control by thresholds of the ideal one, which
    has no phases.
    """
    shape = len(grid), len(grid[0])
    places = [(i, j) for i in range(shape[0]) for j in range(shape[1])]
    wheels = {(i, j): grid[i][j].wheel for i, j in places}
    of_slope = "deceleration_ideal" if output == "deceleration_threshold" else output
    control = of_slope.rpartition("_")[2]
    sides = [
        (place, side)
        for place in range(shape[1])
        for side in inputs.sides([row[place].scene for row in grid])
    ]
    jobs = [Job(wheel, maps[i], every=every) for every in (1, 2) for (i, _), wheel in wheels.items()
            if wheel is not None]  # fmt: skip
    jobs += [
        Job(wheel.under(side.scene), maps[side.number], side.stiffness, 2, (control,))
        for place, side in sides
        if (wheel := grid[side.number][place].wheel) is not None
    ]
    results = list(_in_parallel(jobs, tell))
    count, why = len(places), []
    arrays = []
    for some in (results[:count], results[count : 2 * count]):
        found: ARRAYS = {}
        for (i, j), (outputs, reasons) in zip(places, some, strict=True):
            why += [f"{grid[i][j].name}: {reason}" for reason in reasons]
            for key, value in outputs.items():
                found.setdefault(key, np.full(shape, np.nan))[i, j] = value
        arrays.append(found)
    slopes = np.zeros((*shape, len(inputs.keys)))
    for (place, side), (outputs, _) in zip(sides, results[2 * count :], strict=True):
        value = outputs.get(of_slope, np.nan)
        slopes[side.number, place, inputs.keys.index(side.key)] += 0.5 * side.sign * np.log(value)
    fine, coarse = arrays
    for one, other in ((fine, coarse), (coarse, fine)):
        for key in other:
            one.setdefault(key, np.full(shape, np.nan))
    if output not in fine:
        raise SimulationStopped(f"nothing could be compared: {why[0]}")
    return Values(fine, coarse, Slopes(inputs, slopes), why)


def _in_parallel(jobs: Sequence[Job], tell: Tell) -> Iterator[tuple[dict[str, float], list[str]]]:
    with ProcessPoolExecutor(available_cores()) as pool:
        for number, result in enumerate(pool.map(Job.__call__, jobs), start=1):
            tell(number / len(jobs), f"{number} of {len(jobs)} wheels")
            yield result
