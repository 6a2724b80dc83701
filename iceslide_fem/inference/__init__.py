"""From measured friction to parameters, and from uncertain inputs to the uncertainty of mu.

`iceslide calibrate` fits numbers of a scene to a table of measured mu; `iceslide uncertainty` says
what the doubt in inputs means for mu. Imports `runs`, `workflow`, `preprocess.work` and what is
below them.
"""
