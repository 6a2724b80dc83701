"""What uncertain inputs mean for mu: its spread, and which input it comes from.

`distribution` reads how an input is spread, `sampling` draws joint samples, `propagate` computes
points, and slices and blocks by a control variate, `command` writes and says it. Imports `runs`,
`workflow.sweep` and what is below, and `preprocess.work`.
"""
