"""Runs for scripts: a scene from start to end, and a finished run, as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from iceslide_fem import simulate
from iceslide_fem.postprocess import results
from iceslide_fem.runtime.arrays import plain
from iceslide_fem.runtime.columns import attributes_of
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import Scene, as_toml, override, put, read_scene, scene_from_dict
from iceslide_fem.scene.cases import scene_path
from iceslide_fem.scene.fingerprint import versions_in_words

if TYPE_CHECKING:
    from mpi4py import MPI

    from iceslide_fem.runs.observers import Tell

Variables = dict[str, xr.Variable]


def variables(columns: Mapping[str, ArrayLike], dimensions: str | Sequence[str]) -> Variables:
    """A variable over `dimensions` for each of the `columns`."""
    found = {}
    for name, values in columns.items():
        array = np.asarray(values)
        if array.dtype.kind == "O":
            array = array.astype(str)
        found[name] = xr.Variable(dimensions, array, attributes_of(name))
    return found


def plain_attributes(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the `entries` of a summary that are numbers or texts; NaN for what did not happen.

    Warnings are one text. Files of `Dataset.to_netcdf` hold all of them.
    """
    found: dict[str, Any] = {}
    for name, value in entries.items():
        if value is None:
            found[name] = np.nan
        elif name == "warnings":
            found[name] = "; ".join(value)
        elif isinstance(value, int | float | str):
            found[name] = int(value) if isinstance(value, bool) else value
    return found


def load_scene(
    path: Path | str | None = None,
    overrides: Mapping[str, Any] | Sequence[str] = (),
    *,
    case: str | None = None,
) -> Scene:
    """Read and validate a scene: the file `path`, or the `case` of that name.

    `overrides` replace values by their dotted keys: `{"load.pressure": "3 bar"}`, or texts as for
    `--set`, `["load.pressure=3bar"]`. Values may be NumPy's. Numbers without a unit are SI.
    `iceslide cases` lists the cases. The scene is frozen; a notebook shows what differs from the
    defaults.

    Raises `SceneError` with one sentence where the file cannot be read or a value is not possible.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    scene.load.pressure  # 100000.0, in Pa
    ```
    """
    data = read_scene(scene_path(path, case))
    if isinstance(overrides, Mapping):
        for key, value in overrides.items():
            put(data, key, plain(value))
    else:
        for change in overrides:
            override(data, change)
    return scene_from_dict(data)


_OVER = {"history": "time_s", "preload": "preload_step", "passes": "pass"}  # their dimensions


def run(
    scene: Scene,
    out: Path | str | None = None,
    *,
    petsc_options: Sequence[str] = (),
    force: bool = False,
    pictures: bool = True,
    comm: MPI.Comm | None = None,
    progress: Tell | None = None,
) -> xr.Dataset:
    """Run `scene`, write its results to the folder `out`, and return them as `read_run` does.

    `out` is `results/<name>` if it is not given. `force` replaces results of another scene that it
    holds. `pictures`: draw `report.png`, too. `petsc_options` are words as on PETSc's command line.

    Under mpirun all ranks of `comm` call it with the same scene and folder, and share the work;
    `comm` is `MPI.COMM_WORLD` if it is not given. With `comm=MPI.COMM_SELF` every rank runs a scene
    of its own. Runs in several threads wait for each other: one runs at a time.

    `progress` is called after every step of a slice or block with the row, a dict by column, that
    was added to `preload.csv` or `history.csv`. If it returns False on any rank, the run stops as
    after Ctrl-C, with a checkpoint. Signals are handled in the main thread only.

    Raises `SceneError` where `out` is not to be written to, DOLFINx is missing or ranks were given
    different runs, `SimulationStopped` where the run cannot go on and `Interrupted` where it was
    asked to stop: `read_run(out)` then gives what was accepted. Raises `OutputError` where a file
    cannot be written.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    found = iceslide_fem.run(scene, "results/thesis_point")
    found["mu"].plot()
    found.attrs["mu_mean"]
    ```
    """
    folder = Path("results") / scene.name if out is None else Path(out)
    simulate.run(
        scene,
        folder,
        petsc_options,
        force=force,
        pictures=pictures,
        comm=comm,
        progress=progress,
    )
    return read_run(folder)


def read_run(
    folder: Path | str, table: Literal["history", "preload", "passes"] = "history"
) -> xr.Dataset:
    """The run in `folder` as a dataset, SI units, temperatures in degC.

    Every column of the `table` is a variable, whose unit is its attribute `units`: of `history.csv`
    over `time_s` (accepted steps,), of `preload.csv` over `preload_step`, of `passes.csv` over
    `pass`.
    Attributes: the numbers of `summary.json` (NaN for an event that did not happen), `warnings`,
    `stopped` (why, else ""), `name`, `model`, `scene` (a scene file's text), `versions`, `folder`,
    and for every time series of fields the path of its list, `fields_rubber` say, which ParaView
    and pyvista open. Paths are absolute.

    Raises `SceneError` if the folder holds no finished run, or the run has no such table.

    ```python
    import iceslide_fem

    found = iceslide_fem.read_run("results/thesis_point")
    found["film_height_m"].attrs["units"]  # "m"
    found.sel(time_s=2e-3, method="nearest")["mu"]
    ```
    """
    if table not in _OVER:
        raise SceneError(f'read_run has table = "{table}"; allowed: {", ".join(_OVER)}')
    run = results.read_run(folder)
    columns = {"history": run.history, "preload": run.preload, "passes": run.passes}[table]
    if not columns:
        raise SceneError(f"the run in {folder} has no {table}.csv")
    entries = plain_attributes(run.summary)
    entries["stopped"] = run.summary.get("stopped") or ""
    series = sorted((run.directory.absolute() / "fields").glob("*.pvd"))
    attributes = {
        "iceslide_fem": "run",
        "name": run.scene["name"],
        "model": run.scene["model"],
        "folder": str(run.directory.absolute()),
        "versions": versions_in_words(run.summary.get("versions", {})),
        "scene": as_toml(run.scene),
    }
    attributes |= {f"fields_{path.stem}": str(path) for path in series}
    return xr.Dataset(variables(columns, _OVER[table]), attrs=attributes | entries)
