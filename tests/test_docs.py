"""README and docs say what the program does: keys, columns, examples, links."""

import ast
import csv
import re
import shlex
import tomllib
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest
import typer

from iceslide_fem.cli import app
from iceslide_fem.scene import load_scene
from scripts.studies import record

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
MOST_WORDS = 32_000  # outside what is generated


def reference():
    """The extension that generates the reference pages."""
    spec = spec_from_file_location("reference", DOCS / "_ext" / "reference.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def relative(page):
    return str(page.relative_to(ROOT))


def test_pages_are_short():
    texts = (page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    prose = (re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE) for text in texts)
    assert sum(len(text.split()) for text in prose) <= MOST_WORDS
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


def test_every_page_is_in_the_contents():
    for index in DOCS.rglob("index.md"):
        text = index.read_text(encoding="utf-8")
        listed = set(re.findall(r"^([\w/-]+)$", text[text.index("{toctree}") :], re.MULTILINE))
        own = {page.stem for page in index.parent.glob("*.md")} - {"index"}
        folders = {f"{folder.parent.name}/index" for folder in index.parent.glob("*/index.md")}
        assert listed == own | folders, index


def test_every_key_is_described_with_its_range_and_default():
    pytest.importorskip("sphinx")
    rows = {row[0]: row for _, table in reference().scene_keys() for row in table}
    assert rows["`rubber.edge_radius`"][1:3] == ("0 m", "0 m to 10 mm")
    assert rows["`ice.temperature`"][1:3] == ("-4 degC", "-80 degC to -0.001 degC")
    assert rows["`load.pressure`"][1:3] == ("needed", "0.01 bar to 100 bar, or rows")
    assert rows["`film.voids`"][1:3] == ("`stop`", "`stop`, `carry`")
    assert rows["`rubber.sipes`"][1:3] == ("0", "0 to 8, a list")
    assert rows["`film.contact`"][1:3] == ("–", "a file")
    assert rows["`rubber.heat`"][1:3] == ("`false`", "`mesh`, `true`, `false`")
    assert rows["`load.passes`"][1:3] == ("1", "1 to 100000")


def test_every_column_is_described():
    pytest.importorskip("sphinx")
    pytest.importorskip("iceslide_fem.fenics.compat")
    for table in ("history", "preload", "passes", "probes", "law"):
        assert all(len(row) == 2 and row[1] for row in reference().run_columns(table))


def test_columns_of_laws_are_described():
    pytest.importorskip("sphinx")
    from iceslide_fem.film.contact_age import CONTACT_AREA
    from iceslide_fem.film.viscosity import FILM_VISCOSITY

    described = [row[0].strip("`") for row in reference().run_columns("law")]
    assert {CONTACT_AREA, FILM_VISCOSITY} <= set(described)


@pytest.mark.fe
def test_every_entry_of_a_summary_is_described(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.simulate import run

    small = ["numerics.refinement=0.5", "load.duration=20us", "numerics.tolerance=1e-2"]
    case = ROOT / "cases" / "thesis_1bar.toml"
    described = {row[0].strip("`") for row in reference().run_columns("summary")} - {"checksum"}
    summary = run(load_scene(case, ["model=slice", *small]), tmp_path / "slice")
    assert described == set(summary)
    point = run(load_scene(case, ["model=point", "ice.heat=column"]), tmp_path / "point")
    text = (DOCS / "reference" / "columns.md").read_text(encoding="utf-8")
    (sentence,) = re.findall(r"A point has no (.*?)\.\n", text, re.DOTALL)
    assert set(re.findall("`([^`]+)`", sentence)) == described - set(point)


@pytest.mark.parametrize("page", ["README.md", "docs/reference/scene.md"])
def test_example_scenes_are_valid(page, tmp_path):
    (example,) = re.findall(r"```toml\n(name.*?)```", (ROOT / page).read_text("utf-8"), re.DOTALL)
    (tmp_path / "scene.toml").write_text(example, encoding="utf-8")
    assert load_scene(tmp_path / "scene.toml").name == "my_block"


def test_python_example_of_the_readme_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    found: dict = {}
    exec(example, found)
    assert 0.1 < found["peak"] < 1.0


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)", text):
        if not target.startswith(("http:", "https:")):
            assert (page.parent / target).exists(), target
    for path in re.findall(r"`((?:scripts|iceslide_fem|tests)/[\w./-]+)", text):
        assert (ROOT / path).exists() or page.name == "CHANGELOG.md", path
    for study in re.findall(r"scripts\.studies\.(\w+)", text):
        assert (ROOT / "scripts" / "studies" / f"{study}.py").is_file(), study


def test_tables_of_validation_are_there_and_shown():
    shown = set()
    for page in (DOCS / "validation").glob("*.md"):
        shown |= set(re.findall(r"{validation-table} (\w+)", page.read_text(encoding="utf-8")))
    assert shown == {path.stem for path in (DOCS / "validation" / "data").glob("*.csv")}
    known = tomllib.loads((DOCS / "validation" / "tables.toml").read_text(encoding="utf-8"))
    assert shown == set(known)
    for path in (DOCS / "validation" / "data").glob("*.csv"):
        lines = path.read_text(encoding="utf-8").splitlines()
        about = dict(line[2:].split(": ", 1) for line in lines[: lines.index("#")])
        assert {"printed by", "commit", "date", "machine"} <= set(about), path
        study = about["printed by"].split()[0].removeprefix("scripts.studies.")
        assert (ROOT / "scripts" / "studies" / f"{study}.py").is_file()
        entry = known[path.stem]
        words = " ".join((f"scripts.studies.{entry['study']}", *entry.get("options", ())))
        assert about["printed by"] == words, path
        head, *rows = csv.reader(lines[lines.index("#") + 1 :])
        if "columns" in entry:
            assert head == entry["columns"], path
        else:
            assert ", ".join(head).startswith(entry["head"]), path
        assert rows and all(len(row) == len(head) for row in rows), path


def test_a_page_shows_the_part_of_a_table_that_is_asked_for():
    rows = [["case", "s", "of mu"], ["one, 1 bar", "2", "3"], ["two, 5 bar", "4", "5"]]
    assert record.chosen(rows, {}) == rows
    wanted = {"rows": "1 bar", "columns": ["of mu", "case"]}
    assert record.chosen(rows, wanted) == [["of mu", "case"], ["3", "one, 1 bar"]]
    with pytest.raises(ValueError, match="mu"):
        record.chosen(rows, {"columns": ["mu"]})


def test_modules_name_pages_that_are_there():
    folders = ("iceslide_fem", "cases", "meshes", "scripts", "tests")
    for folder in folders:
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".toml", ".html", ".js"):
                for page in re.findall(r"docs/[\w/-]+\.md", path.read_text(encoding="utf-8")):
                    assert (ROOT / page).is_file(), (path, page)


def messages():
    """Module and text of every string of the package that is no description."""
    for path in (ROOT / "iceslide_fem").rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        described = {
            id(node.body[0].value)
            for node in ast.walk(tree)
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
            and isinstance(node.body[0] if node.body else None, ast.Expr)
        }
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                if id(node) not in described:
                    yield str(path.relative_to(ROOT / "iceslide_fem")), node.value


def test_messages_name_pages_by_their_titles():
    """Whoever has installed the program has no folder of pages."""
    pages = (page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    titles = {title for text in pages for title in re.findall(r"^# (.+)$", text, re.MULTILINE)}
    said = list(messages())
    assert not [module for module, text in said if "docs/" in text]
    cited = {title for _, text in said for title in re.findall(r'\bpage "([^"]+)"', text)}
    assert len(cited) > 5 and cited <= titles


def commands(page):
    """Words of every command line of `iceslide` on a page, in blocks and in code marks."""
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^ *```(?:sh|text)?\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    lines += re.findall("`([^`]*)`", re.sub("```.*?```", "", text, flags=re.DOTALL))
    for line in lines:
        found = re.search(r"(?:^|[;&|] *|mpirun -n \d+ )iceslide ([a-z].*)", line.strip())
        if found:
            yield shlex.split(found.group(1).replace("\n", " "), comments=True)


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_commands_exist_with_their_options(page):
    group = typer.main.get_command(app)
    for name, *words in commands(page):
        assert name in group.commands, name
        _, command, _ = group.resolve_command(typer.Context(group), [name])
        if parts := getattr(command, "commands", None):
            command, words = parts[words[0]], words[1:]
        options = {option for parameter in command.params for option in parameter.opts}
        own = words[: words.index("--")] if "--" in words else words
        given = {word.partition("=")[0] for word in own if word.startswith("--")}
        assert given <= options | {"--help"}, (name, given - options)
        for word in own:
            if word.startswith(("cases/", "docs/", "meshes/")):
                assert (ROOT / word).is_file(), word


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_python_programs_exist(page):
    text = page.read_text(encoding="utf-8")
    for path in re.findall(r"python (cases/[\w/]+\.py|meshes/[\w/]+\.py)", text):
        assert (ROOT / path).is_file(), path
    for study, options in re.findall(r"scripts\.studies\.(\w+)([^`\n]*)`", text):
        source = (ROOT / "scripts" / "studies" / f"{study}.py").read_text(encoding="utf-8")
        for option in re.findall(r"--[a-z-]+", options):
            shared = "picture_options(" in source and option in ("--pictures", "--update-docs")
            assert shared or f'"{option}"' in source, (study, option)
