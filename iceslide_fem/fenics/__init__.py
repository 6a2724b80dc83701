"""All that touches DOLFINx versions, PETSc's factors and compiled forms.

The rest of the package takes DOLFINx from `fenics.compat`. Imports `errors` and `files` only.
"""
