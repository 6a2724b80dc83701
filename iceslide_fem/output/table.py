"""Rows of a run's tables, and CSV files that are complete after every row."""

from __future__ import annotations

import contextlib
import csv
import os
from collections import namedtuple
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self, TextIO, cast

import numpy as np

from iceslide_fem.runtime.errors import OutputError, SceneError
from iceslide_fem.runtime.files import writing
from iceslide_fem.scene.load import Load


class HistoryRow(NamedTuple):
    """A row of `history.csv`, the fields its columns: an accepted step, or t = 0
    (docs/reference/columns.md).

    Forces and energies are those of the whole block, heights, temperature and the melted and
    saturated fractions means over the contact; the energies and the water count from t = 0.
    """

    time_s: float
    step_s: float
    slip_m: float
    mu: float
    film_height_m: float
    squeezed_height_m: float
    surface_temperature_C: float
    contact_fraction: float
    nominal_pressure_Pa: float
    speed_m_per_s: float
    normal_force_N: float
    friction_force_N: float
    plate_displacement_m: float
    melted_fraction: float
    saturated_fraction: float
    friction_work_J: float
    load_work_J: float
    ice_heat_J: float
    rubber_heat_J: float
    latent_heat_J: float
    hysteresis_heat_J: float
    wall_heat_J: float
    rubber_dissipation_J: float
    elastic_energy_J: float
    kinetic_energy_J: float
    energy_imbalance: float
    water_squeezed_m3: float
    water_below_m3: float
    water_left_m3: float
    newton_iterations: int


def row_of(
    load: Load, time: float, values: Mapping[str, Any], internal: Mapping[str, float]
) -> HistoryRow:
    """The row at `time` (s) under a `load`, with `values`, 0 for others, and the law's columns."""
    columns: dict[str, Any] = _NOTHING.copy()
    columns["time_s"] = time
    columns["slip_m"] = load.speeds.integral(time)
    columns["nominal_pressure_Pa"] = load.pressures.at(time)
    columns["speed_m_per_s"] = load.speeds.at(time)
    columns.update(values)
    columns.update(internal)
    kind = row_type(tuple(internal))
    return kind._make(columns.values())  # in the order of the fields


_NOTHING = dict.fromkeys(HistoryRow._fields, 0.0)


@cache
def row_type(internal: tuple[str, ...]) -> type[HistoryRow]:
    """`HistoryRow` with additional columns for the law's `internal` variables."""
    if not internal:
        return HistoryRow
    return cast("type[HistoryRow]", namedtuple("HistoryRow", [*HistoryRow._fields, *internal]))  # noqa: PYI024


class PreloadRow(NamedTuple):
    """A row of `preload.csv`: an equilibrium on the path to sliding; phase is press or ramp."""

    phase: str
    load_fraction: float
    speed_fraction: float
    normal_force_N: float
    friction_force_N: float
    plate_displacement_m: float
    contact_fraction: float
    largest_pressure_Pa: float
    newton_iterations: int


def columns_of(row: type[NamedTuple]) -> tuple[str, ...]:
    """Names of a row's columns: its fields, without the underscore after Python keywords."""
    return tuple(name.rstrip("_") for name in row._fields)


class Table:
    """CSV file that is complete after each appended row; on rank 0 only.

    Rows are named tuples of one type; the fields are the columns. Use it as a context manager.
    Other ranks open and write nothing.
    """

    def __init__(
        self, path: Path | str, row: type[NamedTuple], rank: int, keep: int | None = None
    ) -> None:
        """Create (overwrite) the file at `path` with its header; or, with `keep`, continue it.

        keep: number of rows to keep; later rows are removed. Raises OutputError, and SceneError on
        all ranks if the file has other columns or fewer rows.
        """
        columns, self._path = columns_of(row), path
        self._file: TextIO | None = None
        size = 0 if keep is None else size_of_rows(Path(path), columns, keep)
        if rank > 0:
            return
        with writing(path):
            self._file = open(path, "w" if keep is None else "r+", newline="", encoding="utf-8")
            self._file.truncate(size)
            self._file.seek(size)
        if keep is None:
            self._write(columns)

    def row(self, values: tuple[Any, ...]) -> None:
        """Append one row.

        Raises OutputError if it can't be written; the file then ends with the last row.
        """
        if self._file is not None:
            self._write([_text(value) for value in values])

    def secure(self) -> None:
        """Flush all rows to the disk, so they survive a loss of power."""
        if self._file is not None:
            with writing(self._path):
                os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _write(self, cells: Sequence[str]) -> None:
        assert self._file is not None
        complete = self._file.tell()
        try:
            with writing(self._path):
                csv.writer(self._file, lineterminator="\n").writerow(cells)
                self._file.flush()
        except OutputError:
            os.truncate(self._path, complete)
            with contextlib.suppress(OSError):  # closing tries to write the rest again
                self._file.close()
            self._file = None
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def size_of_rows(path: Path, columns: Sequence[str], rows: int) -> int:
    """Bytes of the header and the first `rows` rows of a table.

    Raises SceneError where it has other columns or fewer rows.
    """
    try:
        lines = path.read_bytes().split(b"\n")[:-1]  # a line without an end is incomplete
    except OSError as error:
        raise SceneError(f"cannot read {path}, which goes on: {error.strerror}") from None
    if not lines or lines[0].decode(errors="replace") != ",".join(columns):
        raise SceneError(f"{path} has other columns than this program writes: it can't go on")
    if len(lines) < rows + 1:
        raise SceneError(f"{path} has {len(lines) - 1} rows, and its checkpoint comes after {rows}")
    return sum(len(line) + 1 for line in lines[: rows + 1])


def _text(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float | np.floating) else str(value)


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
