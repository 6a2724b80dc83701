"""What comes with the program: cases by name, its look at an installation, files beside it."""

import ast
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import pytest
import yaml

import iceslide_fem
from iceslide_fem.cli import main
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import load_scene
from iceslide_fem.scene.cases import case_file, case_files, cases_folder, scene_path
from iceslide_fem.workflow.installation import Answer, Part, answer, can_run, parts

pytestmark = pytest.mark.quick
ROOT = Path(__file__).parent.parent
POINT = ["--set", "model=point", "--set", "load.duration=1ms", "--no-report"]
FOUND = (
    '{"found": {"mpi": "Open MPI v4", "petsc": "3.18", "solvers": "mumps", "dolfinx": "0.5 in /x"},'
    ' "errors": {}}'
)


def exit_of(capsys, *words):
    """Exit code, output and complaint of the whole program."""
    with pytest.raises(SystemExit) as end:
        main(list(words))
    said = capsys.readouterr()
    return end.value.code, said.out, said.err


def test_every_scene_of_the_folder_is_a_case():
    others = {"surfaces", "tyres"}
    there = {path for path in (ROOT / "cases").rglob("*.toml") if not others & {*path.parts}}
    assert {case.path for case in case_files()} == there
    assert case_file("laws/coulomb") == cases_folder() / "laws" / "coulomb.toml"


@pytest.mark.parametrize("case", case_files(), ids=lambda case: case.name)
def test_a_case_is_valid_and_says_what_it_is(case):
    scene = load_scene(case.path)
    assert scene.model == case.model and scene.name == Path(case.name).name
    assert re.fullmatch(r"[A-Za-z].{15,110}\.", case.what) and "(" not in case.what


def test_the_list_of_cases(capsys):
    code, out, _ = exit_of(capsys, "cases")
    assert code == 0 and all(case.name in out for case in case_files())
    assert "LS-DYNA" in out and "a minute" in out


def test_a_case_runs_from_any_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, _, err = exit_of(capsys, "run", "--case", "thesis_1bar", *POINT)
    assert code == 0, err
    assert (tmp_path / "results" / "thesis_1bar" / "history.csv").is_file()


def test_a_case_with_a_table_beside_it_is_swept(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["--case", "braking_wheel", "--vary", "ice.temperature=-4degC,-2degC", "--out", "many"]
    changes = ["--set", "model=point", "--set", "ice.motion=attached", "--no-report"]
    code, _, err = exit_of(capsys, "sweep", *words, *changes)
    assert code == 0, err
    assert (tmp_path / "many" / "sweep.csv").read_text(encoding="utf-8").count("done") == 2


def test_the_mesh_of_a_case_is_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scene = load_scene(case_file("user_mesh"))
    assert scene.rubber.mesh is not None and scene.rubber.mesh.is_file()


@pytest.mark.parametrize("name", ["run", "info", "ladder", "sweep"])
def test_an_unknown_case_is_one_sentence(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, _, err = exit_of(capsys, name, "--case", "thesis_9bar")
    assert code == 2 and err.count("\n") == 1
    assert 'there is no case "thesis_9bar"; allowed: braking_wheel, ' in err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["run", "info", "ladder", "sweep"])
def test_a_file_or_a_case_and_not_both(name, capsys):
    code, _, err = exit_of(capsys, name, str(case_file("thesis_1bar")), "--case", "thesis_1bar")
    assert code == 2 and "give a scene file or the name of a case; given: " in err
    assert exit_of(capsys, name)[0] == 2


def test_cases_lie_in_the_package_if_it_is_installed(tmp_path, monkeypatch):
    monkeypatch.setattr(iceslide_fem, "__file__", str(tmp_path / "iceslide_fem" / "__init__.py"))
    (tmp_path / "iceslide_fem" / "cases").mkdir(parents=True)
    cases_folder.cache_clear()
    try:
        assert cases_folder() == tmp_path / "iceslide_fem" / "cases"
        with pytest.raises(SceneError, match="there is no case"):
            scene_path(None, "thesis_1bar")
    finally:
        cases_folder.cache_clear()


PYTHON = """#!/bin/sh
for last; do :; done
case "$last" in
    *probe) exec "${0%/*}/probe" "$@" ;;
    *pyvista*) exec "${0%/*}/drawing" ;;
    *) exec "${0%/*}/gmsh" ;;
esac
"""


@pytest.fixture
def healthy(monkeypatch, tmp_path):
    """A machine on which all works: a function that makes one of its programs another script."""
    programs = tmp_path / "programs"
    programs.mkdir()

    def replace(name, script):
        (programs / name).write_text(script, encoding="utf-8")
        (programs / name).chmod(0o755)
        return programs / name

    monkeypatch.setattr(sys, "executable", str(replace("python", PYTHON)))
    monkeypatch.setenv("CC", str(replace("cc", "")))
    monkeypatch.setenv("ICESLIDE_CACHE", str(tmp_path / "cache"))
    for name, says in {"probe": FOUND, "gmsh": "4.15", "drawing": "VTK", "mpirun": ""}.items():
        replace(name, saying(says))
    include = tmp_path / "include"
    include.mkdir()
    (include / "Python.h").touch()
    monkeypatch.setattr(sysconfig, "get_paths", lambda: {"include": str(include)})
    return replace


def saying(text, code=0):
    """A program that says `text` and ends with `code`."""
    return f"#!/bin/sh\necho {shlex.quote(text)} >&{2 if code else 1}\nexit {code}\n"


def test_a_healthy_machine(healthy, capsys, tmp_path):
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache" / "form.so").write_bytes(bytes(3_000_000))
    assert all(part.works for part in parts())
    code, out, _ = exit_of(capsys, "doctor")
    assert code == 0 and "missing" not in out and "Points, slices and blocks can run." in out
    assert "3 MB" in re.sub(r"\s+", " ", out)


@pytest.mark.parametrize(
    "name, text, fails, lacking, words, code",
    [
        ("probe", "Segmentation fault", True, "DOLFINx", "python3-dolfinx", 3),
        ("probe", FOUND.replace('"0.5 in /x"', "null"), False, "DOLFINx", "points need neither", 3),
        ("probe", "no JSON", False, "PETSc", "it comes with DOLFINx", 3),
        ("probe", FOUND.replace("mumps", "hypre"), False, "PETSc's packages", "MUMPS", 3),
        ("gmsh", "libGLU.so.1: cannot open", True, "gmsh", "libglu1-mesa", 3),
        ("drawing", "no display", True, "pyvista, VTK", "pip install pyvista", 0),
    ],
)
def test_a_part_that_is_missing(healthy, capsys, name, text, fails, lacking, words, code):
    healthy(name, saying(text, code=int(fails)))
    (part,) = [part for part in parts() if part.name == lacking]
    assert not part.works and words in part.cure
    found_code, out, err = exit_of(capsys, "doctor")
    assert found_code == code and "Traceback" not in out + err
    assert f"{lacking}: {part.cure}." in out and "missing" in out
    assert ("slices and blocks cannot run" in err) == (code == 3)


def test_without_a_compiler_or_a_place_for_forms(healthy, monkeypatch, tmp_path):
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("PATH", "")
    healthy("mpirun", "").unlink()
    (tmp_path / "file").touch()
    monkeypatch.setenv("ICESLIDE_CACHE", str(tmp_path / "file" / "cache"))
    lacking = {part.name: part for part in parts() if not part.works}
    assert set(lacking) == {"mpirun", "C compiler", "cache"}
    assert "gcc python3-dev" in lacking["C compiler"].cure
    assert "ICESLIDE_CACHE" in lacking["cache"].cure


def test_without_pythons_headers(healthy, monkeypatch, tmp_path):
    monkeypatch.setattr(sysconfig, "get_paths", lambda: {"include": str(tmp_path)})
    (part,) = [part for part in parts() if not part.works]
    assert part.name == "C compiler" and "without" in part.found


def test_what_slices_do_not_need_may_be_missing():
    assert can_run([Part("a", "", True, True), Part("b", "", False, False)])
    assert not can_run([Part("a", "", False, True)])


@pytest.mark.parametrize(
    "program, expected",
    [
        ("print(1); print(2)", Answer(True, "2")),
        ("raise ImportError('libGL')", Answer(False, "ImportError: libGL")),
        ("import os; os.abort()", None),
    ],
)
def test_what_a_process_says(program, expected):
    found = answer("-c", program)
    assert found == expected if expected else not found.works and found.text


def test_a_process_that_hangs(monkeypatch):
    def hang(words, timeout, **_):
        raise subprocess.TimeoutExpired(words, timeout)

    monkeypatch.setattr(subprocess, "run", hang)
    assert answer("-c", "") == Answer(False, "no answer within 120 s")


def test_the_probe_says_what_cannot_be_imported(healthy, tmp_path, monkeypatch):
    python = shlex.quote(sys.prefix + "/bin/python")
    healthy("probe", f'#!/bin/sh\nexec {python} "$@"\n')
    (tmp_path / "mpi4py.py").write_text("raise ImportError('libmpi')", encoding="utf-8")
    (tmp_path / "petsc4py.py").write_text("raise RuntimeError('other MPI')", encoding="utf-8")
    (tmp_path / "dolfinx.py").write_text("raise OSError('libhdf5')", encoding="utf-8")
    (tmp_path / "dolfinx_solver.py").write_text("raise ImportError", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(ROOT)]))
    missing = {part.name: part.found for part in parts() if not part.works}
    assert list(missing) == ["DOLFINx", "PETSc", "PETSc's packages", "MPI"]
    assert "libhdf5" in missing["DOLFINx"] and "other MPI" in missing["PETSc"]


def test_one_version_and_who_to_cite():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["cff-version"] == "1.2.0" and citation["version"] == iceslide_fem.__version__
    assert citation["authors"] == [{"name": "The iceslide_fem developers"}]
    (thesis,) = citation["references"]
    title = "Advanced numerical model for viscous friction between rough rubber and smooth ice"
    assert thesis["type"] == "thesis" and thesis["title"] == title
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\n## {iceslide_fem.__version__}\n" in changes and "unreleased" not in changes


def test_all_folders_of_data_are_packages_of_the_wheel():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    folders = project["tool"]["setuptools"]["package-dir"]
    assert {name: (ROOT / path).is_dir() for name, path in folders.items()} == {
        "iceslide_fem": True,
        "iceslide_fem.cases": True,
        "iceslide_fem.meshes": True,
    }
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    named = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    assert {"iceslide_fem.cases", "iceslide_fem.meshes"} <= set(named)
    patterns = project["tool"]["setuptools"]["package-data"]
    for name in ("iceslide_fem.cases", "iceslide_fem.meshes"):
        folder = ROOT / folders[name]
        taken = {path for pattern in patterns[name] for path in folder.glob(pattern)}
        taken |= set(folder.glob("*.py"))
        there = {path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc"}
        assert taken == there
    assert (ROOT / "iceslide_fem" / "py.typed").is_file()


def test_the_container_files_are_well_formed():
    folder = ROOT / "scripts" / "containers"
    text = (folder / "Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert lines[0].startswith("FROM ")
    assert {line.split()[0] for line in lines} <= set(
        "FROM RUN COPY ENV WORKDIR ENTRYPOINT CMD".split()
    )
    copied = [word for line in lines if line.startswith("COPY") for word in line.split()[1:-1]]
    text = (folder / "apptainer.def").read_text(encoding="utf-8")
    sections = re.findall(r"^%(\w+)", text, re.MULTILINE)
    assert sections == ["files", "post", "environment", "runscript"]
    files = text[text.index("%files") : text.index("%post")].splitlines()[1:]
    assert [line.split()[0] for line in files if line.strip()] == copied
    assert all((ROOT / name).exists() for name in copied)
    shell = text[text.index("%post") + len("%post") : text.index("%environment")]
    done = subprocess.run(["bash", "-n"], input=shell, text=True, capture_output=True)
    assert done.returncode == 0, done.stderr
