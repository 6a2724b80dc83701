"""Checkpoints: all that a run needs to go on, in one file that is whole or not there.

The file is a line that says what it is, the SHA-256 of the rest, a line of JSON (the scene, its
fingerprint, numbers, other ranks' files), and the first rank's arrays as NumPy's `.npz`. Every
other rank has a file of its own (`checkpoint_parts`): none has the arrays of all. Arrays come with
their places, so that a run goes on with any number of ranks. The two formats that exist for
DOLFINx, adios4dolfinx and io4dolfinx, need ADIOS2 and DOLFINx 0.7 or newer, and know functions on
meshes; films at contact points and a moving window of ice are none.
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
FINISHED = "finished"  # the last one of a run that has ended
# What a run that goes on needs.
TABLES = "history.csv", "passes.csv", "preload.csv", "probes.csv", "log.jsonl"
GOES_ON = (FILE, FINISHED, PATTERN, *TABLES, "fields")
_FIRST_LINE = b"iceslide_fem checkpoint 2\n"
# What reading or using foreign content ends in; none of it is a fault of the program.
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
    """scene: what runs; state: nested tables of numbers and of the first rank's arrays, empty
    before sliding; parts: the arrays of other ranks.
    """

    scene: Scene
    state: dict[str, Any]
    parts: tuple[Part, ...] = ()


def write_checkpoint(
    folder: Path, scene: Scene, state: Mapping[str, Any], comm: Any = None
) -> None:
    """Write `state` to `folder`: tables of JSON values, the same on all ranks, and own arrays.

    Collective; `comm` None: there is one rank. Raises OutputError on all ranks if that fails on
    one; an older checkpoint then stays.
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
    """Keep the last checkpoint of a run that has ended under its own name. Call it on one rank."""
    with writing(folder / FINISHED):
        os.replace(folder / FILE, folder / FINISHED)


def scene_there(folder: Path) -> dict[str, Any] | None:
    """The scene, as resolved, of the checkpoint in `folder`, to be read; None without a whole one.

    Also of one that another version wrote, with which no run could go on.
    """
    with contextlib.suppress(*_NOT_OURS):
        with open(folder / FILE, "rb") as file:
            if file.readline() == _FIRST_LINE and file.readline():
                scene = json.loads(file.readline())["scene"]
                return scene if isinstance(scene, dict) else None
    return None


def read_checkpoint(folder: Path, name: str = FILE) -> Checkpoint:
    """The checkpoint in `folder`. Raises SceneError if there is none that can be trusted."""
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
    """The last checkpoint in `folder`: that of a run to go on, else of one that has finished."""
    return folder / (FILE if (folder / FILE).is_file() else FINISHED)


def read_changed(folder: Path, changes: Sequence[str]) -> Checkpoint:
    """The last checkpoint in `folder`, of a finished run, too, with `changes` of its scene.

    They may be a longer `load.duration` and what is written. Raises SceneError where there is no
    such checkpoint.
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
    """Where what the checkpoint `path` holds is used: raise SceneError if no run wrote that."""
    try:
        yield
    except _NOT_OURS as error:
        raise SceneError(
            f"the checkpoint {path} does not hold what a run writes "
            f"({type(error).__name__}: {error})"
        ) from None


def fields_there(folder: Path, state: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What `state` lists of the fields in `folder`, if all of it is there; else nothing.

    Then the series begins anew: lists never name what is missing. Call it on one rank.
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
    """Raise ValueError if a number of `state` cannot be one of a run of `scene`."""
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
    """Raise SceneError, naming the first difference, if the checkpoint is of another scene."""
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
