"""The whole program in this process, and the tables that it writes."""

import csv
from functools import partial

import pytest

from iceslide_fem import simulate
from iceslide_fem.cli import main

run = partial(simulate.run, pictures=False)


def exit_code(*words):
    """The program's exit code for these words of a command line."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


def rows_of(path):
    """Rows of a CSV file as dictionaries."""
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers_of(path):
    """The same of a table of numbers."""
    return [{name: float(cell) for name, cell in row.items()} for row in rows_of(path)]
