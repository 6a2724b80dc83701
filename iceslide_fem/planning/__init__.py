"""What a scene needs and costs before it runs: dimensionless numbers, rungs, seconds.

Imports `scene`, `film`, `mesh` and the point of `run`.
"""
