"""Which of some compounds, patterns or tyres is better, under which conditions, and how sure.

`candidates` reads them, `values` computes them, `inputs` has what uncertain inputs mean, `ratios`
what that says, and `command` writes and says it. Imports `runs`, `workflow.sweep`, `preprocess` and
what is below.
"""
