"""Tutorials are notebooks: each opens as JupyterLab opens it. `scripts/docs` runs their cells."""

from pathlib import Path

import pytest

jupytext = pytest.importorskip("jupytext", reason="scripts/setup --docs installs it")
nbformat = pytest.importorskip("nbformat")

ROOT = Path(__file__).parent.parent
PAGES = sorted(path for path in (ROOT / "docs/tutorials").glob("*.md") if path.stem != "index")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_opens_as_a_notebook(page):
    notebook = jupytext.read(page)
    nbformat.validate(notebook)
    assert notebook.metadata["kernelspec"]["display_name"]  # JupyterLab asks for it
    assert any(cell.cell_type == "code" for cell in notebook.cells)
