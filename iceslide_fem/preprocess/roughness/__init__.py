"""From a height map of the rubber to its contact parameters over pressure, without FEniCSx.

Surface (read or generated) -> contact with smooth rigid ice -> k, D, H_V -> table and pictures;
`iceslide roughness` on the command line. Imports `scene` and `runtime` only.
"""
