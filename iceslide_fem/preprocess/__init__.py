"""What is made before a simulation: pressures of a footprint, contact tables of a rough rubber.

Imports `film`, `scene` and `postprocess` (its pages and colours); no DOLFINx, no gmsh.
"""
