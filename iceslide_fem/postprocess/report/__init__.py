"""Pages that say what was computed: of a run, of several, of a ladder, of an unfinished run.

One file of HTML each, with everything in it; those of a footprint and of a sweep are made with
their commands. Imports `results`, `runs` and what is below them; no DOLFINx, and no library that
draws: the page itself does that, by plotly.js.
"""
