"""Reading and drawing of finished runs; no DOLFINx.

Imports `scene` and `film` (their data) and `runtime` only.
"""

from iceslide_fem.postprocess.results.run_directory import (
    Run,
    differences,
    field_files,
    field_parts,
    names_of,
    read_run,
)

__all__ = ["Run", "differences", "field_files", "field_parts", "names_of", "read_run"]
