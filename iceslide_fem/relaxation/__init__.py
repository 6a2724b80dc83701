"""Linear viscoelasticity of rubber: Prony series, creep, and the shift of times with temperature.

`dma`, `master_curve`, `prony_fit` and `dma_fit` find all three in a DMA table; `conventions` reads
other programs' series.

Imports only `runtime`.
"""
