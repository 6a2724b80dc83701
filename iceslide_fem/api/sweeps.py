"""Sweeps for scripts: scenes for all combinations of some of their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from iceslide_fem.api.errors import in_python
from iceslide_fem.api.scenes import AnyScene, as_scene
from iceslide_fem.runtime.arrays import plain
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.workflow.sweep import (
    plan_of,
    read_rows,
    rows_of_keys,
    run_sweep,
    share_cores,
    values_of_key,
)


@in_python()
def sweep(
    scene: AnyScene | list[Any],
    vary: Mapping[str | tuple[str, ...], Sequence[Any]] | None = None,
    out: Path | str | None = None,
    *,
    rows: Path | str | None = None,
    cores_per_case: int = 1,
    cases_at_a_time: int | None = None,
    force: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> xr.Dataset:
    """Run `scene` for every combination of the values in `vary`: what `out` does not hold yet.

    `scene` is a scene, a file or tables, as for `run`, or a list of them. `vary` has lists of
    values by dotted keys, as a scene file has them: texts with units or numbers in SI. Keys that go
    together are a tuple, with a tuple of values in each row of the list; `rows` is a CSV file of
    such rows, as for `iceslide sweep`. `out` is `results/<name>-sweep` if it is not given.

    Points are computed in one call, slices and blocks in processes of `cores_per_case` cores each,
    `cases_at_a_time` (else as many as there are cores for). `say` is given a line for each case,
    `print` for instance. `force` replaces results in `out` that are of other cases.

    The dataset has a dimension for each key in `vary`, with its values in SI, and `time_share`, 201
    even times from 0 to 1 of a case's duration, for the curves `mu` and `film_height_m`. Several
    scenes are a dimension `scene`, of their names. Keys that go together are one dimension, named
    "key,key" or after the file, along which each of them is a coordinate. Variables are the numbers
    of `summary.json`; `status` is "done", "failed" or "not run", and `reason` says why.
    `iceslide_fem.read_sweep(out)` reads it again.

    Raises `SceneError` with one sentence if a value or a combination is not possible, before the
    first case runs. A case that fails raises nothing.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    found = iceslide_fem.sweep(scene, {"load.pressure": ["1 bar", "2 bar"], "load.speed": [1, 3]})
    found["mu_mean"].sel({"load.speed": 3.0}).plot()
    ```
    """
    scenes = [as_scene(one) for one in (scene if isinstance(scene, list) else [scene])]
    axes = []
    for key, values in (vary or {}).items():
        given = _values(key, values)
        axes.append(values_of_key(key, given) if isinstance(key, str) else rows_of_keys(key, given))
    if rows is not None:
        axes.append(read_rows(Path(rows)))
    tables = [(one.name, one.model_dump(mode="json", exclude_unset=True)) for one in scenes]
    plan = plan_of(tables, axes)
    name = "scenes" if len(scenes) > 1 else scenes[0].name
    folder = Path("results") / f"{name}-sweep" if out is None else Path(out)
    return run_sweep(plan, folder, share_cores(cores_per_case, cases_at_a_time), say, force)


def _values(key: Any, values: Any) -> tuple[Any, ...]:
    """The values of a key, of NumPy's types, too, as a scene takes them. Raises SceneError."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray) or not len(values):
        raise SceneError(
            f'vary has {values!r} for {key}; allowed: a list of values, as in ["1 bar", "2 bar"]'
        )
    return tuple(plain(value) for value in values)
