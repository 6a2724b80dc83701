"""A wheel on ice: friction over slip, by a brush that slides on films, and how far it brakes.

Imports what stands below `preprocess`, and `preprocess.footprint`; never FEniCS.
"""
