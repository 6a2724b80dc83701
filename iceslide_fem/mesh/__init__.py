"""From a scene to tagged meshes of rubber and ice, distributed over the ranks.

The built-in `box` or a `user_mesh` for the `rubber`; a patch or a window of `ice`.

Imports `scene`, `fenics` and what is below them.
"""
