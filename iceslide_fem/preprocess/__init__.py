"""Preprocessing: pressures of a footprint, contact tables of rough rubber, rubber data, wheels.

Imports `film`, `scene` and `postprocess` (its pages and colours); no DOLFINx, no gmsh.
"""
