"""Bad inputs of every kind, over all commands, and what becomes of them.

Every input is a command in a folder of its own, in a process of its own with a time limit. It is
refused well (exit code 2, one sentence that names what is wrong, nothing written), finished well,
stopped with its cause (exit code 3, one sentence), or wrong: anything else, or taken where it
should have been refused. Prints the counts, and every wrong one with the reason.
"""

from __future__ import annotations

import io
import json
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np
from PIL import Image

from iceslide_fem.cli import main as iceslide
from iceslide_fem.runtime.units import to_si
from iceslide_fem.scene import Scene
from iceslide_fem.scene.units import Quantity
from scripts.studies.common import ROOT, options

SECONDS = 60.0  # that an input may take, on a machine with other work
MEMORY = 8 * 10**9  # bytes
POINT = ("model=point", "ice.heat=column", "load.duration=0.1ms", "numerics.tolerance=0.1")
SLICE = (
    "model=slice", "ice.heat=column", "load.duration=20us", "numerics.refinement=0.25",
    "numerics.tolerance=0.1",
)  # fmt: skip
SCENE = (ROOT / "cases" / "thesis_1bar.toml").read_text(encoding="utf-8")
Files = dict[str, str | bytes | Callable[[Path], None]]


class Input(NamedTuple):
    """A command's words; what it must say if it is refused; what lies in its folder before.

    ends: how it may end: "refused", or "any" where taking it is right, too.
    """

    words: tuple[str, ...]
    says: str = ""
    files: Files = {}  # noqa: RUF012 (never changed)
    ends: str = "refused"


class Ending(NamedTuple):
    """How an input ended: its class, and for wrong ones why, with what was printed."""

    kind: str
    why: str


# --- the inputs


def sets(changes: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for change in changes for word in ("--set", change))


def changed(*changes: str, command: str = "info", base: Sequence[str] = POINT) -> tuple[str, ...]:
    """A command on the scene of the folder with `changes`."""
    return (command, "scene.toml", *sets([*base, *changes]))


def scene(*changes: str, command: str = "info", says: str = "", ends: str = "refused") -> Input:
    return Input(changed(*changes, command=command), says, {"scene.toml": SCENE}, ends)


def leaves(model: Any = Scene, prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, field in model.model_fields.items():
        if hasattr(field.annotation, "model_fields"):
            yield from leaves(field.annotation, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def quantity(field: Any) -> Quantity | None:
    parts = [
        *field.metadata,
        *(part for arm in get_args(field.annotation) for part in get_args(arm)),
    ]
    return next((part for part in parts if isinstance(part, Quantity)), None)


def values() -> Iterator[Input]:
    """Every number of a scene, out of its range, of another unit, of another kind."""
    commands = ("info", "run", "ladder")
    for number, (key, field) in enumerate(leaves()):
        range_ = quantity(field)
        if range_ is None:
            continue
        low, high = to_si(range_.low, range_.unit), to_si(range_.high, range_.unit)
        bad = [f"{high * 1.1 + 1e-3}", f"{low * 0.9 - 1e-9}", "nan", '"1 furlong^3"', "true", "[1]"]
        bad += ['""', "-inf", '"1e999 m"', '"1 9**9**9*m"', "{ a = 1 }", "1" * 400]
        for place, value in enumerate(bad[(number % 3) :: 3] + [bad[(number * 5) % len(bad)]]):
            yield scene(f"{key}={value}", command=commands[(number + place) % 3], says=key)


def choices() -> Iterator[Input]:
    """Names, switches and choices that are none."""
    for key in ("model", "ice.motion", "ice.heat", "film.carrier", "film.pressure",
                "numerics.film_integrator", "rubber.compound", "rubber.mesh_unit"):  # fmt: skip
        for value in ("nothing", "3", "[]"):
            yield scene(f"{key}={value}", says=key)
    for key in ("rubber.heat", "rubber.inertia", "rubber.sipes", "rubber.mesh", "film.contact"):
        for value in ('"yes"', "-1", "1.5"):
            yield scene(f"{key}={value}", says=key)
    for name in ("a/b", "..", "", " ", "-x", "a" * 200, "ä", "a\nb", "3.5e", "x y"):
        text = SCENE.replace('name = "thesis_1bar"', f"name = {json.dumps(name)}")
        ends = "any" if name == "3.5e" else "refused"
        yield Input(changed(command="run"), "name", {"scene.toml": text}, ends)


def contradictions() -> Iterator[Input]:
    """Keys that are right alone and wrong together, and keys that are missing or unknown."""
    for changes, says in (
        (("rubber.C10=1e5",), "rubber.C10"),
        (("film.k=0.3",), "film has k only"),
        (("film.k=0.3", "film.D=30um"), "film has k and D only"),
        (("film.conductance=1e5",), "film.conductance"),
        (("ice.heat=half-space", "ice.motion=sliding"), "half-space"),
        (("ice.heat=half-space", "rubber.heat=true"), "half-space"),
        (("rubber.heat=true", "rubber.height=10um", "load.duration=1s"), "rubber.height"),
        (("rubber.sipes=8", "rubber.sipe_width=1mm"), "rubber.sipe"),
        (
            ("rubber.sipes=1", "rubber.sipe_width=0.1mm", "rubber.sipe_depth=1mm"),
            "rubber.sipe_depth",
        ),
        (("rubber.compound=A",), "Young's modulus"),
        (("load.pressur=1bar",), "did you mean load.pressure?"),
        (("pressure=1bar",), "load.pressure"),
        (("x.y.z=1",), "not a known key"),
        (("load=3",), "load"),
        (("rubber=[]",), "rubber"),
        (("name.first=a",), "name"),
        (("load.pressure.bar=1",), "load.pressure"),
        (("load..speed=3",), "form"),
        (("=3",), "form"),
        (("load.speed",), "form"),
        ((".".join("a" * 2000) + "=1",), "nested too deeply"),
        (("load.speed=" + "[" * 5000,), "load.speed"),
        (("x" * 5000 + "=1",), "not a known key"),
        (("\x1b[31m=1",), "not a known key"),
    ):
        yield scene(*changes, says=says)
        yield scene(*changes, command="run", says=says)


def scene_files() -> Iterator[Input]:
    """Files that are no scenes."""
    contents: list[tuple[str | bytes, str]] = [
        ("", "missing"),
        ("\x00" * 100, "not valid TOML"),
        (b"\xff\xfe" + SCENE.encode("utf-16-le"), "UTF-8"),
        (b"\x80abc", "UTF-8"),
        ("x = " + "[" * 100_000, "nested too deeply"),
        ("x = " + "{a=" * 3000, "nested too deeply"),
        (".".join("a" * 3000) + " = 1", "nested too deeply"),
        ("[a" + ".a" * 3000 + "]", "nested too deeply"),
        ("[[load]]\nspeed = 1\n", ""),
        (SCENE + SCENE, "not valid TOML"),
        (SCENE.replace('"3 m/s"', "3 m/s"), "in quotes"),
        (SCENE.replace('"3 m/s"', "1" * 5000), ""),
        (SCENE.replace('"3 m/s"', "0x" + "f" * 5000), "load.speed"),
        (SCENE.replace('"3 m/s"', "1979-05-27"), "load.speed"),
        (SCENE.replace('"3 m/s"', '"3 m/s'), "not valid TOML"),
        (SCENE.replace("speed", "sp\\u0065ed"), ""),
        (SCENE.replace("[load]", '[load]\n"a\\nb" = 1'), "not a known key"),
        (SCENE[: len(SCENE) // 2], ""),
        ("<?xml version='1.0'?><a/>", "not valid TOML"),
        (json.dumps({"name": "x"}), "not valid TOML"),
        (b"\x89PNG\r\n\x1a\n" + bytes(range(256)), ""),
        (SCENE.replace("\n", "\r").replace('"1 bar"', '"1 furlong"'), "load.pressure"),
    ]
    for content, says in contents:
        yield Input(("run", "scene.toml"), says, {"scene.toml": content})
    yield Input(changed(), "", {"scene.toml": b"\xef\xbb\xbf" + SCENE.encode()}, "any")
    large = b"#" * 11_000_000
    for command in ("run", "info", "ladder", "sweep"):
        for name in ("nowhere.toml", ".", "/dev/zero", "pipe", "", "x" * 5000, "large.toml"):
            files: Files = {"pipe": lambda path: os.mkfifo(path), "large.toml": large}
            yield Input((command, name), "", files)


def units() -> Iterator[Input]:
    """Quantities that are none."""
    for text in (
        "1", "bar", "1 bar bar", "1 bar/0", "1 bar**9**9", "1 (bar", "1 bar)", "1 'bar'", "--1 bar",
        "1,5 bar", "1e bar", "0x10 bar", "١ bar", "1 bar; import os", "1 __import__('os')", "1 m2",
        "1 bar^99", "1 dB", "1 degC", "1 °µ", "inf bar", "nan bar", "1 " + "(" * 90, "1" * 200,
        "1 bar\x00", "1 bar\nx",
    ):  # fmt: skip
        content = SCENE.replace('"1 bar"', json.dumps(text))
        yield Input(("run", "scene.toml"), "load.pressure", {"scene.toml": content})


Grid = tuple[np.ndarray, list[list[int]], dict[str, list[list[int]]]]


def grid(n: int = 4, size: float = 1e-3, x: float = 0.0) -> Grid:
    """Points, quadrilaterals and named facets of a square, as they should be."""
    line = np.linspace(0.0, size, n + 1)
    points = np.stack([np.tile(line + x, n + 1), np.repeat(line, n + 1)], axis=1)
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    cells = [
        [int(at[j, i]), int(at[j, i + 1]), int(at[j + 1, i + 1]), int(at[j + 1, i])]
        for j in range(n)
        for i in range(n)
    ]
    row = [[int(at[0, i]), int(at[0, i + 1])] for i in range(n)]
    top = [[int(at[n, i]), int(at[n, i + 1])] for i in range(n)]
    return points, cells, {"contact": row, "plate": top}


def together(one: Grid, other: Grid) -> Grid:
    n = len(one[0])
    facets = {
        name: part + [[node + n for node in facet] for facet in other[2].get(name, [])]
        for name, part in one[2].items()
    }
    cells = one[1] + [[node + n for node in cell] for cell in other[1]]
    return np.concatenate([one[0], other[0]]), cells, facets


def msh(mesh: Grid, kind: int = 3, body: str = "rubber", header: str = "$MeshFormat") -> str:
    """A mesh as text of gmsh's format 2.2."""
    points, cells, facets = mesh
    names = [(2, body), *((1, name) for name in facets)]
    lines = [header, "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    lines += [f'{dim} {number} "{name}"' for number, (dim, name) in enumerate(names, 1)]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += [f"{n} {x!r} {y!r} 0" for n, (x, y) in enumerate(points.tolist(), 1)]
    elements = [(kind, 1, cell) for cell in cells]
    for number, part in enumerate(facets.values(), 2):
        elements += [(1, number, facet) for facet in part]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [
        f"{n} {kind} 2 {group} {group} {' '.join(str(node + 1) for node in nodes)}"
        for n, (kind, group, nodes) in enumerate(elements, 1)
    ]
    return "\n".join([*lines, "$EndElements", ""])


def meshes() -> Iterator[Input]:
    """Meshes of users that no block can have."""
    points, cells, facets = grid()
    middle = 12

    def with_points(change: Callable[[np.ndarray], None]) -> str:
        moved = points.copy()
        change(moved)
        return msh((moved, cells, facets))

    def with_cells(new: list[list[int]], **more: Any) -> str:
        return msh((points, new, facets), **more)

    def set_at(node: int, value: Any) -> Callable[[np.ndarray], None]:
        return lambda array: array.__setitem__(node, value)

    def scaled(by: float) -> Callable[[np.ndarray], None]:
        def scale(array: np.ndarray) -> None:
            array *= by

        return scale

    def raised(array: np.ndarray) -> None:
        array += 1e-3

    loose = grid(2, 0.4e-3, 2e-3)
    bodies = together(grid(), (loose[0], loose[1], {"contact": loose[2]["contact"], "plate": []}))
    good = msh(grid())
    twisted = [*cells[:5], [cells[5][0], cells[5][1], cells[5][3], cells[5][2]], *cells[6:]]
    bad: list[tuple[str, str | bytes, str]] = [
        ("a.msh", with_cells(twisted), "inside out"),
        ("a.msh", with_points(set_at(middle, [0.9e-3, 0.9e-3])), ""),
        ("a.msh", with_points(set_at(middle, points[13])), ""),
        ("a.msh", with_points(set_at(middle, [1e9, 1e9])), ""),
        ("a.msh", with_points(set_at(middle, [np.nan, 0.0])), ""),
        ("a.msh", with_points(set_at(middle, [np.inf, 0.0])), ""),
        ("a.msh", with_points(set_at(0, [0.0, -1e-3])), ""),
        ("a.msh", with_points(scaled(0.0)), ""),
        ("a.msh", with_points(scaled(1e3)), "rubber.mesh_unit"),
        ("a.msh", with_points(scaled(1e-6)), "rubber.mesh_unit"),
        ("a.msh", with_points(raised), "lowest point"),
        ("a.msh", msh((points[:, ::-1].copy(), cells, facets)), ""),
        ("a.msh", with_cells([*cells, cells[3]]), "twice"),
        ("a.msh", with_cells([*cells, [0, 4, 24, 20]]), ""),
        ("a.msh", with_cells(cells[:6] + cells[7:]), "any"),
        ("a.msh", with_cells(cells[:-4]), ""),
        ("a.msh", with_cells([]), "no cells"),
        ("a.msh", with_cells([[0, 0, 1, 1]]), ""),
        ("a.msh", with_cells(cells, body="gum"), "rubber"),
        ("a.msh", with_cells([cell[:3] for cell in cells], kind=2), ""),
        ("a.msh", with_cells(cells, kind=4), ""),
        ("a.msh", with_cells([[0, 1, 2, 99]]), ""),
        ("a.msh", msh((points, cells, {"contact": facets["contact"]})), "plate"),
        ("a.msh", msh((points, cells, {"plate": facets["plate"]})), "contact"),
        ("a.msh", msh((points, cells, {**facets, "symmetry": facets["plate"]})), ""),
        ("a.msh", msh((points, cells, {**facets, "contact": [[6, 7]]})), ""),
        ("a.msh", msh((points, cells, {**facets, "contact": facets["contact"][:2]})), "on the ice"),
        ("a.msh", msh((points, cells, {**facets, "plate": [[0, 5]]})), "plate"),
        ("a.msh", msh(bodies), "loose"),
        ("a.msh", msh(together(grid(), grid(3, 1e-3, 0.5e-3))), ""),
        ("a.msh", msh(together(grid(), grid(4, 1e-3, 1e-3))), "two nodes"),
        ("a.msh", msh(together(grid(), grid(7, 1e-3, 1e-3))), ""),
        ("a.msh", msh(together(grid(), grid())), ""),
        ("a.msh", msh(together(grid(), grid(4, 1e-3, 2e-3))), "any"),
        ("a.msh", "", "first line"),
        ("a.msh", "\n" + good, "first line"),
        ("a.msh", "// " + good, "first line"),
        ("a.msh", good[: len(good) // 2], ""),
        ("a.msh", good.replace("$Nodes\n25", "$Nodes\n999999999"), ""),
        ("a.msh", good.replace("$Nodes\n25", "$Nodes\n-1"), ""),
        ("a.msh", good.replace("2.2 0 8", "9.9 0 8"), ""),
        ("a.msh", good.replace("2.2 0 8", "2.2 1 8"), ""),
        ("a.msh", good.encode() + os.urandom(1000), "any"),
        ("a.msh", b"$MeshFormat\n" + bytes(range(256)) * 20, ""),
        ("a.msh", 'SystemCall "touch executed";\n', "first line"),
        ("a.geo", 'SystemCall "touch executed";\n', ""),
        ("a.MSH", 'SystemCall "touch executed";\n', ""),
        ("a.msh2", 'SystemCall "touch executed";\n', ""),
        ("a.stl", "", ""),
        ("a.stl", "solid x\nendsolid x\n", ""),
        ("a.stl", bytes(84), ""),
        ("a.brep", "DBRep_DrawableShape\n", ""),
        ("a.vtu", "<VTKFile/>", ""),
        ("a.vtu", "<!DOCTYPE a [<!ENTITY b 'xxxx'><!ENTITY c '&b;&b;&b;'>]><a>&c;</a>", ""),
        ("a.vtk", "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\n", ""),
        ("a.vtk", "# vtk DataFile Version 3.0\nx\nBINARY\nDATASET STRUCTURED_POINTS\n", ""),
        ("a.inp", "*NODE\n1, 0, 0\n*ELEMENT, TYPE=CPS4\n1, 1, 2, 3, 4\n", ""),
        ("a.obj", "v 0 0 0\n", ""),
        ("a.off", "OFF\n1 1 0\n", ""),
        ("a.ply", "ply\nformat ascii 1.0\nend_header\n", ""),
        ("a.med", b"\x89HDF\r\n\x1a\n" + bytes(100), ""),
        ("a.xdmf", "<Xdmf/>", ""),
        ("a.bdf", "BEGIN BULK\nGRID\n", ""),
        ("a.node", "x\n", ""),
        ("a.e", bytes(10), ""),
        ("a.cgns", bytes(10), ""),
        ("a.svg", "<svg/>", ""),
        ("a.json", "{}", ""),
        ("a", good, ""),
    ]  # fmt: skip
    for name, content, says in bad:
        ends = "any" if says == "any" else "refused"
        words = changed(f"rubber.mesh={name}", base=("model=slice", "ice.heat=column"))
        files: Files = {"scene.toml": SCENE, name: content}
        yield Input(words, "" if says == "any" else says, files, ends)
    for name in ("folder", "/dev/zero", "nowhere.msh", "pipe", "x" * 5000):
        words = changed(f"rubber.mesh={name}", command="run", base=("model=slice",))
        special: Files = {
            "scene.toml": SCENE, "folder": lambda path: path.mkdir(), "pipe": os.mkfifo,
        }  # fmt: skip
        yield Input(words, "rubber.mesh", special)
    script: Files = {"scene.toml": SCENE, "a.msh": 'SystemCall "touch executed";\n'}
    for command in ("run", "ladder", "info"):
        yield Input(changed("rubber.mesh=a.msh", command=command, base=SLICE), "first line", script)
    varied = ("--vary", "rubber.mesh=a.msh,b.msh")
    yield Input((*changed(command="sweep", base=SLICE), *varied), "", script | {"b.msh": good})


def contact_tables() -> Iterator[Input]:
    head, rows = "pressure_Pa,k,D_m,H_V_m", "1e5,0.25,3e-5,3e-6\n1e6,0.7,9e-5,4e-7\n"
    for content in (
        "", head, f"{head}\n{rows.splitlines()[0]}\n", rows,
        f"{head}\n{rows}".replace("0.25", "nan"),
        f"{head}\n{rows}".replace("0.25", "-1"), f"{head}\n1e6,0.7,9e-5,4e-7\n1e5,0.2,3e-5,3e-6\n",
        f"{head}\n{rows}".replace("0.7", "0.1"), f"{head}\n{rows}".replace("4e-7", "1"),
        f"{head}\n1e5\n2e5\n", f"{head}\n{rows}".replace("1e5", "1e5 Pa"),
        b"\xff\xfe", b"\x00" * 50,
        f"{head},k\n" + "1,2,3,4,5\n" * 2, '"' * 999, "a" * 200_000,
    ):  # fmt: skip
        files: Files = {"scene.toml": SCENE, "c.csv": content}
        yield Input(changed("film.contact=c.csv"), "film.contact", files)


def sizes() -> Iterator[Input]:
    """What no machine holds, or what would never end."""
    for changes in (
        ("rubber.length=1m", "rubber.height=10um"),
        ("numerics.refinement=8", "ice.margin=1m"),
        ("model=slice", "ice.motion=sliding", "ice.cell=0.1um", "rubber.length=1m"),
        ("model=slice", "ice.motion=sliding", "ice.cell=0.1um", "ice.trail=1m"),
        ("rubber.length=1m", "rubber.width=10um", "rubber.height=1m", "numerics.refinement=8"),
        ("rubber.sipes=8", "rubber.sipe_width=10um", "rubber.sipe_depth=10um", "rubber.length=1m"),
    ):
        for command in ("run", "info"):
            ends = "any" if command == "info" else "refused"
            words = changed(*changes, command=command, base=())
            yield Input(words, "GB", {"scene.toml": SCENE}, ends)


def sweeps() -> Iterator[Input]:
    for varied, says in (
        ((), "--vary"),
        (("load.pressure",), "form"),
        (("load.pressure=",), "load.pressure"),
        (("load.pressure=1bar:5bar",), "form"),
        (("load.pressure=1bar:5bar:0",), "count"),
        (("load.pressure=1bar:5bar:-3",), "count"),
        (("load.pressure=1bar:5bar:2.5",), "count"),
        (("load.pressure=1bar:5bar:100000000",), "count"),
        (("load.pressure=1bar:5bar:" + "9" * 5000,), "count"),
        (("load.pressure=1bar:1bar:3",), "twice"),
        (("load.pressure=1bar,1bar",), "twice"),
        (("load.pressure=1bar,99999bar",), "load.pressure"),
        (("load.pressure=1 9**9**9*bar:2bar:3",), "load.pressure"),
        (("load.pressure=nan:1bar:3",), "load.pressure"),
        (("load.pressure=1bar:5m:3",), "load.pressure"),
        (("load.pressure=1bar:5bar:500", "load.speed=1:5:500"), "cases"),
        (("load.pressure=1bar,2bar", "load.pressure=3bar,4bar"), "twice"),
        (("model=point,nothing",), "model"),
        (("model=1:3:3",), "model"),
        (("name=a,b",), "name"),
        (("rubber=1,2",), "rubber"),
        (("nothing=1,2",), "nothing"),
        (("film.contact=a.csv,b.csv",), "film.contact"),
        (("rubber.sipes=0,1,2,9",), "rubber.sipe"),
        (("film.k=true:false:3",), "film.k"),
    ):
        more = tuple(word for one in varied for word in ("--vary", one))
        yield Input((*changed(command="sweep"), *more), says, {"scene.toml": SCENE})
    vary = ("--vary", "load.pressure=1bar,2bar")
    for bad in (
        ("--cores-per-case", "0"), ("--cores-per-case", "9999"), ("--cases-at-a-time", "0"),
        ("--cases-at-a-time", "9999"), ("--cores-per-case", "x"), ("--out", "scene.toml"),
        ("--out", "scene.toml/deeper"), ("--out", "\x01" * 300), ("--nothing",),
    ):  # fmt: skip
        yield Input((*changed(command="sweep"), *vary, *bad), "", {"scene.toml": SCENE})


def option_words() -> Iterator[Input]:
    more: tuple[tuple[str, ...], ...] = (
        ("--out", "scene.toml"), ("--out", "scene.toml/x"), ("--out", "y" * 300),
        ("--out", "/proc/nothing"), ("--out", "/dev/null"), ("--out", ""),
        ("--checkpoint-every", "nan"), ("--checkpoint-every", "-1"), ("--checkpoint-every", "x"),
        ("--checkpoint-every", "1e999"), ("--checkpoint-at", "-1ms"), ("--checkpoint-at", "1 m"),
        ("--checkpoint-at", ""), ("--checkpoint-at", "1 9**9**9*s"), ("--checkpoint-at", "9 s"),
        ("--set", ""), ("--set",), ("--nothing",), ("other.toml",), ("--restart", "."),
        ("--restart", "nowhere"), ("--restart", "scene.toml"), ("--restart", ""),
    )  # fmt: skip
    for words in more:
        yield Input((*changed(command="run"), *words), "", {"scene.toml": SCENE})
    for words in (
        (), ("run",), ("walk",), ("info",), ("view",), ("view", "."), ("view", "nowhere"),
        ("view", "scene.toml"), ("view", ""), ("info", "scene.toml", "x"), ("ladder",), ("sweep",),
        ("run", "--restart", "."), ("run", "--restart", ""), ("footprint",), ("roughness",),
        ("view", ".", "--animate"), ("ladder", "scene.toml", "--refine", "0"),
        ("ladder", "scene.toml", "--refine", "99"), ("ladder", "scene.toml", "--refine", "nan"),
        ("ladder", "scene.toml", "--refine", "x"), ("ladder", "scene.toml", "--out", "scene.toml"),
    ):  # fmt: skip
        yield Input(words, "", {"scene.toml": SCENE})


def picture(size: tuple[int, int] = (60, 40), mode: str = "L", fmt: str = "PNG") -> bytes:
    y, x = np.mgrid[: size[1], : size[0]]
    inside = (abs(x - size[0] / 2) < size[0] / 3) & (abs(y - size[1] / 2) < size[1] / 3)
    stream = io.BytesIO()
    noise = np.random.default_rng(1).integers(0, 30, inside.shape)
    Image.fromarray((inside * 200 + noise).astype(np.uint8)).convert(mode).save(stream, fmt)
    return stream.getvalue()


def footprints() -> Iterator[Input]:
    """Pictures that are none, and options that fit none."""
    usual = ("--length", "180mm", "--width", "120mm", "--max-pressure", "5bar")
    good = picture()
    bomb = b"P5\n60000 60000\n255\n"
    contents: list[tuple[str, str | bytes]] = [
        ("a.png", b""), ("a.png", b"text"), ("a.png", good[:100]), ("a.png", good[:-200]),
        ("a.png", picture((1, 1))), ("a.png", picture((1, 9))), ("a.ppm", bomb),
        ("a.png", b"\x89PNG\r\n\x1a\n" + bytes(500)), ("a.svg", "<svg/>"), ("a.gif", b"GIF89a"),
        ("a.jpg", b"\xff\xd8\xff"),
        ("a.tif", b"II*\x00" + bytes(50)), ("a.eps", "%!PS\n(x) show"), ("a.png", bytes(1000)),
    ]  # fmt: skip
    for name, content in contents:
        ends = "any" if len(content) < 100 and content[1:4] == b"PNG" else "refused"
        yield Input(("footprint", name, *usual, "--out", "out"), "", {name: content}, ends)
    for name in ("nowhere.png", ".", "/dev/zero", "pipe", "", "x" * 5000):
        pipe: Files = {"pipe": lambda path: os.mkfifo(path)}
        yield Input(("footprint", name, *usual, "--out", "out"), "", pipe)
    for bad in (
        ("--length", "0"), ("--length", "nan"), ("--length", "1 bar"), ("--length", "-1mm"),
        ("--length", "9km"), ("--width", ""), ("--max-pressure", "4"), ("--max-pressure", "-5bar"),
        ("--max-pressure", "1 9**9**9*bar"), ("--min-pressure", "6bar"), ("--min-pressure", "x"),
        ("--threshold", "9bar"), ("--threshold", "-1bar"), ("--colormap", "nothing"),
        ("--legend", "1,2,3"), ("--legend", "0,0,9999,9999"), ("--legend", "a,b,c,d"),
        ("--background", "nocolour"), ("--rotation", "nan"), ("--rotation", "x"),
        ("--crop", "0,0,0,0"), ("--crop", "-5,-5,10,10"), ("--crop", "50,30,10,10"),
        ("--crop", "1" * 400 + ",0,1,1"), ("--load", "0"), ("--load", "1e99"), ("--load", "3 m"),
        ("--speed", "-3"), ("--speed", "1e9"), ("--slip", "2"), ("--slip", "nan"),
        ("--temperature", "5degC"), ("--temperature", "-400degC"), ("--compound", "Z"),
        ("--compound", "A"), ("--contact", "nowhere.csv"), ("--contact", "a.png"),
        ("--static-friction", "-1"), ("--depth", "0"), ("--thesis-slip", "-1"),
        ("--thesis-time", "0"), ("--tolerance", "0"), ("--tolerance", "1"), ("--out", "a.png"),
        ("--nothing",),
    ):  # fmt: skip
        words = ("footprint", "a.png", *usual, "--out", "out", *bad)
        yield Input(words, "", {"a.png": good})


def surfaces() -> Iterator[Input]:
    """Height maps that are none, and options that fit none."""
    rng = np.random.default_rng(1)
    heights = rng.normal(size=(64, 64)) * 1e-6

    def npy(array: Any, **how: Any) -> bytes:
        stream = io.BytesIO()
        np.save(stream, array, **how)
        return stream.getvalue()

    good = npy(heights)
    holed = heights.copy()
    holed[3, 4] = np.nan
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("main.xml", "<x/>")
    contents: list[tuple[str, str | bytes]] = [
        ("a.npy", b""), ("a.npy", good[:200]), ("a.npy", b"\x93NUMPY\x01\x00" + bytes(100)),
        ("a.npy", npy(np.array([{"a": 1}], dtype=object), allow_pickle=True)),
        ("a.npy", npy(np.zeros(5))), ("a.npy", npy(np.zeros((64, 64)))),
        ("a.npy", npy(heights * np.nan)),
        ("a.npy", npy(np.zeros((2, 2, 2)))), ("a.npy", npy(np.full((64, 64), np.inf))),
        ("a.npy", npy(np.array([["a"]]))), ("a.npy", npy(heights[:1])),
        ("a.npy", npy(heights * 1e9)),
        ("a.csv", ""), ("a.csv", "a,b\nc,d\n"), ("a.csv", "1,2\n3\n"), ("a.txt", bytes(99)),
        ("a.xyz", "1 2\n"), ("a.xyz", "x y z\n"), ("a.x3p", b"no zip"),
        ("a.x3p", packed.getvalue()),
        ("a.png", picture()), ("a", good), ("surface.toml", ""), ("surface.toml", "x = ["),
        ("surface.toml", "hurst = 2.0\n"), ("surface.toml", "[[[[\n"),
    ]  # fmt: skip
    for name, content in contents:
        words = ("roughness", name, "--pixel", "10um", "--out", "out")
        yield Input(words, "", {name: content})
    for name in ("nowhere.npy", ".", "/dev/zero", "pipe", ""):
        pipe: Files = {"pipe": lambda path: os.mkfifo(path)}
        yield Input(("roughness", name, "--pixel", "10um", "--out", "out"), "", pipe)
    for bad in (
        ("--pixel", "0"), ("--pixel", "1 bar"), ("--pixel", "1 9**9**9*m"), ("--pixel", "1km"),
        ("--modulus", "0"), ("--modulus", "-1MPa"), ("--compound", "Z"),
        ("--scene", "nowhere.toml"),
        ("--scene", "a.npy"), ("--pressures", "1bar"), ("--pressures", "5bar:1bar:5"),
        ("--pressures", "1bar:5bar:1"), ("--pressures", "1bar:5bar:999999999"),
        ("--pressures", "0bar:5bar:5"), ("--pressures", "a:b:c"), ("--realisations", "0"),
        ("--definition", "mine"), ("--shortest-wave", "1km"), ("--height-unit", "bar"),
        ("--out", "a.npy"), ("--nothing",),
    ):  # fmt: skip
        words = ("roughness", "a.npy", "--pixel", "10um", "--out", "out", *bad)
        yield Input(words, "", {"a.npy": good})


def traps() -> Iterator[Input]:
    """What looks right to a person, or to one layer of the program, and is not; some of it is."""
    for value, ends in (
        ("1 mm 2 mm", "refused"), ("١ mm", "any"), ("0x10 mm", "refused"), ("1_000 um", "any"),
        ("1 mm;", "refused"), ("1,5 mm", "refused"), ("1 mm/mm", "refused"), ("1e-3", "any"),
        ("1 mm + 1 s", "refused"), ("mm", "refused"), ("1 mm # long", "refused"),
        ("(1 mm)", "any"), ("1 Mm", "refused"), ("1 MM", "refused"), ("1\u00a0mm", "any"),
    ):  # fmt: skip
        text = SCENE.replace('length = "1 mm"', f"length = {json.dumps(value)}")
        yield Input(changed(command="info"), "rubber.length", {"scene.toml": text}, ends)
    for value, ends in (
        ("\u22124 degC", "any"), ("-4 °C", "any"), ("-4 C", "refused"), ("24.8 degF", "any"),
        ("-4", "refused"), ("4 degC", "refused"), ("-4 delta_degC", "refused"), ("0 K", "refused"),
    ):  # fmt: skip
        yield scene(f"ice.temperature={json.dumps(value)}", says="ice.temperature", ends=ends)
    for value, ends in (
        ("{ a = [nan, 0.0, 0.0] }", "refused"), ("{ 'a/b' = [0.0, 0.0, 0.0] }", "any"),
        ("{ a = [0.0, 0.0] }", "refused"), ("{ a = [1e9, 0.0, 0.0] }", "refused"),
        ("{ '' = [0.0, 0.0, 0.0] }", "any"), ("[0.0, 0.0, 0.0]", "refused"),
    ):  # fmt: skip
        change = f"output.probes={value}"
        yield Input(changed(change, command="run", base=SLICE), "", {"scene.toml": SCENE}, ends)
    for value in ("[]", "[3e-6, 1e-6]", "[-1e-6]", "1e9", "[nan]", '"1 us 2 us"'):
        change = f"output.times={value}"
        ends = "any" if value in ("[]", "[3e-6, 1e-6]") else "refused"
        yield Input(
            changed(change, command="run", base=SLICE), "output.times", {"scene.toml": SCENE}, ends
        )
    table = "pressure_Pa,k,D_m,H_V_m\n1e5,0.2,2e-5,3e-6\n5e5,0.4,4e-5,1e-6\n"
    for content, ends in (
        (table, "any"), (table.replace("\n", "\r\n"), "any"), ("\ufeff" + table, "any"),
        (table.encode("utf-16"), "any"), (table.replace(",", ";"), "any"),
        (table.replace("2e-5", "20"), "refused"), (table.replace("1e5", "5e5"), "refused"),
        (table.replace("0.4", "4.0"), "refused"), (table.replace("0.4", "0.1"), "refused"),
        (table.replace("3e-6", "nan"), "refused"), (table + "1e5,0.2,2e-5,3e-6\n", "refused"),
        (table.replace("k", "K"), "any"), (table.replace("H_V_m", "k"), "refused"),
    ):  # fmt: skip
        files: Files = {"scene.toml": SCENE, "t.csv": content}
        yield Input(changed("film.contact=t.csv", command="run"), "t.csv", files, ends)
    here = (*changed(command="run"), "--out", ".")
    yield Input(here, "", {"scene.toml": SCENE}, "any")
    yield Input(here, "holds", {"scene.toml": SCENE, "letter.txt": "dear"})
    loop: Files = {"scene.toml": lambda path: path.symlink_to("scene.toml")}
    yield Input(("info", "scene.toml"), "scene.toml", loop)
    heights = np.random.default_rng(1).normal(size=(64, 64)) * 1e-6
    slope = np.add.outer(np.arange(64.0), np.arange(64.0)) * 1e-6
    for array, ends in (
        (heights.astype(complex), "refused"), (heights > 0, "any"), (slope, "refused"),
        (np.asfortranarray(heights), "any"), (heights.astype(">f8"), "any"),
        (heights.astype("f2"), "any"),
        ((heights * 1e6).astype("i2"), "refused"), (np.repeat(heights, 3, axis=0)[:3], "refused"),
    ):  # fmt: skip
        stream = io.BytesIO()
        np.save(stream, array)
        words = ("roughness", "a.npy", "--pixel", "8um", "--pressures", "1bar:5bar:2")
        yield Input((*words, "--out", "out"), "", {"a.npy": stream.getvalue()}, ends)
    spectrum = 'hurst = 0.8\nrolloff = "0.2 mm"\nshortest_wave = "60 um"\n'
    for text in (
        'size = "1 mm"\npixels = 100000\nrms_height = "1 um"\n',
        'size = "1 mm"\npixels = 128\nrms_height = "1 m"\n',
        'size = "10 um"\npixels = 128\nrms_height = "1 um"\n',
        'size = "1 m"\npixels = 128\nrms_height = "1 um"\n',
        'size = "1 mm"\npixels = 128\nrms_height = "1 um"\nrms_slope = 0.3\n',
    ):
        made: Files = {"surface.toml": spectrum + text}
        yield Input(("roughness", "surface.toml", "--out", "out"), "", made)


def damaged(point: Path, block: Path, stopped: Path) -> Iterator[Input]:
    """Finished and stopped runs with something gone, cut or forged."""

    def copy(of: Path, *changes: tuple[str, Callable[[bytes], bytes] | None]) -> Files:
        def make(folder: Path) -> None:
            shutil.copytree(of, folder)
            for name, change in changes:
                for path in sorted(folder.glob(name)):
                    if change is None:
                        shutil.rmtree(path) if path.is_dir() else path.unlink()
                    else:
                        path.write_bytes(change(path.read_bytes()))

        return {"run": make}

    def json_with(**entries: Any) -> Callable[[bytes], bytes]:
        return lambda content: json.dumps({**json.loads(content), **entries}).encode()

    def half(content: bytes) -> bytes:
        return content[: len(content) // 2]

    def noise(_: bytes) -> bytes:
        return bytes(range(256)) * 4

    for of in (point, block):
        for name, change, ends in (
            ("summary.json", half, "refused"),
            ("summary.json", noise, "refused"),
            ("summary.json", lambda _: b"[]", "refused"),
            ("summary.json", lambda _: b"{}", "refused"),
            ("summary.json", lambda _: b"[" * 100_000, "refused"),
            ("summary.json", json_with(scene=3), "refused"),
            ("summary.json", json_with(scene={}), "refused"),
            ("summary.json", json_with(mu_peak="x"), "refused"),
            ("history.csv", half, "any"),
            ("history.csv", noise, "refused"),
            ("history.csv", lambda _: b"", "refused"),
            ("history.csv", lambda content: content.replace(b"mu", b"nu"), "refused"),
            ("history.csv", lambda content: content[:-7], "any"),
            ("history.csv", lambda content: content.replace(b"0.", b"x."), "refused"),
            ("history.csv", None, "refused"),
        ):
            yield Input(("view", "run"), "", copy(of, (name, change)), ends)
    for name, change, ends in (
        ("fields", None, "any"),
        ("fields/*.pvd", half, "refused"),
        ("fields/*.pvd", noise, "refused"),
        ("fields/*.pvd", None, "any"),
        ("fields/*.vtu", half, "refused"),
        ("fields/*.vtu", noise, "refused"),
        ("fields/*.vtu", None, "refused"),
    ):
        yield Input(("view", "run"), "", copy(block, (name, change)), ends)

    header = b"iceslide_fem checkpoint 1\n"

    def signed(body: bytes) -> bytes:
        import hashlib

        return header + hashlib.sha256(body).hexdigest().encode() + b"\n" + body

    def forged(change: Callable[[dict[str, Any]], Any]) -> Callable[[bytes], bytes]:
        def make(content: bytes) -> bytes:
            line, _, arrays = content[len(header) + 65 :].partition(b"\n")
            return signed(json.dumps(change(json.loads(line))).encode() + b"\n" + arrays)

        return make

    for change in (
        half, noise, lambda _: b"", lambda content: content[:-1], lambda _: header,
        lambda _: signed(b""), lambda _: signed(b"{}\n"), lambda _: signed(b"[]\n"),
        lambda _: signed(b"[" * 100_000), lambda _: signed(b"null\nPK"),
        forged(lambda line: {**line, "scene": {}}), forged(lambda line: {**line, "numbers": 3}),
        forged(lambda line: {**line, "numbers": {}}), forged(lambda line: {"scene": line["scene"]}),
        forged(lambda line: {**line, "fingerprint": "0"}), forged(lambda line: []),
        lambda content: signed(content[len(header) + 65 :][:-200]),
    ):  # fmt: skip
        yield Input(("run", "--restart", "run"), "", copy(stopped, ("checkpoint", change)))
    for name, change, ends in (
        ("history.csv", None, "any"), ("history.csv", half, "any"), ("history.csv", noise, "any"),
        ("fields", None, "any"), ("preload.csv", None, "any"), ("checkpoint", None, "refused"),
    ):  # fmt: skip
        yield Input(("run", "--restart", "run"), "", copy(stopped, (name, change)), ends)
    yield Input(("run", "--restart", "run"), "", copy(block), "refused")
    yield Input((*changed(command="run"), "--restart", "run"), "", copy(stopped), "refused")


def inputs(runs: Path) -> list[Input]:
    """All of them; `runs` holds the runs that some of them damage."""
    made = [
        *values(), *choices(), *contradictions(), *scene_files(), *units(), *meshes(),
        *contact_tables(), *sizes(), *sweeps(), *option_words(), *footprints(), *surfaces(),
        *traps(),
        *damaged(runs / "point", runs / "slice", runs / "stopped"),
    ]  # fmt: skip
    return made


# --- running and judging


class Child(NamedTuple):
    """A command that runs in `folder`, which held `before`, until `deadline` at the latest."""

    pid: int
    asked: Input
    folder: Path
    before: dict[str, tuple[int, int]]
    deadline: float


def started(asked: Input, where: Path | str, seconds: float) -> Child:
    """Lay an input's folder and start its command there, in a copy of this process."""
    folder = Path(tempfile.mkdtemp(dir=where))
    for name, made in asked.files.items():
        path = folder / name
        if callable(made):
            made(path)
        else:
            path.write_bytes(made.encode() if isinstance(made, str) else made)
    return launched(asked, folder, seconds)


def launched(asked: Input, folder: Path, seconds: float) -> Child:
    """Start an input's command in its folder."""
    before = content(folder)
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            os.setpgrp()
            for number, path in enumerate(streams(folder), 1):
                os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            os.chdir(folder)
            try:
                iceslide(list(asked.words))
            except SystemExit as end:
                code = end.code if isinstance(end.code, int) else int(bool(end.code))
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            os._exit(code)
    return Child(pid, asked, folder, before, time.monotonic() + seconds)


def streams(folder: Path) -> list[Path]:
    """Files that standard output and error of a command go to."""
    return [folder.with_name(folder.name + suffix) for suffix in (".out", ".err")]


def ended(child: Child) -> tuple[bool, int | None]:
    """Whether a command has ended, and its exit code: None if it was killed at its deadline."""
    pid, status = os.waitpid(child.pid, os.WNOHANG)
    if pid:
        return True, os.waitstatus_to_exitcode(status)
    if time.monotonic() < child.deadline:
        return False, None
    os.killpg(child.pid, signal.SIGKILL)
    os.waitpid(child.pid, 0)
    return True, None


def all_endings(asked: Sequence[Input], where: str, at_a_time: int) -> Iterator[Ending]:
    """How inputs end, in their order."""
    waiting = dict(enumerate(asked))
    running: dict[int, Child] = {}
    found: dict[int, Ending] = {}
    for number in range(len(asked)):
        while number not in found:
            while waiting and len(running) < at_a_time:
                first = next(iter(waiting))
                running[first] = started(waiting.pop(first), where, SECONDS)
            for key, child in list(running.items()):
                done, code = ended(child)
                if done:
                    found[key] = judged(running.pop(key), code)
            time.sleep(0.005)
        yield found.pop(number)


def content(folder: Path) -> dict[str, tuple[int, int]]:
    """Every file below a folder, with its time and size, and every folder; locks and logs do not
    count, nor what a killed run had half written, nor the page that `view` draws of a whole history
    before it comes to damaged fields.
    """
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.name in (".lock", "log.jsonl", "report.png") or path.suffix == ".part":
            continue
        status = path.lstat()
        seen = (0, 0) if path.is_dir() else (status.st_mtime_ns, status.st_size)
        found[str(path.relative_to(folder))] = seen
    return found


def judged(child: Child, code: int | None) -> Ending:
    """How an input ended, whose command has this exit code; its folder goes."""
    asked, folder = child.asked, child.folder
    after = content(folder)
    out, error = (path.read_text(errors="replace") for path in streams(folder))
    for path in streams(folder):
        path.unlink()
    shutil.rmtree(folder)
    changed_paths = {
        path for path in child.before | after if child.before.get(path) != after.get(path)
    }
    said = error.strip()
    one_line = said.startswith("iceslide: ") and "\n" not in said
    usage = code == 2 and ("Usage:" in said + out or "─ Error ─" in said)
    if code is None:
        return Ending("wrong", f"did not end in {SECONDS:g} s: {said[-300:]}")
    if "Traceback" in said + out or code < 0 or code not in (0, 2, 3):
        return Ending("wrong", f"exit code {code}: {(said + out)[-300:]}")
    if code in (2, 3) and not (one_line or usage):
        return Ending("wrong", f"exit code {code}, not one sentence: {said[-300:]}")
    if "executed" in changed_paths:
        return Ending("wrong", "a script was executed")
    if code == 2:
        if changed_paths:
            return Ending("wrong", f"refused, but wrote {sorted(changed_paths)[:3]}: {said[-200:]}")
        if asked.says not in said and not usage:
            return Ending("wrong", f'refused without "{asked.says}": {said[-300:]}')
        return Ending("refused well", said)
    if code == 3:
        return Ending("stopped with its cause", said)
    if asked.ends == "refused":
        return Ending("wrong", f"taken: {out.strip()[-200:]}")
    return Ending("finished well", "")


def prepared(folder: Path) -> None:
    """A finished point, a finished slice, and a slice that was killed after its first rows."""
    (folder / "scene.toml").write_text(SCENE)
    long = (*SLICE, "load.duration=0.2ms", "numerics.max_step=1us")
    for name, changes in (("point", POINT), ("slice", SLICE), ("stopped", long)):
        words = (*changed(command="run", base=changes), "--out", name, "--checkpoint-every", "0")
        child = launched(Input(words), folder, 600.0)
        while not (end := ended(child))[0]:
            time.sleep(0.1)
            history = folder / name / "history.csv"
            if name == "stopped" and history.exists() and history.read_text().count("\n") > 5:
                child = child._replace(deadline=0.0)
        if end[1] or not list(
            (folder / name).glob("checkpoint" if end[1] is None else "summary.json")
        ):
            sys.exit(f"the run to be damaged ended with {end[1]}: {streams(folder)[1].read_text()}")


def main(arguments: Sequence[str] | None = None) -> None:
    parser = options(__doc__)
    parser.add_argument("--processes", type=int, default=2, help="at a time")
    parser.add_argument("--quick", action="store_true", help="every fortieth input")
    parser.add_argument("--list", action="store_true", help="print how every input ended")
    given = parser.parse_args(arguments)
    to_si("1 m", "m")  # loads what every process would load
    with tempfile.TemporaryDirectory() as where:
        runs = Path(where) / "runs"
        runs.mkdir()
        prepared(runs)
        asked = inputs(runs)[:: 40 if given.quick else 1]
        counts: Counter[str] = Counter()
        for one, ending in zip(asked, all_endings(asked, where, given.processes), strict=True):
            counts[ending.kind] += 1
            if given.list or ending.kind == "wrong":
                words = " ".join(
                    word if len(word) < 60 else word[:57] + "..." for word in one.words
                )
                print(f"{ending.kind}: {words!r}\n    {ending.why}", flush=True)
        print(f"{len(asked)} inputs")
        for kind in ("refused well", "finished well", "stopped with its cause", "wrong"):
            print(f"{kind}: {counts[kind]}")


if __name__ == "__main__":
    main()
