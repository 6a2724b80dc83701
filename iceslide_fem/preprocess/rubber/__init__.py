"""From dynamic mechanical analysis, or a scene, to viscoelastic rubber: arms, shifts, pictures.

`iceslide rubber` on the command line; the fit itself is in `relaxation`. Imports
`postprocess.report`, `scene`, `relaxation` and `runtime` only.
"""
