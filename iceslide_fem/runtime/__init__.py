"""Basis of all parts: arrays, curves, units, names of columns, errors, files, tables, ranks, the
terminal.

It has no physics, and imports nothing of the package.
"""
