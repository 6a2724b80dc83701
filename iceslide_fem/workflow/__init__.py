"""Many runs: what a scene will cost, the ladder of models, sweeps, and the page about a folder.

Imports `simulate`, `preprocess`, `postprocess` and what is below them.
"""
