"""Rough surfaces: height maps of files, their Fourier series, statistics and power spectra, and
rubber on them.

Imports `relaxation` and `runtime`.
"""
