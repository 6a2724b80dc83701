"""DOLFINx versions, the factors of PETSc and MUMPS, and compiled forms.

The rest of the package imports DOLFINx from `fenics.compat`. Imports `runtime` only.
"""
