"""The pages build; tutorials are notebooks that JupyterLab opens, and their cells run."""

import subprocess
from pathlib import Path

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
jupytext = pytest.importorskip("jupytext", reason="scripts/setup --docs installs it")
jupyter_cache = pytest.importorskip("jupyter_cache", reason="scripts/setup --docs installs it")
nbformat = pytest.importorskip("nbformat")

pytestmark = pytest.mark.fe
ROOT = Path(__file__).parent.parent


def code(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def test_pages_build_without_warnings_and_their_notebooks_run():
    built = subprocess.run([ROOT / "scripts" / "docs"], capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    executed = jupyter_cache.get_cache(ROOT / "results" / "docs" / ".jupyter_cache")
    tutorials = ROOT / "docs" / "tutorials"
    for page in sorted(set(tutorials.glob("*.md")) - {tutorials / "index.md"}):
        opened = jupytext.read(page)
        nbformat.validate(opened)
        assert opened.metadata["kernelspec"]["display_name"]  # JupyterLab asks for it
        record = executed.match_cache_notebook(opened)  # the same cells, or KeyError
        ran = code(executed.get_cache_bundle(record.pk).nb)
        assert len(ran) == len(code(opened)) > 0 and all(cell.execution_count for cell in ran)
