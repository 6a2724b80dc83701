"""README and docs say what the program does: keys, columns, examples, links."""

import re
import shlex
from pathlib import Path
from typing import Literal, get_args, get_origin

import numpy as np
import pytest
import typer

from iceslide_fem.cli import app
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.scene.rows import RowsOf
from iceslide_fem.scene.units import Quantity

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parent.parent
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]


def rows(page, heading):
    """Cells of the first table below a heading, without its head; code marks removed."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    lines = text[text.index(f"\n## {heading}\n") :].splitlines()[2:]
    first = next(number for number, line in enumerate(lines) if line.startswith("|"))
    table = []
    for line in lines[first + 2 :]:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in line.strip("|").split("|")])
    return table


def names(page, heading):
    """All names in code marks in the first column of that table."""
    return [name for row in rows(page, heading) for name in re.findall("`([^`]+)`", row[0])]


def leaves(model, prefix=""):
    """Dotted key -> field of everything that a scene file can set."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and hasattr(field.annotation, "model_fields"):
            yield from leaves(field.annotation, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def test_scene_page_has_every_key_with_its_range_and_default():
    fields, table = dict(leaves(Scene)), rows("scene.md", "All keys")
    assert [row[0].strip("`") for row in table] == list(fields)
    for (key, field), (_, default, allowed, _) in zip(fields.items(), table, strict=True):
        annotations = [*field.metadata, *get_args(field.annotation)]
        annotations += [more for part in annotations for more in getattr(part, "__metadata__", ())]
        quantity = next((part for part in annotations if isinstance(part, Quantity | RowsOf)), None)
        quantity = quantity.value if isinstance(quantity, RowsOf) else quantity
        if quantity is not None:
            assert allowed == f"{quantity.low} to {quantity.high}", key
        if get_origin(field.annotation) is Literal:
            assert re.findall("`([^`]+)`", allowed) == [*map(str, get_args(field.annotation))], key
        if isinstance(field.default, tuple):
            several = [tuple(re.findall("`([^`]+)`", cell)) for cell in (default, allowed)]
            assert several == [field.default, get_args(get_args(field.annotation)[0])], key
        elif default == "none":
            assert not field.default, key
        elif default in ("", "chosen"):
            assert field.is_required() or field.default is None, key
        elif quantity is not None:
            assert to_si(default, quantity.unit) == field.default, key
        else:
            assert default == str(field.default).lower(), key


def test_outputs_page_has_every_column():
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.output.passes import PassRow
    from iceslide_fem.output.probes import ProbeRow
    from iceslide_fem.output.table import HistoryRow, PreloadRow, columns_of

    assert names("outputs.md", "history.csv") == list(HistoryRow._fields)
    assert names("outputs.md", "preload.csv") == list(PreloadRow._fields)
    assert names("outputs.md", "passes.csv") == list(columns_of(PassRow))
    assert names("outputs.md", "probes.csv") == list(ProbeRow._fields)


@pytest.mark.fe
def test_outputs_page_has_every_entry_of_a_summary(tmp_path):
    pytest.importorskip("iceslide_fem.fenics.compat")
    from iceslide_fem.simulate import run

    small = ["numerics.refinement=0.5", "load.duration=20us", "numerics.tolerance=1e-2"]
    case = ROOT / "cases" / "thesis_1bar.toml"
    described = set(names("outputs.md", "summary.json")) - {"checksum"}  # of the file alone
    summary = run(load_scene(case, ["model=slice", *small]), tmp_path / "slice")
    assert described == set(summary)
    point = run(load_scene(case, ["model=point", "ice.heat=column"]), tmp_path / "point")
    text = (ROOT / "docs" / "outputs.md").read_text(encoding="utf-8")
    (sentence,) = re.findall(r"A point has no (.*?)\.\n", text, re.DOTALL)
    assert set(re.findall("`([^`]+)`", sentence)) == described - set(point)


@pytest.mark.parametrize("page", ["README.md", "docs/scene.md"])
def test_example_scenes_are_valid(page, tmp_path):
    (example,) = re.findall(r"```toml\n(name.*?)```", (ROOT / page).read_text("utf-8"), re.DOTALL)
    (tmp_path / "scene.toml").write_text(example, encoding="utf-8")
    assert load_scene(tmp_path / "scene.toml").name == "my_block"


def test_python_example_of_the_readme_runs():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    _, example = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    found: dict = {}
    exec(example, found)
    assert found["peaks"].shape == (1000,) and np.isfinite(found["peaks"]).all()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#\s]+)", text):
        if not target.startswith(("http:", "https:")):
            assert (page.parent / target).exists(), target
    for path in re.findall(r"`((?:scripts|iceslide_fem|tests)/[\w./-]+)", text):
        assert (ROOT / path).exists() or page.name == "CHANGELOG.md", path
    for study in re.findall(r"scripts\.studies\.(\w+)", text):
        assert (ROOT / "scripts" / "studies" / f"{study}.py").is_file(), study


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


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_exist_with_their_options(page):
    known = typer.main.get_command(app).commands
    for name, *words in commands(page):
        assert name in known, name
        options = {option for parameter in known[name].params for option in parameter.opts}
        own = words[: words.index("--")] if "--" in words else words
        given = {word.partition("=")[0] for word in own if word.startswith("--")}
        assert given <= options | {"--help"}, (name, given - options)
        for word in own:
            if word.startswith(("cases/", "docs/", "meshes/")):
                assert (ROOT / word).is_file(), word


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_python_programs_exist(page):
    text = page.read_text(encoding="utf-8")
    for path in re.findall(r"python (cases/[\w/]+\.py|meshes/[\w/]+\.py)", text):
        assert (ROOT / path).is_file(), path
    for study, options in re.findall(r"scripts\.studies\.(\w+)([^`\n]*)`", text):
        source = (ROOT / "scripts" / "studies" / f"{study}.py").read_text(encoding="utf-8")
        for option in re.findall(r"--[a-z-]+", options):
            shared = "picture_options(" in source and option in ("--pictures", "--update-docs")
            assert shared or f'"{option}"' in source, (study, option)
