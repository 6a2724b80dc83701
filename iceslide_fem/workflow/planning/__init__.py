"""What a scene needs and costs before it runs: dimensionless numbers, levels, seconds.

Imports `scene`, `film`, `laws`, `mesh`, the point of `runs`, and the table of `output`.
"""
