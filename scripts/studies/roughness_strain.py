"""What the half-space misses of large strains: rough profiles by finite elements beside it.

A plane strain block of compound B with a random profile below, mirrored at its sides, is pressed on
a frictionless plane: quadratic quadrilaterals, the package's Mooney-Rivlin energy, penalty contact.
The half-space presses the same profile at the pressure that the elements have found.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from mpi4py import MPI
from petsc4py import PETSc

from iceslide_fem.fenics import compat
from iceslide_fem.preprocess.roughness.half_space import press
from iceslide_fem.rubber.element import QUADRATURE_DEGREE, energy_density
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.scene.materials import BAR, COMPOUNDS
from scripts.studies.common import options, table

RUBBER = COMPOUNDS["B"]
MODULUS = RUBBER.youngs_modulus / (1.0 - RUBBER.poissons_ratio**2)
LENGTH = 0.2e-3  # m, half a period
HEIGHT = 0.15e-3
WAVES = range(3, 12)  # half-waves in LENGTH: 133 to 36 um
PENALTY = 2e13  # Pa/m: 50 nm at 10 bar; gaps are counted from the mean of what overlaps
SLOPES = (0.1, 0.3, 0.5)


class Pressed(NamedTuple):
    """Mean pressure (Pa), fraction of the length in contact, mean gap (m)."""

    pressure: float
    share: float
    gap: float


def profile(slope: float, x: Array, seed: int = 1) -> Array:
    """Heights (m, towards the plane) of random signs and falling amplitudes, of this rms slope."""
    random = np.random.default_rng(seed)
    n = np.array(WAVES)[:, None]
    amplitude = random.choice([-1.0, 1.0], n.shape) * random.uniform(0.5, 1.0, n.shape) / n**1.5
    z = (amplitude * np.cos(np.pi * n * x / LENGTH)).sum(axis=0)
    dense = np.linspace(0.0, LENGTH, 2001)
    derivative = np.pi * n / LENGTH * amplitude * np.sin(np.pi * n * dense / LENGTH)
    return np.asarray(z * slope / np.sqrt(np.mean(derivative.sum(axis=0) ** 2)))


class Block:
    """The block and its equilibrium under a plate that is moved down."""

    def __init__(self, slope: float, across: int, up: int) -> None:
        self.mesh = dolfinx_mesh.create_rectangle(
            MPI.COMM_SELF,
            [np.zeros(2), np.array([LENGTH, 1.0])],
            [across, up],
            dolfinx_mesh.CellType.quadrilateral,
        )
        points = self.mesh.geometry.x
        s = points[:, 1].copy()
        graded = (np.exp(2.5 * s) - 1.0) / (np.exp(2.5) - 1.0)
        below = profile(slope, np.linspace(0.0, LENGTH, 4001)).max() - profile(slope, points[:, 0])
        points[:, 1] = below * (1.0 - graded) + HEIGHT * graded
        space = compat.vector_space(self.mesh, 2)
        self.u = fem.Function(space)
        where = space.tabulate_dof_coordinates()
        sides = np.flatnonzero((where[:, 0] < 1e-9) | (where[:, 0] > LENGTH - 1e-9))
        self.top = np.flatnonzero(where[:, 1] > HEIGHT * (1.0 - 1e-9))
        self.fixed = np.unique(np.concatenate([2 * sides, 2 * self.top, 2 * self.top + 1]))
        facets = dolfinx_mesh.locate_entities_boundary(
            self.mesh, 1, lambda x: (x[1] < 0.5 * HEIGHT) & (x[0] > -1.0)
        )
        mid = dolfinx_mesh.compute_midpoints(self.mesh, 1, facets)
        inner = (mid[:, 0] > 1e-9) & (mid[:, 0] < LENGTH - 1e-9)
        tags = dolfinx_mesh.meshtags(
            self.mesh, 1, np.sort(facets[inner]), np.ones(inner.sum(), np.int32)
        )
        ds = ufl.Measure("ds", self.mesh, subdomain_data=tags)(1, metadata={"quadrature_degree": 8})
        X = ufl.SpatialCoordinate(self.mesh)
        gap = X[1] + self.u[1]
        push = PENALTY * ufl.max_value(-gap, 0.0)
        energy = energy_density(ufl.grad(self.u), RUBBER) * ufl.dx(
            metadata={"quadrature_degree": QUADRATURE_DEGREE}
        )
        contact = 0.5 * PENALTY * ufl.max_value(-gap, 0.0) ** 2 * ds
        residual = ufl.derivative(energy + contact, self.u)
        self._residual = compat.form(residual)
        self._tangent = compat.form(ufl.derivative(residual, self.u))
        self._force = compat.form(push * ds)
        self._vector, self._change = compat.create_vector(space), compat.create_vector(space)
        self._matrix = compat.create_matrix(self._tangent)
        self._solver = PETSc.KSP().create(MPI.COMM_SELF)
        self._solver.setType("preonly")
        self._solver.getPC().setType("lu")
        tangent = ufl.as_vector((-ufl.FacetNormal(self.mesh)[1], ufl.FacetNormal(self.mesh)[0]))
        stretch = abs(tangent[0] + ufl.dot(ufl.grad(self.u)[0, :], tangent))
        self._touching = compat.form(ufl.conditional(ufl.lt(gap, 0.0), stretch, 0.0) * ds)
        self._overlap = fem.Constant(self.mesh, PETSc.ScalarType(0.0))
        self._volume = compat.form(ufl.max_value(gap + self._overlap, 0.0) * stretch * ds)

    def lowered(self, by: float) -> Pressed:
        """Move the plate down by this more (m) and find equilibrium."""
        before = self.u.x.array.copy()
        self.u.x.array[2 * self.top + 1] -= by
        vector, change, matrix, solver = self._vector, self._change, self._matrix, self._solver
        for _ in range(60):
            compat.assemble_vector(vector, self._residual)
            compat.assemble_matrix(matrix, self._tangent)
            vector.array[self.fixed] = 0.0
            matrix.zeroRowsColumns(self.fixed.astype(PETSc.IntType), 1.0)
            solver.setOperators(matrix)
            solver.solve(vector, change)
            length = float(np.abs(change.array).max())
            if not np.isfinite(length):
                break
            self.u.x.array[:] -= min(1.0, 2e-6 / max(length, 1e-30)) * change.array
            if length < 1e-11:
                return self._found()
        self.u.x.array[:] = before
        raise SimulationStopped("the profile finds no equilibrium")

    def _found(self) -> Pressed:
        force, touching = (
            compat.assemble_scalar(each, MPI.COMM_SELF) / LENGTH
            for each in (self._force, self._touching)
        )
        self._overlap.value = force / (PENALTY * max(touching, 1e-3))
        volume = compat.assemble_scalar(self._volume, MPI.COMM_SELF) / LENGTH
        return Pressed(force, touching, volume)


def half_space(slope: float, pressures: list[float], pixels: int = 1024) -> list[Pressed]:
    """The same profile, mirrored, on the half-space."""
    x = (np.arange(pixels) + 0.5) * LENGTH / pixels
    z = profile(slope, x)
    heights = np.tile(np.concatenate([z, z[::-1]]), (4, 1))
    contacts = press(heights, LENGTH / pixels, MODULUS, pressures)
    return [
        Pressed(p, float((contact.pressure > 0).mean()), float(contact.gap.mean()))
        for p, contact in zip(pressures, contacts, strict=True)
    ]


def main() -> None:
    """Print the table."""
    parser = options(__doc__)
    parser.add_argument("--quick", action="store_true", help="a coarse mesh, one slope")
    quick = parser.parse_args().quick
    rows = []
    for slope in SLOPES[:1] if quick else SLOPES:
        block = Block(slope, *((40, 12) if quick else (80, 18)))
        step = 0.05 * slope * 30e-6
        found: list[Pressed] = []
        while not found or found[-1].pressure < 6.0 * BAR and found[-1].share < 0.95:
            try:
                found.append(block.lowered(step))
            except SimulationStopped:
                step *= 0.5
                if step < 1e-9:
                    raise
        smooth = half_space(slope, [each.pressure for each in found])
        wanted = np.array([0.2, 0.35, 0.5, 0.65, 0.8])
        for share in wanted:
            i = int(np.argmin([abs(each.share - share) for each in found]))
            fe, hs = found[i], smooth[i]
            rows.append(
                (
                    slope, f"{fe.pressure / BAR:.2f}", f"{fe.share:.3f}", f"{hs.share:.3f}",
                    f"{fe.share / hs.share - 1.0:+.1%}", f"{1e6 * fe.gap:.3f}",
                    f"{1e6 * hs.gap:.3f}", f"{fe.gap / hs.gap - 1.0:+.1%}",
                )
            )  # fmt: skip
    head = ("rms slope", "p, bar", "k, elements", "k, half-space", "difference")
    table((*head, "gap, um, elements", "gap, um, half-space", "difference"), rows)


if __name__ == "__main__":
    main()
