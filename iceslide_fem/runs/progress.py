"""Progress of a run: simulated time, friction, step and iterations, on rank 0 only."""

from __future__ import annotations

from iceslide_fem.runs.observation import Observation
from iceslide_fem.runtime.progress import LongTask


class Progress(LongTask):
    """Context manager that shows the progress of a run of `total_time` (s, simulated).

    Only rank 0 shows it. Under mpirun standard error is no terminal, so lines are printed.
    """

    def __init__(self, comm_rank: int, total_time: float) -> None:
        super().__init__(total_time, comm_rank == 0)

    def __call__(self, step: Observation) -> None:
        """Show t = 0 or an accepted step of sliding."""
        row = step.row
        self.update(row.time_s, row.mu, row.step_s, row.newton_iterations, "sliding")

    def update(self, time: float, mu: float, step: float, newton: int, text: str = "") -> None:
        """Show an accepted step: its end `time` and length `step` (s), friction coefficient `mu`,
        number of `newton` iterations, and `text` such as the name of the phase.
        """
        where = f"t = {1e3 * time:.3f} of {1e3 * self.total:g} ms"
        words = f"mu {mu:.3f}", f"step {1e3 * step:.3g} ms", f"{newton} Newton", text
        self.show(time, where, *words)
