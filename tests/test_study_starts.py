"""Every study starts, and says what it does."""

import importlib
import pkgutil
import re
import sys

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

import scripts.studies
from scripts.studies.common import ROOT

pytestmark = pytest.mark.fe

SHARED = {
    "common", "blocks", "command_runs", "peers_calculix", "peers_ngsolve", "wet_changes",
    "component_changes",
}  # fmt: skip
NAMES = sorted({module.name for module in pkgutil.iter_modules(scripts.studies.__path__)} - SHARED)


@pytest.mark.parametrize("name", NAMES)
def test_help_explains_and_does_nothing_else(name, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, "--help"])
    study = importlib.import_module(f"scripts.studies.{name}")
    with pytest.raises(SystemExit) as ended:
        study.main()
    assert ended.value.code == 0
    assert study.__doc__.splitlines()[0] in capsys.readouterr().out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_pictures_are_drawn_where_the_options_say(name):
    source = (ROOT / "scripts" / "studies" / f"{name}.py").read_text(encoding="utf-8")
    assert not re.search(r"savefig|print_figure", source)  # but by `common.draw`
