"""Meshes with values, one part per rank, for pyvista and ParaView.

In a slice all points are (x, z, 0). The third component of vectors and tensors is out of the plane.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import cell_dofs, cell_name
from iceslide_fem.heat.elements import LayeredElements
from iceslide_fem.mechanics.contact_surface import FACET_OF, ContactSurface
from iceslide_fem.mechanics.hyperelasticity import HyperelasticBody
from iceslide_fem.mechanics.stress import StressRecovery, from_vertices, von_mises
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.columns import TEMPERATURE

Cells = NDArray[np.int64]

# By kind and number of nodes of a cell: meshio's name, and VTK's node order.
_VTK_CELLS = {
    ("interval", 2): ("line", [0, 1]),
    ("triangle", 3): ("triangle", [0, 1, 2]),
    ("triangle", 6): ("triangle6", [0, 1, 2, 5, 3, 4]),
    ("quadrilateral", 4): ("quad", [0, 1, 3, 2]),
    ("quadrilateral", 9): ("quad9", [0, 1, 3, 2, 4, 6, 7, 5, 8]),
    ("tetrahedron", 4): ("tetra", [0, 1, 2, 3]),
    ("tetrahedron", 10): ("tetra10", [0, 1, 2, 3, 9, 6, 8, 7, 5, 4]),
    ("hexahedron", 8): ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6]),
    ("hexahedron", 27): (
        "hexahedron27",
        [0, 1, 3, 2, 4, 5, 7, 6, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 15, 14]
        + [22, 23, 21, 24, 20, 25, 26],
    ),
}  # fmt: skip
_CORNERS = {"interval": 2, "triangle": 3, "quadrilateral": 4}
# Cell type of a facet extruded downwards.
_STACKED = {"line": "quad", "triangle": "wedge", "quad": "hexahedron"}


class Grid(NamedTuple):
    """Points (n, 3), m; cells of one kind (meshio's name); values by name."""

    points: Array
    kind: str
    cells: Cells
    point_data: dict[str, Array]
    cell_data: dict[str, Array]


class RubberGrid:
    """This rank's cells of the undeformed block, with nodal values."""

    def __init__(self, rubber: HyperelasticBody) -> None:
        self._rubber = rubber
        space, topology = rubber.space, rubber.mesh.topology
        self._dofs = cell_dofs(space)[: topology.index_map(topology.dim).size_local]
        self._kind, order = _VTK_CELLS[(cell_name(rubber.mesh), self._dofs.shape[1])]
        self._used, numbers = np.unique(self._dofs, return_inverse=True)
        self._cells = numbers.reshape(self._dofs.shape)[:, order].astype(np.int64)
        self._points = _in_space(space.tabulate_dof_coordinates()[self._used, : _dim(rubber)])
        self._layers = rubber.materials.regions[: len(self._dofs)].astype(float)
        self._recovery, self._between = StressRecovery(rubber), from_vertices(rubber)

    def grid(
        self,
        u: Array,
        velocity: Array | None,
        stress: bool,
        more: Mapping[str, Array] | None = None,
        fallen: Array | None = None,
    ) -> Grid | None:
        """The grid with displacements `u`, velocities, stresses, and `more` nodal values.
        Collective.

        u, velocities: (blocked dofs, d); fallen: reduction of stress and energy by relaxation. None
        on a rank without cells.
        """
        data = {"displacement": _in_space(u), **(more or {})}
        if velocity is not None:
            data["velocity (m/s)"] = _in_space(velocity)
        if stress:
            at_nodes = self._at_nodes(self._recovery.at_vertices(u, fallen))
            six, energy = np.split(at_nodes, [6], axis=-1)
            data |= {
                "Cauchy stress (Pa)": six,
                "von Mises stress (Pa)": von_mises(six),
                "hydrostatic stress (Pa)": six[:, :3].mean(axis=-1),
                "strain energy density (J/m^3)": energy[:, 0],
            }
        if not len(self._cells):
            return None
        values = {name: value[self._used] for name, value in data.items()}
        layers = {"layer": self._layers} if self._rubber.materials.several else {}
        return Grid(self._points, self._kind, self._cells, values, layers)

    def _at_nodes(self, at_vertices: Array) -> Array:
        """Nodal values (n, 7) from values of cells at their vertices (c, k, 7). Collective.

        A vertex has the weighted mean over the cells of all ranks. Other nodes are interpolated.
        """
        weights, count = self._recovery.weights[..., None], at_vertices.shape[-1]
        vertices = self._dofs[:, : weights.shape[1]]
        sums = np.zeros((self._rubber.displacements.shape[0], count + 1))
        np.add.at(sums, vertices, np.concatenate([weights * at_vertices, weights], axis=-1))
        sums = self._over_ranks(sums)
        means = sums[vertices, :count] / sums[vertices, count:]
        at_nodes = np.zeros((len(sums), count))
        at_nodes[self._dofs] = self._between @ means
        return at_nodes

    def _over_ranks(self, values: Array) -> Array:
        """Sums (n, m) over ranks at shared nodes. Collective."""
        vector, dim = self._rubber.create_vector(), _dim(self._rubber)
        sums = np.pad(values, ((0, 0), (0, -values.shape[1] % dim)))
        for first in range(0, sums.shape[1], dim):
            some = slice(first, first + dim)
            with vector.localForm() as local:
                local.array[:] = sums[:, some].ravel()
            compat.sum_ghosts(vector)
            compat.update_ghosts(vector)
            with vector.localForm() as local:
                sums[:, some] = local.array.reshape(-1, dim)
        vector.destroy()
        return sums[:, : values.shape[1]]


def mesh_grid(elements: LayeredElements, values: Mapping[str, Array], along: float) -> Grid | None:
    """This rank's cells of a layered mesh, shifted `along` x (m); None without cells.

    values: at all local dofs of the space. Each cell is split into halves, in which values are
    nearly linear downwards.
    """
    if not len(elements.halves):
        return None
    used, numbers = np.unique(elements.halves, return_inverse=True)
    x = elements.space.tabulate_dof_coordinates()[used]
    dim = elements.space.mesh.geometry.dim
    points = _in_space(x[:, :dim])
    points[:, 0] += along
    kind = {2: "quad", 3: "hexahedron"}[dim]
    here = {name: np.real(value[used]) for name, value in values.items()}
    return Grid(points, kind, numbers.astype(np.int64).reshape(-1, 2**dim), here, {})


class FacetGrid:
    """This rank's deformed contact facets, with means of values at their points."""

    def __init__(self, rubber: HyperelasticBody, surface: ContactSurface) -> None:
        self._surface, self._flat = surface, _dim(rubber) == 2
        facet = FACET_OF[cell_name(rubber.mesh)]
        self._kind, order = _VTK_CELLS[(facet, _CORNERS[facet])]
        # A facet's nodes begin with its corners, in every Lagrange element.
        self._corner_nodes = surface.nodes[surface.firsts][:, order]
        self._corner_dofs = surface.dofs[surface.firsts][:, order]
        _, self._first, point = np.unique(
            self._corner_dofs, return_index=True, return_inverse=True
        )  # shared corners are shared points
        self._cells = point.reshape(self._corner_dofs.shape).astype(np.int64)

    def grid(
        self, u: Array, values: Mapping[str, Array], force: Array | None = None
    ) -> Grid | None:
        """Facets displaced by `u` (blocked dofs, d), with means of `values` (f, q).

        Points with NaN are excluded. force: of the ice on each facet or part, (f, d), N. The
        traction is force per drawn area of the facet, so its integral is the force. None on a rank
        without facets.
        """
        if not len(self._cells):
            return None
        corners = self._corners(u)
        data = dict(zip(values, self._means(list(values.values())).T, strict=True))
        if force is not None:
            area = _areas(corners)
            forces = self._of_facets(_in_space(force))
            data["traction (Pa)"] = forces / np.where(area > 0.0, area, np.inf)[:, None]
        return Grid(corners.reshape(-1, 3)[self._first], self._kind, self._cells, {}, data)

    def below(
        self, u: Array, touching: NDArray[np.bool_], depths: Array, profiles: Array
    ) -> Grid | None:
        """Columns below touching facets with `profiles` (f, n_depths); None without such facets.

        Neighbouring columns share no points, because each has its own values.
        """
        if not touching.any():
            return None
        corners, values = self._corners(u)[touching], profiles[touching]
        vertical = 1 if self._flat else 2
        corners[..., vertical] = 0.0
        points = np.repeat(corners[:, None], depths.size, axis=1)  # (f, n_depths, k, 3)
        points[..., vertical] = -depths[None, :, None]
        f, n, k = points.shape[:3]
        number = np.arange(f * n * k).reshape(f, n, k)
        upper, lower = number[:, :-1].reshape(-1, k), number[:, 1:].reshape(-1, k)
        cells = np.hstack([lower, upper[:, ::-1] if k == 2 else upper])
        data = {TEMPERATURE.name: np.repeat(values.reshape(-1), k)}
        return Grid(points.reshape(-1, 3), _STACKED[self._kind], cells, data, {})

    def means(self, values: Array) -> Array:
        """Means (f, ...) of values (f, q, ...) at all points."""
        weights = abs(self._surface.weights)
        return np.asarray(
            np.einsum("fq,fq...->f...", weights, values)
            / weights.sum(axis=1).reshape(-1, *[1] * (values.ndim - 2))
        )

    def _of_facets(self, amounts: Array) -> Array:
        """Sums (facets, k) of amounts (f, k) over the parts of each facet."""
        firsts = self._surface.firsts
        return amounts if firsts.size == len(amounts) else np.add.reduceat(amounts, firsts)

    def _corners(self, u: Array) -> Array:
        return _in_space(self._corner_nodes + u[self._corner_dofs])

    def _means(self, values: Sequence[Array]) -> Array:
        """Means (facets, k) of k `values` (f, q) over points without NaN."""
        weights = abs(self._surface.weights)
        at = np.array(values).reshape(len(values), *weights.shape)
        known = ~np.isnan(at)
        total = self._of_facets((known * weights).sum(axis=2).T)
        amount = self._of_facets(np.where(known, at * weights, 0.0).sum(axis=2).T)
        return np.where(total > 0.0, amount / np.where(total > 0.0, total, 1.0), np.nan)


def point_grid(positions: Array, values: Mapping[str, Array]) -> Grid | None:
    """This rank's contact points at positions (f, q, d), m, with `values` (f, q)."""
    points = _in_space(positions.reshape(-1, positions.shape[-1]))
    if not len(points):
        return None
    data = {name: value.ravel() for name, value in values.items()}
    return Grid(points, "vertex", np.arange(len(points))[:, None], data, {})


def tensor_grid(lines: Sequence[Array], values: Mapping[str, Array]) -> Grid:
    """Values on all nodes of a grid with lines of x, (y,) (z), m, in C order."""
    shape = [line.size for line in lines]
    coordinates = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    points = np.zeros((len(coordinates), 3))
    points[:, : len(lines)] = coordinates
    number = np.arange(len(points)).reshape(shape)
    low, high = slice(None, -1), slice(1, None)
    if len(lines) == 1:
        kind, corners = "line", [number[low], number[high]]
    else:
        around = [(low, low), (high, low), (high, high), (low, high)]
        kind, corners = "quad", [number[sides] for sides in around]
    if len(lines) == 3:
        kind, layers = "hexahedron", (low, high)
        corners = [number[(*sides, layer)] for layer in layers for sides in around]
    cells = np.stack([corner.ravel() for corner in corners], axis=1)
    data = {name: np.asarray(value).ravel() for name, value in values.items()}
    return Grid(points, kind, cells, data, {})


def _areas(corners: Array) -> Array:
    """Areas (m2; lengths, m) of facets by their corners in order around them (f, k, 3)."""
    if corners.shape[1] == 2:
        return np.asarray(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=-1))
    fans = [
        np.cross(corners[:, i] - corners[:, 0], corners[:, i + 1] - corners[:, 0])
        for i in range(1, corners.shape[1] - 1)
    ]
    return np.asarray(0.5 * sum(np.linalg.norm(fan, axis=-1) for fan in fans))


def _in_space(vectors: Array) -> Array:
    """Vectors (..., d) with three components."""
    missing = 3 - vectors.shape[-1]
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, missing)])


def _dim(rubber: HyperelasticBody) -> int:
    return int(rubber.mesh.geometry.dim)
