"""One scene on the rungs with rubber: from the undeformed block to the end of its sliding."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from iceslide_fem.coupling.energy import Ledger
from iceslide_fem.coupling.history import (
    Row,
    interface_fields,
    outside_table,
    preload_row,
    slide_row,
)
from iceslide_fem.coupling.sliding import Accepted, Sliding, place_at_start
from iceslide_fem.errors import Interrupted, SimulationStopped
from iceslide_fem.fenics.compat import MPI
from iceslide_fem.interface.ice_continuum import Continuum
from iceslide_fem.output.fields import Fields
from iceslide_fem.output.summary import begin_run
from iceslide_fem.output.table import HISTORY_COLUMNS, PRELOAD_COLUMNS, Table
from iceslide_fem.rubber.block import Block, PathPoint, build_block, press, start_sliding
from iceslide_fem.rubber.sipes import smallest_opening
from iceslide_fem.run.checkpoint import Checkpoint, write_checkpoint
from iceslide_fem.run.interruption import Interruption
from iceslide_fem.run.progress import Progress
from iceslide_fem.run.schedule import FieldTimes, Saves, Schedule
from iceslide_fem.run.summary import Results
from iceslide_fem.scene import Scene


def run_block(
    scene: Scene,
    out: Path,
    schedule: Schedule,
    resumed: Checkpoint | None,
) -> tuple[dict[str, Any], SimulationStopped | Interrupted | None]:
    """Run `scene` into `out`, from its beginning or from `resumed`. Collective.

    Returns the entries of its summary (none before sliding), and why it stopped early, if it did.
    """
    comm = MPI.COMM_WORLD
    results = Results()
    stopped: SimulationStopped | Interrupted | None = None
    with ExitStack() as open_files:
        interruption = open_files.enter_context(Interruption(comm))
        progress = open_files.enter_context(Progress(comm.rank, scene.load.duration))
        try:
            block = build_block(scene, comm)
            begin_run(out, comm.rank)  # not before: a mesh that cannot be used leaves nothing
            results.dofs = block.rubber.n_dofs
            state = resumed.state if resumed is not None else {}
            if state:
                place_at_start(block, state["sliding"])
            else:
                _bring_to_speed(block, out, results, progress, interruption)
            _slide(block, out, state, schedule, results, progress, interruption, open_files)
        except (SimulationStopped, Interrupted) as reason:
            stopped = reason
    return results.entries(), stopped


def _bring_to_speed(
    block: Block, out: Path, results: Results, progress: Progress, interruption: Interruption
) -> None:
    """Press the block and bring it to its speed; rows of `preload.csv`."""
    rank = block.surface.comm.rank
    if rank == 0:
        write_checkpoint(out, block.scene, {})  # to go on from means to begin, so far

    with Table(out / "preload.csv", PRELOAD_COLUMNS, rank) as preload:

        def observe(point: PathPoint) -> None:
            row = preload_row(block, point)
            preload.row(row)
            results.iterations += point.solution.iterations
            mu = row["friction_force_N"] / row["normal_force_N"]
            progress.update(0.0, mu, 0.0, point.solution.iterations, point.phase)
            if interruption.requested():
                raise interruption.error("before sliding", out)

        press(block, observe)
        start_sliding(block, observe)


def _slide(
    block: Block,
    out: Path,
    state: dict[str, Any],
    schedule: Schedule,
    results: Results,
    progress: Progress,
    interruption: Interruption,
    open_files: ExitStack,
) -> None:
    """Slide from t = 0, or from `state`, to the end; rows of `history.csv`, fields, checkpoints."""
    comm, duration = block.surface.comm, block.scene.load.duration
    sliding = Sliding(block)
    ledger = Ledger(sliding)
    ice = sliding.carrier.ice
    temperature = None
    if isinstance(ice, Continuum):
        temperature = ice.show(sliding.current.interface.ice)
        results.dofs += ice.n_dofs
    if state:
        sliding.restore(state["sliding"])
        ledger.restore(state["ledger"])
        results.restore(state["results"])
        progress.go_on(sliding.current.time)
    rows = len(results.rows) if state else None
    history = Table(out / "history.csv", HISTORY_COLUMNS, comm.rank, keep=rows)
    open_files.enter_context(history)
    earlier = state["fields"] if state else ()
    fields = Fields(out / "fields", block.rubber, block.surface, temperature, earlier)
    open_files.enter_context(fields)
    saves = Saves(schedule, sliding.current.time, comm)

    def save() -> None:
        history.secure()
        present = {
            "sliding": sliding.state(),
            "ledger": ledger.state(),
            "results": results.state(),
            "fields": fields.written,
        }
        if comm.rank == 0:
            write_checkpoint(out, block.scene, present)

    def heed() -> None:
        """Stop here, with a checkpoint of the last accepted step, if a signal asks for it."""
        if interruption.requested():
            save()
            time = sliding.current.time
            where = f"at t = {1e3 * time:.4g} ms of {1e3 * duration:.4g} ms"
            raise interruption.error(where, out)

    def note(accepted: Accepted | None) -> Row:
        row = slide_row(sliding, ledger, accepted)
        history.row(row)
        results.note(row, accepted.rejected if accepted else 0)
        if accepted is None or accepted.solved:  # else the block is as it was
            results.outside_table_fraction = outside_table(block, sliding.current.contact)
            results.sipe_opening = min(results.sipe_opening, smallest_opening(block))
        return row

    if not state:
        fields.write(0.0, interface_fields(sliding, None))
        note(None)
        save()
    due = FieldTimes(duration, sliding.current.time)
    while sliding.current.time < duration:
        accepted = sliding.advance(heed)
        time = sliding.current.time
        ledger.add(accepted)
        row = note(accepted)
        if due(time):
            if isinstance(ice, Continuum):
                ice.show(sliding.current.interface.ice)
            fields.write(time, interface_fields(sliding, accepted))
        progress.update(time, row["mu"], accepted.dt, accepted.iterations, "sliding")
        if saves.due(time):
            save()
        heed()
