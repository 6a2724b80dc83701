"""The commands of `iceslide`: their options, and what they print; one module each.

Those of one folder alone (`roughness`, `rubber`, `app`) stand in it as its `options`. Everything
heavy is imported where it is used, so that `iceslide --help` is quick. Imports everything but
`cli`.
"""
