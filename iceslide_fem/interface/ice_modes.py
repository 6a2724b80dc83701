"""Lateral modes of heat conduction in the ice, which diagonalise conduction along its surface.

With the capacity of linear elements lumped along x and y, capacity and conduction of a grid are
sums of Kronecker products of the matrices of its lines (C lumped, K stiffness) and of those of a
column of ice (M, A),

    capacity   = Cx Cy M
    conduction = alpha (Kx Cy M + Cx Ky M) + Cx Cy A,

The modes of each line, K f = m C f along x and y, and those of the column along z diagonalise both
at once (Lynch, Rice and Thomas, Numer. Math. 6 (1964) 185). An implicit stage is a product with a
small matrix along each axis, one division per mode, and the products back. Lumping prevents the
cooling of nodes beside a sudden flux, such as ahead of a leading edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from iceslide_fem.runtime.arrays import Array


class LineModes(NamedTuple):
    """Modes of a line: vectors (nodes, modes), orthonormal in its lumped mass, and rates (modes,),
    1/m2. inverse (modes, nodes) takes nodal values to amplitudes.
    """

    vectors: Array
    inverse: Array
    rates: Array


def line_modes(line: Array) -> LineModes:
    """Modes of linear elements between the sorted coordinates `line`, m."""
    widths = np.diff(line)
    mass = 0.5 * (np.append(widths, 0.0) + np.insert(widths, 0, 0.0))
    stiffness = np.zeros((line.size, line.size))
    for first, width in enumerate(widths):
        nodes = slice(first, first + 2)
        stiffness[nodes, nodes] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / width
    rates, vectors = eigh(stiffness, np.diag(mass))
    rates[0] = 0.0  # exactly zero: a uniform temperature does not decay, so heat is conserved
    return LineModes(vectors, vectors.T * mass, rates)


class SurfaceModes:
    """Lateral modes of the grid of sorted coordinates `lines` (x, in 3-D y), m.

    lines: the modes of each; rates: of all modes, of the grid's shape, 1/m2. Values and amplitudes
    have that shape, too, or more axes before it.
    """

    def __init__(self, lines: Sequence[Array]) -> None:
        self.lines = [line_modes(line) for line in lines]
        self.rates = np.zeros(())
        for modes in self.lines:
            self.rates = np.add.outer(self.rates, modes.rates)

    def amplitudes(self, values: Array) -> Array:
        """Amplitudes of values at the nodes."""
        return _along_axes([modes.inverse for modes in self.lines], values)

    def values(self, amplitudes: Array) -> Array:
        """Values at the nodes of amplitudes."""
        return _along_axes([modes.vectors for modes in self.lines], amplitudes)

    def load_amplitudes(self, loads: Array) -> Array:
        """Modal loads of nodal loads (W, for example)."""
        return _along_axes([modes.vectors.T for modes in self.lines], loads)

    def loads(self, amplitudes: Array) -> Array:
        """Nodal loads of modal loads."""
        return _along_axes([modes.inverse.T for modes in self.lines], amplitudes)


def _along_axes(matrices: Sequence[Array], values: Array) -> Array:
    """`values` with each of the last axes multiplied by its matrix."""
    last = values @ matrices[-1].T
    return np.asarray(last if len(matrices) == 1 else matrices[0] @ last)


class StageSurface(NamedTuple):
    """The surface in a stage.

    offset: nodal temperatures without heat, K; resistance: of the lateral modes, or of the columns,
    K m2/W. Both have the grid's shape, or are flattened.
    """

    offset: Array
    resistance: Array


class SurfaceConduction:
    """Conduction below the surface in a `stage`; arrays are of all nodes, (n,)."""

    def __init__(
        self,
        stage: StageSurface,
        cell_area: Array,
        shape: tuple[int, ...],
        modes: SurfaceModes | None,
    ) -> None:
        """cell_area: of the nodes, m2; shape: of the grid; modes: None without lateral
        conduction.
        """
        self.stage, self.cell_area, self._modes, self._shape = stage, cell_area, modes, shape
        self.offset = stage.offset.ravel()
        self.resistance = stage.resistance.reshape(shape)
        ends = float(self.resistance.min()), float(self.resistance.max())
        self.middle = float(np.sqrt(ends[0] * ends[1]))  # resistance, K m2/W

    def taken(self, rise: Array) -> Array:
        """Heat (W) that the ice takes at a surface `rise` (K) above the offset."""
        if self._modes is None:
            return self.cell_area / self.resistance.ravel() * rise
        amplitudes = self._modes.amplitudes(rise.reshape(self._shape))
        return self._modes.loads(amplitudes / self.resistance).ravel()

    def warmed(self, heat: Array) -> Array:
        """Rise (K) of the surface above the offset at a `heat` (W) into the ice."""
        if self._modes is None:
            return self.resistance.ravel() / self.cell_area * heat
        amplitudes = self._modes.load_amplitudes(heat.reshape(self._shape))
        return self._modes.values(amplitudes * self.resistance).ravel()
