"""Pages that say what was computed: of a run, of several, of a sweep, a ladder, a footprint.

One file of HTML each, with everything in it. Imports `results`, `planning`, `footprint` and what is
below them; no DOLFINx, and no library that draws: the page itself does that, by plotly.js.
"""
