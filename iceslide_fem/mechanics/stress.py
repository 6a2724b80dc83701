"""Stress and stored energy in the block, from its displacements, at points and at nodes.

They are evaluated in NumPy with tables of the element, so no form has to be compiled. Shapes: c
cells, q points in each, a nodes of each, k vertices of each, d = 2 or 3 components.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.mechanics.contact_surface import space_degree
from iceslide_fem.mechanics.element import SIX, SPLIT, VOLUME_DEGREE, WHOLE_DEGREE, tensors
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MooneyRivlin


class Deformation(NamedTuple):
    """Deformation measures of the law: J (...), bbar = J^(-2/3) F F^T (..., 3, 3), bbar^2,
    traces.
    """

    J: Array
    b: Array
    squared: Array
    trace: Array
    trace_squared: Array

    @classmethod
    def of(cls, F: Array) -> Deformation:
        """From the deformation gradient (..., 3, 3)."""
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = np.moveaxis(F, (-2, -1), (0, 1))
        J = xx * (yy * zz - yz * zy) + xy * (yz * zx - yx * zz) + xz * (yx * zy - yy * zx)
        b = J[..., None, None] ** (-2.0 / 3.0) * _squared(F)
        squared = _squared(b)
        return cls(J, b, squared, _trace(b), _trace(squared))


def _squared(tensors: Array) -> Array:
    """A A^T of tensors (..., 3, 3) with contiguous components.

    It is several times faster than NumPy's products of many small matrices.
    """
    rows = np.moveaxis(tensors, (-2, -1), (0, 1))
    product = np.empty(rows.shape)
    for i, j in SIX:
        product[i, j] = rows[i, 0] * rows[j, 0] + rows[i, 1] * rows[j, 1] + rows[i, 2] * rows[j, 2]
        product[j, i] = product[i, j]
    return np.moveaxis(product, (0, 1), (-2, -1))


def _trace(tensors: Array) -> Array:
    return np.asarray(tensors[..., 0, 0] + tensors[..., 1, 1] + tensors[..., 2, 2])


def strain_energy(at: Deformation, material: MooneyRivlin) -> Array:
    """W = C10 (I1bar - 3) + C01 (I2bar - 3) + (J - 1)^2 / D1, J/m3."""
    I1, I2 = at.trace, 0.5 * (at.trace**2 - at.trace_squared)
    energy = material.C10 * (I1 - 3.0) + material.C01 * (I2 - 3.0)
    return np.asarray(energy + (at.J - 1.0) ** 2 / material.D1)


def cauchy_stress(at: Deformation, material: MooneyRivlin) -> Array:
    """Cauchy stress (Pa) of `strain_energy`, (..., 3, 3); constants of shapes that broadcast.

    sigma = (2 / J) dev[(C10 + C01 I1bar) bbar - C01 bbar^2] + 2 (J - 1) / D1.
    """
    linear, unit = material.C10 + material.C01 * at.trace, np.eye(3)
    mean = (linear * at.trace - material.C01 * at.trace_squared) / 3.0
    C01 = np.asarray(material.C01)[..., None, None]
    stress = linear[..., None, None] * at.b - C01 * at.squared
    pressure = 2.0 * (at.J - 1.0) / material.D1 - 2.0 / at.J * mean
    return np.asarray((2.0 / at.J)[..., None, None] * stress + pressure[..., None, None] * unit)


def von_mises(stress: Array) -> Array:
    """sqrt(3/2 s : s) of the stress deviator s, from six stress components (..., 6), Pa."""
    normal, shear = stress[..., :3], stress[..., 3:]
    deviator = normal - normal.mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=-1) + 3.0 * (shear**2).sum(axis=-1)))


class Gradients:
    """Displacement gradients at the same reference points of several cells.

    inverse: of the cells' Jacobians (d, d, c, q); stretch: their determinants (c, q).
    """

    def __init__(self, rubber: HyperelasticBody, cells: NDArray[np.int_], points: Array) -> None:
        """`points` (q, d) on the reference cell, in the local `cells`."""
        name, space = compat.cell_name(rubber.mesh), rubber.space
        element = compat.basix_lagrange(name, space_degree(space))
        self.dofs = compat.cell_dofs(space)[cells]
        table = np.array(element.tabulate(1, points))[..., 0]
        self.shape, self._slopes = table[0], table[1:]
        linear = np.array(compat.basix_lagrange(name, 1).tabulate(1, points))[..., 0]
        dim = rubber.mesh.geometry.dim
        x = space.tabulate_dof_coordinates()[:, :dim][self.dofs[:, : linear.shape[-1]]]
        jacobian = np.einsum("sqk,cki->cqis", linear[1:], x)
        inverse = np.moveaxis(np.linalg.inv(jacobian), (2, 3), (0, 1))
        self.inverse = np.ascontiguousarray(inverse)
        self.stretch = np.abs(np.linalg.det(jacobian))
        self.vertex_shape = linear[0]

    def deformation(self, u: Array) -> Array:
        """F (c, q, 3, 3) of nodal displacements `u` (blocked dofs, d); plane strain in a slice."""
        dim, points, nodes = self._slopes.shape
        flat = self._slopes.reshape(dim * points, nodes) @ u[self.dofs]
        by_point = np.moveaxis(flat.reshape(len(flat), dim, points, dim), (1, 3), (0, 1))
        F = np.zeros((3, 3, len(flat), points))  # contiguous components, as in `_squared`
        for i, j in itertools.product(range(dim), repeat=2):
            F[i, j] = sum(by_point[s, i] * self.inverse[s, j] for s in range(dim))
        for i in range(3):
            F[i, i] += 1.0
        return np.moveaxis(F, (0, 1), (-2, -1))


class CellPoints(Gradients):
    """Stress and energy at the same reference points of several cells.

    In cells with reduced volumetric integration, the pressure is the linear function (in tetrahedra
    the constant) through its values at these quadrature points. J oscillates between them without
    resistance.
    """

    def __init__(self, rubber: HyperelasticBody, cells: NDArray[np.int_], points: Array) -> None:
        """`points` (q, d) on the reference cell, in the local `cells` of this rank's own."""
        super().__init__(rubber, cells, points)
        self._constants = rubber.materials.at_cells(cells)
        self._cells, self._from_rule = cells, _from_rule(rubber, points)
        self._split = rubber.kinds[cells] == SPLIT
        if not self._split.any():
            return
        name = compat.cell_name(rubber.mesh)
        kept = compat.quadrature(name, VOLUME_DEGREE[name])[0]
        linear = compat.basix_lagrange(name, 1)
        here, there = (np.array(linear.tabulate(0, x))[0, ..., 0] for x in (points, kept))
        self._kept = Gradients(rubber, cells[self._split], kept)
        # (points where it is kept, q); of one point a constant
        self._between = np.linalg.lstsq(there.T, here.T, rcond=None)[0]

    def stress_and_energy(self, u: Array, fallen: Array | None = None) -> Array:
        """The six components of the Cauchy stress (Pa) and the energy density (J/m3), (c, q, 7).

        fallen: reduction of stress and energy by relaxation, in all cells of this rank at
        quadrature points (`Relaxed.fallen`).
        """
        F = self.deformation(u)
        at = Deformation.of(F)
        if self._split.any():
            at.J[self._split] = np.linalg.det(self._kept.deformation(u)) @ self._between
        stress = cauchy_stress(at, self._constants)
        six = [stress[..., row, column] for row, column in SIX]
        found = np.stack([*six, strain_energy(at, self._constants)], axis=-1)
        return found if fallen is None else found - self._fallen(F, at.J, fallen[self._cells])

    def _fallen(self, F: Array, J: Array, fallen: Array) -> Array:
        """The reduction `fallen` (c, r, 7) as Cauchy stress and energy density at the points."""
        here = self._from_rule @ fallen
        cauchy = F @ tensors(here[..., :6]) @ np.swapaxes(F, -1, -2) / J[..., None, None]
        return np.stack([*(cauchy[..., i, j] for i, j in SIX), here[..., 6]], axis=-1)


class StressRecovery:
    """Stress and energy density smoothed to the vertices of this rank's cells.

    In each cell a linear function is fitted to the values at quadrature points. The value at a
    vertex is the mean over its cells, weighted with their nodal volumes. The integral over the
    undeformed block is preserved exactly.
    """

    def __init__(self, rubber: HyperelasticBody) -> None:
        """Tables for all cells that this rank owns."""
        name = compat.cell_name(rubber.mesh)
        topology = rubber.mesh.topology
        points, weights = compat.quadrature(name, WHOLE_DEGREE[name])
        owned = np.arange(topology.index_map(topology.dim).size_local)
        self._points = CellPoints(rubber, owned, points)
        volume = self._points.stretch * weights  # (c, q)
        vertex = self._points.vertex_shape
        mass = np.einsum("cq,qk,ql->ckl", volume, vertex, vertex)
        self._nearest = np.linalg.solve(mass, np.einsum("cq,qk->ckq", volume, vertex))
        self.weights = volume @ vertex  # (c, k), m3 (m2 in a slice)

    def at_vertices(self, u: Array, fallen: Array | None = None) -> Array:
        """Values of each cell at its vertices (c, k, 7), for `u` (blocked dofs, d).

        fallen: as in `CellPoints.stress_and_energy`.
        """
        return np.asarray(self._nearest @ self._points.stress_and_energy(u, fallen))


def _from_rule(rubber: HyperelasticBody, points: Array) -> Array:
    """Matrix (q, r) from values at a cell's r quadrature points to other points.

    It is a least-squares fit by the displacement's polynomials, or by lower ones where the rule has
    fewer points.
    """
    name = compat.cell_name(rubber.mesh)
    rule = compat.quadrature(name, WHOLE_DEGREE[name])[0]
    if np.array_equal(points, rule):
        return np.eye(len(rule))
    degrees = range(space_degree(rubber.space), 0, -1)
    elements = (compat.basix_lagrange(name, degree) for degree in degrees)
    element = next(one for one in elements if one.dim <= len(rule))
    here, there = (np.array(element.tabulate(0, x))[0, ..., 0] for x in (points, rule))
    return np.asarray(here @ np.linalg.pinv(there))


def from_vertices(rubber: HyperelasticBody) -> Array:
    """Values of the vertices' shape functions at the nodes of a cell, (a, k)."""
    name = compat.cell_name(rubber.mesh)
    nodes: Any = compat.basix_lagrange(name, space_degree(rubber.space)).points
    return np.array(compat.basix_lagrange(name, 1).tabulate(0, np.asarray(nodes)))[0, ..., 0]
