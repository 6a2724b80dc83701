"""Linear viscoelasticity of rubber: Prony series, creep, and the shift of times with temperature.

`dma`, `master_curve`, `prony_fit` and `dma_fit` determine them from a DMA table.

Imports only `runtime`.
"""
