"""The built-in meshes as files, to look at or to start from."""

from __future__ import annotations

from pathlib import Path

from iceslide_fem.mesh import gmsh_model
from iceslide_fem.mesh.ice import ice_lines, tagged_ice
from iceslide_fem.mesh.ice_body import ice_body
from iceslide_fem.mesh.rubber import tagged_rubber
from iceslide_fem.scene import Scene


def write_mesh(scene: Scene, folder: Path | str) -> list[Path]:
    """Write the scene's rubber and ice meshes as gmsh files to `folder`; returns their paths."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    on_mesh = scene.ice.heat == "mesh"
    ice = ice_body(scene) if on_mesh else tagged_ice(ice_lines(scene), scene.ice.stack)
    meshes = {"rubber": tagged_rubber(scene), "ice": ice}
    paths = []
    for kind, tagged in meshes.items():
        paths.append(folder / f"{scene.name}_{kind}.msh")
        gmsh_model.save(tagged, paths[-1])
    return paths
