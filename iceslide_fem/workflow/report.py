"""Work of `iceslide report`: recognise the results in a folder, and write their page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.page import Page, write_page
from iceslide_fem.postprocess.results import read_run
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable, writing

FILE = "report.html"


def report(folders: Sequence[Path], out: Path | None = None) -> Path:
    """Write the page about the results in the folders; returns its path.

    Without `out` it is report.html in a single folder, else results/comparison.html. Raises
    SceneError if there is nothing to report, OutputError if the page cannot be written.
    """
    if out is None:
        out = folders[0] / FILE if len(folders) == 1 else Path("results") / "comparison.html"
    elif out.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f"--out {out} is no page: give a file that ends in .html")
    check_writable(out.parent)
    page = page_of(folders)
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
    return write_page(out, page)


def page_of(folders: Sequence[Path]) -> Page:
    """The page about a run, sweep, ladder, footprint or wheel, or several runs side by side."""
    for folder in folders:
        if not folder.is_dir():
            raise SceneError(f"{folder} is not a folder; give one that a command wrote to")
    # Imports are local, because a page is made after every run.
    if len(folders) > 1:
        from iceslide_fem.postprocess.report.of_runs import page_of_runs

        return page_of_runs(list(folders))
    (folder,) = folders
    summary = _summary(folder)
    for key in ("footprint", "wheel"):
        if key in summary:
            return _page_of_preprocessor(folder, key, summary)
    if summary:
        from iceslide_fem.postprocess.report.of_run import page_of_run

        return page_of_run(read_run(folder))
    if (folder / "sweep.nc").is_file():
        from iceslide_fem.workflow.sweep.report_page import page_of_sweep

        return page_of_sweep(folder)
    levels = [path for path in sorted(folder.glob("*/summary.json")) if _is_level(path)]
    if levels:
        from iceslide_fem.postprocess.report.of_runs import page_of_ladder

        return page_of_ladder(folder, levels)
    from iceslide_fem.postprocess.report.of_run import is_unfinished, page_of_unfinished

    if is_unfinished(folder):
        return page_of_unfinished(folder)
    raise SceneError(f"{folder} holds nothing to report: no run, sweep, ladder, footprint or wheel")


def _page_of_preprocessor(folder: Path, name: str, summary: Mapping[str, Any]) -> Page:
    """The page of a footprint or wheel. Raises SceneError if its files are damaged."""
    from iceslide_fem.preprocess.footprint import command as footprints
    from iceslide_fem.preprocess.wheel import command as wheels
    from iceslide_fem.preprocess.work import page_of

    try:
        if name == "wheel":
            return page_of(wheels.words(summary), wheels.charts_in(folder), summary)
        drawn = footprints.charts_in(folder, summary["case"]["thesis_balance"])
        return page_of(footprints.words(summary), drawn, summary)
    except (AttributeError, KeyError, OSError, TypeError, ValueError) as error:
        raise SceneError(f"{folder} holds no whole {name} ({error})") from None


def _summary(folder: Path) -> dict[str, Any]:
    """Content of summary.json in the folder; empty without one."""
    path = folder / "summary.json"
    if not path.is_file():
        return {}
    try:
        summary = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise SceneError(f"{path} is not what a command wrote ({error})") from None
    if not isinstance(summary, dict) or not summary:
        raise SceneError(f"{path} is not what a command wrote")
    return summary


def _is_level(path: Path) -> bool:
    return path.parent.name.startswith(("point_", "slice_", "block_"))
