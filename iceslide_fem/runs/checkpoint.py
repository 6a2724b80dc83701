"""Checkpoints: the whole state of a run, written atomically.

The file has an identifying line, the SHA-256 of the rest, a line of JSON (the scene, its
fingerprint, numbers, other ranks' files), and the first rank's arrays as NumPy's `.npz`. Every
other rank has its own file (`checkpoint_parts`), so no rank holds all arrays. Arrays are saved with
their positions, so a run can continue on any number of ranks. The two existing formats for DOLFINx,
adios4dolfinx and io4dolfinx, need ADIOS2 and DOLFINx 0.7 or newer. They save functions on meshes,
but not films at contact points or a moving window of ice.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.runs.checkpoint_parts import (
    PATTERN,
    Part,
    packed,
    parts_of,
    remove_others,
    write_part,
)
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.runtime.files import replace_file, writing
from iceslide_fem.runtime.ranks import from_root, together
from iceslide_fem.scene import Scene, flat, scene_from_dict
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.scene.messages import shortened
from iceslide_fem.scene.toml import key_and_text, override

FILE = "checkpoint"
FINISHED = "finished"  # the last checkpoint of a finished run
# Tables that a continued run needs.
TABLES = "history.csv", "passes.csv", "preload.csv", "probes.csv", "log.jsonl"
GOES_ON = (FILE, FINISHED, PATTERN, *TABLES, "fields")
_FIRST_LINE = b"iceslide_fem checkpoint 2\n"
# Errors of reading or using foreign content; they are not faults of the program.
_NOT_OURS = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NotImplementedError,
    OSError,
    RecursionError,
    TypeError,
    ValueError,
    zipfile.BadZipFile,
    zlib.error,
)


class Checkpoint(NamedTuple):
    """scene: of the run; state: nested tables of numbers and of the first rank's arrays, empty
    before sliding; parts: arrays of other ranks.
    """

    scene: Scene
    state: dict[str, Any]
    parts: tuple[Part, ...] = ()


def write_checkpoint(
    folder: Path, scene: Scene, state: Mapping[str, Any], comm: Any = None
) -> None:
    """Write `state` to `folder`: tables of JSON values (equal on all ranks) and own arrays.

    Collective; `comm` None: one rank. Raises OutputError on all ranks if one rank fails; an older
    checkpoint then stays valid.
    """
    entries = flat(state)
    arrays = {key: value for key, value in entries.items() if isinstance(value, np.ndarray)}
    numbers = {key: value for key, value in entries.items() if key not in arrays}
    listed: list[tuple[str, str]] = []
    if comm is not None:
        mine = together(lambda: write_part(folder, comm.rank, arrays) if comm.rank else None, comm)
        listed = [one for one in comm.allgather(mine) if one is not None]

    def write() -> None:
        header = {
            "fingerprint": fingerprint(scene),
            "scene": scene.as_dict(),
            "numbers": numbers,
            "parts": listed,
        }
        body = json.dumps(header).encode() + b"\n" + packed(arrays)
        digest = hashlib.sha256(body).hexdigest().encode()
        replace_file(folder / FILE, _FIRST_LINE + digest + b"\n" + body)
        remove_others(folder, listed)

    from_root(write, comm)


def finish(folder: Path) -> None:
    """Rename the last checkpoint of a finished run. Call it on one rank."""
    with writing(folder / FINISHED):
        os.replace(folder / FILE, folder / FINISHED)


def scene_there(folder: Path) -> dict[str, Any] | None:
    """The resolved scene of the checkpoint in `folder`; None without a complete one.

    Checkpoints of other versions are included, although no run can continue from them.
    """
    scene = _header_there(folder).get("scene")
    return scene if isinstance(scene, dict) else None


def fingerprint_there(folder: Path) -> str | None:
    """Fingerprint of the scene of the checkpoint in `folder`; None without one."""
    return _header_there(folder).get("fingerprint")


def _header_there(folder: Path) -> dict[str, Any]:
    """What the checkpoint in `folder` says before its arrays; {} without one."""
    with contextlib.suppress(*_NOT_OURS):
        with open(folder / FILE, "rb") as file:
            if file.readline() == _FIRST_LINE and file.readline():
                header = json.loads(file.readline())
                return header if isinstance(header, dict) else {}
    return {}


def read_checkpoint(folder: Path, name: str = FILE) -> Checkpoint:
    """The checkpoint in `folder`. Raises SceneError if there is no valid one."""
    path = folder / name
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise SceneError(
            f"{folder} holds no checkpoint: no run was begun there, or it has finished "
            "(--set load.duration=TIME may let it go on)"
        ) from None
    except OSError as error:
        raise SceneError(f"cannot read the checkpoint {path}: {error.strerror}") from None
    if not content.startswith(_FIRST_LINE):
        raise SceneError(f"{path} is not a checkpoint of this program")
    digest, _, body = content[len(_FIRST_LINE) :].partition(b"\n")
    if hashlib.sha256(body).hexdigest().encode() != digest:
        raise SceneError(f"the checkpoint {path} is damaged: its checksum does not fit its content")
    line, _, packed_arrays = body.partition(b"\n")
    with trusted(path):
        header = json.loads(line)
        given, print_there, numbers = (header[key] for key in ("scene", "fingerprint", "numbers"))
        scene, listed = scene_from_dict(given), [(str(n), str(d)) for n, d in header["parts"]]
    if fingerprint(scene) != print_there:
        raise SceneError(
            f"the checkpoint {path} is of another version of iceslide_fem or DOLFINx, or a file "
            "that its scene names has changed: start the run anew"
        )
    with trusted(path):
        with np.load(io.BytesIO(packed_arrays), allow_pickle=False) as file:
            arrays = {key: file[key] for key in file}
        state = _nested(numbers | arrays)
        _check(state, scene)
    return Checkpoint(scene, state, parts_of(folder, listed))


def last_checkpoint(folder: Path) -> Path:
    """The last checkpoint in `folder`: of an unfinished run, else of a finished one."""
    return folder / (FILE if (folder / FILE).is_file() else FINISHED)


def read_changed(folder: Path, changes: Sequence[str]) -> Checkpoint:
    """The last checkpoint in `folder`, also of a finished run, with `changes` of its scene.

    Allowed changes are a longer `load.duration` and the output. Raises SceneError if there is no
    checkpoint or a change is not allowed.
    """
    name = last_checkpoint(folder).name
    checkpoint = read_checkpoint(folder, name)
    before, changed = checkpoint.scene, checkpoint.scene.as_dict()
    for change in changes:
        key, _ = key_and_text(change)
        if key != "load.duration" and not key.startswith("output."):
            raise SceneError(
                f"--restart goes on with a run as it is: {shortened(key)} cannot be changed; "
                "allowed: load.duration and the keys of output"
            )
        override(changed, change)
    scene = scene_from_dict(changed)
    duration, first = scene.load.duration, before.load.duration
    if scene.load.passes > 1 and duration != first:
        raise SceneError(
            f"the run in {folder} has {scene.load.passes} passes, each as long as load.duration; "
            "it cannot be changed"
        )
    if duration < first or (duration == first and name == FINISHED):
        raise SceneError(
            f"load.duration = {1e3 * duration:.4g} ms does not let the run in {folder} go on; "
            f"allowed: longer than its {1e3 * first:.4g} ms"
        )
    return checkpoint._replace(scene=scene)


@contextlib.contextmanager
def trusted(path: Path) -> Iterator[None]:
    """Context in which errors from the content of checkpoint `path` become SceneError."""
    try:
        yield
    except _NOT_OURS as error:
        raise SceneError(
            f"the checkpoint {path} does not hold what a run writes "
            f"({type(error).__name__}: {error})"
        ) from None


def fields_there(folder: Path, state: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Fields listed in `state`, if all their files are in `folder`; else an empty list.

    The series then starts anew, because a list must not name missing files. Call it on one rank.
    """
    earlier = [dict(entry) for entry in state.get("fields", ())]
    fields = folder / "fields"
    names = {str(name) for entry in earlier for key, name in entry.items() if key != "time"}
    lost = sorted(name for name in names if not (fields / Path(name).name).is_file())
    if not lost:
        return earlier
    print(f"Note: {fields} has lost {lost[0]}: fields are written from here on only.")
    if fields.is_dir():
        shutil.rmtree(fields)
    return []


def _check(state: Mapping[str, Any], scene: Scene) -> None:
    """Raise ValueError if a number of `state` is impossible in a run of `scene`."""
    if not state:
        return
    sliding = state["sliding"]
    time, step, duration = sliding["time"], sliding["step"], scene.load.sliding_time
    if not 0.0 <= time <= duration or not 0.0 < step:
        raise ValueError(f"time {time} s, step {step} s in a run of {duration} s")
    for key, value in flat(state).items():
        if isinstance(value, np.ndarray) and not np.isfinite(value).all():
            raise ValueError(f"{key} is not finite")


def same_scene(scene: Scene, checkpoint: Checkpoint, folder: Path) -> None:
    """Raise SceneError with the first difference if the checkpoint has another scene."""
    if fingerprint(scene) == fingerprint(checkpoint.scene):
        return
    here, there = flat(scene.as_dict()), flat(checkpoint.scene.as_dict())
    counts = [key for key in here if key != "name" and not key.startswith("output.")]
    key = next((key for key in counts if here[key] != there[key]), "rubber.mesh")
    raise SceneError(
        f"the checkpoint in {folder} is of another scene: {key} is {there[key]} there and "
        f"{here[key]} here"
    )


def _nested(entries: Mapping[str, Array | Any]) -> dict[str, Any]:
    """Tables of dotted keys; the inverse of `flat`."""
    tables: dict[str, Any] = {}
    for key, value in entries.items():
        *outer, name = key.split(".")
        table = tables
        for part in outer:
            table = table.setdefault(part, {})
        table[name] = value
    return tables
