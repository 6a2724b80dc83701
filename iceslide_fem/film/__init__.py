"""The interface at a point: film, melting, heat in ice and rubber columns; no mesh, no MPI.

Laws are pure functions of arrays, one entry per contact point. Imports `errors`,
`materials` and `thermal_layers`, and `scene` where it reads one; never FEniCS, PETSc or gmsh.
"""
