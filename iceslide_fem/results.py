"""Finished runs for user scripts: the public names of `postprocess.results`."""

from iceslide_fem.postprocess.results import Run, differences, field_files, field_parts, read_run

__all__ = ["Run", "differences", "field_files", "field_parts", "read_run"]
