"""The page of a run, of several, a sweep, a ladder, a footprint: whole, true, and drawn."""

import base64
import errno
import gzip
import html
import json
import os
import re
import shlex
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from program import exit_code, rows_of

pytest.importorskip("iceslide_fem.fenics.compat")  # the outputs' writers need it

from runs import a_scene, write_run  # noqa: E402
from written_fields import write_fields  # noqa: E402

from iceslide_fem.output.summary import write_summary  # noqa: E402
from iceslide_fem.postprocess.report.curves import (  # noqa: E402
    BALANCE,  # noqa: E402
    charts_of,
    charts_of_one,
)
from iceslide_fem.postprocess.report.of_pages import page_of_pages  # noqa: E402
from iceslide_fem.postprocess.report.of_runs import verdict  # noqa: E402
from iceslide_fem.postprocess.report.page import (  # noqa: E402
    OPTIONS,
    Cell,
    Chart,
    Curve,
    HeatMap,
    Page,
    Section,
    Table,
    Text,
    plain,
    thinned,
)
from iceslide_fem.postprocess.report.page import html as html_of  # noqa: E402
from iceslide_fem.postprocess.report.saved import read_page, save_page  # noqa: E402
from iceslide_fem.postprocess.results import read_run  # noqa: E402
from iceslide_fem.preprocess.footprint.case import FootprintCase  # noqa: E402
from iceslide_fem.preprocess.footprint.pressure_map import gaussian_profile  # noqa: E402
from iceslide_fem.preprocess.footprint.synthetic import Tread, grey_picture, save  # noqa: E402
from iceslide_fem.runs.checkpoint import write_checkpoint  # noqa: E402
from iceslide_fem.runs.doubts import before_run  # noqa: E402
from iceslide_fem.runtime.errors import SceneError  # noqa: E402
from iceslide_fem.scene import load_scene, scene_from_dict  # noqa: E402
from iceslide_fem.scene.fingerprint import sources_hash  # noqa: E402
from iceslide_fem.workflow.report import page_of, report  # noqa: E402
from iceslide_fem.workflow.sweep import make_plan  # noqa: E402

SCENE = """\
name = "seen"
model = "point"
[rubber]
compound = "B"
[load]
pressure = "1 bar"
speed = "3 m/s"
duration = "4 ms"
[ice]
heat = "column"
[numerics]
tolerance = 1e-2
"""
LARGEST = 10e6  # bytes
OF_A_RUN = ["results", "warnings", "curves", "neglected", "scene", "again"]
VIEWS = {
    "light": {"viewport": {"width": 1200, "height": 900}},
    "dark": {"viewport": {"width": 1200, "height": 900}, "color_scheme": "dark"},
    "phone": {"viewport": {"width": 390, "height": 844}},
}


class Parsed(HTMLParser):
    """Links, sections, cells with keys, and labels of a page."""

    def __init__(self, text):
        super().__init__()
        self.references, self.sections, self.values, self.labels = [], [], {}, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.references += [found[name] for name in ("src", "href", "action") if name in found]
        if tag == "section":
            self.sections.append(found["id"])
        if "data-key" in found:
            self.values.setdefault(found["data-key"], found["data-value"])
        if "chart" in found.get("class", ""):
            self.labels.append(found["aria-label"])


def numbers_in(path):
    """What the page's script draws."""
    packed = re.search(r'id="numbers">([^<]*)<', path.read_text("utf-8"))[1]
    return json.loads(gzip.decompress(base64.b64decode(packed)))


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A page of everything that has one, by what it is of."""
    root = tmp_path_factory.mktemp("reports")
    scene = root / "scene.toml"
    scene.write_text(SCENE)
    found = {}
    assert exit_code("run", scene, "--out", root / "point") == 0
    found["point"] = root / "point" / "report.html"
    for name, model, cells in (
        ("slice", "slice", "quadrilateral"),
        ("block", "block", "tetrahedron"),
        ("hexahedra", "block", "hexahedron"),
    ):
        folder = root / name
        folder.mkdir()
        write_run(folder, model)
        write_fields(folder, cells, True)
        found[name] = report([folder])
    stopped = root / "stopped"
    stopped.mkdir()
    write_run(stopped, "slice")
    summary = json.loads((stopped / "summary.json").read_text())
    warnings = ["the energies do not close: 3.0% of the friction work is missing"]
    summary |= {"stopped": "the block <tipped> over", "warnings": warnings}
    write_summary(stopped / "summary.json", summary)
    found["stopped"] = report([stopped])
    ladder = root / "ladder"
    for name, model in (("point_column", "point"), ("slice_column_x1", "slice")):
        (ladder / name).mkdir(parents=True)
        write_run(ladder / name, model)
        summary = json.loads((ladder / name / "summary.json").read_text())
        write_summary(ladder / name / "summary.json", summary | {"wall_s": 1.0 + len(name)})
    found["ladder"] = report([ladder])
    vary = ["--vary", "load.pressure=1bar:3bar:3", "--vary", "ice.temperature=-6degC,-2degC"]
    assert exit_code("sweep", scene, *vary, "--out", root / "sweep") == 0
    found["sweep"] = root / "sweep" / "report.html"
    picture = save(
        grey_picture(Tread(ribs=2, pitch=60e-3).footprint((20, 40)), 4e5), root / "g.png"
    )
    size = ["--length", "180mm", "--width", "140mm", "--max-pressure", "4bar"]
    assert exit_code("footprint", picture, *size, "--out", root / "footprint") == 0
    found["footprint"] = root / "footprint" / "report.html"
    x, pressure = gaussian_profile(0.18, 2e5, 30)
    rows = [f"{a:.9g},{p:.9g}" for a, p in zip(x, pressure, strict=True)]
    (root / "profile.csv").write_text("\n".join(["x_m,pressure_Pa", *rows]) + "\n")
    assert exit_code("footprint", "--line", root / "profile.csv", "--out", root / "line") == 0
    found["line"] = root / "line" / "report.html"
    found["runs"] = report([root / "point", root / "slice", stopped], root / "both.html")
    return found


ALL = ["point", "slice", "block", "hexahedra", "stopped", "ladder", "sweep", "footprint", "line"]
ALL += ["runs"]


@pytest.mark.parametrize("name", ALL)
def test_a_page_is_one_file_with_every_section(pages, name):
    text = pages[name].read_text("utf-8")
    page = Parsed(text)
    assert len(text.encode()) < LARGEST
    assert all(link.startswith(("#", "data:")) for link in page.references), page.references
    assert "@import" not in text and "url(" not in text.split("</style>")[0]
    expected = {
        "point": OF_A_RUN,
        "stopped": OF_A_RUN,
        "ladder": ["results", "curves", "warnings", "neglected", "again"],
        "sweep": ["curves", "results", "warnings", "scene", "again"],
        "footprint": ["results", "warnings", "curves", "neglected", "again"],
        "line": ["results", "warnings", "curves", "neglected", "again"],
        "runs": ["scenes", "results", "differences", "curves", "warnings", "again"],
    }
    assert page.sections == expected.get(name, [*OF_A_RUN[:3], "fields", *OF_A_RUN[3:]])
    drawn = numbers_in(pages[name])
    charts = [key for key in drawn if key != "fields"]
    charts += [drawing["name"] for drawing in drawn.get("fields", {"drawings": []})["drawings"]]
    assert len(page.labels) == len(charts) > 2
    assert all(len(label) > 20 for label in page.labels)


@pytest.mark.parametrize("name", ["point", "slice", "stopped"])
def test_what_a_page_says_is_what_the_summary_says(pages, name):
    page = Parsed(pages[name].read_text("utf-8"))
    summary = json.loads((pages[name].parent / "summary.json").read_text())
    for key in ("mu_peak", "mu_peak_time_s", "mu_mean", "mu_end", "melt_onset_s"):
        assert float(page.values[key]) == summary[key]
    assert page.values["saturation_s"] == "None" and summary["saturation_s"] is None
    text = pages[name].read_text("utf-8")
    shown = re.search(r"([\d.]+); numerical ± ([\d.e-]+), model up to ± ([\d.e-]+)", text)
    value, numerical, model = (float(part) for part in shown.groups())
    assert value == pytest.approx(summary["mu_peak"], abs=model)
    tolerance = summary["scene"]["numerics"]["tolerance"]
    assert numerical == pytest.approx(tolerance * value, rel=0.5) and numerical < model
    assert len(shown[1].split(".")[-1]) <= 2  # as many digits as the model's error leaves
    if name == "point":
        assert page.values["scene_hash"] == summary["scene_hash"]
        assert summary["versions"]["sources"] in text


def test_the_curves_are_those_of_the_history(pages):
    folder = pages["point"].parent
    table = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    curve = numbers_in(pages["point"])["mu"]["curves"][0]
    assert curve["x"] == pytest.approx(1e3 * table["time_s"], rel=1e-5)
    assert curve["y"] == pytest.approx(table["mu"], rel=1e-5)


def test_the_scene_on_the_page_runs_again(pages):
    text = pages["point"].read_text("utf-8")
    toml = re.search(r"<pre[^>]*>(name = .*?)</pre>", text, re.S)[1].replace("&#34;", '"')
    summary = json.loads((pages["point"].parent / "summary.json").read_text())
    assert scene_from_dict(tomllib.loads(toml)).as_dict() == summary["scene"]


def test_a_stopped_run_says_so_and_its_words_are_not_markup(pages):
    text = pages["stopped"].read_text("utf-8")
    assert "Stopped before its end." in text and "the block &lt;tipped&gt; over" in text
    assert "The energies do not close: 3.0% of the friction work is missing." in text
    assert "stopped: the block &lt;tipped&gt;" in pages["runs"].read_text("utf-8")
    assert "Stopped before" not in pages["point"].read_text("utf-8")


def test_a_run_without_a_summary_has_a_page_too(tmp_path):
    write_run(tmp_path, "slice")
    (tmp_path / "summary.json").unlink()
    (tmp_path / "stopped.txt").write_text("the plate cannot find its place\n")
    text = report([tmp_path]).read_text("utf-8")
    assert "the plate cannot find its place" in text and "7 ms of sliding in 28 steps" in text
    assert set(numbers_in(tmp_path / "report.html")) >= {"mu", "film_height_m"}
    (tmp_path / "history.csv").write_text("time_s,mu\n0.0,0.")  # killed while it wrote
    assert "0 ms of sliding" in report([tmp_path]).read_text("utf-8")


def test_a_killed_run_says_what_it_was_and_has_it_as_a_file(tmp_path):
    write_run(tmp_path, "slice")
    (tmp_path / "b").mkdir()
    (tmp_path / "summary.json").unlink()
    write_checkpoint(tmp_path, a_scene("slice"), {})
    tall = a_scene("slice").as_dict() | {"name": "tall"}
    tall["rubber"] |= {"height": 4e-3}
    write_checkpoint(tmp_path / "b", scene_from_dict(tall), {})
    assert "Warnings" in report([tmp_path / "b"]).read_text("utf-8")  # it may buckle
    text = html.unescape(report([tmp_path]).read_text("utf-8"))
    assert "A rubber block of 1 x 1 x 1 mm (compound B)" in text and "It was ended before" in text
    toml = re.search(r"<pre[^>]*>(name = .*?)</pre>", text, re.S)[1]
    assert scene_from_dict(tomllib.loads(toml)) == a_scene("slice")
    (tmp_path / "checkpoint").write_bytes(b"iceslide_fem checkpoint 1\n12\n{")
    assert "goes on from its last" in report([tmp_path]).read_text("utf-8")


def test_pages_say_what_computed_them(pages):
    for name in ("point", "sweep", "footprint", "line", "runs"):
        assert f">{sources_hash()}<" in pages[name].read_text("utf-8"), name


def test_the_sweep_on_the_page_is_the_same_sweep(pages, tmp_path):
    text = html.unescape(pages["sweep"].read_text("utf-8"))
    toml = re.search(r"<pre[^>]*>(name = .*?)</pre>", text, re.S)[1]
    command = re.search(r"iceslide sweep (\S+)\.toml(.*?)</pre>", text, re.S)
    (tmp_path / "seen.toml").write_text(toml)
    assert command[1] == "seen"
    vary = shlex.split(command[2].replace("\\\n", ""))[1::2]
    plan = make_plan([tmp_path / "seen.toml"], [], vary)
    assert "a relative error of mu(t) of 0.01 (numerics" in text
    assert "Numerical: numerics.tolerance times the value" in pages["runs"].read_text("utf-8")
    table = rows_of(pages["sweep"].parent / "sweep.csv")
    assert [case.name for case in plan.cases] == [row["case"] for row in table]


def test_simplifications_that_matter_are_warned_of():
    case = Path(__file__).parent.parent / "cases" / "thesis_1bar.toml"
    said = " ".join(before_run(load_scene(case, ["model=slice"])))
    assert re.search(r"by more than the tolerance:\s+plane strain \(up to \d", said)
    assert "bending (" not in said  # a slice bends


def test_runs_are_compared_as_long_as_both_slid(pages, tmp_path):
    write_run(tmp_path, "slice")
    run = read_run(tmp_path)
    part = {name: column[:5] for name, column in run.history.items()}
    (tmp_path / "b").mkdir()
    write_run(tmp_path / "b", "slice")
    lines = (tmp_path / "b" / "history.csv").read_text().splitlines(keepends=True)[:6]
    (tmp_path / "b" / "history.csv").write_text("".join(lines))
    text = report([tmp_path, tmp_path / "b"], tmp_path / "c.html").read_text("utf-8")
    end = 1e3 * part["time_s"][-1]
    assert re.search(rf"<td>0.00%</td><td>0.00%</td><td>{end:.4g} ms</td>", text)
    assert '<th scope="row">0.6364</th><td>0.2636</td><td>0.2636</td>' in text
    assert '<th scope="row">1.273</th><td>0.3273</td><td>–</td>' in text  # open where one ends
    stopped = run._replace(summary=run.summary | {"stopped": "tipped"})
    assert verdict(stopped, run, 0.0) == "stopped before its end"


def test_fields_of_runs_are_side_by_side_on_one_scale(tmp_path):
    folders = [tmp_path / name for name in ("a", "b")]
    for folder in folders:
        folder.mkdir()
        write_run(folder, "slice")
        write_fields(folder, "quadrilateral", True)
    drawn = numbers_in(report(folders, tmp_path / "both.html"))["fields"]["drawings"]
    assert [one["kind"] for one in drawn[:4]] == ["cells", "cells", "lines", "lines"]
    assert [one["title"][:3] for one in drawn[:2]] == ["a: ", "b: "]
    for one, other in zip(drawn[::2], drawn[1::2], strict=True):
        assert all(one.get(key) == other.get(key) for key in ("range", "xrange", "yrange"))
    text = (tmp_path / "both.html").read_text("utf-8")
    assert "Difference, and percent" in text and "+0.0000 (+0.00%)" in text


def test_a_contact_larger_than_the_nominal_area_is_no_fraction_of_itself():
    columns = ("contact_fraction", "melted_fraction", "saturated_fraction")
    history = dict.fromkeys((*BALANCE, *columns, "time_s", "step_s"), np.zeros(2))
    history["contact_fraction"] = np.array([0.9, 1.05])
    shares, *_ = charts_of_one(SimpleNamespace(history=history, phases={}, preload={}))
    assert "contact / nominal area 105 %" in shares.says and "bulge onto the plate" in shares.says
    history["contact_fraction"] = np.array([0.9, 0.95])
    shares, *_ = charts_of_one(SimpleNamespace(history=history, phases={}, preload={}))
    assert "bulge" not in shares.says


def test_many_curves_are_said_in_short_and_loads_are_drawn_where_they_change(tmp_path):
    write_run(tmp_path, "slice")
    run = read_run(tmp_path)
    names = [chart.name for chart in charts_of({"a": run})]
    faster = run._replace(
        history=run.history | {"speed_m_per_s": np.linspace(1.0, 3.0, run.history["mu"].size)}
    )
    charts = charts_of({"a": faster})
    assert [chart.name for chart in charts] == [*names, "speed_m_per_s"]
    thinning = run._replace(
        history=run.history | {"film_viscosity_Pa_s": 0.002 - run.history["time_s"] / 100.0}
    )
    charts = charts_of({"a": run, "b": thinning})
    assert [chart.name for chart in charts] == [*names, "film_viscosity_Pa_s"]
    assert [curve.name for curve in charts[-1].curves] == ["b"]
    many = charts_of({name: run for name in "abcdefg"})
    assert many[0].says.startswith("7 curves; at their ends between 0.25 (a) and 0.25")


def test_loads_that_go_in_time_are_said_as_ranges(tmp_path):
    write_run(tmp_path, "slice")
    summary = json.loads((tmp_path / "summary.json").read_text())
    summary["scene"]["load"] |= {
        "pressure": [[0.0, 1e5], [7e-3, 2e5]],
        "speed": [[0.0, 3.0], [1e-3, 2.0]],
    }
    write_summary(tmp_path / "summary.json", summary)
    text = report([tmp_path]).read_text("utf-8")
    assert "with 1 to 2 bar and slides at 2 to 3 m/s for 7 ms" in text


def test_a_first_film_that_follows_the_ice_is_said(tmp_path):
    write_run(tmp_path, "slice")
    summary = json.loads((tmp_path / "summary.json").read_text())
    summary["scene"]["film"]["initial_height"] = [[263.15, 50e-9], [271.15, 90e-9]]
    write_summary(tmp_path / "summary.json", summary)
    assert "The film begins with 80 nm." in report([tmp_path]).read_text("utf-8")


def test_the_ladder_is_compared_with_its_finest(pages):
    text = pages["ladder"].read_text("utf-8")
    assert text.index("point_column") < text.index("slice_column_x1")
    assert "within the tolerance" in text and ">finest<" in text


def test_a_line_and_a_map_say_their_edge_temperatures(pages):
    for name in ("line", "footprint"):
        summary = json.loads((pages[name].parent / "summary.json").read_text())
        ends = (summary["film"][f"{end}_edge_temperature_C"] for end in ("leading", "trailing"))
        assert "{:.2f}, {:.2f} degC".format(*ends) in pages[name].read_text("utf-8")
    drawn = numbers_in(pages["line"])
    names = [curve["name"] for curve in drawn["mu"]["curves"]]
    assert names == ["film law"]


@pytest.mark.parametrize("name", ["line", "footprint"])
def test_the_command_on_the_page_is_the_same_case(pages, name):
    text = html.unescape(pages[name].read_text("utf-8"))
    command = re.search(r"iceslide footprint ?(.*?)</pre>", text, re.S)[1]
    words = shlex.split(command.replace("\\\n", ""))
    case = {} if name == "line" else {"image": words.pop(0)}
    options = (word.removeprefix("--").replace("-", "_") for word in words[::2])
    case |= dict(zip(options, words[1::2], strict=True))
    summary = json.loads((pages[name].parent / "summary.json").read_text())
    assert FootprintCase.of(case).model_dump(mode="json") == summary["case"]


def test_fields_are_those_that_were_written(pages):
    drawn = numbers_in(pages["slice"])["fields"]
    assert len(drawn["moments"]) == 3 and drawn["moments"][0].startswith("t = 0 ms, mu = 0.2")
    kinds = [drawing["kind"] for drawing in drawn["drawings"]]
    assert kinds == ["cells", "lines", "lines", "lines", "heat"]
    pressure = drawn["drawings"][1]["frames"][-1][0]
    touching = [(x, y) for x, y in zip(pressure["x"], pressure["y"], strict=True) if y is not None]
    for x, y in touching:  # as written_fields has it: 1 + (x / size) / 1 bar, x of the facet
        assert 0.0 < y < 4.0 and abs(x) < 20.0
    block = numbers_in(pages["hexahedra"])["fields"]["drawings"]
    assert [drawing["kind"] for drawing in block] == ["solid", "cells", "cells", "cells", "heat"]
    assert max(map(max, block[0]["faces"])) < len(block[0]["frames"][0]["points"]) / 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "nowhere is not a folder"),
        (["."], "holds nothing to report"),
        (["point", "point"], "the same folder is given twice"),
        (["point", "--out", "page.txt"], "give a file that ends in .html"),
        (["point", "--title", " "], "a title is a text"),
    ],
)
def test_wrong_input_is_a_sentence(pages, arguments, words, monkeypatch, capsys, tmp_path):
    root = pages["point"].parent.parent
    monkeypatch.chdir(tmp_path if arguments == ["."] else root)
    assert exit_code("report", *arguments) == 2
    said = capsys.readouterr()
    assert words in said.err and said.err.count("\n") == 1 and said.out == ""


def test_a_page_may_have_a_title_of_its_own(pages, tmp_path):
    out = tmp_path / "own.html"
    assert exit_code("report", pages["point"].parent, "--title", "Winter <1>", "--out", out) == 0
    assert "<title>Winter &lt;1&gt;" in out.read_text("utf-8")


def test_no_report_and_a_page_that_cannot_be_written(tmp_path, monkeypatch, capsys):
    (tmp_path / "scene.toml").write_text(SCENE)
    out = tmp_path / "out"
    assert exit_code("run", tmp_path / "scene.toml", "--out", out, "--no-report") == 0
    assert not (out / "report.html").exists()
    replace = os.replace

    def full(source, target):
        if Path(target).name == "report.html":
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    assert exit_code("run", tmp_path / "scene.toml", "--out", out) == 0
    assert "Note: no report.html: cannot write" in capsys.readouterr().out


def test_numbers_are_those_with_six_digits():
    values = [0.0, -1.23456789e-9, 123456789.0, 0.1, 1.0, 999999.5, np.nan, np.inf, 2.5e-7]
    expected = [float(f"{value:.6g}") for value in values[:6]] + [None, None, 2.5e-7]
    assert plain(values) == expected


def test_long_curves_keep_their_peak():
    time = np.linspace(0.0, 1.0, 40_001)
    mu = np.exp(-((time - 0.123456) ** 2) / 1e-9)
    x, y = thinned(time, mu)
    assert x.size < 2000 and y.max() == mu.max() and (x[0], x[-1]) == (0.0, 1.0)


def test_a_folder_with_a_damaged_summary_is_refused(tmp_path):
    (tmp_path / "summary.json").write_text("[1]")
    with pytest.raises(SceneError, match="not what a command wrote"):
        page_of([tmp_path])
    (tmp_path / "summary.json").write_text('{"footprint": {}, "case": {}}')
    with pytest.raises(SceneError, match="run its command again"):
        page_of([tmp_path])
    for text in ("", "[]", '{"sections": [{}]}', '{"title": "", "summary": "", "sections": [[]]}'):
        (tmp_path / "page.json").write_text(text)
        with pytest.raises(SceneError, match="not what a command wrote"):
            page_of([tmp_path])


def drawn_in(page, path):
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-ready]")


def test_every_kind_of_drawing_is_drawn_without_a_network(pages, open_page):
    page = open_page(offline=True)
    for name in ("hexahedra", "ladder", "footprint"):
        drawn_in(page, pages[name])
        charts = page.locator(".chart").count()
        assert page.locator(".chart[data-drawn] .main-svg").count() >= charts > 2
        assert page.locator("#trouble").is_hidden()


def test_slider_keys_and_schemes(pages, open_page):
    seen = {}
    for name, view in VIEWS.items():
        page = open_page(offline=True, **view)
        drawn_in(page, pages["slice"])
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
        ink, paper = page.evaluate(
            "(style => [style.color, style.backgroundColor])(getComputedStyle(document.body))"
        )
        seen[name] = page.evaluate("document.querySelector('#mu .js-line').style.stroke")
        assert contrast(ink, paper) > 7.0 and contrast(seen[name], paper) > 3.0
    assert seen["light"] == seen["phone"] != seen["dark"]
    page.focus("#moment")
    last = page.text_content("#moment-said")
    page.keyboard.press("Home")
    assert page.text_content("#moment-said").startswith("t = 0 ms") and last != "t = 0 ms"
    page.focus("#mu")
    page.keyboard.press("ArrowRight")
    assert page.locator("#mu ~ .reading").inner_text() == "sliding time (ms) 0: this run 0.2"
    page.keyboard.press("+")
    low, high = page.evaluate("document.getElementById('mu').layout.xaxis.range")
    assert high - low < 4.0
    page.keyboard.press("Home")
    ice = page.locator("#ice")
    assert re.search(r"Now -?[\d.]+ to -?[\d.]+ °C", ice.get_attribute("aria-label"))
    ice.focus()
    page.keyboard.press("ArrowRight")
    read = page.locator("#ice ~ .reading").inner_text()
    page.keyboard.press("ArrowDown")
    assert re.fullmatch(r"x \(mm\) \S+, z \(µm\) \S+: \S+ °C", read)
    assert page.locator("#ice ~ .reading").inner_text() != read
    page.emulate_media(color_scheme="dark")  # as on the screen when a browser begins to print
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    word = page.evaluate("getComputedStyle(document.querySelector('#mu .xtick text')).fill")
    assert contrast(word, "rgb(255, 255, 255)") > 7.0
    page.emulate_media(media="print", color_scheme="dark")
    printed = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert printed == "rgb(255, 255, 255)"


def contrast(one, other):
    """Contrast of two colours of CSS, as the WCAG define it."""

    def luminance(colour):
        parts = np.array([float(part) for part in re.findall(r"[\d.]+", colour)][:3]) / 255.0
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def a_page(mu, curve, degrees):
    tables = [
        Table(
            "Main figures", ["", ""], [[Cell("peak mu"), Cell(mu)], [Cell("ice"), Cell(degrees)]]
        ),
        Table("Friction", ["speed", "mu", "ice (°C)"], [[Cell("50"), Cell(mu), Cell(degrees[:2])]]),
    ]
    chart = Chart("mu", "Friction", "Of a wheel.", "slip", "mu", [Curve("", [0.0, 1.0], curve)])
    heat = HeatMap("map", "Pressure", "", "x", "y", "bar", ([0, 1], [0]), [[1.0, np.nan]])
    options = [[Cell("--temperature"), Cell(degrees)], [Cell("--speed"), Cell("3 m/s")]]
    parts = [Text("--temperature=-4degC", "code"), Table(OPTIONS, ["option", "value"], options)]
    sections = [
        Section("results", "Results", tables),
        Section("warnings", "Warnings", [Text("Hot.", "warning")]),
        Section("curves", "Curves", [chart, heat]),
        Section("again", "Again", parts),
    ]
    return Page("a wheel", "A wheel.", sections)


def test_a_saved_page_is_read_back(tmp_path):
    page = a_page("0.2", [0.0, np.nan], "-4 °C")
    save_page(page, tmp_path)
    assert html_of(read_page(tmp_path)) == html_of(page)


def test_several_pages_are_set_against_the_first():
    pages = {
        "a": a_page("0.20", [0.1, 0.2], "-4 °C"),
        "b": a_page("0.25", [0.2, 0.3], "-8 °C"),
        "c": a_page("none", [0.2, 0.3], "-4 °C"),
    }
    page = page_of_pages(pages, "iceslide report a b c")
    sections = {section.name: section.parts for section in page.sections}
    (different,) = sections["scenes"]
    assert [[cell.text for cell in row] for row in different.rows] == [
        ["--temperature", "-4 °C", "-8 °C", "-4 °C"]
    ]
    beside, below, *_ = sections["results"]
    assert [[cell.text for cell in row] for row in beside.rows] == [
        ["peak mu", "0.20", "0.25 (+25.0%)", "none"],
        ["ice", "-4 °C", "-8 °C", "-4 °C"],
    ]
    assert [cell.text for cell in below.rows[1]] == ["b", "50", "0.25 (+25.0%)", "-8"]
    chart, *maps = sections["curves"]
    assert [curve.name for curve in chart.curves] == ["a", "b", "c"] and chart.says == "Of a wheel."
    assert len({part.name for part in maps}) == len(maps) == 3
    assert sections["warnings"][1].words == "b: Hot."
    assert sections["again"][0].words == "iceslide report a b c"


def test_a_run_and_a_sweep_are_on_one_page(pages):
    page = page_of([pages["point"].parent, pages["sweep"].parent])
    assert {"Key results", "Cases in the order of the table sweep.csv"} <= {
        part.caption for part in page.sections[0].parts
    }


def test_what_another_run_changes_is_a_command_that_makes_it(tmp_path):
    for name, bar in (("a", 1), ("b", 2)):
        scene = tmp_path / f"{name}.toml"
        scene.write_text(SCENE.replace("1 bar", f"{bar} bar"))
        assert exit_code("run", scene, "--no-report", "--out", tmp_path / name) == 0
    page = page_of([tmp_path / "a", tmp_path / "b"])
    again = next(section for section in page.sections if section.name == "again")
    words = shlex.split(again.parts[2].words)
    assert words[:2] == ["iceslide", "run"] and "load.pressure=200000.0" in words
    assert exit_code("run", tmp_path / "a.toml", *words[3:-1], tmp_path / "again") == 0
    found = [read_run(tmp_path / name).summary["mu_mean"] for name in ("b", "again")]
    assert found[0] == found[1]


def test_a_run_on_a_drawn_block_shows_its_mesh(tmp_path):
    write_run(tmp_path, "slice")
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert "mesh" not in [section.name for section in page_of([tmp_path]).sections]
    mesh = Path(__file__).parent.parent / "meshes" / "siped_block.msh"
    rubber = {"compound": "B", "mesh": str(mesh)}
    scene = scene_from_dict({**summary["scene"], "rubber": rubber}).as_dict()
    write_summary(tmp_path / "summary.json", summary | {"scene": scene})
    text = report([tmp_path]).read_text("utf-8")
    assert "drawn in siped_block.msh" in text and 'src="data:image/png;base64,' in text
    page = Parsed(text)
    assert "mesh" in page.sections and all(
        link.startswith(("#", "data:")) for link in page.references
    )
