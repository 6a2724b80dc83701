"""Parameter sweeps: scenes with every combination of varied values.

Points are computed in one vectorised call, finite element cases in separate processes. A case is
identified by its scene and the program versions. A second sweep in the same folder computes only
missing, failed or changed cases. Imports `runs`, `postprocess` and what is below them; it starts
simulations as processes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import xarray as xr

from iceslide_fem.film.doubts import WITHOUT_MELTING
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.folders import claimed, clear_results, results_in
from iceslide_fem.scene.fingerprint import scene_hash
from iceslide_fem.workflow.sweep.axes import read_rows, rows_of_keys, values_of_key
from iceslide_fem.workflow.sweep.plan import Case, Plan, make_plan, plan_of
from iceslide_fem.workflow.sweep.points import simulate_points
from iceslide_fem.workflow.sweep.processes import (
    Cores,
    case_folder,
    check_meshes,
    compute,
    prepare,
    scene_file,
    share_cores,
    take_over,
)
from iceslide_fem.workflow.sweep.table import (
    DONE,
    NOT_COMPUTED,
    CaseResult,
    cases_in,
    done_points,
    read_outcome,
    read_sweep,
    scenes_of_table,
    write_sweep,
)

__all__ = [
    "Cores",
    "Plan",
    "cases_in",
    "failures",
    "make_plan",
    "plan_of",
    "read_rows",
    "read_sweep",
    "rows_of_keys",
    "run_sweep",
    "share_cores",
    "values_of_key",
]


def run_sweep(
    plan: Plan,
    folder: Path,
    cores: Cores | None,
    say: Callable[[str], None] = lambda _: None,
    force: bool = False,
) -> xr.Dataset:
    """Compute the missing cases of `plan` in `folder`, and write the table of all cases.

    Without `cores` finite element cases are not run: their scenes are written, and existing results
    are collected. say: called with a line for every finished case. The table is written even after
    an error. force: first remove results in `folder` of other cases. Raises SceneError if it may
    not write there.
    """
    scenes = {scene_hash(case.scene) for case in plan.cases}
    read = [path for case in plan.cases for path in case.scene.files.values()]
    with claimed(folder, partial(_other_results, scenes), force, read):
        if force and _other_results(scenes, folder) is not None:
            clear_results(folder)
        return _run_sweep(plan, folder, cores, say)


def _other_results(scenes: set[str], folder: Path) -> str | None:
    """Description of results in `folder` unless all their cases are in `scenes`."""
    if not {path.name for path in results_in(folder)} & {"sweep.csv", "cases"}:
        return "results of another command"
    if not (folder / "sweep.csv").is_file():
        return None
    missing = scenes_of_table(folder) - scenes
    return f"another sweep (of {len(missing)} other cases)" if missing else None


def _run_sweep(
    plan: Plan, folder: Path, cores: Cores | None, say: Callable[[str], None]
) -> xr.Dataset:
    outcomes = _found(plan, folder, say)
    missing = [case for case in plan.cases if outcomes[case.name].status != DONE]
    points = [case for case in missing if case.scene.model == "point"]
    others = [case for case in missing if case.scene.model != "point"]
    check_meshes(others)
    say(f"{len(plan.cases)} cases, {len(plan.cases) - len(missing)} of them done before")
    try:
        found = simulate_points([case.scene for case in points])
        outcomes |= {case.name: outcome for case, outcome in zip(points, found, strict=True)}
        if cores is None:
            for case in others:
                scene_file(folder, case)
        elif others:
            each = f"{cores.per_case} core{'s' * (cores.per_case > 1)} each"
            say(f"{len(others)} to run, {cores.at_a_time} at a time on {each}")
            prepare(folder, others)
            for number, (case, outcome) in enumerate(compute(folder, others, cores), start=1):
                outcomes[case.name] = outcome
                say(f"[{number}/{len(others)}] {_described(case, outcome)}")
    finally:
        dataset = write_sweep(folder, plan, [outcomes[case.name] for case in plan.cases])
    onsets = [
        outcomes[case.name].summary["melt_onset_s"]
        for case in plan.cases
        if case.scene.friction.law == "film"
        and outcomes[case.name].status == DONE
        and case.scene.film.dry_stress is None
        and not case.scene.ice.is_wet
    ]
    if cold := onsets.count(None):
        say(f"Note: in {cold} of {len(onsets)} cases the ice does not melt: {WITHOUT_MELTING}.")
    return dataset


def failures(dataset: xr.Dataset) -> list[str]:
    """A line for each reason of unfinished cases, with their number."""
    status, reason = dataset["status"].values.ravel(), dataset["reason"].values.ravel()
    kept = Counter((kind, why) for kind, why in zip(status, reason, strict=True) if kind != DONE)
    return [f"{count} {kind}: {why}" for (kind, why), count in kept.most_common()]


def _found(plan: Plan, folder: Path, say: Callable[[str], None]) -> dict[str, CaseResult]:
    """Existing result of each case in the folder."""
    try:
        points = done_points(folder)
    except SceneError as damaged:
        say(f"Points are computed again: {damaged}")
        points = {}
    take_over(folder, plan.cases)
    return {
        case.name: points.get(case.fingerprint, NOT_COMPUTED)
        if case.scene.model == "point"
        else read_outcome(case_folder(folder, case), case.scene)
        for case in plan.cases
    }


def _described(case: Case, outcome: CaseResult) -> str:
    """A case and its outcome in one line."""
    words = [f"{k}={v:.6g}" if isinstance(v, float) else f"{k}={v}" for k, v in case.at.items()]
    result = f"{outcome.status}: {outcome.reason}"
    if outcome.status == DONE:
        result = f"mean mu {outcome.summary['mu_mean']:.4f}, {outcome.summary['wall_s']:.0f} s"
    return f"{' '.join(words)}: {result}"
