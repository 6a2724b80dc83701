"""A wheel for vehicle programs: tyre property files and functional mock-up units.

Imports `preprocess` and what is below; never FEniCS.
"""
