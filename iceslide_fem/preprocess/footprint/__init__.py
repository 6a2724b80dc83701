"""From the picture of a tyre's footprint to pressure, temperature, water film and friction.

The macroscopic models of chapters 3 and 4 of R. Leonardi's thesis, next to them a heat source
that moves and the project's film law at every pixel. No part of it needs FEniCS or gmsh.
Imports `film`, `scene`, `postprocess` (its colours and pages) and what is below them.

Maps are arrays (ny, nx): x is the direction of travel, towards which the tyre moves, so ice
enters at the right and leaves at the left; y is up.
"""
