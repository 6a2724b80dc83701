"""Translations and rotations of the rubber: the near null space for algebraic multigrid."""

from __future__ import annotations

import itertools

import numpy as np

from iceslide_fem.fenics.compat import PETSc
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody


def rigid_modes(rubber: HyperelasticBody) -> PETSc.NullSpace:
    """The orthonormal rigid motions of `rubber`: three in a slice, six in a block. Collective."""
    dim, comm = rubber.mesh.geometry.dim, rubber.mesh.comm
    n_owned = rubber.space.dofmap.index_map.size_local
    x = rubber.space.tabulate_dof_coordinates()[:n_owned, :dim]
    motions = [np.eye(dim)[axis] * np.ones_like(x) for axis in range(dim)]
    for one, other in itertools.combinations(range(dim), 2):
        turning = np.zeros_like(x)
        turning[:, one], turning[:, other] = -x[:, other], x[:, one]
        motions.append(turning)
    modes: list[PETSc.Vec] = []
    for motion in motions:
        mode = rubber.create_vector()
        mode.array[:] = motion.ravel()
        for before in modes:
            mode.axpy(-mode.dot(before), before)
        mode.normalize()
        modes.append(mode)
    return PETSc.NullSpace().create(vectors=modes, comm=comm)
