"""All that touches DOLFINx versions, PETSc's and MUMPS's factors, and compiled forms.

The rest of the package takes DOLFINx from `fenics.compat`. Imports `runtime` only.
"""
