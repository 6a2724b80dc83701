"""What uncertain inputs mean for mu: its spread, and which input it comes from.

`sampling` has the joint inputs, `propagate` computes points, and slices, blocks and `tyres` with
points as control variate, `command` writes and says it. Imports `runs`, `workflow.sweep` and what
is below, and `preprocess`.
"""
