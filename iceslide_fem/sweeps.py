"""Sweeps for user scripts: the public names of `workflow.sweep`."""

from iceslide_fem.workflow.sweep import (
    Cores,
    Plan,
    failures,
    make_plan,
    read_sweep,
    run_sweep,
    share_cores,
)

__all__ = ["Cores", "Plan", "failures", "make_plan", "read_sweep", "run_sweep", "share_cores"]
