"""What `iceslide compare` writes: compare.json, compare.csv, its runs, and charts."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.inference.compare.case import OUTPUTS, CompareCase
from iceslide_fem.inference.compare.ratios import Ratio, flags, sentence
from iceslide_fem.inference.compare.values import Values
from iceslide_fem.postprocess.report.page import Chart, Curve
from iceslide_fem.preprocess.work import csv_text
from iceslide_fem.runs.doubts import by_kind, in_ranges
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.units import ZERO_CELSIUS
from iceslide_fem.scene import flat
from iceslide_fem.scene.nested import different

TABLE, RUNS = "compare.csv", "cases"
UNITS = {"deceleration": "m/s²"}
NAMED = 4  # names before a warning at most


class Comparison(NamedTuple):
    """Computed values of the candidates of a case, and the folder of their runs, or None."""

    case: CompareCase
    values: Values
    runs: Path | None = None

    @property
    def names(self) -> list[str]:
        """Of the candidates, the reference first."""
        return [one.name for one in self.case.candidates]

    @property
    def numerical(self) -> list[float]:
        """Part by which steps and meshes may move each ratio: its largest change over conditions
        when all is computed more coarsely.
        """
        fine, coarse = self._both
        return _moved(fine / fine[0], coarse / coarse[0])

    @property
    def numerical_of_value(self) -> list[float]:
        """The same of each value."""
        return _moved(*self._both)

    @property
    def _both(self) -> tuple[Array, Array]:
        """The values, and those of the coarser computation, (candidates, conditions)."""
        output = self.case.quantity
        return self.values.fine[output], self.values.coarse[output]

    def ratios(self, one: int) -> dict[str, Ratio]:
        """The ratios of a candidate to the reference by conditions, where both are known."""
        value, slopes = self.values.fine[self.case.quantity], self.values.slopes
        bands = slopes.band_of_ratio(one)
        found = {}
        for place, here in enumerate(self.case.conditions):
            ratio = float(value[one, place] / value[0, place])
            if np.isfinite(ratio):
                inputs = float(bands[place]) if slopes.inputs.keys else None
                found[here.name] = Ratio(ratio, self.numerical[one], inputs)
        return found

    @property
    def sentences(self) -> list[str]:
        """What they say of each candidate."""
        stops = self.case.kind == "stops"
        return [
            sentence(name, self.names[0], stops, ratios, self.values.slopes.most_of_ratio(number))
            for number, name in enumerate(self.names)
            if number > 0 and (ratios := self.ratios(number))
        ]


def _moved(fine: Array, coarse: Array) -> list[float]:
    """The largest relative difference of each candidate over conditions, 0 without any."""
    moved = np.abs(coarse / fine - 1.0)
    return [float(np.nanmax(row)) if np.isfinite(row).any() else 0.0 for row in moved]


def figures(case: CompareCase, found: Comparison) -> dict[str, Any]:
    """The content of compare.json."""
    warnings = [f"{len(found.values.failures)} computations failed: {found.values.failures[0]}"
                ] if found.values.failures else []  # fmt: skip
    warnings += _grouped(found.values.doubts)
    rules: list[str] = []
    value = found.values.fine[case.quantity]
    ideal = found.values.fine.get("deceleration_ideal", value)
    if (np.isnan(value) & np.isfinite(ideal)).any():
        warnings.append(
            "by thresholds the car does not stop where the table says nothing; --output "
            "deceleration_ideal compares wheels at their peak there"
        )
    if case.quantity == "deceleration_threshold":
        reference = {
            here.name: float(value[0, place])
            for place, here in enumerate(case.conditions)
            if np.isfinite(value[0, place])
        }
        index = {
            name: found.ratios(number) for number, name in enumerate(found.names) if number > 0
        }
        rules = flags(reference, index)
    return {
        "kind": case.kind,
        "output": case.quantity,
        "reference": found.names[0],
        "conditions": _conditions(found),
        "inputs": [dict(one) for one in found.values.slopes.inputs.spreads],
        "sentences": found.sentences,
        "rules": rules,
        "different": _different(case),
        "runs": _runs(case),
        "warnings": warnings,
    }


def _grouped(doubts: Sequence[tuple[str, str]]) -> list[str]:
    """Warnings that differ in numbers only as one, with the names that have them."""
    said = []
    for some in by_kind(doubts):
        names, sentences = list(dict.fromkeys(name for name, _ in some)), [each for _, each in some]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        said.append(f"{', '.join(names[:NAMED])}{more}: {in_ranges(sentences)}")
    return said


def _conditions(found: Comparison) -> list[dict[str, Any]]:
    return [_condition(found, place) for place in range(len(found.case.conditions))]


def _condition(found: Comparison, place: int) -> dict[str, Any]:
    here, slopes = found.case.conditions[place], found.values.slopes
    temperature = here.temperature
    candidates = {}
    for number, name in enumerate(found.names):
        value = float(found.values.fine[found.case.quantity][number, place])
        ratio = found.ratios(number).get(here.name)
        exact = not slopes.inputs.keys
        candidates[name] = {
            "value": _known(value),
            "value_numerical": _known(value * found.numerical_of_value[number]),
            "value_inputs": None
            if exact
            else _known(value * float(slopes.band_of_value(number)[place])),
            "ratio": ratio and ratio.value,
            "ratio_numerical": ratio and ratio.value * ratio.numerical,
            "ratio_inputs": ratio and (None if exact else ratio.value * (ratio.inputs or 0.0)),
            "ratio_low": ratio and ratio.low,
            "ratio_high": ratio and ratio.high,
            "verdict": ratio and ("reference" if number == 0 else ratio.verdict),
            **{
                key: _known(float(found.values.fine[key][number, place]))
                for key in OUTPUTS[found.case.kind]
                if key in found.values.fine
            },
        }
    return {
        "name": here.name,
        "temperature_C": None if temperature is None else temperature - ZERO_CELSIUS,
        "water_m": here.water,
        "candidates": candidates,
    }


def _known(value: float) -> float | None:
    """A number, None for NaN: JSON has none."""
    return value if np.isfinite(value) else None


def _runs(case: CompareCase) -> list[list[str]]:
    """Names of the runs of slices and blocks, by condition; none of points and wheels."""
    if case.kind != "scenes" or all(one.scene.model == "point" for one in case.candidates):
        return []
    return [list(names) for names in zip(*case.run_names, strict=True)]


def _different(case: CompareCase) -> dict[str, list[Any]]:
    """Keys in which candidates differ, with their values, SI."""
    found = different([flat(one.tables) for one in case.candidates])
    return {key: values for key, values in found.items() if key not in ("name", "wheel.scene")}


def write(case: CompareCase, found: Comparison, out: Path) -> None:
    """Write compare.csv, and the runs of slices and blocks."""
    rows = [
        {"condition": place["name"], "candidate": name, **entries}
        for place in _conditions(found)
        for name, entries in place["candidates"].items()
    ]
    columns = {key: [np.nan if row[key] is None else row[key] for row in rows] for key in rows[0]}
    columns["condition"] = [f'"{name}"' for name in columns["condition"]]
    replace_file(out / TABLE, csv_text(columns))
    if found.runs is None:
        return
    if (found.runs / RUNS).is_dir():
        for path in (found.runs / RUNS).glob("*_coarse"):
            shutil.rmtree(path)
        shutil.move(found.runs / RUNS, out / RUNS)
    shutil.rmtree(found.runs)


def charts(case: CompareCase, found: Comparison) -> Mapping[str, Sequence[Chart]]:
    """Charts by the names of pictures."""
    unit = UNITS.get(case.quantity.partition("_")[0], "1")
    label = f"{case.quantity} ({unit})"
    over = [here.temperature for here in case.conditions]
    if None in over or len(set(over)) == 1:
        x, axis = np.arange(1.0, len(over) + 1), "condition"
        if len(over) > 1 and case.water:
            x, axis = 1e6 * np.array(case.water), "water on the ice (µm)"
        waters = [slice(None)]
        curves_of = [""]
    else:
        every = len(case.water) or 1
        x, axis = np.array(case.temperature) - ZERO_CELSIUS, "ice temperature (°C)"
        waters = [slice(place, None, every) for place in range(every)]
        curves_of = [f", {1e6 * water:.4g} µm" for water in case.water] or [""]
    alone = np.size(x) == 1
    value = found.values.fine[case.quantity]
    of_values, of_ratios, look = [], [], 0
    for number, name in enumerate(found.names):
        ratios = found.ratios(number)
        for some, more in zip(waters, curves_of, strict=True):
            here = [condition.name for condition in case.conditions[some]]
            of_values.append(Curve(f"{name}{more}", x, value[number, some], look, alone))
            if number > 0:
                known = [ratios.get(condition) for condition in here]
                middle = [np.nan if one is None else _percent(one.value) for one in known]
                of_ratios += [
                    Curve(f"{name}{more}", x, middle, look, alone),
                    Curve(f"{name}{more}, band", *_bars(x, known), look),
                ]
            look += 1
    ends = np.array([np.min(x), np.max(x)])
    of_ratios.append(Curve(found.names[0], ends, np.zeros(2), 0, alone))
    said = " ".join(found.sentences)
    return {
        "compare": [
            Chart("ratio", f"Over {found.names[0]}", said, axis, "difference (%)", of_ratios),
            Chart("value", "Values", f"{case.quantity} of each.", axis, label, of_values),
        ]
    }


def _percent(ratio: float) -> float:
    """Difference to the reference, %."""
    return 100.0 * (ratio - 1.0)


def _bars(x: Any, ratios: Sequence[Ratio | None]) -> tuple[list[float], list[float]]:
    """Vertical bars from the lower to the upper end of ratios."""
    across, up = [], []
    for place, ratio in zip(x, ratios, strict=True):
        if ratio is not None:
            across += [place, place, np.nan]
            up += [_percent(ratio.low), _percent(ratio.high), np.nan]
    return across, up
