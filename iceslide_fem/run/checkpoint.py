"""Checkpoints: all that a run needs to go on, in one file that is whole or not there.

The file is a line that says what it is, the SHA-256 of the rest, a line of JSON (the scene, its
fingerprint, numbers), and the arrays as NumPy's `.npz`. Arrays are gathered from all ranks with
their places, so that a run goes on with any number of ranks. The two formats that exist for
DOLFINx, adios4dolfinx and io4dolfinx, need ADIOS2 and DOLFINx 0.7 or newer, and know functions on
meshes; films at contact points and a moving window of ice are none.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from iceslide_fem.arrays import Array
from iceslide_fem.errors import SceneError
from iceslide_fem.files import replace_file
from iceslide_fem.scene import Scene, flat, scene_from_dict
from iceslide_fem.scene.fingerprint import fingerprint

FILE = "checkpoint"
_FIRST_LINE = b"iceslide_fem checkpoint 1\n"


class Checkpoint(NamedTuple):
    """scene: what runs; state: nested tables of numbers and arrays, empty before sliding."""

    scene: Scene
    state: dict[str, Any]


def write_checkpoint(folder: Path, scene: Scene, state: Mapping[str, Any]) -> None:
    """Write `state` (tables of JSON values and arrays) to `folder`. Call it on one rank.

    Raises OutputError if that fails; an older checkpoint then stays.
    """
    entries = flat(state)
    arrays: dict[str, Any] = {
        key: value for key, value in entries.items() if isinstance(value, np.ndarray)
    }
    header = {
        "fingerprint": fingerprint(scene),
        "scene": scene.as_dict(),
        "numbers": {key: value for key, value in entries.items() if key not in arrays},
    }
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    body = json.dumps(header).encode() + b"\n" + packed.getvalue()
    digest = hashlib.sha256(body).hexdigest().encode()
    replace_file(folder / FILE, _FIRST_LINE + digest + b"\n" + body)


def read_checkpoint(folder: Path) -> Checkpoint:
    """The checkpoint in `folder`. Raises SceneError if there is none that can be trusted."""
    path = folder / FILE
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise SceneError(
            f"{folder} holds no checkpoint: no run was begun there, or it has finished"
        ) from None
    except OSError as error:
        raise SceneError(f"cannot read the checkpoint {path}: {error.strerror}") from None
    if not content.startswith(_FIRST_LINE):
        raise SceneError(f"{path} is not a checkpoint of this program")
    digest, _, body = content[len(_FIRST_LINE) :].partition(b"\n")
    if hashlib.sha256(body).hexdigest().encode() != digest:
        raise SceneError(f"the checkpoint {path} is damaged: its checksum does not fit its content")
    line, _, packed = body.partition(b"\n")
    header = json.loads(line)
    scene = scene_from_dict(header["scene"])
    if fingerprint(scene) != header["fingerprint"]:
        raise SceneError(
            f"the checkpoint {path} is of another version of iceslide_fem or DOLFINx, or a file "
            "that its scene names has changed: start the run anew"
        )
    try:
        with np.load(io.BytesIO(packed), allow_pickle=False) as file:
            arrays = {key: file[key] for key in file}
    except (ValueError, zipfile.BadZipFile):
        raise SceneError(f"the checkpoint {path} is damaged: it has no arrays") from None
    return Checkpoint(scene, _nested(header["numbers"] | arrays))


def same_scene(scene: Scene, checkpoint: Checkpoint, folder: Path) -> None:
    """Raise SceneError, naming the first difference, if the checkpoint is of another scene."""
    if fingerprint(scene) == fingerprint(checkpoint.scene):
        return
    here, there = flat(scene.as_dict()), flat(checkpoint.scene.as_dict())
    key = next((key for key in here if key != "name" and here[key] != there[key]), "rubber.mesh")
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
