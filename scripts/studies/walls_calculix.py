"""Walls that meet, beside CalculiX: two lugs pushed together on the same mesh, smooth and rubbing.

A block with one sipe hangs on its plate, which is held. Its outer sides are turned about their
upper ends, the left one inwards and up, the right one inwards and down, in equal steps, so that the
walls of the sipe meet at the mouth and slip on each other. This program computes a slice, CalculiX
one row of cells in plane strain, surface to surface with the same penalty, and the same stiffness
while walls stick. Printed are the force between the walls, and the largest difference of the
displacements at the nodes that both have. Without `ccx` only this program's part is there; --quick
is one coarse pair.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from scipy.spatial import cKDTree

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc
from iceslide_fem.fenics.start import start_petsc
from iceslide_fem.mechanics.block import Block, build_block
from iceslide_fem.mesh.rubber import tagged_rubber
from iceslide_fem.mesh.tagged import IntArray, TaggedMesh
from iceslide_fem.runtime.arrays import Array, Mask
from iceslide_fem.runtime.errors import NotConverged
from iceslide_fem.scene.materials import BAR, MooneyRivlin
from scripts.studies.common import case, draw, options, picture_options, table
from scripts.studies.peers_calculix import FACES, listed, rows, with_middles, wrapped

LENGTH, HEIGHT = 6e-3, 4e-3
SIPE = "[{position='0 mm', width='0.2 mm', depth='3 mm'}]"
IN, ALONG = 0.3e-3, 0.4e-3  # m: how far the lower end of a side goes inwards, and up or down
STEPS, THICK = 20, 0.1e-3  # of the push; m: of CalculiX's row
FRICTIONS, QUICK = (0.0, 0.05, 0.3), 0.25
ITERATIONS, SMALL = 30, 1e-6  # Newton's; of the residual, N/m
MM = 1e3


class Pushed(NamedTuple):
    """Nodes (n, 2), their displacements (n, 2), m; components of the walls' force, N/m, positive.

    Inclined walls have a vertical force without friction, too.
    """

    nodes: Array
    moved: Array
    horizontal: float
    vertical: float


def lugs(friction: float, refinement: float) -> Block:
    """The block, a slice."""
    return build_block(
        case("thesis_1bar", "model=slice", f"rubber.length={LENGTH}m", f"rubber.height={HEIGHT}m",
             f"rubber.sipes={SIPE}", f"rubber.wall_friction={friction}",
             f"numerics.refinement={refinement}"),
        MPI.COMM_SELF,
    )  # fmt: skip


def held(x: Array) -> tuple[Mask, Array]:
    """Which of the nodes (n, 2) are on the plate or pushed, and their ways at the end (n, 2), m."""
    ends = np.isclose(np.abs(x[:, 0]), LENGTH / 2)
    share = ends * np.sign(x[:, 0]) * (1.0 - x[:, 1] / HEIGHT)
    return ends | np.isclose(x[:, 1], HEIGHT), share[:, None] * [-IN, -ALONG]


def pushed_here(block: Block) -> Pushed:
    """By this program: Newton's method in each of the steps, whose end walls remember."""
    rubber = block.rubber
    self_contact, u = rubber.self_contact, rubber.displacements
    assert self_contact is not None
    x = rubber.space.tabulate_dof_coordinates()[:, :2]
    fixed, way = held(x)
    unknowns = (2 * np.flatnonzero(fixed)[:, None] + [0, 1]).ravel().astype(PETSc.IntType)
    residual, change = rubber.create_vector(), rubber.create_vector()
    matrix, solver = rubber.create_matrix(), PETSc.KSP().create(MPI.COMM_SELF)
    solver.setType("preonly")
    solver.getPC().setType("lu")
    for step in range(1, STEPS + 1):
        for _ in range(ITERATIONS):
            rubber.internal_forces(residual)
            left = (step / STEPS * way - u)[fixed]
            residual.array[unknowns] = 0.0
            if np.abs(left).max() == 0.0 and residual.norm() < SMALL:
                break
            rubber.internal_forces(residual)
            residual.scale(-1.0)
            change.set(0.0)
            change.array[unknowns] = left.ravel()
            rubber.tangent(matrix)
            matrix.zeroRowsColumns(unknowns, 1.0, change, residual)
            solver.setOperators(matrix)
            solver.solve(residual, change)
            u += change.array.reshape(u.shape)
            u[fixed] = (step / STEPS * way)[fixed]
        else:
            raise NotConverged("the lugs find no equilibrium")
        block.set_stick_points(block.stick_points_after()[0])
    forces = np.zeros_like(u)
    self_contact.add_forces(u, forces)
    horizontal, vertical = np.abs(forces[x[:, 0] > 0.0].sum(axis=0))
    return Pushed(x, u.copy(), float(horizontal), float(vertical))


def pushed_by_calculix(
    ccx: str, mesh: TaggedMesh, material: MooneyRivlin, penalty: float, friction: float
) -> Pushed:
    """By CalculiX, the program `ccx`, on the slice's `mesh`; penalty, Pa/m."""
    with tempfile.TemporaryDirectory() as folder:
        nodes, text = written(mesh, material, penalty, friction)
        Path(folder, "lugs.inp").write_text(text, encoding="utf-8")
        environment = os.environ | {"OMP_NUM_THREADS": "1"}
        done = subprocess.run([ccx, "lugs"], cwd=folder, env=environment, capture_output=True)
        results = Path(folder, "lugs.dat")
        if done.returncode or not results.is_file():
            raise NotConverged("CalculiX finds no equilibrium")
        return read(results.read_text(encoding="utf-8"), nodes)


def written(
    mesh: TaggedMesh, material: MooneyRivlin, penalty: float, friction: float
) -> tuple[Array, str]:
    """All nodes (n, 3), mm, of a row of CalculiX's 20-node bricks, and the input."""
    flat, count = mesh.points[:, :2] * MM, len(mesh.points)
    sheets = [np.insert(flat, 1, y, axis=1) for y in (THICK * MM, 0.0)]
    cells = np.hstack([mesh.cells, mesh.cells + count])  # the second sheet lies where x * z points
    nodes, cells = with_middles(np.concatenate(sheets), cells, "hexahedron")
    numbers = np.arange(len(nodes)) + 1
    fixed, way = held(nodes[:, [0, 2]] / MM)
    pushes = [
        f"{node},{direction},{direction},{value:.12g}"
        for node, values in zip(numbers[fixed], way[fixed] * MM, strict=True)
        for direction, value in zip((1, 3), values, strict=True)
    ]
    left, right = (sides(mesh, sign) for sign in (-1.0, 1.0))
    elastic = [material.C10 * 1e-6, material.C01 * 1e-6, material.D1 * 1e6]
    spring = penalty * 1e-9
    lines = [
        "*NODE, NSET=ALL", *rows(numbers, nodes),
        "*ELEMENT, TYPE=C3D20R, ELSET=RUBBER", *wrapped(np.arange(len(cells)) + 1, cells + 1),
        "*MATERIAL, NAME=RUBBER", "*HYPERELASTIC, MOONEY-RIVLIN", listed(elastic),
        "*SOLID SECTION, ELSET=RUBBER, MATERIAL=RUBBER",
        "*SURFACE, NAME=LEFT, TYPE=ELEMENT", *left, "*SURFACE, NAME=RIGHT, TYPE=ELEMENT", *right,
        "*SURFACE INTERACTION, NAME=TOUCH", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{spring}", *(["*FRICTION", f"{friction},{spring}"] if friction else []),
        "*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "LEFT,RIGHT",
        "*BOUNDARY", "ALL,2,2",
        f"*STEP, NLGEOM, INC={20 * STEPS}", "*STATIC",
        f"{1 / STEPS},1.,1e-6,{1 / STEPS}",
        "*BOUNDARY", *pushes,
        "*NODE PRINT, NSET=ALL, FREQUENCY=1000", "U",
        "*CONTACT PRINT, SLAVE=LEFT, MASTER=RIGHT, FREQUENCY=1000", "CF", "*END STEP",
    ]  # fmt: skip
    return nodes, "\n".join(lines) + "\n"


def sides(mesh: TaggedMesh, sign: float) -> list[str]:
    """Element and face of the walls on one side of the middle."""
    middle = mesh.points[mesh.facets["walls"]].mean(axis=1)[:, 0]
    edges = {tuple(sorted(edge)) for edge in mesh.facets["walls"][middle * sign > 0.0].tolist()}
    around = FACES["hexahedron"][2:]  # of a brick over a quadrilateral: by its edges in turn
    return [
        f"{cell},S{number}"
        for cell, corners in enumerate(mesh.cells.tolist(), 1)
        for number, face in enumerate(around, 3)
        if tuple(sorted(corners[int(one)] for one in face if int(one) < 4)) in edges
    ]


def read(results: str, nodes: Array) -> Pushed:
    """Displacements and the force on the walls at the end, from what CalculiX has printed."""
    moved, forces, reading = np.full(nodes.shape, np.nan), np.zeros(3), ""
    for line in results.splitlines():
        words = line.split()
        if "displacements" in line:
            reading = "displacements" if float(words[-1]) == 1.0 else ""
        elif "total surface force" in line:
            reading = "force"
        elif words and words[0][0].isalpha():
            reading = ""
        elif reading == "displacements" and len(words) == 4:
            moved[int(words[0]) - 1] = [float(word) for word in words[1:]]
        elif reading == "force" and len(words) >= 3:
            forces, reading = np.array([float(word) for word in words[:3]]), ""
    if np.isnan(moved).any():
        raise NotConverged("CalculiX does not reach the end of the push")
    front = nodes[:, 1] == 0.0
    horizontal, vertical = np.abs(forces[[0, 2]]) / THICK
    plane = [0, 2]
    return Pushed(nodes[front][:, plane] / MM, moved[front][:, plane] / MM, horizontal, vertical)


def apart(one: Pushed, other: Pushed) -> float:
    """Largest difference of displacements, m, at the nodes of `other`, all of which `one` has."""
    distance, at = cKDTree(one.nodes).query(other.nodes)
    assert distance.max() < 1e-9
    return float(np.abs(one.moved[at] - other.moved).max())


def picture(found: dict[float, tuple[Pushed, Pushed | None, Array]], cells: IntArray) -> Figure:
    """Deformed lugs with CalculiX's nodes, and the pressure between the walls."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    lugs_axes, walls_axes = figure.subplots(1, 2, width_ratios=[1.5, 1.0])
    ours, theirs, _ = found[max(found)]
    at = MM * (ours.nodes + ours.moved)
    lugs_axes.add_collection(
        PolyCollection(list(at[cells]), facecolor="#dddddd", edgecolor="#888888", linewidth=0.3)
    )
    if theirs is not None:
        lugs_axes.plot(*(MM * (theirs.nodes + theirs.moved)).T, ".", ms=1.5, color="#0072b2",
                       label="nodes of CalculiX")  # fmt: skip
        lugs_axes.legend(fontsize=7, frameon=False, loc="upper left")
    lugs_axes.set(aspect="equal", xlabel="x (mm)", ylabel="z (mm)", ylim=(None, MM * HEIGHT + 0.8))
    lugs_axes.set_title(f"friction coefficient {max(found):g}", fontsize=9)
    for friction, colour in zip(found, ("#0072b2", "#009e73", "#d55e00"), strict=False):
        pressures = found[friction][2]
        walls_axes.plot(MM * pressures[:, 0], pressures[:, 1] / BAR, ".", ms=3, color=colour,
                        label=f"mu = {friction:g}")  # fmt: skip
    walls_axes.set(xlabel="z (mm)", ylabel="pressure of the walls (bar)", ylim=(0, None))
    walls_axes.legend(fontsize=7, frameon=False)
    walls_axes.grid(alpha=0.3)
    return figure


HEAD = ("mu", "program", "horizontal force (N/mm)", "vertical force (N/mm)",
        "displacements differ by", "of the largest")  # fmt: skip


def main() -> None:
    """Run the study."""
    parser = options(__doc__)
    parser.add_argument("--refinement", type=float, default=0.5, help="of the mesh")
    parser.add_argument("--quick", action="store_true", help="a coarse mesh, without friction")
    picture_options(parser)
    asked = parser.parse_args()
    start_petsc()
    ccx = shutil.which("ccx")
    if ccx is None:
        print("CalculiX is not here: no `ccx` is found.")
    found: dict[float, tuple[Pushed, Pushed | None, Array]] = {}
    lines = []
    refinement = QUICK if asked.quick else asked.refinement
    for friction in FRICTIONS[: 1 if asked.quick else None]:
        block = lugs(friction, refinement)
        self_contact, scene = block.rubber.self_contact, block.scene
        assert self_contact is not None
        ours, theirs = pushed_here(block), None
        lines.append([friction, "iceslide_fem", *forces_of(ours), "", ""])
        if ccx is not None:
            mesh, material = tagged_rubber(scene), scene.mooney_rivlin
            theirs = pushed_by_calculix(ccx, mesh, material, self_contact.penalty, friction)
            difference = apart(ours, theirs)
            share = difference / np.abs(ours.moved).max()
            lines.append([friction, "CalculiX", *forces_of(theirs), f"{1e6 * difference:.3g} um",
                          f"{share:.2%}"])  # fmt: skip
        at, pressure = self_contact.pressure(block.rubber.displacements)
        found[friction] = ours, theirs, np.column_stack([at[:, -1], pressure])
    table(HEAD, lines)
    corners = compat.cell_dofs(block.rubber.space)[:, [0, 1, 3, 2]].astype(np.int64)
    draw(picture(found, corners), asked.pictures / "walls_calculix.png")


def forces_of(pushed: Pushed) -> list[str]:
    """Forces between the walls, for a table."""
    return [f"{1e-3 * force:.4f}" for force in (pushed.horizontal, pushed.vertical)]


if __name__ == "__main__":
    main()
