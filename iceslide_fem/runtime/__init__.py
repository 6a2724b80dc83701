"""What every part stands on: arrays, units, errors, files, tables, ranks, the terminal.

Knows nothing of rubber or ice, and imports nothing of the package.
"""
