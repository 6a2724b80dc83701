"""Planning of a run: dimensionless numbers, estimates and cost before it starts.

Imports `scene`, `film`, `laws`, `mesh`, the point of `runs`, and the table of `output`.
"""
