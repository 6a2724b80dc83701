"""Files of a finished run: summary, histories, also of passes, and times of fields."""

from __future__ import annotations

import csv
import json
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import trapezoid

from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene.materials import BAR, ICE, Solid

PASS = "pass"  # column with the number of the pass
DECIMALS = 12  # of times (s) computed as sums of steps


class Run(NamedTuple):
    """The files of a run; SI units, as in the columns' names.

    history: column -> (rows,); preload: the same for press and speed ramp; passes: the same for
    passes over the same ice; both are empty if the run has none; summary: as in summary.json.
    `pandas.DataFrame(run.passes)` makes a table of pandas.
    """

    directory: Path
    summary: dict[str, Any]
    history: dict[str, Array]
    preload: dict[str, Array]
    passes: dict[str, Array] = {}

    @property
    def scene(self) -> dict[str, Any]:
        """The resolved scene."""
        return dict(self.summary["scene"])

    @property
    def ice(self) -> Solid:
        """The resolved ice; defaults for runs of older versions."""
        given = {name: self.scene["ice"].get(name, usual) for name, usual in ICE._asdict().items()}
        return Solid(**given)

    @property
    def title(self) -> str:
        """The scene in one line: name, model, pressure, speed, temperature and the ice's model."""
        scene, load, ice = self.scene, self.scene["load"], self.scene["ice"]
        celsius = ice["temperature"] - ZERO_CELSIUS
        again = f", {self.passes[PASS].size} passes" if self.passes else ""
        return (
            f"{scene['name']}: {scene['model']}, {load_range(load['pressure'], BAR)} bar, "
            f"{load_range(load['speed'], 1.0)} m/s, {ice['motion']} ice at {celsius:.3g} °C "
            f"({ice['heat']}){again}"
        )

    @property
    def sliding_time(self) -> Array:
        """Time (s) of every row of the history without the rests between passes."""
        return sliding_time(self.history)

    def mean(self, column: str) -> float:
        """Mean of a history `column` over the sliding time."""
        time, values = self.sliding_time, self.history[column]
        slid = float(time[-1])
        return float(trapezoid(values, time)) / slid if slid else float(values[0])

    def one_pass(self, number: int) -> Run:
        """Pass `number` (from 1) as a separate run; its times begin with the pass.

        A negative number counts from the last pass, -1. A run with one pass is its only pass.
        Raises ValueError if there is no such pass.
        """
        count = self.passes[PASS].size if self.passes else 1
        which = number if number > 0 else count + 1 + number
        if not 1 <= which <= count:
            raise ValueError(
                f"there is no pass {number}; allowed: 1 to {count}, or -1 for the last"
            )
        if not self.passes:
            return self
        here = {name: v[self.history[PASS] == which] for name, v in self.history.items()}
        history = here | {"time_s": sliding_time(here)}
        del history[PASS]
        summary = self.summary | _summary_of(history, self.passes, which)
        return self._replace(summary=summary, history=history, passes={})

    def at(self, column: str, time: float) -> float:
        """History `column` at `time` (s), linear between steps."""
        return float(np.interp(time, self.history["time_s"], self.history[column]))

    @property
    def phases(self) -> dict[str, tuple[float, float]]:
        """Start and end (s) of the phases of the film: warming, melting, saturated."""
        end = float(self.history["time_s"][-1])
        times = (self.summary.get(key) for key in ("melt_onset_s", "saturation_s"))
        onset, saturation = (end if time is None else float(time) for time in times)
        spans = {
            "warming": (0.0, onset),
            "melting": (onset, saturation),
            "saturated": (saturation, end),
        }
        return {name: span for name, span in spans.items() if span[1] > span[0]}

    @property
    def preload_friction(self) -> tuple[Array, Array]:
        """Progress of press (0 to 1) and speed ramp (1 to 2), with friction over normal force."""
        normal = self.preload["normal_force_N"]
        loaded = normal > 1e-9 * normal.max()
        progress = self.preload["load_fraction"] + self.preload["speed_fraction"]
        return progress[loaded], self.preload["friction_force_N"][loaded] / normal[loaded]


def sliding_time(history: Mapping[str, Array]) -> Array:
    """Time (s) of every row without rests, as the sum of steps.

    Times in a table have ten digits, so long rests leave few digits within a pass.
    """
    if PASS not in history:
        return history["time_s"]
    return np.asarray(np.cumsum(history["step_s"]).round(DECIMALS))


def names_of(folders: Sequence[Path]) -> list[str]:
    """Names of results: the shortest distinct ends of their paths. Raises SceneError for twins."""
    parts = [folder.absolute().parts for folder in folders]
    for count in range(1, max(map(len, parts)) + 1):
        names = ["/".join(each[-count:]) for each in parts]
        if len(set(names)) == len(names):
            return names
    raise SceneError("the same folder is given twice; give several results, or one")


def _summary_of(
    history: Mapping[str, Array], passes: Mapping[str, Array], number: int
) -> dict[str, Any]:
    """Summary of one pass from its `history` and its row of `passes`."""
    row = {name: float(values[passes[PASS] == number][0]) for name, values in passes.items()}
    full = np.flatnonzero(history["saturated_fraction"] > 0.0)
    onset = row["melt_onset_s"]
    return {
        "mu_peak": row["mu_peak"],
        "mu_peak_time_s": float(history["time_s"][int(np.argmax(history["mu"]))]),
        "mu_mean": row["mu_mean"],
        "mu_end": row["mu_end"],
        "melt_onset_s": onset if np.isfinite(onset) else None,
        # a step ends where the free volume is full
        "saturation_s": float(history["time_s"][max(full[0] - 1, 0)]) if full.size else None,
        "steps": int(row["steps"]),
        "rejected_steps": int(row["rejected_steps"]),
    }


def load_range(load: Any, unit: float) -> str:
    """A load in `unit`, or its range over time."""
    if not isinstance(load, list):
        return f"{load / unit:.3g}"
    values = [value / unit for _, value in load]
    return f"{min(values):.3g} to {max(values):.3g}"


def read_run(directory: Path | str) -> Run:
    """Read a finished run. Raises SceneError if the directory holds none."""
    directory = Path(directory)
    try:
        summary = json.loads((directory / "summary.json").read_text(encoding="utf-8"))
        history = read_table(directory / "history.csv")
        preload = directory / "preload.csv"
        earlier = read_table(preload) if preload.is_file() else {}
        again = directory / "passes.csv"
        passes = read_table(again) if again.is_file() else {}
    except OSError as error:
        missing = Path(error.filename).name
        raise SceneError(f"{directory} holds no finished run (no readable {missing})") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(f"{directory} holds no finished run ({error})") from None
    if not _is_of_a_run(summary, history):
        raise SceneError(f"{directory} holds no finished run (its files are of something else)")
    return Run(directory, summary, history, earlier, passes)


def _is_of_a_run(summary: Any, history: Mapping[str, Array]) -> bool:
    """Whether summary and history have the required entries."""
    try:
        tables = [summary["scene"][name] for name in ("rubber", "load", "ice", "numerics")]
        numbers = [summary[name] for name in ("mu_peak", "mu_peak_time_s")]
        curves = [history[name] for name in ("time_s", "mu")]
    except (LookupError, TypeError):
        return False
    return (
        all(isinstance(table, dict) for table in tables)
        and all(isinstance(number, float | int) for number in numbers)
        and all(
            len(curve) and curve.dtype == float and np.isfinite(curve).all() for curve in curves
        )
    )


def differences(run: Run, exact: Run, count: int = 500) -> Array:
    """Relative differences of mu(t) from another run, at `count` common sliding times.

    Rests between passes are excluded.
    """
    end = min(float(each.sliding_time[-1]) for each in (run, exact))
    times = np.linspace(0.0, end, count)
    mu, reference = (np.interp(times, r.sliding_time, r.history["mu"]) for r in (run, exact))
    return np.asarray(mu / reference - 1.0)


def largest_and_rms(run: Run, exact: Run) -> tuple[float, float]:
    """Largest and root mean square of the `differences` to another run."""
    change = differences(run, exact)
    return float(np.abs(change).max()), float(np.sqrt(np.mean(change**2)))


def field_files(directory: Path, name: str) -> list[tuple[float, Path]]:
    """Times (s) and files of the field `name` (rubber, ice, interface); empty if not written.

    For a field in parts it gives the first part. Raises SceneError if the list is damaged.
    """
    return [(time, parts[0]) for time, parts in field_parts(directory, name)]


def field_parts(directory: Path, name: str) -> list[tuple[float, list[Path]]]:
    """Times (s) and the files of all parts of the field `name`; empty if not written.

    Raises SceneError if the list is damaged.
    """
    path = directory / "fields" / f"{name}.pvd"
    if not path.is_file():
        return []
    found: list[tuple[float, list[Path]]] = []
    try:
        for entry in ET.parse(path).iter("DataSet"):
            file = path.parent / entry.attrib["file"]
            if int(entry.attrib.get("part", 0)) == 0:
                found.append((float(entry.attrib["timestep"]), [file]))
            else:
                found[-1][1].append(file)
    except (ET.ParseError, LookupError, OSError, ValueError) as error:
        raise SceneError(f"{path} is not a list that a run wrote ({error})") from None
    return found


def read_table(path: Path) -> dict[str, Array]:
    """Columns of a table that a run wrote, by their names. Raises OSError, ValueError."""
    text = path.read_text(encoding="utf-8")
    if not text.endswith("\n"):
        raise ValueError(f"the last row of {path.name} is not whole")
    heading, *rows = csv.reader(text.splitlines())
    if not all(len(row) == len(heading) and row[-1] for row in rows):
        raise ValueError(f"a row of {path.name} is not whole")
    columns = zip(*rows, strict=True) if rows else [()] * len(heading)
    return dict(zip(heading, map(_values, columns), strict=True))


def _values(cells: Sequence[str]) -> Array:
    """The numbers in a column of a table, or its texts if they are none."""
    try:
        return np.array([cell or "nan" for cell in cells], dtype=float)
    except ValueError:
        return np.array(cells, dtype=object)
