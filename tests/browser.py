"""Headless Chromium for the tests of pages: Debian's package `chromium`, driven by playwright.

`chromium` and `open_page` are fixtures of all tests, imported once: a process can start no second
driver beside the first. Where there is no browser the tests that ask for one are skipped.
"""

import shutil

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="session")
def chromium():
    """The browser, started once."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright here: scripts/setup --browser"
    )
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("no Chromium here: scripts/setup --browser")
    with playwright.sync_playwright() as driver:
        try:
            # no sandbox: root cannot have one; nothing but the tests' own pages is opened
            browser = driver.chromium.launch(
                executable_path=program, args=["--no-sandbox", "--enable-unsafe-swiftshader"]
            )
        except playwright.Error as error:
            pytest.skip(f"Chromium does not start: {str(error).splitlines()[0]}")
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium):
    """A function that opens a new page and gives playwright's `Page`.

    Its keywords are those of playwright's `new_context`: `color_scheme="dark"`, `offline=True`,
    `viewport={"width": 390, "height": 844}`. After the test no page may have thrown an error,
    written one to the console, or asked the network for something it did not get, unless it was
    opened with `meant`, a text of such a complaint ("status of 422"). It is said beforehand, as
    a browser may complain long after the answer that it complains about.
    """
    contexts, complaints = [], []

    def open_new(meant=None, **options):
        contexts.append(chromium.new_context(**options))
        page = contexts[-1].new_page()

        def note(complaint):
            if meant is None or meant not in complaint:
                complaints.append(complaint)

        page.on("pageerror", lambda error: note(f"thrown: {error}"))
        page.on("console", lambda said: said.type == "error" and note(f"console: {said.text}"))
        return page

    yield open_new
    for context in contexts:
        context.close()
    assert complaints == []
