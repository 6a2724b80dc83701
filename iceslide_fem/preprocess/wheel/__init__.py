"""A wheel on ice: friction over slip from a footprint, by a brush whose bristles slide on films;
and how far it brakes.

Imports what stands below `preprocess`, and `preprocess.footprint`; never FEniCS.
"""
