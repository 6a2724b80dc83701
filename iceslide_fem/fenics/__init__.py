"""All that touches DOLFINx versions, PETSc's and MUMPS's factors, compiled forms and compiled C.

The rest of the package takes DOLFINx from `fenics.compat`. Imports `errors`, `files` and
`parallel`.
"""
