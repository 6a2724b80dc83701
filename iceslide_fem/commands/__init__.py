"""The commands of `iceslide`: options and printed output, one module each.

Those of `footprint`, `wheel`, `roughness` and `rubber` are made from their models (`preprocessors`,
`from_model`). Heavy imports are local, so `iceslide --help` is fast. Imports everything but `cli`.
"""
