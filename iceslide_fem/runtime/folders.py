"""Output folders of all commands, and the rule for replacing results.

A new or empty folder is free. A folder with results is refused unless they have the same input (a
repeat) or `--force` is given; then all results in it are removed. A folder with anything else is
always refused. Only one command can write to a folder at a time.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import check_writable, writing

try:
    import fcntl
except ImportError:  # not on Windows, where folders are not locked
    fcntl = None  # type: ignore[assignment]

LOCK = ".lock"
# Output of the commands, as patterns of file names: of runs, sweeps and ladders, footprints and
# wheels, surfaces, rubber. The checkpoint is the first, so that no run continues from half-removed
# results.
RESULTS = [
    *"checkpoint checkpoint.* finished summary.json stopped.txt history.csv passes.csv".split(),
    *"preload.csv probes.csv log.jsonl report.png report.html page.json fields".split(),
    *"view.gif view.mp4 view_*.png *.part".split(),
    *"sweep.csv sweep.nc mu_by_*.png map_*.png cases".split(),
    *"ladder.png point_* slice_* block_*".split(),
    *"footprint.vti pressure.png temperature.png film_height.png wet_dry.png mu.png".split(),
    *"along.png thesis.png comparison.png comparison.csv line.csv line.png".split(),
    *"mu_slip.csv mu_slip.png stops.csv stops.png".split(),
    *"contact.csv contact_*ms.csv surface.json map.png contact.png parameters.png".split(),
    *"spectrum.png rubber.toml rubber.csv rubber.json shift_factors.csv master_curve.png".split(),
    *"shift_factors.png relaxation.png stress.png".split(),
    *"uncertainty.json samples.csv runs.csv distribution.png inputs.png control.png".split(),
    *"compare.json compare.csv compare.png".split(),
    *"hysteresis.csv speed.png waves.csv waves.png cut_off.png".split(),
    *"calibration.json residuals.csv snippet.toml measured.png profiles.png residuals.png".split(),
]
FOLDERS = ("fields", "cases", "point_*", "slice_*", "block_*")
# Allowed beside results, and kept: scenes, and files of a queue or a sweep.
BESIDE = ("*.toml", "*.log", "log.txt", "slurm-*", ".*")


def check_folder(
    out: Path, same: Callable[[Path], str | None], force: bool, reads: Iterable[Path] = ()
) -> None:
    """Raise SceneError, and touch nothing, if `out` may not be written to.

    same: called if there are results; it returns their description for "OUT holds ...", or None if
    they have the same input and may be replaced. reads: input files of the command, which are never
    removed.
    """
    check_writable(out)
    if not out.is_dir():
        return
    with _reading(out):
        foreign = sorted(path.name for path in out.iterdir() if not _is_known(path))
    if foreign:
        more = f" and {len(foreign) - 1} more" if len(foreign) > 1 else ""
        raise SceneError(
            f"{out} holds other files than results ({foreign[0]}{more}): give another "
            "folder with --out"
        )
    results = results_in(out)
    gone = {path.resolve() for path in results}
    for path in reads:
        if not gone.isdisjoint((path.resolve(), *path.resolve().parents)):
            raise SceneError(
                f"{out} holds {path}, which is read and would be removed: give another folder "
                "with --out"
            )
    if force or not results:
        return
    found = same(out)
    if found is not None:
        raise SceneError(
            f"{out} holds {found}; give another folder with --out, or --force to replace "
            "what is there"
        )


@contextlib.contextmanager
def claimed(
    out: Path,
    same: Callable[[Path], str | None] = lambda _: None,
    force: bool = False,
    reads: Sequence[Path] = (),
) -> Iterator[None]:
    """Lock `out` for this process, after `check_folder`; on one rank only.

    The folder is created, and removed if nothing was written to it. Raises SceneError.
    """
    check_folder(out, same, force, reads)
    made = [path for path in (out, *out.absolute().parents) if not path.exists()]
    with writing(out):
        out.mkdir(parents=True, exist_ok=True)
    try:
        with _locked(out):
            check_folder(out, same, force, reads)  # again: it may have changed before the lock
            yield
    finally:
        with contextlib.suppress(OSError):  # not empty
            for path in made:
                path.rmdir()


def other_case(file: str, case: Mapping[str, Any], out: Path) -> str | None:
    """Description of results in `out` if their JSON `file` differs from `case`; for `same`."""
    try:
        there = json.loads((out / file).read_bytes())["case"]
        changed = [key for key in {**there, **case} if there.get(key) != case.get(key)]
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return "results of another command, or some that are not whole"
    if not changed:
        return None
    key = changed[0]
    return f"results of other input ({key} is {there.get(key)} there and {case.get(key)} here)"


def results_in(out: Path) -> list[Path]:
    """All results in `out`, of any command."""
    with _reading(out):
        return [path for pattern in RESULTS for path in sorted(out.glob(pattern))]


def clear_results(out: Path, keep: Sequence[str] = ()) -> None:
    """Remove all results in `out` except names in `keep`. Raises OutputError."""
    with writing(out):
        for path in results_in(out):
            if any(path.match(pattern) for pattern in keep):
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink(missing_ok=True)
            if path.parent != out:
                with contextlib.suppress(OSError):  # it has other files
                    path.parent.rmdir()


def _is_known(path: Path) -> bool:
    """Whether a file is a result, or allowed beside results."""
    if path.is_dir() and not path.name.startswith("."):
        return any(path.match(pattern) for pattern in FOLDERS)
    return any(path.match(pattern) for pattern in (*RESULTS, *BESIDE))


@contextlib.contextmanager
def _reading(out: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SceneError(f"cannot read the folder {out}: {error.strerror}") from None


@contextlib.contextmanager
def _locked(out: Path) -> Iterator[None]:
    """Hold the lock of `out`. The system releases it when this process ends in any way."""
    path = out / LOCK
    if fcntl is None:
        yield
        return
    while True:
        with writing(path):
            file = open(path, "a+", encoding="utf-8")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            with file:
                file.seek(0)
                holder = file.read().strip() or "another process"
            raise SceneError(
                f"{out} is in use: {holder} is writing there; wait for it, or give another folder "
                "with --out"
            ) from None
        except OSError:  # a file system without locks
            pass
        with contextlib.suppress(OSError):
            if os.fstat(file.fileno()).st_ino == path.stat().st_ino:
                break
        file.close()  # its holder has just removed it: the lock is void
    with file:
        with contextlib.suppress(OSError):  # a full disk: the holder's name is optional
            file.truncate(0)
            file.write(f"process {os.getpid()} on {platform.node()}")
            file.flush()
        try:
            yield
        finally:
            path.unlink(missing_ok=True)
