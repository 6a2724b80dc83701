"""A small generated surface, like that of compound B, as `iceslide roughness` takes it."""

SPEC = """\
rms_height = "5.8 um"
hurst = 0.2
rolloff = "175 um"
shortest_wave = "70 um"
size = "1 mm"
pixels = 64
"""
