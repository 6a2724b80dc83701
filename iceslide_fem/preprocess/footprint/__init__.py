"""From the picture of a tyre's footprint to pressure, temperature, water film and friction.

It has the macroscopic models of chapters 3 and 4 of R. Leonardi's thesis, a model with a moving
heat source, and the project's film law at every pixel. It needs neither FEniCS nor gmsh. Imports
`film`, `scene`, `postprocess` (its colours and pages) and what is below them.

Maps are arrays (ny, nx): x is the direction of travel of the tyre, so ice enters at the right and
leaves at the left; y is up.
"""
