"""Work of `iceslide report`: recognise the results in a folder, and write their page."""

from __future__ import annotations

import base64
import json
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.postprocess.report.page import Page, Picture, Section, write_page
from iceslide_fem.postprocess.report.saved import FILE as SAVED
from iceslide_fem.postprocess.report.saved import read_page
from iceslide_fem.postprocess.results import Run, names_of, read_run
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable, writing

FILE = "report.html"


def report(folders: Sequence[Path], out: Path | None = None, title: str | None = None) -> Path:
    """Write the page about the results in the folders; returns its path. title: for its own one.

    Without `out` it is report.html in a single folder, else a file in results with the names of
    the first two. Raises SceneError if there is nothing to report, OutputError if the page cannot
    be written.
    """
    if out is None:
        out = folders[0] / FILE if len(folders) == 1 else Path("results") / _named(folders)
    elif out.suffix.lower() not in (".html", ".htm"):
        raise SceneError(f"--out {out} is no page: give a file that ends in .html")
    if title is not None and not title.strip():
        raise SceneError(f'a title is a text; given: --title "{title}"')
    check_writable(out.parent)
    page = page_of(folders)
    if title is not None:
        page = page._replace(title=title.strip())
    with writing(out):
        out.parent.mkdir(parents=True, exist_ok=True)
    return write_page(out, page)


def _named(folders: Sequence[Path]) -> str:
    """Name of the page about several results."""
    first, second, *others = (folder.absolute().name for folder in folders)
    more = f"_and_{len(others)}_more" if others else ""
    return f"{first}_against_{second}{more}.html"


def page_of(folders: Sequence[Path]) -> Page:
    """The page about what a command wrote to a folder, or about several of them side by side."""
    for folder in folders:
        if not folder.is_dir():
            raise SceneError(f"{folder} is not a folder; give one that a command wrote to")
    if len(folders) == 1:
        return _page_of(folders[0])
    # Imports are local, because a page is made after every run.
    if all(_is_run(folder) for folder in folders):
        from iceslide_fem.postprocess.report.of_runs import page_of_runs

        return page_of_runs(list(folders))
    from iceslide_fem.postprocess.report.of_pages import page_of_pages

    names = names_of(folders)
    pages = {name: _page_of(folder) for name, folder in zip(names, folders, strict=True)}
    return page_of_pages(pages, " ".join(["iceslide report", *map(str, folders)]))


def _is_run(folder: Path) -> bool:
    return bool(_summary(folder)) and not (folder / SAVED).is_file()


def _page_of(folder: Path) -> Page:
    """The page about a run, a sweep, a ladder, or what another command has shown."""
    if (folder / SAVED).is_file():
        return read_page(folder)
    if summary := _summary(folder):
        if "case" in summary:
            raise SceneError(f"{folder} was written without {SAVED}: run its command again")
        from iceslide_fem.postprocess.report.of_run import page_of_run

        run = read_run(folder)
        return _with_mesh(page_of_run(run), run)
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
    raise SceneError(f"{folder} holds nothing to report: give a folder that a command wrote")


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


def _with_mesh(page: Page, run: Run) -> Page:
    """The page with a picture of the block's mesh, if a user has drawn it and its file is there."""
    from iceslide_fem.postprocess.report.words import scene_of

    scene = scene_of(run.scene)
    if scene is None or scene.model == "point" or not scene.rubber.is_drawn:
        return page
    from iceslide_fem.workflow.planning.mesh_picture import draw_mesh

    with tempfile.TemporaryDirectory() as alone:
        path = Path(alone) / "mesh.png"
        draw_mesh(scene, path)
        png = base64.b64encode(path.read_bytes()).decode()
    drawn = Picture("The mesh", "The mesh that is computed, its parts in colours", png)
    return page._replace(
        sections=[*page.sections[:-1], Section("mesh", "The mesh", [drawn]), page.sections[-1]]
    )


def _is_level(path: Path) -> bool:
    return path.parent.name.startswith(("point_", "slice_", "block_"))
