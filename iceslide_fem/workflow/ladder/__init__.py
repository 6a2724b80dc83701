"""The model ladder: one scene on every level, error against cost.

Imports `simulate`, `postprocess` and what is below them.
"""
