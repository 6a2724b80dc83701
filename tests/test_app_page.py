"""The page of `iceslide app` in a real browser, beside what the library computes."""

import json
import time
from functools import partial
from pathlib import Path
from urllib.parse import parse_qs, urlencode

import numpy as np
import pytest
from app_server import fixtures

from iceslide_fem.app import line, point, wheel
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict

open_app, served = fixtures()
REFUSED = "status of 422"  # what the browser says of an answer to wrong input
PICTURE = str(Path(__file__).parent.parent / "docs" / "pictures" / "footprint_picture.jpg")

# What charts hold is drawn on a canvas: the page is asked for its numbers.
CURVE = """async (texts) => (await (await import(new URL("api.js", document.baseURI))).ask(
    "point", { texts })).series.mu"""
MOVE = """([id, place]) => { const slider = document.getElementById(id); slider.value = place;
    slider.dispatchEvent(new Event("input", { bubbles: true })); }"""


def drawn(page, count="drawn"):
    """How often the curves of the point (or `lines`) have been drawn."""
    return int(page.evaluate(f"document.documentElement.dataset.{count} ?? 0"))


def opened(open_page, served, state="", **options):
    """A page whose first curves are there."""
    page = open_page(**options)
    page.goto(served.address + state)
    page.wait_for_selector("html[data-ready]")
    return page


def until(true, seconds=30.0):
    """Wait for it to become true."""
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "waited for too long"
        time.sleep(0.02)


def wait_drawn(page, before=0, count="drawn"):
    until(lambda: drawn(page, count) > before)


def address(page):
    """The address as the page has written it."""
    return page.evaluate("location.href")


def shown(page, quantity, tab="point"):
    """The text of a number beside the curves."""
    return page.locator(f"#{tab}-numbers div:has(dt:text-is('{quantity}')) dd").inner_text()


def shows(page, tab, quantity, due):
    """Whether that number is shown: an older answer may still be there."""
    return np.isclose(float(shown(page, quantity, tab).split()[0]), due, rtol=6e-3)


def test_every_slider_redraws_the_curve_of_the_library(served, open_page):
    page = opened(open_page, served, "#tab=point&contact=constants")
    wait_drawn(page)
    for slider in point.SLIDERS:
        before = drawn(page)
        page.evaluate(MOVE, [f"point-{slider.key}-slider", 400])
        wait_drawn(page, before)
        texts = {s.key: page.locator(f"[id='point-{s.key}']").input_value() for s in point.SLIDERS}
        assert texts[slider.key] != slider.text(slider.start)
        expected = point.curves(texts | {"contact": "constants"})
        until(partial(shows, page, "point", "mean μ", expected["numbers"]["mu_mean"]))
        assert page.evaluate(CURVE, texts | {"contact": "constants"}) == expected["series"]["mu"]
    rows, _ = point_history(scene_from_dict(_tables(page)))
    assert expected["series"]["mu"] == [row.mu for row in rows]
    assert "Drawn in" in page.locator("#point-time").inner_text()


def _tables(page):
    """The scene behind the button TOML."""
    import tomllib

    page.click("#show-toml")
    text = page.locator("#snippet pre").inner_text()
    page.click("#snippet-close")
    return tomllib.loads(text)


def test_a_pinned_curve_stays_and_the_address_gives_all_of_it_again(served, open_page):
    page = opened(open_page, served)
    wait_drawn(page)
    page.click("#pin")
    page.evaluate(MOVE, ["point-load.speed-slider", 300])
    default = "mean μ, sliding speed 3 m/s"  # in what it differs from the present curve
    until(lambda: page.locator(f"#point-numbers dt:text-is('{default}')").count() == 1)
    before = drawn(page)
    page.click("#pin")
    page.evaluate(MOVE, ["point-load.pressure-slider", 600])
    wait_drawn(page, before)
    page.locator("#pins input").last.fill("slow & wet")
    page.select_option("#map-y", "ice.temperature")
    for part in ("pin=", "pin2=", "slow", "load.speed", "y=ice"):
        until(lambda part=part: part in address(page))
    other = opened(open_page, served, "#" + address(page).partition("#")[2])
    until(lambda: other.locator("#pins li").count() == 2)
    names = [other.locator(f"#{chart} .u-legend").first for chart in ("chart-mu", "chart-film")]
    until(lambda: all("slow & wet" in each.inner_text() for each in names))
    first = next(dt for dt in page.locator("#point-numbers dt").all_inner_texts() if "3 m/s" in dt)
    for each in ("mean μ", "mean μ, slow & wet", first, "melting begins"):
        until(lambda each=each: shown(other, each).split()[0] == shown(page, each).split()[0])
    assert len({shown(page, each) for each in ("mean μ", "mean μ, slow & wet", first)}) == 3
    other.locator("#pins button").first.click()
    until(lambda: "pin2=" not in address(other) and "pin=" in address(other))
    assert "slow & wet" in other.locator("#chart-mu .u-legend").inner_text()
    until(lambda: other.locator("#chart-map").get_attribute("aria-label") is not None)
    assert "ice temperature" in other.locator("#chart-map").get_attribute("aria-label")


def test_a_click_on_the_map_takes_over_its_values(served, open_page):
    page = opened(open_page, served)
    until(lambda: page.locator("#chart-map .u-over").count() == 1)
    page.locator("#chart-map").scroll_into_view_if_needed()
    box = page.locator("#chart-map .u-over").bounding_box()
    before = drawn(page)
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 0.2 * box["height"])
    page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + 0.2 * box["height"])
    wait_drawn(page, before)
    pressure = page.locator("[id='point-load.pressure']").input_value()
    assert 4.0 < float(pressure.split()[0]) < 12.0
    assert "mean μ" in page.locator("#map-value").inner_text()


def test_wrong_input_marks_its_field_with_the_sentence_of_the_command(served, open_page):
    page = opened(open_page, served, meant=REFUSED)
    wait_drawn(page)
    field = page.locator("[id='point-load.pressure']")
    field.fill("300 bar")
    page.wait_for_selector("[id='point-load.pressure'][aria-invalid=true]")
    fault = page.locator(f"[id='{field.get_attribute('aria-errormessage')}']").inner_text()
    assert fault == ('load.pressure = "300 bar" is out of range; allowed: "0.01 bar" to "100 bar"')
    chart, stale = page.locator("#point figure").first, page.locator("#point .stale")
    assert _opacity(chart) < 0.5 and stale.is_visible()  # a curve of other values
    field.fill("3,5 bar")
    until(lambda: page.locator("[aria-invalid]").count() == 0)
    assert _opacity(chart) == 1.0 and not stale.is_visible()
    until(partial(shows, page, "point", "mean μ", _mean("3.5 bar")))


def _opacity(found):
    return float(found.evaluate("each => getComputedStyle(each).opacity"))


def _mean(pressure):
    texts = {s.key: s.text(s.start) for s in point.SLIDERS if s.key not in point.CONSTANTS}
    return point.curves(texts | {"load.pressure": pressure})["numbers"]["mu_mean"]


def test_back_goes_to_the_tab_before(served, open_page):
    page = opened(open_page, served)
    wait_drawn(page)
    page.fill("[id='point-load.speed']", "2 m/s")
    page.click("#tab-wheel")  # before the address has the speed
    wait_drawn(page, count="wheels")
    page.fill("#wheel-speed", "40 km/h")
    until(lambda: "speed=40" in address(page))
    page.click("#tab-scene")
    for tab in ("Wheel", "Point"):
        page.go_back()
        assert page.locator("[role=tab][aria-selected=true]").inner_text() == tab
    assert page.locator("[id='point-load.speed']").input_value() == "2 m/s"
    assert "load.speed=2" in address(page)
    page.go_forward()
    assert page.locator("#wheel").is_visible()
    assert page.locator("#wheel-speed").input_value() == "40 km/h"
    assert "speed=40" in address(page)


def test_what_a_field_means_is_shown_by_keyboard_and_said_with_it(served, open_page):
    page = opened(open_page, served)
    field, tip = page.locator("[id='point-load.pressure']"), page.locator("#tip")
    meaning = page.locator(f"[id='{field.get_attribute('aria-describedby')}']").text_content()
    assert meaning.startswith("Nominal pressure") and tip.is_hidden()
    page.locator(".field", has=field).locator("button.help").focus()
    page.keyboard.press("Enter")
    until(lambda: tip.is_visible())
    assert tip.inner_text() == meaning
    page.keyboard.press("Escape")
    until(lambda: tip.is_hidden())
    for tab, least in (("line", 10), ("wheel", 10), ("scene", 7)):
        page.click(f"#tab-{tab}")
        shown = page.locator(f"#{tab} button.help[title]:not([title='remove']):visible")
        assert shown.count() >= least, tab


def _add(page, key):
    """Add a key of a scene by its name."""
    page.fill("#scene-search", key)
    page.click(f"#scene-keys button:has(b:text-is('{key}'))")


def test_a_scene_shows_what_it_sets_and_finds_any_other_key(served, open_page):
    layers = '[{name = "base", above = "4 mm", C10 = "0.5 MPa"}]'
    state = {"tab": "scene", "name": "few", "model": "slice", "rubber.compound": "B"}
    state |= {"load.pressure": "1 bar", "load.speed": "3 m/s", "load.duration": "7 ms"}
    state |= {"rubber.layers": layers}
    page = opened(open_page, served, "#" + urlencode(state), meant=REFUSED)
    keys = "[...document.querySelectorAll('#scene [data-key]')].map((each) => each.dataset.key)"
    assert set(page.evaluate(keys)) == set(state) - {"tab"}
    rubber = page.locator("[id='scene-rubber.layers']")
    assert rubber.input_value() == layers and rubber.evaluate("each => each.tagName") == "TEXTAREA"
    assert "0.01 bar to 100 bar" in page.locator("#scene .group").nth(2).inner_text()
    page.fill("#scene-search", "melting point reach")  # words of its meaning
    until(lambda: "film.dry_residual" in page.locator("#scene-keys").inner_text())
    _add(page, "ice.temperature")
    field = page.locator("[id='scene-ice.temperature']")
    assert field.evaluate("each => each === document.activeElement")
    field.fill("-7,5 degC")
    until(lambda: "ice.temperature" in address(page))
    page.click("[aria-label='Remove rubber.layers']")
    until(lambda: "can be run" in page.locator("#scene-state").inner_text())
    tables = _tables(page)
    assert tables["ice"] == {"temperature": "-7.5 degC"} and "layers" not in tables["rubber"]
    page.fill("#scene-search", "")
    _add(page, "film.k")  # an error names keys that are not there
    page.fill("[id='scene-film.k']", "0.3")
    page.wait_for_selector("[id='scene-film.D'][aria-invalid=true]")


def test_the_wheel_brakes_if_it_is_asked_to(served, open_page):
    page = opened(open_page, served, "#tab=wheel&speed=20+km/h", meant=REFUSED)
    wait_drawn(page, count="wheels")
    assert page.locator("#stops").is_hidden() and page.locator("#wheel-mass").is_hidden()
    page.select_option("#wheel-abs", "yes")
    until(lambda: page.locator("#stops-table tbody tr").count() == 3)
    expected = wheel.stops({"speed": "20 km/h", "abs": "yes", "mass": "350 kg"})["controls"]
    until(lambda: page.locator("#stops.outdated").count() == 0)
    rows = page.locator("#stops-table tbody tr").all()
    for row, stop in zip(rows, expected.values(), strict=True):
        cells = [float(text) for text in row.locator("td").all_inner_texts()]
        due = [stop[name] for name in ("distance", "time", "deceleration")]
        assert np.allclose(cells, due, rtol=6e-3)
    assert "locked" in page.locator("#chart-stops").get_attribute("aria-label")
    page.click("#show-toml")
    assert "--abs" in page.locator("#snippet pre").inner_text()
    page.click("#snippet-close")
    page.fill("#wheel-end_speed", "30 km/h")
    page.wait_for_selector("#wheel-end_speed[aria-invalid=true]")
    page.select_option("#wheel-abs", "no")
    until(lambda: page.locator("#stops").is_hidden())
    until(lambda: page.locator("[aria-invalid]").count() == 0)


# The first chart of a tab with its legend stands above the fields, and between the window's sides.
WHOLE = """(tab) => {
  const box = (name) => document.querySelector(`#${tab} ${name}`)?.getBoundingClientRect();
  const parts = ["figure", ".u-legend", "canvas"].map(box);
  return parts.every((each) => each && each.height > 0 && each.left >= 0 && each.right <= 390
    && each.bottom <= box(".controls").top + 1);
}"""


def test_the_first_chart_is_whole_on_a_phone(served, open_page):
    page = opened(open_page, served, viewport={"width": 390, "height": 844})
    for tab, count in (("point", "drawn"), ("line", "lines"), ("wheel", "wheels")):
        page.click(f"#tab-{tab}")
        wait_drawn(page, count=count)
        until(partial(page.evaluate, WHOLE, tab))
        assert page.evaluate("document.documentElement.scrollWidth") <= 390, tab


def test_the_page_needs_no_network(served, open_page):
    page = open_page()
    asked = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(served.address)
    wait_drawn(page)
    page.click("#tab-line")
    wait_drawn(page, count="lines")
    page.click("#tab-wheel")
    wait_drawn(page, count="wheels")
    page.click("#tab-scene")
    until(lambda: page.locator("#info tbody tr").count() > 5)
    assert asked and all(url.startswith((served.address, "data:")) for url in asked)


def test_two_pages_at_once_do_not_disturb_each_other(served, open_page):
    pages = [opened(open_page, served, f"#tab=point&load.speed={v}+m/s") for v in (1, 4)]
    for page in pages:
        wait_drawn(page)
    for place in (300, 500):
        for page in pages:
            page.evaluate(MOVE, ["point-load.pressure-slider", place])
    time.sleep(0.3)
    for page, speed in zip(pages, ("1 m/s", "4 m/s"), strict=True):
        texts = {"load.pressure": page.locator("[id='point-load.pressure']").input_value()}
        texts |= {"load.speed": speed, "load.duration": "7 ms"}
        until(partial(shows, page, "point", "mean μ", point.curves(texts)["numbers"]["mu_mean"]))


def test_without_the_token_the_browser_shows_what_to_do(served, open_page):
    page = open_page(meant="status of 403")
    root = served.address[: served.address[:-1].rindex("/") + 1]
    for wrong in (root, root + "wrong/"):
        assert page.goto(wrong).status == 403
        assert "iceslide app" in page.locator("body").inner_text()


def test_every_slider_of_the_line_redraws_what_the_library_computes(served, open_page):
    page = opened(open_page, served, "#tab=line&thesis_balance=yes&model=next+pixel")
    wait_drawn(page, count="lines")
    picture = dict(source="image", image=PICTURE, legend="556,42,583,378", crop="0,0,540,420")
    picture["row"] = "210"
    for profile in ({}, picture):
        if profile:
            before = drawn(page, "lines")
            state = {"tab": "line", "thesis_balance": "yes", "model": "next pixel"} | profile
            page.evaluate("state => { location.hash = state; }", urlencode(state))
            wait_drawn(page, before, "lines")
        of_picture = {slider.key: slider.key in line.OF_PICTURE for slider in line.TAB.sliders}
        moved = [key for key, is_there in of_picture.items() if is_there == bool(profile)]
        for key in moved:
            before = drawn(page, "lines")
            page.evaluate(MOVE, [f"line-{key}-slider", 450])
            wait_drawn(page, before, "lines")
            until(lambda key=key: f"{key}=" in address(page))
            parts = parse_qs(address(page).partition("#")[2])
            state = {name: texts[0] for name, texts in parts.items()}
            assert state.pop("tab") == "line"
            expected = line.curves(state)["numbers"]
            for name, number in (
                ("largest rise", "peak_rise"),
                ("μ of the balance (3.8)", "mu_balance"),
            ):
                until(partial(shows, page, "line", name, expected[number]))
    page.click("#show-toml")
    assert page.locator("#snippet pre").inner_text().startswith(f"iceslide footprint {PICTURE}")


def test_the_address_of_a_scene_gives_all_of_it_again(served, open_page):
    rows = '[["-10 degC", "2.64 mPa*s"], ["0 degC", "1.79 mPa*s"]]'
    page = opened(open_page, served, "#tab=scene")
    _add(page, "water.viscosity")
    for key, text in {"name": "linked", "water.viscosity": rows}.items():
        page.fill(f"[id='scene-{key}']", text)
    for part in ("name=linked", "viscosity"):
        until(lambda part=part: part in address(page))
    wrong = "#" + address(page).partition("#")[2] + "&ice.margin=9+s"
    other = opened(open_page, served, wrong, meant=REFUSED)
    other.wait_for_selector("[id='scene-ice.margin'][aria-invalid=true]")
    other.fill("[id='scene-ice.margin']", "")
    until(lambda: "can be run" in other.locator("#scene-state").inner_text())
    tables = _tables(other)
    assert tables["name"] == "linked" and tables["water"]["viscosity"] == json.loads(rows)


def test_every_slider_of_the_wheel_redraws_what_the_library_computes(served, open_page):
    page = open_page(meant=REFUSED)
    asked = []
    page.on("request", lambda request: asked.append(request.url.rpartition("/")[2]))
    page.goto(served.address + "#tab=wheel&shape=gaussian&gaussian.2=25+mm&tread=blocks")
    wait_drawn(page, count="wheels")
    assert asked.count("wheel") == 1  # an address is computed once
    for slider in (each for each in wheel.TAB.sliders if each.key not in wheel.OF_STOPS):
        before = drawn(page, "wheels")
        page.evaluate(MOVE, [f"wheel-{slider.key}-slider", 450])
        wait_drawn(page, before, "wheels")
        until(lambda key=slider.key: f"{key}=" in address(page))
        parts = parse_qs(address(page).partition("#")[2])
        state = {name: texts[0] for name, texts in parts.items() if name != "tab"}
        expected = wheel.curves(state)["numbers"]
        for name, number in (("peak μ", "mu_peak"), ("locked μ", "mu_locked")):
            until(partial(shows, page, "wheel", name, expected[number]))
    said = page.locator("#chart-wheel-mu").get_attribute("aria-label")
    assert said.startswith("Friction over slip: peak")
    page.select_option("#wheel-tread", "slick")
    until(lambda: page.locator("[id='wheel-groove']").is_hidden())
    page.fill("#wheel-speed", "500 km/h")
    page.wait_for_selector("#wheel-speed[aria-invalid=true]")
    page.click("#show-toml")
    assert page.locator("#snippet pre").inner_text().startswith("iceslide wheel")


@pytest.mark.fe
def test_a_scene_is_checked_run_cancelled_and_run_on(served, open_page):
    pytest.importorskip("iceslide_fem.fenics.compat")
    page = opened(open_page, served, "#tab=scene", meant=REFUSED)
    page.fill("#scene-name", "a/b")
    page.wait_for_selector("#scene-name[aria-invalid=true]")
    assert page.locator("#run").is_disabled()
    _add(page, "numerics.refinement")
    for key, text in {
        "name": "seen",
        "load.duration": "2 ms",
        "numerics.refinement": "0.5",
    }.items():
        page.fill(f"[id='scene-{key}']", text)
    page.wait_for_selector("#run:enabled")
    until(lambda: page.locator("#info td:text-is('transit time')").count() == 1)
    page.click("#run")
    state = page.locator("#run-state")
    until(lambda: "sliding" in state.inner_text(), 120.0)
    asked = []
    page.on("dialog", lambda dialog: (asked.append(dialog.type), dialog.accept()))
    page.reload()
    assert asked == ["beforeunload"]  # a run is going
    until(lambda: page.locator("#runs li:has-text('seen')").count() == 1)
    until(lambda: state.get_attribute("data-state") == "running")
    page.click("#cancel")
    until(lambda: state.get_attribute("data-state") == "cancelled", 60.0)
    said = page.locator("#run-said")
    assert "SIGTERM" in said.inner_text() and page.locator(".error:visible").count() == 0
    assert page.locator("#progress").get_attribute("value") != "1"
    page.click("#resume")
    until(lambda: state.get_attribute("data-state") == "running", 60.0)
    assert said.is_hidden() and page.locator("#resume").is_hidden()
    until(lambda: state.get_attribute("data-state") == "done", 120.0)
    summary = json.loads((served.folder / "results/seen/summary.json").read_text("utf-8"))
    assert summary["stopped"] is None
    assert np.isclose(float(state.inner_text().split()[-1]), summary["mu_end"], rtol=6e-3)
    until(lambda: page.locator("#report").is_visible())
    report = page.locator("#report-frame").get_attribute("src")
    assert served.get(f"{served.root}/{report}")[0] == 200
    page.fill("[id='scene-load.duration']", "3 ms")
    page.wait_for_selector("#run:enabled")
    page.click("#run")
    until(lambda: "--force" in said.inner_text())  # the folder holds another run
    assert page.locator("#report").is_hidden() and page.locator("#progress-of-run").is_hidden()
    page.check("#force")
    page.click("#run")
    until(lambda: "sliding" in state.inner_text(), 120.0)
    page.uncheck("#force")
    for _ in range(2):  # what was cancelled makes place
        assert said.is_hidden() and page.locator(".error:visible").count() == 0
        page.click("#cancel")
        until(lambda: state.get_attribute("data-state") == "cancelled", 60.0)
        assert page.locator(".error:visible").count() == 0
        page.click("#run")
        until(lambda: state.get_attribute("data-state") == "running")
        until(lambda: "sliding" in state.inner_text(), 120.0)
    page.click("#cancel")
    until(lambda: state.get_attribute("data-state") == "cancelled", 60.0)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1300])
def test_every_tab_fits_and_is_readable(served, open_page, scheme, width):
    page = opened(open_page, served, color_scheme=scheme, viewport={"width": width, "height": 844})
    for tab in ("point", "line", "wheel", "scene"):
        page.click(f"#tab-{tab}")
        page.wait_for_timeout(100)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, tab
        nameless = page.evaluate(UNLABELLED)
        assert nameless == [], tab
        poor = page.evaluate(CONTRAST)
        assert poor == [], tab
    page.keyboard.press("ArrowRight")
    assert page.locator("[role=tab][aria-selected=true]").inner_text() == "Point"
    wait_drawn(page)
    page.focus("[id='point-load.pressure-slider']")
    before = page.locator("[id='point-load.pressure']").input_value()
    page.keyboard.press("ArrowRight")
    assert page.locator("[id='point-load.pressure']").input_value() != before


UNLABELLED = """() => [...document.querySelectorAll("input, select, button, progress, iframe")]
    .filter((each) => each.offsetParent && !(each.labels?.length || each.ariaLabel || each.title
        || each.innerText?.trim())).map((each) => each.id)"""

# WCAG 2: 4.5 to 1 for text against what is behind it.
CONTRAST = """() => {
  const parse = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => v / 255)
    .map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4))
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (each) => {
    for (let at = each; at; at = at.parentElement) {
      const colour = parse(getComputedStyle(at).backgroundColor);
      if (colour.length === 3 || colour[3] > 0.99) return colour;
    }
    return [255, 255, 255];
  };
  const found = new Set();
  for (const each of document.querySelectorAll("main *, header *")) {
    const text = [...each.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    if (!text || !each.offsetParent || each.disabled) continue;
    const [a, b] = [light(parse(getComputedStyle(each).color)), light(behind(each))];
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) found.add(`${each.tagName} ${each.className} ${ratio.toFixed(2)}`);
  }
  return [...found];
}"""
