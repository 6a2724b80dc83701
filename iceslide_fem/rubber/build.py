"""Construction of a scene's block: mesh, forms, contact and equilibrium solver."""

from __future__ import annotations

from iceslide_fem.fenics import compat
from iceslide_fem.fenics.compat import MPI, PETSc, fem, ufl
from iceslide_fem.laws.table import law_of
from iceslide_fem.mesh.rubber import nominal_area, rubber_mesh
from iceslide_fem.mesh.size import check_memory
from iceslide_fem.rubber.block import Block
from iceslide_fem.rubber.contact import default_penalty
from iceslide_fem.rubber.contact_points import contact_points
from iceslide_fem.rubber.element import Energy, stored_energy
from iceslide_fem.rubber.equilibrium import Equilibrium
from iceslide_fem.rubber.hyperelasticity import HyperelasticBody
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.ranks import from_root
from iceslide_fem.scene import Scene
from iceslide_fem.scene.contradictions import too_soft

# Penalty of self-contact over that of the ice contact. Lugs are soft: with stiffer walls the
# iteration would open and close them alternately.
WALLS = 0.1


def build_block(scene: Scene, comm: MPI.Comm, energy: Energy = stored_energy) -> Block:
    """Mesh the scene's block and prepare its forms. Collective.

    energy: another element than the default. Raises SceneError if the user's mesh or the penalty is
    unsuitable, or if the memory does not suffice.
    """
    law = law_of(scene)
    from_root(lambda: check_memory(scene), comm)
    mesh = rubber_mesh(scene, comm)
    z = mesh.mesh.geometry.x[:, mesh.mesh.geometry.dim - 1]
    height = float(comm.allreduce(z.max(initial=0.0), op=MPI.MAX))
    fault = too_soft(scene, height)  # a user's mesh has its height only now
    if fault is not None:
        raise SceneError(fault)
    material = scene.mooney_rivlin
    density = scene.rubber.density if scene.rubber.inertia else 0.0
    relaxation = scene.rubber.relaxation
    rubber = HyperelasticBody(mesh, material, 2, energy, density, relaxation)
    numerics = scene.numerics
    penalty = numerics.penalty or default_penalty(material, height, numerics.tolerance)
    rubber.enable_self_contact(WALLS * penalty, scene.rubber.wall_friction)
    rubber.enable_plate_contact(height, penalty)
    surface = contact_points(scene, rubber, height)
    ds = ufl.Measure("ds", domain=mesh.mesh, subdomain_data=mesh.facet_tags)
    plate = fem.Constant(mesh.mesh, PETSc.ScalarType(1.0)) * ds(mesh.tags["plate"])
    area = nominal_area(scene) or compat.assemble_scalar(compat.form(plate), comm)
    if scene.model == "slice":
        scale = scene.rubber.width
    else:
        scale = 2.0 if "symmetry" in mesh.tags else 1.0
    pressure = scene.load.pressures.first
    return Block(
        scene,
        rubber,
        surface,
        Equilibrium(rubber, surface, penalty),
        law,
        area,
        pressure * area,
        scale,
        height,
    )
