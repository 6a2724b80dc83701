"""Runs for scripts: a scene from start to end, and a finished run, as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from iceslide_fem import simulate
from iceslide_fem.api.errors import in_python
from iceslide_fem.api.scenes import AnyScene, as_scene
from iceslide_fem.postprocess import results
from iceslide_fem.runs.checkpoint import read_checkpoint, same_scene
from iceslide_fem.runs.model_levels import resolved
from iceslide_fem.runtime.columns import attributes_of
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import as_toml
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


_OVER = {"history": "time_s", "preload": "preload_step", "passes": "pass"}  # their dimensions


@in_python()
def run(
    scene: AnyScene,
    out: Path | str | None = None,
    *,
    petsc_options: Sequence[str] = (),
    force: bool = False,
    restart: bool = False,
    pictures: bool = True,
    comm: MPI.Comm | None = None,
    progress: Tell | None = None,
) -> xr.Dataset:
    """Run `scene`, write its results to the folder `out`, and return them as `read_run` does.

    `scene` is a scene, or what `load_scene` takes: a file, or tables. `out` is `results/<name>` if
    it is not given. `force` replaces results of another scene that it holds. `restart` goes on with
    the run of the same scene in `out` from its last checkpoint. `pictures`: draw `report.png`, too.
    `petsc_options` are words as on PETSc's command line.

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
    scene = as_scene(scene)
    folder = Path("results") / scene.name if out is None else Path(out)
    resumed = read_checkpoint(folder) if restart else None
    if resumed is not None:
        same_scene(resolved(scene), resumed, folder)
    simulate.run(
        scene,
        folder,
        petsc_options,
        resumed=resumed,
        force=force,
        pictures=pictures,
        comm=comm,
        progress=progress,
    )
    return read_run(folder)


@in_python()
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


@in_python()
def difference(a: xr.Dataset, b: xr.Dataset) -> xr.Dataset:
    """Run `a` minus run `b`, as `read_run` gives them, on one time axis.

    Runs have times of their own, so that `a - b` keeps the few that both have. Here `time_s` has
    the times of both, from the later start to the earlier end, and between its own times a run is
    linear. Variables are the columns that both have as real numbers; differences of temperatures
    are in K.

    Raises `SceneError` where one is no run over time, where the times of one do not rise (those of
    several passes), or where no time is common to both.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    slow = iceslide_fem.run(scene.replace({"load.speed": "2 m/s", "name": "slow"}))
    fast = iceslide_fem.run(scene.replace({"load.speed": "4 m/s", "name": "fast"}))
    iceslide_fem.difference(fast, slow)["mu"].plot()
    ```
    """
    for one in (a, b):
        name = one.attrs.get("name", "a dataset")
        if "time_s" not in one.dims or "time_s" not in one.coords:
            raise SceneError(f"{name} is no run over time_s; allowed: what run or read_run gives")
        if (np.diff(one["time_s"]) <= 0.0).any():
            raise SceneError(f"the times of {name} do not rise: it has several passes; take one")
    first, second = a["time_s"].values, b["time_s"].values
    both = np.union1d(first, second)
    start, end = max(first[0], second[0]), min(first[-1], second[-1])
    times = both[(both >= start) & (both <= end)]
    if not times.size:
        raise SceneError("no time is common to both runs")
    columns = [
        str(name)
        for name in a.data_vars
        if name in b and a[name].dims == b[name].dims == ("time_s",)
        if a[name].dtype.kind == b[name].dtype.kind == "f"
    ]
    found = variables({"time_s": times}, "time_s")
    for name in columns:
        apart = np.interp(times, first, a[name]) - np.interp(times, second, b[name])
        about = attributes_of(name)
        about["units"] = about["units"].replace("degC", "K")
        about["long_name"] = f"difference of {about['long_name']}"
        found[name] = xr.Variable("time_s", apart, about)
    names = " - ".join(str(one.attrs.get("name", "")) for one in (a, b))
    return xr.Dataset(found, attrs={"iceslide_fem": "difference", "name": names})
