"""One step of block and film, committed whole or not at all; its energies and its error.

Imports `interface`, `rubber`, `mesh`, `film`, `fenics`, `scene` and what is below them.
"""
