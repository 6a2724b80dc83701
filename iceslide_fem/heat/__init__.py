"""The heat equation on gmsh meshes in DOLFINx: ice, the layers below it, and the rubber.

Imports `fenics`, `mesh`, `film` and what is below them; `interface` puts films on it.
"""
