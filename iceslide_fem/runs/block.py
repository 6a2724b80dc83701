"""A run of a slice or block: from the undeformed block to the end of sliding."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

from iceslide_fem.coupling.ledger import Ledger
from iceslide_fem.coupling.restart import checkpoint_tables, resumed
from iceslide_fem.coupling.sliding import Rejection, Sliding
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.fenics.garbage import freed_at_end
from iceslide_fem.heat.equation import check_options
from iceslide_fem.mechanics.block import Block, build_block
from iceslide_fem.mechanics.press import PathPoint, press, start_sliding
from iceslide_fem.output.history import law_columns, preload_row, slide_row
from iceslide_fem.output.probes import ProbeRow, Probes
from iceslide_fem.output.summary import Log, notify_next_run
from iceslide_fem.output.table import (
    PASS,
    HistoryRow,
    PassRow,
    PreloadRow,
    Table,
    columns_of,
    row_type,
    size_of_rows,
)
from iceslide_fem.runs.checkpoint import (
    GOES_ON,
    Checkpoint,
    fields_there,
    last_checkpoint,
    trusted,
    write_checkpoint,
)
from iceslide_fem.runs.interruption import Interruption
from iceslide_fem.runs.observers import (
    Checkpoints,
    FieldSeries,
    PassSeries,
    ProbeSeries,
    Progress,
    Stops,
    Tell,
    Watch,
)
from iceslide_fem.runs.pace import Observation, Observer, Pace, TimeLimit
from iceslide_fem.runs.schedule import Schedule
from iceslide_fem.runs.summary import Results
from iceslide_fem.runtime.errors import Interrupted, OutputError, SceneError, SimulationStopped
from iceslide_fem.runtime.folders import clear_results
from iceslide_fem.runtime.launch import rank
from iceslide_fem.runtime.ranks import failing_together, from_root
from iceslide_fem.scene import Scene


def run_block(
    scene: Scene,
    out: Path,
    schedule: Schedule,
    checkpoint: Checkpoint | None,
    comm: MPI.Comm,
    tell: Tell | None = None,
) -> tuple[dict[str, Any], SimulationStopped | Interrupted | None]:
    """Run `scene` on the ranks of `comm`, from the start or from a `checkpoint`. Collective.

    Results are in `out`; `tell` is given every row (`Watch.tell`). Returns the entries of the
    summary (none before sliding), and the reason of an early stop, or None.
    """
    results = Results()
    try:
        with freed_at_end():
            _run(scene, out, schedule, checkpoint, comm, tell, results)
    except (SimulationStopped, Interrupted) as reason:
        return results.entries(), reason
    return results.entries(), None


def _run(
    scene: Scene,
    out: Path,
    schedule: Schedule,
    checkpoint: Checkpoint | None,
    comm: MPI.Comm,
    tell: Tell | None,
    results: Results,
) -> None:
    """Run a scene and collect its `results`. Raises SimulationStopped and Interrupted."""
    limit = TimeLimit(scene, comm, schedule.clock)
    state = checkpoint.state if checkpoint is not None else {}
    with failing_together(comm):
        block = build_block(scene, comm)
        if scene.ice.heat == "mesh":
            check_options(comm)
        probes = Probes(block)
        before = _before(block, probes, out, checkpoint, results) if checkpoint and state else None
    # Not earlier: an unsuitable mesh or checkpoint must not change anything on disk.
    from_root(lambda: clear_results(out, keep=GOES_ON if state else ()), comm)
    log = Log(out, comm.rank)

    def note(error: Exception) -> None:
        if not isinstance(error, SceneError):  # with it, nothing has started
            notify_next_run(out, error)
            with contextlib.suppress(OutputError):  # it may be the reason
                log("stopped", reason=str(error) or type(error).__name__)

    with (
        failing_together(comm, note),
        Interruption(comm) as interruption,
        Progress(rank(), scene.load.sliding_time) as progress,
    ):
        watch = Watch(out, schedule, results, progress, interruption, log, limit, tell)
        limit.handle_signals("when its mesh is made")
        begun = "restart" if state else "begin"
        log(begun, name=scene.name, model=scene.model, ranks=comm.size)
        if before is None:
            _bring_to_speed(block, watch)
            sliding = Sliding(block)
            before = sliding, Ledger(sliding)
        _slide(*before, probes, watch, state)
        for warning in results.entries()["warnings"]:
            log("warning", text=warning)
        log("end", time_s=scene.load.sliding_time)


def _bring_to_speed(block: Block, watch: Watch) -> None:
    """Press the block and bring it to its speed; rows of `preload.csv`."""
    number = block.surface.comm.rank
    if number == 0:
        write_checkpoint(watch.out, block.scene, {})  # a restart from it starts anew

    with Table(watch.out / "preload.csv", PreloadRow, number) as preload:

        def observe(point: PathPoint) -> None:
            row = preload_row(block, point)
            preload.row(row)
            watch.log(
                row.phase,
                load_fraction=row.load_fraction,
                speed_fraction=row.speed_fraction,
                newton_iterations=row.newton_iterations,
            )
            watch.results.iterations += row.newton_iterations
            mu = row.friction_force_N / row.normal_force_N
            watch.progress.update(0.0, mu, 0.0, row.newton_iterations, row.phase)
            watch.tell(row)

        def handle_signals(where: str) -> None:
            if watch.interruption.requested():
                raise watch.interruption.error("before sliding", watch.out)
            watch.limit.handle_signals(f"when {where}")

        press(block, observe, before=handle_signals)
        start_sliding(block, observe, before=handle_signals)


def _before(
    block: Block, probes: Probes, out: Path, checkpoint: Checkpoint, results: Results
) -> tuple[Sliding, Ledger]:
    """Sliding block, ledger and `results` of the run in `out`, restored from `checkpoint`.

    Raises SceneError if something does not fit; `out` is not changed.
    """
    state = checkpoint.state
    with trusted(last_checkpoint(out)):
        others = [functools.partial(part.table, "sliding") for part in checkpoint.parts]
        sliding = resumed(block, state["sliding"], others)
        ledger = Ledger(sliding)
        ledger.restore(state["ledger"])
        results.restore(state["results"])
        size_of_rows(out / "history.csv", columns_of(history_type(sliding)), len(results.rows))
        if state["probes"]:
            size_of_rows(out / "probes.csv", ProbeRow._fields, state["probes"])
        if ended := state.get("passes", {}).get("written"):
            size_of_rows(out / "passes.csv", columns_of(PassRow), ended)
    return sliding, ledger


def _slide(
    sliding: Sliding, ledger: Ledger, probes: Probes, watch: Watch, state: Mapping[str, Any]
) -> None:
    """Slide to the end and call the observers; `state`: of the run to continue."""
    results, out, comm = watch.results, watch.out, sliding.block.surface.comm
    results.dofs = sliding.n_dofs
    if state:
        watch.progress.go_on(sliding.current.time)
    watch.log("slide", time_s=sliding.current.time, unknowns=results.dofs)
    with ExitStack() as open_files:
        tables: list[Table] = []

        def opened(name: str, kind: type[NamedTuple], keep: int | None) -> Table:
            table = open_files.enter_context(Table(out / name, kind, comm.rank, keep))
            tables.append(table)
            return table

        rows = len(results.rows) if state else None
        history = opened("history.csv", history_type(sliding), rows)
        earlier = from_root(lambda: fields_there(out, state), comm)
        fields = FieldSeries(out / "fields", sliding, earlier, watch.log)
        probed, passed = state.get("probes", 0), state.get("passes", {})
        values = opened("probes.csv", ProbeRow, probed or None) if len(probes) else None
        probing = ProbeSeries(values, probes, probed)
        load, over = sliding.block.scene.load, passed.get("written") or None
        ended = opened("passes.csv", PassRow, over) if load.passes > 1 else None
        passes = PassSeries(ended, load, results, passed)
        parts: dict[str, Callable[[], Any]] = {
            "passes": passes.state,
            "sliding": functools.partial(checkpoint_tables, sliding),
            "ledger": ledger.state,
            "results": results.state,
            "fields": fields.state,
            "probes": probing.state,
        }
        checkpoints = Checkpoints(out, sliding, parts, tables, watch)
        stops = Stops(sliding, checkpoints, watch)
        observers: list[Observer] = [
            lambda step: history.row(step.history_row),
            passes,
            results,
            fields,
            probing,
            watch.progress,
            checkpoints,
            lambda step: watch.tell(step.history_row),
            stops,
            Pace(sliding, checkpoints.save),
        ]
        for step in _steps(sliding, ledger, stops.refused, begins=not state):
            for observe in observers:
                observe(step)


def history_type(sliding: Sliding) -> type[HistoryRow]:
    """The type of the rows of `history.csv`."""
    several = sliding.block.scene.load.passes > 1
    return row_type((*law_columns(sliding), *((PASS,) if several else ())))


def _steps(
    sliding: Sliding, ledger: Ledger, refused: Rejection, begins: bool
) -> Iterator[Observation]:
    """Observations: t = 0 if sliding `begins`, every accepted step, and every start of a pass."""
    if begins:
        yield Observation(sliding, None, slide_row(sliding, ledger, None))
    while True:
        for accepted in sliding.steps(refused):
            ledger.add(accepted)
            yield Observation(sliding, accepted, slide_row(sliding, ledger, accepted))
        if not sliding.pass_is_over:
            return
        sliding.begin_pass()
        ledger.begin()
        yield Observation(sliding, None, slide_row(sliding, ledger, None))
