"""The interface at a point: film, melting, heat in ice and rubber columns; no mesh, no MPI.

Laws are pure functions of arrays, one entry per contact point. Imports `scene` and
`runtime`; never FEniCS, PETSc or gmsh.
"""
