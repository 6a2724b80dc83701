"""The folders are the architecture: imports lead down, and FEniCS stays where it is."""

import ast
import re
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

pytestmark = pytest.mark.quick

PACKAGE = Path(__file__).parent.parent / "iceslide_fem"

# From the ground up; a module or folder imports only what stands below its floor.
FLOORS = [
    {"runtime"},
    {"relaxation"},
    {"surfaces"},
    {"scene", "fenics"},
    {"film", "mesh"},
    {"laws"},
    {"heat", "mechanics", "reference"},
    {"interface"},
    {"coupling"},
    {"output"},
    {"runs"},
    {"postprocess"},
    {"preprocess", "simulate"},
    {"workflow"},
    {"inference"},
    {"api", "exchange"},
    {"app"},
    {"commands"},
    {"cli"},
    {"__main__"},
]
FLOOR = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
# What needs no finite elements is usable without them, and starts fast.
WITHOUT_FENICS = {"runtime", "relaxation", "surfaces", "scene", "film", "laws", "reference"}
WITHOUT_FENICS |= {"relaxation", "preprocess", "postprocess", "api", "exchange", "app"}
WITHOUT_FENICS |= {"commands", "cli"}
FINITE_ELEMENTS = {
    "basix",
    "dolfinx",
    "dolfinx_solver",
    "ffcx",
    "gmsh",
    "mpi4py",
    "petsc4py",
    "ufl",
}
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if path != PACKAGE / "__init__.py")


def room_of(module):
    """Folder or module directly in the package."""
    return module.relative_to(PACKAGE).with_suffix("").parts[0]


def imported(tree):
    """Dotted names of all modules that are imported anywhere in a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
            yield from (f"{node.module}.{name.name}" for name in node.names)


def imported_at_once(tree):
    """The same of what runs when the module is imported: not in functions, not for types only."""
    nodes = list(tree.body)
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from imported(node)
        elif not isinstance(node, ast.FunctionDef) and "TYPE_CHECKING" not in ast.dump(
            getattr(node, "test", ast.Constant(0))
        ):
            nodes += ast.iter_child_nodes(node)


def rooms(names):
    """Rooms of this package among dotted names."""
    return {name.split(".")[1] for name in names if name.startswith("iceslide_fem.")} & set(FLOOR)


def test_every_room_has_its_floor():
    assert {room_of(module) for module in MODULES} <= set(FLOOR)


@pytest.mark.parametrize("module", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_lead_down(module):
    room = room_of(module)
    tree = ast.parse(module.read_text(encoding="utf-8"))
    below = {other for other in FLOOR if FLOOR[other] < FLOOR[room]} | {room}
    assert rooms(imported(tree)) <= below
    # Closed forms are what the physics is compared with; footprints show those of others, too.
    if room not in ("preprocess", "reference"):
        assert "reference" not in rooms(imported(tree))
    if room in WITHOUT_FENICS:
        assert not {name.split(".")[0] for name in imported_at_once(tree)} & FINITE_ELEMENTS


def test_no_module_imports_itself_through_others():
    """Not for types, either: what two modules share has a module of its own."""
    names = {}
    for module in MODULES:
        parts = module.relative_to(PACKAGE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = module
    needs = {
        name: {found for found in imported(ast.parse(module.read_text("utf-8"))) if found in names}
        for name, module in names.items()
    }
    order = TopologicalSorter({name: found - {name} for name, found in needs.items()})
    order.prepare()  # raises CycleError, which names the circle


@pytest.mark.parametrize("folder", sorted(path.name for path in PACKAGE.iterdir() if path.is_dir()))
def test_a_folder_says_what_it_is_and_what_it_imports(folder):
    if folder == "__pycache__":
        return
    text = ast.get_docstring(ast.parse((PACKAGE / folder / "__init__.py").read_text("utf-8")))
    what, _, imports = text.partition("\n\n")
    assert len(what) > 20 and "mports" in text, "say what the folder is and what it may import"


def test_the_page_for_contributors_has_the_folders_from_the_ground_up():
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text[text.index("| of `iceslide_fem/`") :].split("\n\n")[0]
    named = re.findall("`([a-z]+)/`", table)
    folders = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert set(named) == folders and len(named) == len(folders)
    assert [FLOOR[name] for name in named] == sorted(FLOOR[name] for name in named)


def test_few_modules_stand_beside_the_folders():
    assert len(list(PACKAGE.glob("[!_]*.py"))) <= 3


def test_one_step_is_read_from_few_files():
    text = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"^\d+\. `([a-z_/]+\.py)`", text, flags=re.MULTILINE)
    lines = [len((PACKAGE / name).read_text(encoding="utf-8").splitlines()) for name in named]
    assert 10 <= len(named) <= 14 and sum(lines) <= 3300
