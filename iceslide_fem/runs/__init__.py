"""A run from start to end: press, ramp, slide; checkpoints, progress, signals.

Imports `coupling`, `output` and everything below them.
"""
