"""From a scene to tagged meshes of rubber and ice, distributed over the ranks.

Imports `scene`, `fenics` and what is below them.
"""
