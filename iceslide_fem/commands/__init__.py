"""The commands of `iceslide`: options and printed output, one module each.

Commands of one folder only (`roughness`, `rubber`, `app`) are in its module `options`. Heavy
imports are local, so `iceslide --help` is fast. Imports everything but `cli`.
"""
