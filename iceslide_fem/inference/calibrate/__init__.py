"""Parameters of a scene from measured friction, their intervals, and what is not determined.

`measured` reads the data, `problem` is the residual, `fit` solves it and finds intervals,
`command` writes and says all of it. Imports `runs` and what is below, and `preprocess.work`.
"""
