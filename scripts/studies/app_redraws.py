"""How long the page of `iceslide app` takes from a slider's move to the new curves.

The page's own clock, in headless Chromium (Debian's package `chromium`, `scripts/setup --app` and
`--browser`), over twenty places of every slider of the point.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from typing import Any

import numpy as np

from iceslide_fem.app.point import SLIDERS
from scripts.studies.common import options, table

MOVE = """([id, place]) => { const slider = document.getElementById(id); slider.value = place;
    slider.dispatchEvent(new Event("input", { bubbles: true })); }"""
DRAWN = "Number(document.documentElement.dataset.drawn ?? 0)"


def main() -> None:
    """Print median, 90 % and most of the milliseconds, for each slider."""
    options(__doc__).parse_args()
    places = np.linspace(50, 950, 20).round().tolist()
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
            page = browser.new_page()
            page.goto(_address(server) + "#tab=point&contact=constants")
            page.wait_for_selector("html[data-ready]")
            _wait_drawn(page, 0)
            rows = []
            for slider in SLIDERS:
                taken = []
                for place in places:
                    before = page.evaluate(DRAWN)
                    page.evaluate(MOVE, [f"point-{slider.key}-slider", place])
                    _wait_drawn(page, before)
                    page.wait_for_timeout(150)  # what follows the curves has been drawn, too
                    said = page.locator("#point-time").inner_text()
                    taken.append(float(re.findall(r"\d+", said)[0]))
                values = [np.median(taken), np.quantile(taken, 0.9), max(taken)]
                rows.append([slider.key, *(f"{value:.0f}" for value in values)])
            browser.close()
        finally:
            server.terminate()
    table(["slider", "median, ms", "90 %, ms", "most, ms"], rows)


def _wait_drawn(page: Any, before: int) -> None:
    """Until the curves have been drawn once more (the page lets no text become a script)."""
    while page.evaluate(DRAWN) <= before:
        page.wait_for_timeout(20)


def _address(server: subprocess.Popen[str]) -> str:
    """Where the server says that its page is."""
    for line in server.stdout or ():
        if found := re.search(r"http://\S+", line):
            return found[0]
    sys.exit("The page was not served.")


if __name__ == "__main__":
    main()
