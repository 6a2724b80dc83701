"""The rubber's element: Mooney-Rivlin energy, and its quadrature in a cell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, ufl
from iceslide_fem.mesh.gmsh_model import DistributedMesh
from iceslide_fem.mesh.profile import CONTACT_HEIGHT
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.scene.materials import MooneyRivlin

# The displacement is quadratic. Cells that may touch something, and cells in the lower half of the
# block, integrate the whole energy at 3 x 3 x 3 points. This prevents crushed corners. The other
# cells integrate the volumetric part at 2 x 2 x 2 points, tetrahedra at one, because cells at the
# plate lock with more (see docs/explanation/rubber.md).
# Strain is linear in triangles and tetrahedra, so fewer points suffice there.
DEGREE = 2
WHOLE_DEGREE = {"triangle": 2, "quadrilateral": 5, "tetrahedron": 2, "hexahedron": 5}
VOLUME_DEGREE = {"quadrilateral": 3, "tetrahedron": 1, "hexahedron": 3}
WHOLE, SPLIT = 1, 2  # subdomains of the measure: full and selective integration
# Rows and columns of the six components of a symmetric tensor, in VTK's order. In a slice the axes
# are x, z and the normal of the plane.
SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
ROUNDING = 1e-6  # of the height: assigns a layer at half height to the lower half
# The elastic energy (J; J/m in a slice) as a UFL functional of a displacement, a material, and the
# measure with its subdomains WHOLE and SPLIT.
Energy = Callable[[Any, MooneyRivlin, Any], Any]


def energy_density(grad_u: Any, material: MooneyRivlin) -> Any:
    """W = C10 (I1bar - 3) + C01 (I2bar - 3) + (J - 1)^2 / D1 (J/m3) as a UFL expression.

    In a slice the strain is plane: `grad_u` (2, 2) gets an undeformed third direction.
    """
    return isochoric_energy(grad_u, material) + volumetric_energy(grad_u, material)


def isochoric_energy(grad_u: Any, material: MooneyRivlin) -> Any:
    """The part C10 (I1bar - 3) + C01 (I2bar - 3) of `energy_density`.

    I1 = |F|^2 and I2 = |cof F|^2. All powers of J share one logarithm and one exponential, so the
    residual takes two thirds to four fifths of the time of the usual formulas.
    """
    dim = grad_u.ufl_shape[0]
    F = ufl.Identity(dim) + grad_u
    J = ufl.det(F)
    size = ufl.inner(F, F)
    if dim == 2:
        I1, I2 = size + 1.0, size + J**2
    else:
        I1, I2 = size, ufl.inner(ufl.cofac(F), ufl.cofac(F))
    scale = ufl.exp(-2.0 / 3.0 * ufl.ln(J))
    return material.C10 * (scale * I1 - 3.0) + material.C01 * (scale**2 * I2 - 3.0)


def volumetric_energy(grad_u: Any, material: MooneyRivlin) -> Any:
    """The part (J - 1)^2 / D1 of `energy_density`."""
    J = ufl.det(ufl.Identity(grad_u.ufl_shape[0]) + grad_u)
    return (J - 1.0) ** 2 / material.D1


def stored_energy(u: Any, material: MooneyRivlin, dx: Any) -> Any:
    """Elastic energy (J; J/m in a slice) of the displacement `u` as a UFL functional."""
    F = ufl.grad(u)
    return integrated(isochoric_energy(F, material), volumetric_energy(F, material), dx)


def integrated(isochoric: Any, volumetric: Any, dx: Any) -> Any:
    """Integral of both parts of an energy density (J/m3), each with its quadrature."""
    cell = compat.measured_cell(dx)
    degrees = WHOLE_DEGREE[cell], VOLUME_DEGREE.get(cell, WHOLE_DEGREE[cell])
    whole, volume = ({"quadrature_degree": one} for one in degrees)
    together = (isochoric + volumetric) * dx(WHOLE, metadata=whole)
    apart = isochoric * dx(SPLIT, metadata=whole)
    return together + apart + volumetric * dx(SPLIT, metadata=volume)


def tensors(six: Array) -> Array:
    """Symmetric tensors (..., 3, 3) of their six components (..., 6), in the order of `SIX`."""
    full = np.empty((*six.shape[:-1], 3, 3))
    for number, (i, j) in enumerate(SIX):
        full[..., i, j] = full[..., j, i] = six[..., number]
    return full


def kinds_of_cells(block: DistributedMesh) -> NDArray[np.int32]:
    """WHOLE or SPLIT of every cell that this rank owns, (n,). Collective.

    WHOLE cells are those with a facet that may touch ice or another wall, those in the lower half
    of the block, and all triangles.
    """
    mesh, tags = block.mesh, block.facet_tags
    z = compat.cell_midpoints(mesh)[:, mesh.geometry.dim - 1]
    top = mesh.geometry.x[:, mesh.geometry.dim - 1].max(initial=0.0)
    split = z > (CONTACT_HEIGHT + ROUNDING) * mesh.comm.allreduce(float(top), op=MPI.MAX)
    split &= compat.cell_name(mesh) in VOLUME_DEGREE
    meeting = [block.tags[name] for name in ("contact", "walls") if name in block.tags]
    facets = tags.indices[np.isin(tags.values, meeting)]
    split[compat.facet_cell_pairs(mesh, facets)[0]] = False
    return np.where(split, SPLIT, WHOLE).astype(np.int32)
