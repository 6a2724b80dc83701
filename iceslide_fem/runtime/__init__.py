"""Basis of all parts: arrays, units, errors, files, tables, ranks, the terminal.

It has no physics, and imports nothing of the package.
"""
