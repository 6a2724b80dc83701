"""Which element? The press of a 1 mm cube on several of them: error, work, and shear at 5 bar.

The half of a cube of compound B is pressed without friction by 1 and 5 bar on meshes of
growing refinement. The error is that of the plate's displacement, against the value that
Richardson extrapolation gives from the mixed element. Then the cube is pressed by 5 bar under a
shear proportional to the pressure, as far as equilibria are found. Prints tables in Markdown.
Times are of the processor, on one process, without compilation.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq
from scipy.sparse import csr_matrix

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.laws.film import FilmLaw
from iceslide_fem.mechanics.block import Block
from iceslide_fem.mechanics.contact import contact_points, default_penalty
from iceslide_fem.mechanics.element import (
    DEGREE,
    SPLIT,
    VOLUME_DEGREE,
    WHOLE,
    WHOLE_DEGREE,
    Energy,
    energy_density,
    isochoric_energy,
    stored_energy,
    volumetric_energy,
)
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.loaded_block import Equilibrium
from iceslide_fem.mechanics.materials import Material
from iceslide_fem.mechanics.press import PathPoint, press
from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.grid import tensor_grid
from iceslide_fem.mesh.profile import CONTACT_HEIGHT
from iceslide_fem.mesh.tagged import TaggedMesh
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import BAR, COMPOUNDS, MooneyRivlin
from scripts.studies import common
from scripts.studies.blocks import shear_of_pressure

MATERIAL = COMPOUNDS["B"]
OF_HEXAHEDRA = WHOLE_DEGREE["hexahedron"]
SIZE = 1e-3  # m
NUMBERS = (2, 4, 6, 8, 12)  # cells along x
SHEARED_NUMBERS = (4, 8)
SHEARS = (0.15, 0.3)  # of the contact pressure; 0.15 is the most the film gives at 5 bar
DEFAULT = "Q2, 2x2x2 volumetric above"
REFERENCE = "Q2/P1 mixed"


# --- meshes: nested under doubling, so that extrapolation has smooth errors


def half_cube(n: int, gathered: float = 0.4) -> TaggedMesh:
    """n x n/2 x n hexahedra (n even), finer at the contact edges and at both ends of the height.

    `gathered`, 0 to 0.5: how much finer, from not at all to cells without extent.
    """
    turn = gathered * np.pi
    along = SIZE / 2 * np.sin(turn * np.linspace(-1, 1, n + 1)) / np.sin(turn)
    upwards = along + SIZE / 2

    def sides(centre: Array) -> Any:
        lower = centre[:, 2] < CONTACT_HEIGHT * SIZE
        return lower & np.isclose(centre[:, :2], [[SIZE / 2]]).any(axis=1)

    parts = {
        "contact": lambda c: (c[:, 2] == 0.0) | sides(c * [1, 1, 1]) | sides(c * [-1, 1, 1]),
        "plate": lambda c: np.isclose(c[:, 2], SIZE),
    }
    return tensor_grid([along, along[n // 2 :], upwards], "rubber", parts)


def in_tetrahedra(grid: TaggedMesh) -> TaggedMesh:
    """Every hexahedron cut into six tetrahedra along its diagonal, facets to match (Kuhn)."""
    # by coordinates, because gmsh's versions begin at different corners: the diagonals run from the
    # lowest corner to the highest; a tetrahedron is a way along edges between
    corners = grid.points[grid.cells]
    upper = corners > corners.mean(axis=1, keepdims=True)
    cubes = np.take_along_axis(grid.cells, np.argsort(upper @ [1, 2, 4], axis=1), axis=1)
    ways = []
    for order in itertools.permutations([1, 2, 4]):
        ways.append(np.cumsum([0, *order]))
    cells = np.concatenate([cubes[:, way] for way in ways])
    volume = np.linalg.det(np.diff(grid.points[cells], axis=1))
    cells[volume < 0] = cells[volume < 0][:, [0, 1, 3, 2]]
    facets = {}
    for name, quads in grid.facets.items():
        first = np.argmin(grid.points[quads].sum(axis=2), axis=1)[:, None]
        turned = np.take_along_axis(quads, (first + np.arange(4)) % 4, axis=1)
        facets[name] = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    return TaggedMesh(grid.points, "tetrahedron", cells, facets, grid.body)


# --- elements


def fully_integrated(degree: int) -> Energy:
    """Energy integrated by one rule of the given degree."""

    def energy(u: Any, material: MooneyRivlin, dx: Any) -> Any:
        return energy_density(ufl.grad(u), material) * dx(metadata={"quadrature_degree": degree})

    return energy


def under_integrated(u: Any, material: MooneyRivlin, dx: Any) -> Any:
    """Energy whose volumetric part is integrated by 2 x 2 x 2 points in all cells."""
    isochoric = isochoric_energy(ufl.grad(u), material)
    volumetric = volumetric_energy(ufl.grad(u), material)
    full, reduced = (
        dx(metadata={"quadrature_degree": q}) for q in (OF_HEXAHEDRA, VOLUME_DEGREE["hexahedron"])
    )
    return isochoric * full + volumetric * reduced


class MixedRubber(HyperelasticBody):
    """Quadratic displacement and a pressure that is linear in each hexahedron (Q2/P1).

    The pressure is p = 2/D1 Pi(J - 1), Pi the L2 projection in each cell, so it is eliminated
    there: K = K_uu(p) + 2/D1 B^T M^-1 B, B the derivative of the moments of J, M the mass matrix.
    On one process. Cells whose energy the default takes whole may be as they are there.
    """

    def __init__(
        self, block: gmsh_model.DistributedMesh, material: MooneyRivlin, everywhere: bool
    ) -> None:
        """`everywhere`: whether those cells are mixed, too."""
        pressures = compat.polynomial_space(block.mesh, 1)
        self._pressure = fem.Function(pressures)
        rule = {"quadrature_degree": OF_HEXAHEDRA}

        def mixed(dx: Any) -> Any:
            return dx(metadata=rule) if everywhere else dx(SPLIT, metadata=rule)

        def dilatation(u: Any) -> Any:
            return ufl.det(ufl.Identity(3) + ufl.grad(u)) - 1.0

        def energy(u: Any, material: MooneyRivlin, dx: Any) -> Any:
            F = ufl.grad(u)
            total = isochoric_energy(F, material) * dx(metadata=rule)
            total += self._pressure * dilatation(u) * mixed(dx)
            if not everywhere:
                total += volumetric_energy(F, material) * dx(WHOLE, metadata=rule)
            return total

        super().__init__(block, {"rubber": Material(material)}, 2, energy)
        test, trial = ufl.TestFunction(pressures), ufl.TrialFunction(pressures)
        moments = test * dilatation(self.u) * mixed(self.dx)
        self._moments = compat.form(moments)
        moved = ufl.TrialFunction(self.space)
        self._slope = compat.form(ufl.derivative(moments, self.u, moved))
        self._integrals = compat.create_vector(pressures)
        mass = compat.form(trial * test * self.dx(metadata=rule))
        self._coupling = compat.create_matrix(self._slope)
        self._stiffness = self._inverse(mass, 2.0 / material.D1)
        self._product: PETSc.Mat | None = None

    @staticmethod
    def _inverse(mass: Any, factor: float) -> PETSc.Mat:
        """factor M^-1, cell by cell."""
        matrix = compat.assemble_matrix(compat.create_matrix(mass), mass)
        rows, columns, values = matrix.getValuesCSR()
        blocks = factor * np.linalg.inv(values.reshape(-1, 4, 4))
        return PETSc.Mat().createAIJ(matrix.size, csr=(rows, columns, blocks.ravel()))

    def _update_pressure(self) -> None:
        compat.assemble_vector(self._integrals, self._moments)
        self._stiffness.mult(self._integrals, compat.petsc_vector(self._pressure))

    def internal_forces(self, vector: PETSc.Vec) -> None:
        self._update_pressure()
        super().internal_forces(vector)

    def tangent(self, matrix: PETSc.Mat, walls: csr_matrix | None = None) -> None:
        self._update_pressure()
        super().tangent(matrix, walls)
        compat.assemble_matrix(self._coupling, self._slope)
        self._product = self._stiffness.PtAP(self._coupling, result=self._product)
        matrix.axpy(1.0, self._product, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)


class Element(NamedTuple):
    """An element: how its cubes are meshed and its forms made; cells along x that are tried."""

    in_tetrahedra: bool
    forms: Callable[[gmsh_model.DistributedMesh, MooneyRivlin], HyperelasticBody]
    numbers: tuple[int, ...]


def displacement_element(
    degree: int, energy: Energy
) -> Callable[[gmsh_model.DistributedMesh, MooneyRivlin], HyperelasticBody]:
    """Forms of displacements of a degree with that energy."""
    return lambda mesh, material: HyperelasticBody(
        mesh, {"rubber": Material(material)}, degree, energy
    )


ELEMENTS = {
    "P1 tetrahedra": Element(
        True, displacement_element(1, fully_integrated(1)), (4, 8, 12, 16, 24)
    ),
    "P2 tetrahedra": Element(True, displacement_element(2, fully_integrated(4)), NUMBERS),
    "Q2": Element(False, displacement_element(2, fully_integrated(OF_HEXAHEDRA)), NUMBERS),
    "Q2, 2x2x2 volumetric": Element(False, displacement_element(2, under_integrated), NUMBERS),
    DEFAULT: Element(False, displacement_element(DEGREE, stored_energy), NUMBERS),
    "Q2/P1 mixed": Element(False, partial(MixedRubber, everywhere=True), NUMBERS),
    "Q2/P1 mixed above": Element(False, partial(MixedRubber, everywhere=False), NUMBERS),
}

# --- presses


class Press(NamedTuple):
    """One press: plate displacement (m; at the last load if it failed), fraction of the load that
    was reached, dofs, Newton iterations, tangents, seconds."""

    displacement: float
    reached: float
    dofs: int
    iterations: int
    tangents: int
    seconds: float


def pressed(
    element: Element,
    grid: TaggedMesh,
    pressure: float,
    mu: float = 0.0,
    material: MooneyRivlin = MATERIAL,
    tolerance: float = 0.1,
) -> Press:
    """Press the half cube `grid` of hexahedra under a shear of `mu` times the pressure.

    `tolerance` is what the penalty is made for.
    """
    scene = scene_from_dict(
        {
            "name": "cube",
            "model": "block",
            "rubber": {"compound": "B"},
            "load": {"pressure": pressure, "speed": 1.0, "duration": 1e-3},
        }
    )
    tagged = in_tetrahedra(grid) if element.in_tetrahedra else grid
    rubber = element.forms(gmsh_model.distribute(tagged, MPI.COMM_SELF), material)
    start = process_time()
    surface = contact_points(scene, rubber, SIZE)
    equilibrium = Equilibrium(rubber, surface, default_penalty(material, SIZE, tolerance))
    area = SIZE**2 / 2
    friction = FilmLaw(scene.contact_parameters, None, 0.05 * pressure)
    block = Block(scene, rubber, surface, equilibrium, friction, area, pressure * area, 2.0, SIZE)
    points: list[PathPoint] = []
    reached = 1.0
    try:
        press(block, points.append, shear_of_pressure(mu))
    except SimulationStopped:
        reached = max((point.load for point in points), default=0.0)
    return Press(
        equilibrium.plate_displacement(),
        reached,
        rubber.n_dofs,
        sum(point.solution.iterations for point in points),
        sum(point.solution.jacobians for point in points),
        process_time() - start,
    )


def extrapolated(numbers: Sequence[int], values: Sequence[float]) -> tuple[float, float]:
    """Limit d and order q of values d + c n^-q given at three numbers of cells n."""
    n, v = np.array(numbers, dtype=float), np.array(values)
    ratio = (v[2] - v[1]) / (v[1] - v[0])

    def differs(q: float) -> float:
        return float((n[1] ** -q - n[2] ** -q) / (n[0] ** -q - n[1] ** -q) - ratio)

    q = brentq(differs, 0.1, 8.0)
    share = n[2] ** -q / (n[1] ** -q - n[2] ** -q)
    return float(v[2] + share * (v[2] - v[1])), float(q)


# --- output

Presses = dict[str, dict[int, Press]]


def frictionless(pressure: float, coarse: int) -> Presses:
    """Presses of every element on its `coarse` coarsest meshes (all, if that is more)."""
    return {
        name: {n: pressed(element, half_cube(n), pressure) for n in element.numbers[:coarse]}
        for name, element in ELEMENTS.items()
    }


def limit(presses: Presses, name: str) -> tuple[float, float]:
    """Plate displacement (m) and order that the three finest meshes of an element lead to."""
    finest = list(presses[name].items())[-3:]
    return extrapolated([n for n, _ in finest], [press.displacement for _, press in finest])


def print_presses(pressure: float, presses: Presses) -> None:
    """Table of the frictionless presses by one pressure (Pa)."""
    exact, _ = limit(presses, REFERENCE)
    print(f"\n### {pressure / BAR:g} bar, frictionless: plate displacement {1e6 * exact:.2f} um\n")
    rows = []
    for name, meshes in presses.items():
        for n, found in meshes.items():
            failed = "" if found.reached == 1.0 else f" (failed at {found.reached:.0%})"
            plate = f"{1e6 * found.displacement:.2f}{failed}"
            error = f"{found.displacement / exact - 1.0:+.2%}"
            work = (found.iterations, found.tangents, f"{found.seconds:.2f}")
            rows.append((name, n, found.dofs, plate, error, *work))
    head = ("element", "cells along x", "dofs", "plate, um", "error", "Newton", "tangents", "s")
    common.table(head, rows)
    print("\nExtrapolated from the three finest meshes of each element (um, and order in 1/n):\n")
    for name in presses:
        value, order = limit(presses, name)
        print(f"- {name}: {1e6 * value:.2f}, {order:.1f}")


def print_sheared(numbers: Sequence[int], shears: Sequence[float]) -> None:
    """Table of the presses by 5 bar under shear."""
    print("\n### 5 bar under shear: fraction of the load reached, plate, tangents, seconds\n")
    head = ("element", "cells along x", *(f"tau = {mu:g} p" for mu in shears))

    def cell(element: Element, n: int, mu: float) -> str:
        found = pressed(element, half_cube(n), 5 * BAR, mu)
        return (
            f"{found.reached:.0%}, {1e6 * found.displacement:.1f} um, "
            f"{found.tangents}, {found.seconds:.1f} s"
        )

    common.table(
        head,
        (
            (name, n, *(cell(element, n, mu) for mu in shears))
            for name, element in ELEMENTS.items()
            for n in numbers
        ),
    )


def draw(results: dict[float, Presses], path: Path) -> None:
    """Chart of the error against the seconds, one panel for each pressure."""
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    panels = figure.subplots(1, len(results), sharey=True)
    for panel, (pressure, presses) in zip(panels, results.items(), strict=True):
        exact, _ = limit(presses, REFERENCE)
        for (name, meshes), mark in zip(presses.items(), "v^soD*P", strict=True):
            errors = [abs(press.displacement / exact - 1.0) for press in meshes.values()]
            panel.loglog(
                [press.seconds for press in meshes.values()], errors, mark + "-", label=name
            )
        panel.set(title=f"{pressure / BAR:g} bar, frictionless", xlabel="processor seconds")
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("relative error of the plate's displacement")
    panels[-1].legend(fontsize="small", loc="lower left")  # no curve is there
    common.draw(figure, path, 130)


def main() -> None:
    """Print the tables and draw the chart."""
    parser = common.options(__doc__)
    parser.add_argument("--quick", action="store_true", help="coarse meshes only, a few seconds")
    common.picture_options(parser, "docs")
    options = parser.parse_args()
    results: dict[float, Presses] = {}
    for pressure in (1 * BAR, 5 * BAR):
        results[pressure] = frictionless(pressure, 3 if options.quick else 5)
        print_presses(pressure, results[pressure])
    print_sheared(
        (2,) if options.quick else SHEARED_NUMBERS, SHEARS[:1] if options.quick else SHEARS
    )
    draw(results, options.pictures / "elements.png")


if __name__ == "__main__":
    main()
