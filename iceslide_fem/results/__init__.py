"""Finished runs, read and drawn; no DOLFINx.

Imports `errors`, `materials`, `progress` and types only.
"""

from iceslide_fem.results.run_directory import Run, differences, field_files, read_run

__all__ = ["Run", "differences", "field_files", "read_run"]
