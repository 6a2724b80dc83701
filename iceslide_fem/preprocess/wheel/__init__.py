"""A wheel on ice: friction over slip from a footprint, by a brush whose bristles slide on films.

Imports what stands below `preprocess`, and `preprocess.footprint`; never FEniCS.
"""
