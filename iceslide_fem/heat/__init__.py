"""The heat equation on gmsh's meshes, in DOLFINx: ice and what lies below it, and the rubber.

Imports `fenics`, `mesh`, `film` and what is below them; `interface` puts films on it.
"""
