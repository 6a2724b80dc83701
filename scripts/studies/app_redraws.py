"""How long the page of `iceslide app` takes from the move of a slider to new curves.

Headless Chromium moves each slider of the point and of the wheel to twenty places; the page says
how long it has taken from there to the curves. A table before says what the wheel's friction is off
by for its number of cells, against four times as many.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from typing import Any
from urllib.parse import urlencode

import numpy as np

from iceslide_fem.app import point, wheel
from iceslide_fem.app.form import Slider, Texts
from iceslide_fem.app.wheel import CELLS
from iceslide_fem.preprocess.footprint.pressure_map import LINE_PIXELS
from iceslide_fem.preprocess.wheel.case import WheelCase
from scripts.studies.common import options, table

MOVE = """([id, place]) => { const slider = document.getElementById(id); slider.value = place;
    slider.dispatchEvent(new Event("input", { bubbles: true })); }"""
DRAWN = "name => Number(document.documentElement.dataset[name] ?? 0)"
GAUSSIAN = {"shape": "gaussian"}
BLOCKS = GAUSSIAN | {"tread": "blocks"}
DRY = {"dry_stress": "3.3 bar", "initial_height": "0 nm"}
WHEELS: dict[str, Texts] = {
    "slick, even pressure": {},
    "slick, a Gaussian": GAUSSIAN,
    "slick, dry contact": DRY,
    "blocks, a Gaussian": BLOCKS,
    "blocks, dry contact": BLOCKS | DRY,
}
# What is moved: a tab, its state in the address, its sliders, and what counts its drawings.
MOVED: list[tuple[str, Texts, Sequence[Slider], str]] = [
    ("point", {"contact": "constants"}, point.SLIDERS, "drawn"),
    ("wheel", {}, [s for s in wheel.TAB.sliders if s.key not in wheel.TAB.only], "wheels"),
    ("wheel", BLOCKS, [s for s in wheel.TAB.sliders if s.key not in wheel.OF_STOPS], "wheels"),
]


def main() -> None:
    """Print errors of the wheel's curves, then median, 90 % and most of the milliseconds."""
    options(__doc__).parse_args()
    head = [
        f"wheel of {CELLS} cells",
        f"mu differs from that of {LINE_PIXELS} pixels by, of its peak",
    ]
    table(head, ([name, f"{_off_by(texts):.1%}"] for name, texts in WHEELS.items()))
    print()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        sys.exit("There is no playwright here: scripts/setup --browser.")
    if (program := shutil.which("chromium")) is None:
        sys.exit("There is no Chromium here: scripts/setup --browser.")
    command = [sys.executable, "-m", "iceslide_fem.cli", "app", "--no-browser"]
    with (
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server,
        sync_playwright() as driver,
    ):
        try:
            browser = driver.chromium.launch(executable_path=program, args=["--no-sandbox"])
            page, address = browser.new_page(), _address(server)
            rows = [row for each in MOVED for row in _redraws(page, address, *each)]
            browser.close()
        finally:
            server.terminate()
    table(["tab", "slider", "median, ms", "90 %, ms", "most, ms"], rows)


def _off_by(texts: Texts) -> float:
    """Largest difference of a curve of mu from that on the command's pixels, of its peak."""
    case = WheelCase.of(wheel.options(texts))
    coarse, fine = (
        np.array([each.mu for each in wheel.computed(case, cells)[1].points])
        for cells in (CELLS, LINE_PIXELS)
    )
    return float(np.abs(coarse - fine).max() / fine.max())


def _redraws(
    page: Any, address: str, tab: str, state: Texts, sliders: Sequence[Slider], count: str
) -> list[list[str]]:
    """Milliseconds of every slider of a tab."""
    page.goto("about:blank")  # another state of the same page would be no new page
    page.goto(f"{address}#{urlencode({'tab': tab} | dict(state))}")
    page.wait_for_selector("html[data-ready]")
    _wait_drawn(page, count, 0)
    named = f"{tab}, {state['tread']}" if "tread" in state else tab
    rows = []
    for slider in sliders:
        taken = []
        moved = f"{tab}-{slider.key}-slider"
        start = int(page.locator(f"[id='{moved}']").input_value())
        for place in np.linspace(50, 950, 20).round().tolist():
            before = page.evaluate(DRAWN, count)
            page.evaluate(MOVE, [moved, place])
            _wait_drawn(page, count, before)
            page.wait_for_timeout(150)  # what follows the curves has been drawn, too
            said = page.locator(f"#{tab}-time").inner_text()
            taken.append(float(re.findall(r"\d+", said)[0]))
        before = page.evaluate(DRAWN, count)
        page.evaluate(MOVE, [moved, start])
        _wait_drawn(page, count, before)
        values = [np.median(taken), np.quantile(taken, 0.9), max(taken)]
        rows.append([named, slider.key, *(f"{value:.0f}" for value in values)])
    return rows


def _wait_drawn(page: Any, count: str, before: int) -> None:
    """Until the curves have been drawn once more (the page lets no text become a script)."""
    while page.evaluate(DRAWN, count) <= before:
        page.wait_for_timeout(20)


def _address(server: subprocess.Popen[str]) -> str:
    """Where the server says that its page is."""
    for line in server.stdout or ():
        if found := re.search(r"http://\S+", line):
            return found[0]
    sys.exit("The page was not served.")


if __name__ == "__main__":
    main()
