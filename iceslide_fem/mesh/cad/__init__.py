"""Treads of CAD files: solids, sections and sweeps, meshed and named by geometry.

OpenCASCADE may crash on a bad file, so `tread` runs `worker` in a process of its own.
"""
