"""Compile the forms of scenes, and mesh them, before their cases start.

Otherwise the first cases would wait for each other to compile the same forms. It is a separate
program (`python -m iceslide_fem.workflow.sweep.compile_forms SCENE.toml ...`), because the sweep
must not start MPI: its child processes could not use MPI then.
"""

from __future__ import annotations

import sys

from iceslide_fem.scene import Scene, load_scene
from iceslide_fem.workflow.sweep.processes import forms_of


def compile_forms(scene: Scene) -> None:
    """Build block and interface of `scene` once and discard them."""
    from iceslide_fem.fenics.compat import MPI
    from iceslide_fem.interface.build import film_frame_of
    from iceslide_fem.rubber.build import build_block

    block = build_block(scene, MPI.COMM_WORLD)
    block.rubber.displacements[:, -1] -= 1e-6 * block.height  # meshing of the ice needs contact
    film_frame_of(block)


if __name__ == "__main__":
    kinds = {forms_of(scene): scene for scene in map(load_scene, sys.argv[1:])}
    for kind in kinds.values():
        compile_forms(kind)
