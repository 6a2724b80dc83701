"""Work with many runs: cost estimates, the model hierarchy (ladder), sweeps, and report pages.

Imports `simulate`, `preprocess`, `postprocess` and what is below them.
"""
