"""Tutorials are notebooks: each opens as JupyterLab opens it, and its cells run."""

from pathlib import Path

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
jupytext = pytest.importorskip("jupytext", reason="scripts/setup --docs installs it")
nbclient = pytest.importorskip("nbclient", reason="scripts/setup --docs installs it")
nbformat = pytest.importorskip("nbformat")

pytestmark = pytest.mark.fe
ROOT = Path(__file__).parent.parent
PAGES = sorted(path for path in (ROOT / "docs/tutorials").glob("*.md") if path.stem != "index")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_opens_as_a_notebook_and_runs(page, tmp_path):
    notebook = jupytext.read(page)
    nbformat.validate(notebook)
    assert notebook.metadata["kernelspec"]["display_name"]  # JupyterLab asks for it
    here = tmp_path / "docs" / "tutorials"  # as in a clone, which stays as it is
    here.mkdir(parents=True)
    for folder in ("cases", "meshes", "docs/pictures"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    how = {"resources": {"metadata": {"path": str(here)}}, "timeout": 300}
    nbclient.NotebookClient(notebook, kernel_name="python3", **how).execute()
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert cells and all(cell.execution_count for cell in cells)
