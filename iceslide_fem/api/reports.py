"""Pages about results, for scripts."""

from __future__ import annotations

from pathlib import Path

from iceslide_fem.api.errors import in_python
from iceslide_fem.workflow.report import report as write


@in_python()
def report(*folders: Path | str, out: Path | str | None = None) -> Path:
    """Write one page about what is in the folders, as `iceslide report`; returns its path.

    A folder is that of a run, sweep, ladder, footprint or wheel; several runs are compared. `out`
    is `report.html` in a single folder, else `results/comparison.html`, if it is not given.

    Raises `SceneError` with one sentence where there is nothing to report, `OutputError` where the
    page cannot be written.

    ```python
    import iceslide_fem

    iceslide_fem.report("results/thesis_point")  # results/thesis_point/report.html
    ```
    """
    return write([Path(folder) for folder in folders], None if out is None else Path(out))
