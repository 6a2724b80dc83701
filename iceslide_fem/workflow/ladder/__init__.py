"""The model ladder: one scene on every level, error against cost.

Imports `simulate`, `results`, `planning` and what is below them.
"""
