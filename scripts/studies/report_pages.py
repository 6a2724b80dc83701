"""What the pages of `iceslide report` cost, the size of libraries that could draw them, a picture.

Libraries that are not installed are left out; sizes are of what a page has to carry along.
"""

from __future__ import annotations

import gzip
import importlib.metadata
import importlib.util
import shutil
import tempfile
from pathlib import Path

from iceslide_fem.scene import Scene
from iceslide_fem.simulate import run
from iceslide_fem.workflow.report import report
from scripts.studies.common import case, options, picture_options, table, timed

# Files that a page with curves, maps and pointers has to have in it.
LIBRARIES = {
    "plotly": ["package_data/plotly.min.js"],
    "bokeh": ["server/static/js/bokeh.min.js"],
    "vl_convert": ["vl_convert.abi3.so"],  # what altair makes its pages with, without a network
}
SCREEN = {"width": 1200, "height": 900}


def libraries() -> None:
    """Sizes of what each library puts into a page."""
    rows = []
    for name, files in LIBRARIES.items():
        found = importlib.util.find_spec(name)
        if found is None or found.origin is None:
            rows.append([name, "not installed", "", ""])
            continue
        content = b"".join((Path(found.origin).parent / file).read_bytes() for file in files)
        version = importlib.metadata.version(name.replace("_", "-") + _suffix(name))
        packed = len(gzip.compress(content, 6)) / 1e6
        rows.append([name, version, f"{len(content) / 1e6:.2f}", f"{packed:.2f}"])
    table(["library", "version", "MB", "MB, gzip"], rows)


def _suffix(name: str) -> str:
    return "-python" if name == "vl_convert" else ""


def pages(folder: Path, scenes: dict[str, Scene]) -> None:
    """Size and processor seconds of the page of a run on each level."""
    rows = []
    for name, scene in scenes.items():
        out = folder / name
        run(scene, out, force=True)
        path, seconds = timed(lambda out=out: report([out]))  # type: ignore[misc]
        rows.append([name, f"{path.stat().st_size / 1e6:.2f}", f"{seconds:.2f}"])
    path, seconds = timed(lambda: report([folder / name for name in scenes], folder / "all.html"))
    rows.append(["all of them, compared", f"{path.stat().st_size / 1e6:.2f}", f"{seconds:.2f}"])
    table(["page of", "MB", "processor seconds"], rows)


def photograph(page: Path, pictures: Path) -> None:
    """The page in a browser: its top, and its fields in the dark."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        for name, scheme, anchor in (("top", "light", "body"), ("fields", "dark", "#fields")):
            context = browser.new_context(offline=True, viewport=SCREEN, color_scheme=scheme)
            sheet = context.new_page()
            sheet.goto(page.absolute().as_uri())
            sheet.wait_for_selector("body[data-ready]")
            sheet.locator(anchor).evaluate("element => element.scrollIntoView()")
            sheet.wait_for_timeout(1500)
            path = pictures / f"report_{name}.png"
            pictures.mkdir(parents=True, exist_ok=True)
            sheet.screenshot(path=path)
            print(f"drawn: {path}")
        browser.close()


def main() -> None:
    """Print both tables and draw the pictures."""
    parser = options(__doc__)
    picture_options(parser)
    parser.add_argument("--quick", action="store_true", help="no block in 3-D, short runs")
    arguments = parser.parse_args()
    libraries()
    short = ["numerics.tolerance=1e-2", *(["load.duration=0.5ms"] if arguments.quick else [])]
    scenes = {
        "point": case("thesis_1bar", "model=point", "ice.heat=column", *short),
        "slice": case("thesis_1bar", "model=slice", *short),
    }
    if not arguments.quick:
        small = ["numerics.refinement=0.5", "load.duration=2ms", "numerics.tolerance=5e-2"]
        scenes["block"] = case("thesis_1bar", *small)
    with tempfile.TemporaryDirectory() as folder:
        pages(Path(folder), scenes)
        if importlib.util.find_spec("playwright") and shutil.which("chromium"):
            photograph(Path(folder) / "slice" / "report.html", arguments.pictures)


if __name__ == "__main__":
    main()
