"""Friction laws of one's own: the protocol, what reads and checks a law, Coulomb's friction.

`protocol` is the specification. Everything here knows arrays, and nothing of meshes, ranks or
films. Imports `materials` and what is below it only.
"""
