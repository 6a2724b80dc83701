"""One scene on every level of the model hierarchy: error, cost, and the cheapest sufficient level.

Levels worth running (`levels`) run in the order of cost. All are compared with the finest one.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomlkit

from iceslide_fem.fenics.compat import MPI
from iceslide_fem.mesh.size import check_memory, shortage
from iceslide_fem.postprocess.results import Run, read_run
from iceslide_fem.postprocess.results.run_directory import largest_and_rms
from iceslide_fem.runs.model_levels import ModelLevel, fineness, level_name, on_level
from iceslide_fem.runs.simplifications import Simplifications, simplifications
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.folders import claimed, clear_results
from iceslide_fem.runtime.ranks import failing_together, from_root
from iceslide_fem.scene import Scene, load_scene, override
from iceslide_fem.scene.input_file import read_text
from iceslide_fem.scene.toml import set_folder
from iceslide_fem.simulate import difference, run
from iceslide_fem.workflow.ladder.levels import levels, of_mesh


class LevelResult(NamedTuple):
    """A level: its run, or the reason without one; memory (bytes, all ranks).

    largest, rms: relative difference of mu(t) to the finest level's; NaN without a run.
    """

    level: ModelLevel
    run: Run | None
    note: str
    memory: float
    largest: float = np.nan
    rms: float = np.nan

    @property
    def name(self) -> str:
        """Model, heat and refinement, as in directories and charts."""
        return level_name(self.level)

    def as_dict(self) -> dict[str, Any]:
        """What `iceslide ladder --json` says of it."""
        done = {} if self.run is None else self.run.summary
        return {
            "name": self.name,
            **self.level._asdict(),
            **{key: done.get(key) for key in ("mu_mean", "mu_peak", "wall_s")},
            "largest_difference": self.largest,
            "rms_difference": self.rms,
            "memory_bytes": self.memory,
            "note": self.note,
        }


def climb(
    scene: Scene,
    out: Path,
    factors: Sequence[float],
    tell: Callable[[str], None],
    force: bool = False,
) -> tuple[list[LevelResult], Simplifications]:
    """Run `scene` on every level worth it, into directories below `out`. Collective.

    tell: called with a line before every run; force: replace other results in `out`. Raises
    SceneError if it may not write there, or the user's mesh is unsuitable.
    """
    with failing_together(MPI.COMM_WORLD), ExitStack() as claim:

        def take() -> None:
            if scene.rubber.is_drawn:
                check_memory(on_level(scene, ModelLevel(of_mesh(scene), scene.ice.heat, 1.0)))
            read = list(scene.files.values())
            claim.enter_context(claimed(out, partial(_other_results, scene), force, read))
            clear_results(out)

        from_root(take, MPI.COMM_WORLD)
        return _climb(scene, out, factors, tell)


def _other_results(scene: Scene, out: Path) -> str | None:
    """Description of results in `out` that are not levels of this scene, else None."""
    free = ("model", "ice.heat", "numerics.refinement")
    summaries = [json.loads(path.read_bytes()) for path in out.glob("*/summary.json")]
    if not summaries or (out / "summary.json").is_file():
        return "results of another command, or of a ladder that is not whole"
    changed = (difference(scene, summary.get("scene"), free) for summary in summaries)
    return next((f"a ladder of another scene ({change})" for change in changed if change), None)


def _climb(
    scene: Scene, out: Path, factors: Sequence[float], tell: Callable[[str], None]
) -> tuple[list[LevelResult], Simplifications]:
    found = simplifications(scene)
    chosen, skipped = levels(scene, found, factors)
    for level in chosen.copy():
        short = from_root(partial(shortage, on_level(scene, level)), MPI.COMM_WORLD)
        if short:
            chosen.remove(level)
            skipped[level] = f"not run: it {short}"
    outcomes = []
    warm: set[tuple[str, str]] = set()
    for number, level in enumerate(chosen, 1):
        tell(f"{number} of {len(chosen)}: {level_name(level)}")
        if level.model != "point" and (level.model, level.heat) not in warm:
            warm.add((level.model, level.heat))
            _compile(scene, level)
        outcomes.append(_outcome(scene, level, out))
    outcomes += [LevelResult(level, None, reason, np.nan) for level, reason in skipped.items()]
    return compared(outcomes), found


def compared(outcomes: Sequence[LevelResult]) -> list[LevelResult]:
    """The outcomes with their differences to the finest run among them."""
    finest = finest_of(outcomes)
    if finest is None or finest.run is None:
        return list(outcomes)
    result = []
    for outcome in outcomes:
        if outcome.run is not None:
            largest, rms = largest_and_rms(outcome.run, finest.run)
            outcome = outcome._replace(largest=largest, rms=rms)
        result.append(outcome)
    return result


def finest_of(outcomes: Sequence[LevelResult]) -> LevelResult | None:
    """The finest completed level."""
    done = (one for one in outcomes if one.run is not None)
    return max(done, key=lambda one: fineness(one.level), default=None)


def cheapest_of(outcomes: Sequence[LevelResult], tolerance: float) -> LevelResult | None:
    """The fastest run with a largest difference within `tolerance`."""
    good = [one for one in outcomes if one.run is not None and one.largest <= tolerance]
    return min(good, key=lambda one: one.run.summary["wall_s"] if one.run else 0.0, default=None)


def write_scene(source: Path, overrides: Sequence[str], level: ModelLevel, path: Path) -> None:
    """Write the scene file `source` with `overrides` on `level`; comments and units stay."""
    document = tomlkit.parse(read_text(source, "the scene file"))
    set_folder(document, source.absolute().parent)
    for change in overrides:
        override(document, change)
    set_folder(document, Path.cwd())
    scene = load_scene(source, overrides)
    document["model"] = level.model
    changes = [f"ice.heat={level.heat}"]
    if level.model != "point" and level.refinement != scene.numerics.refinement:
        changes.append(f"numerics.refinement={level.refinement}")
    for change in changes:
        override(document, change)
    path.write_text(tomlkit.dumps(document), encoding="utf-8")


def _outcome(scene: Scene, level: ModelLevel, out: Path) -> LevelResult:
    """Run the scene on one level. Collective."""
    folder = out / level_name(level)
    _reset_peak_memory()
    try:
        run(on_level(scene, level), folder)
    except SimulationStopped as reason:
        return LevelResult(level, None, f"stopped: {reason}", _peak_memory())
    memory = _peak_memory()
    MPI.COMM_WORLD.barrier()  # until rank 0 has written everything
    return LevelResult(level, read_run(folder), "", memory)


def _compile(scene: Scene, level: ModelLevel) -> None:
    """Compile the forms of a level by a short, coarse run, outside the timing. Collective."""
    duration = max(1e-6, 1e-3 * scene.load.duration)
    short = scene.model_copy(update={"load": scene.load.model_copy(update={"duration": duration})})
    comm = MPI.COMM_WORLD
    with tempfile.TemporaryDirectory() as folder:
        with suppress(SimulationStopped):  # maybe too coarse for equilibrium, but compiled
            run(on_level(short, level._replace(refinement=0.25)), comm.bcast(folder))
        comm.barrier()


def _reset_peak_memory() -> None:
    """Reset this process's peak memory on Linux; else it includes earlier levels."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_memory() -> float:
    """Sum of the peak memories of all processes, bytes. Collective."""
    status = Path("/proc/self/status").read_text()
    kilobytes = next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM"))
    return float(MPI.COMM_WORLD.allreduce(1024.0 * float(kilobytes), op=MPI.SUM))
