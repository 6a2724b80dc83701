"""Rows of `passes.csv`, and rows of a history that has several passes."""

from __future__ import annotations

from typing import NamedTuple

from iceslide_fem.output.table import HistoryRow, row_type

PASS = "pass_"  # field name of the column `pass`


class PassRow(NamedTuple):
    """A row of `passes.csv`: one pass of the rubber over the same ice (docs/reference/columns.md).

    surface_start_C, surface_end_C: surface temperature of the ice at start and end; base_C: at the
    lower end of the ice, at the end, NaN for a half-space; melt_onset_s: from the start of the
    pass, NaN without melting; film and squeezed height: at the end.
    """

    pass_: int
    start_s: float
    mu_mean: float
    mu_peak: float
    mu_end: float
    melt_onset_s: float
    surface_start_C: float
    surface_end_C: float
    base_C: float
    film_height_m: float
    squeezed_height_m: float
    friction_work_J: float
    steps: int
    rejected_steps: int


def of_pass(row: HistoryRow, number: int, start: float) -> HistoryRow:
    """The row with the column `pass`; its time counts from the `start` (s) of that pass."""
    reported = row._fields[len(HistoryRow._fields) :]
    kind = row_type((*reported, PASS))
    time, *others = row  # the time is the first column
    return kind._make((start + time, *others, number))
