"""Pages about results, for scripts."""

from __future__ import annotations

from pathlib import Path

from iceslide_fem.api.errors import in_python
from iceslide_fem.workflow.report import report as write


@in_python()
def report(
    folder: Path | str,
    *others: Path | str,
    out: Path | str | None = None,
    title: str | None = None,
) -> Path:
    """Write one page about what is in the folders, as `iceslide report`; returns its path.

    A folder is what a run, a sweep or a preprocessor wrote; several are compared with the first.
    `out` is `report.html` in a single folder, else `results/A_against_B.html`, if it is not given.
    `title` replaces the heading.

    Raises `SceneError` with one sentence where there is nothing to report, `OutputError` where the
    page cannot be written.

    ```python
    import iceslide_fem

    iceslide_fem.report("results/thesis_point")  # results/thesis_point/report.html
    ```
    """
    return write([Path(folder), *map(Path, others)], None if out is None else Path(out), title)
