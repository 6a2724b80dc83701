"""Runs for scripts: a scene from start to end, and a finished run, as a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from iceslide_fem import results, simulate
from iceslide_fem.api.datasets import plain_attributes, variables
from iceslide_fem.scene import Scene, as_toml
from iceslide_fem.scene.fingerprint import versions_in_words


def run(
    scene: Scene,
    out: Path | str | None = None,
    *,
    petsc_options: Sequence[str] = (),
    force: bool = False,
    pictures: bool = True,
) -> xr.Dataset:
    """Run `scene`, write its results to the folder `out`, and return them as `read_run` does.

    `out` is `results/<name>` if it is not given. `force` replaces results of another scene that it
    holds. `pictures`: draw `report.png`, too. `petsc_options` are words as on PETSc's command line.
    Under mpirun it is collective.

    Raises `SceneError` where `out` is not to be written to or DOLFINx is missing,
    `SimulationStopped` where the run cannot go on and `Interrupted` where it was asked to stop:
    `read_run(out)` then gives what was accepted. Raises `OutputError` where a file cannot be
    written.

    ```python
    import iceslide_fem

    scene = iceslide_fem.load_scene(case="thesis_1bar", overrides={"model": "point"})
    found = iceslide_fem.run(scene, "results/thesis_point")
    found["mu"].plot()
    found.attrs["mu_mean"]
    ```
    """
    folder = Path("results") / scene.name if out is None else Path(out)
    simulate.run(scene, folder, petsc_options, force=force, pictures=pictures)
    return read_run(folder)


def read_run(folder: Path | str) -> xr.Dataset:
    """The run in `folder` as a dataset, SI units, temperatures in degC.

    Every column of `history.csv` is a variable over `time_s` (accepted steps,), whose unit is its
    attribute `units`. Columns of `preload.csv` are over `preload_step` and begin with `preload_`,
    those of `passes.csv` are over `pass_number` and begin with `pass_`, where there are such files.
    Attributes: the numbers of `summary.json` (NaN for an event that did not happen), `warnings`,
    `stopped` (why, else ""), `name`, `model`, `scene` (a scene file's text), `versions`, `folder`,
    and for every time series of fields the path of its list, `fields_rubber` say, which ParaView
    and pyvista open.

    Raises `SceneError` if the folder holds no finished run.

    ```python
    import iceslide_fem

    found = iceslide_fem.read_run("results/thesis_point")
    found["film_height_m"].attrs["units"]  # "m"
    found.sel(time_s=2e-3, method="nearest")["mu"]
    ```
    """
    return dataset_of(results.read_run(folder))


def dataset_of(run: results.Run) -> xr.Dataset:
    """The dataset of a run that has been read."""
    data = variables(run.history, "time_s")
    data |= variables(run.preload, "preload_step", "preload_")
    if run.passes:
        numbers, own = run.passes["pass"], dict(run.passes)
        del own["pass"]
        data |= variables(own, "pass_number", "pass_")
        data["pass_number"] = xr.Variable("pass_number", numbers.astype(int), {"units": "1"})
    entries = plain_attributes(run.summary)
    entries["stopped"] = run.summary.get("stopped") or ""
    series = sorted((run.directory / "fields").glob("*.pvd"))
    attributes = {
        "iceslide_fem": "run",
        "name": run.scene["name"],
        "model": run.scene["model"],
        "folder": str(run.directory),
        "versions": versions_in_words(run.summary.get("versions", {})),
        "scene": as_toml(run.scene),
    }
    attributes |= {f"fields_{path.stem}": str(path) for path in series}
    return xr.Dataset(data, attrs=attributes | entries)
