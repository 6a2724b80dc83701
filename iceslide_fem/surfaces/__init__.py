"""Rough surfaces: height maps of files, their Fourier series, statistics and power spectra.

Imports only `runtime`.
"""
