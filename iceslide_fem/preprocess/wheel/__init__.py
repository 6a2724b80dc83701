"""A wheel on ice: friction over slip by a brush model on films, and stopping distances.

Imports what is below `preprocess`, and `preprocess.footprint`; never FEniCS.
"""
