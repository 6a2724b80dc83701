"""Modes of heat conduction on a tensor grid of linear elements: what diagonalises the ice.

With the capacity lumped along x and y, capacity and conduction of the grid are sums of Kronecker
products of the matrices of its lines (C lumped, M consistent mass; K stiffness),

    capacity   = rho c   Cx Cy Mz
    conduction = lambda (Kx Cy Mz + Cx Ky Mz + Cx Cy Kz),

so that the modes of each line, K f = m C f along x and y and K f = m M f along z, diagonalise both
at once (Lynch, Rice and Thomas, Numer. Math. 6 (1964) 185): an implicit stage is a product with
a small matrix along each axis, there and back, and one division per mode. Vertical lines keep the
accuracy of the consistent mass, while nodes beside a sudden flux, as ahead of a leading edge, are
not cooled by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from iceslide_fem.arrays import Array


class LineModes(NamedTuple):
    """Modes of a line: vectors (nodes, modes), orthonormal in its mass, and rates (modes,), 1/m2.

    inverse (modes, nodes) takes nodal values to amplitudes.
    """

    vectors: Array
    inverse: Array
    rates: Array


def line_matrices(line: Array) -> tuple[Array, Array]:
    """Mass (m) and stiffness (1/m) of linear elements between the sorted coordinates `line`, m."""
    mass, stiffness = np.zeros((2, line.size, line.size))
    for first, size in enumerate(np.diff(line)):
        nodes = slice(first, first + 2)
        mass[nodes, nodes] += size / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
        stiffness[nodes, nodes] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / size
    return mass, stiffness


def line_modes(line: Array, lumped: bool) -> LineModes:
    """Modes of a line, with its mass `lumped` or consistent."""
    mass, stiffness = line_matrices(line)
    if lumped:
        mass = np.diag(mass.sum(axis=1))
    rates, vectors = eigh(stiffness, mass)
    rates[0] = 0.0  # uniform warmth does not decay: exactly, so that heat is conserved
    return LineModes(vectors, vectors.T @ mass, rates)


class GridModes:
    """Modes of the grid of sorted coordinates `lines` (x, in 3-D y, and z last), m.

    rates: of all modes, of the grid's shape, 1/m2; surface: of the vertical modes at the top.
    """

    def __init__(self, lines: Sequence[Array]) -> None:
        self._lateral = [line_modes(line, lumped=True) for line in lines[:-1]]
        self._all = [*self._lateral, line_modes(lines[-1], lumped=False)]
        self.rates = np.zeros(())
        for modes in self._all:
            self.rates = np.add.outer(self.rates, modes.rates)
        self.surface = self._all[-1].vectors[-1]

    def amplitudes(self, nodal: Array) -> Array:
        """Amplitudes of nodal values, both of the grid's shape."""
        return _along_axes([modes.inverse for modes in self._all], nodal)

    def nodal(self, amplitudes: Array) -> Array:
        """Nodal values of amplitudes, both of the grid's shape."""
        return _along_axes([modes.vectors for modes in self._all], amplitudes)

    def surface_amplitudes(self, nodal: Array) -> Array:
        """Lateral amplitudes of values at the surface's nodes, both of the surface's shape."""
        return _along_axes([modes.inverse for modes in self._lateral], nodal)

    def surface_values(self, amplitudes: Array) -> Array:
        """Values at the surface's nodes of lateral amplitudes."""
        return _along_axes([modes.vectors for modes in self._lateral], amplitudes)

    def load_amplitudes(self, loads: Array) -> Array:
        """What loads (W, say) at the surface's nodes are to each lateral mode."""
        return _along_axes([modes.vectors.T for modes in self._lateral], loads)

    def surface_loads(self, amplitudes: Array) -> Array:
        """Loads at the surface's nodes that are `amplitudes` to the lateral modes."""
        return _along_axes([modes.inverse.T for modes in self._lateral], amplitudes)


def _along_axes(matrices: Sequence[Array], values: Array) -> Array:
    """`values` with each axis multiplied by a matrix of its own."""
    if len(matrices) == 1:
        return np.asarray(matrices[0] @ values)
    if len(matrices) == 2:  # the surface in 3-D, in every iteration of a stage
        return np.asarray(matrices[0] @ values @ matrices[1].T)
    for matrix in matrices:  # takes the first axis, and puts what becomes of it last
        values = np.tensordot(values, matrix, axes=(0, 1))
    return values
