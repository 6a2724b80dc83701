"""Sweeps for scripts: a scene for all combinations of some of its values."""

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
from iceslide_fem.workflow.sweep import plan_of, run_sweep, share_cores


@in_python()
def sweep(
    scene: AnyScene,
    vary: Mapping[str, Sequence[Any]],
    out: Path | str | None = None,
    *,
    cores_per_case: int = 1,
    cases_at_a_time: int | None = None,
    force: bool = False,
    say: Callable[[str], None] = lambda line: None,
) -> xr.Dataset:
    """Run `scene` for every combination of the values in `vary`: what `out` does not hold yet.

    `vary` has lists of values by dotted keys, as a scene file has them: texts with units or numbers
    in SI. `out` is `results/<name>-sweep` if it is not given. Points are computed in one call,
    slices and blocks in processes of `cores_per_case` cores each, `cases_at_a_time` (else as many
    as there are cores for). `say` is given a line for each case, `print` for instance. `force`
    replaces results in `out` that are of other cases.

    The dataset has a dimension for each key in `vary`, with its values in SI, and `time_share`, 201
    even times from 0 to 1 of a case's duration, for the curves `mu` and `film_height_m`. Variables
    are the numbers of `summary.json`; `status` is "done", "failed" or "not run", and `reason` says
    why. `iceslide_fem.read_sweep(out)` reads it again.

    Raises `SceneError` with one sentence if a value or a combination is not possible, before the
    first case runs. A case that fails raises nothing.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    found = iceslide_fem.sweep(scene, {"load.pressure": ["1 bar", "2 bar"], "load.speed": [1, 3]})
    found["mu_mean"].sel({"load.speed": 3.0}).plot()
    ```
    """
    given = {key: _values(key, values) for key, values in vary.items()}
    scene = as_scene(scene)
    plan = plan_of(scene.model_dump(mode="json", exclude_unset=True), given)
    folder = Path("results") / f"{scene.name}-sweep" if out is None else Path(out)
    return run_sweep(plan, folder, share_cores(cores_per_case, cases_at_a_time), say, force)


def _values(key: str, values: Any) -> tuple[Any, ...]:
    """The values of a key, of NumPy's types, too, as a scene takes them. Raises SceneError."""
    if isinstance(values, str) or not isinstance(values, Sequence | np.ndarray) or not len(values):
        raise SceneError(
            f'vary has {values!r} for {key}; allowed: a list of values, as in ["1 bar", "2 bar"]'
        )
    return tuple(plain(value) for value in values)
