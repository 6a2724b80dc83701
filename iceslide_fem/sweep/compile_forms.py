"""Compile a scene's forms, and mesh it, before several processes want them at the same time.

FFCx's cache lets one process compile and the others wait ten seconds, which a 3-D tangent takes
longer than. A program of its own (`python -m iceslide_fem.sweep.compile_forms SCENE.toml ...`),
because the sweep itself must not start MPI: what it starts could not use it then.
"""

from __future__ import annotations

import sys

from iceslide_fem.scene import Scene, load_scene


def forms_of(scene: Scene) -> tuple[object, ...]:
    """What the forms of a scene depend on: scenes with the same need to be compiled once.

    Material constants, loads and sizes are data of the forms, not part of their code.
    """
    return scene.model, scene.ice.heat, scene.ice.motion, scene.rubber.heat, scene.rubber.mesh


def compile_forms(scene: Scene) -> None:
    """Build block and interface of `scene` once and forget them."""
    from iceslide_fem._dolfinx import MPI
    from iceslide_fem.block import build_block
    from iceslide_fem.interface import carrier_of

    block = build_block(scene, MPI.COMM_WORLD)
    block.rubber.displacements[:, -1] -= 1e-6 * block.height  # the ice is meshed below a contact
    carrier_of(block)


if __name__ == "__main__":
    kinds = {forms_of(scene): scene for scene in map(load_scene, sys.argv[1:])}
    for kind in kinds.values():
        compile_forms(kind)
