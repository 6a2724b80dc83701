"""Shear stiffness of a tread block from a slice run, cached.

The block slides under Coulomb friction that shears it by 0.1 %. The stiffness is the friction
stress mu p over the mean displacement of its foot relative to its top.
"""

from __future__ import annotations

import contextlib
import csv
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from iceslide_fem.fenics.cache import cache_folder
from iceslide_fem.runtime.errors import OutputError, SceneError
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.runtime.launch import module_words
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.scene.materials import MooneyRivlin

STRAIN = 1e-3  # shear of the block, small enough for linear stiffness
MU = 0.05  # small, so the block does not tip
PLACES = 16  # Gauss points on the foot
SPEED, DURATION = 1.0, 1e-6  # m/s, s: a short run; equilibrium is found before sliding
PATIENCE = 600.0  # s


def block_stiffness(rubber: MooneyRivlin, length: float, height: float) -> float:
    """c (Pa/m) of a block in plane strain with a fixed top; close to G / H for a flat block.

    length, height: m. It is computed once per program version, and cached in the user's cache
    folder. Raises SceneError if the slice cannot run.
    """
    try:
        given = _scene(rubber, length, height)
        scene = scene_from_dict(given)
        kept = cache_folder() / f"shear-{fingerprint(scene)}.json"
        with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
            return float(json.loads(kept.read_bytes())["stiffness_Pa_per_m"])
        found = _computed(given)
    except SceneError as error:
        raise SceneError(
            f"the shear stiffness of a block, {1e3 * length:.4g} mm long and {1e3 * height:.4g} mm "
            f"high, cannot be computed ({error}); give --stiffness a number, such as 7e7Pa/m"
        ) from None
    with contextlib.suppress(OSError, OutputError):  # without a cache it is computed again
        kept.parent.mkdir(parents=True, exist_ok=True)
        replace_file(kept, json.dumps({"stiffness_Pa_per_m": found}) + "\n")
    return found


def _scene(rubber: MooneyRivlin, length: float, height: float) -> dict[str, Any]:
    """The tables of the block's scene."""
    at, _ = np.polynomial.legendre.leggauss(PLACES)
    return {
        "name": "shear",
        "model": "slice",
        "rubber": {
            "C10": rubber.C10, "C01": rubber.C01, "D1": rubber.D1,
            "length": length, "height": height,
        },
        "load": {
            "pressure": STRAIN * rubber.shear_modulus / MU, "speed": SPEED, "duration": DURATION,
        },
        "friction": {"law": "coulomb", "mu": MU},
        "numerics": {"tolerance": 1e-3},
        "output": {
            "times": 0,
            "probes": {
                f"p{i:02d}": [0.5 * length * float(x), 0.0, 0.0] for i, x in enumerate(at)
            },
        },
    }  # fmt: skip


def _computed(scene: dict[str, Any]) -> float:
    """c (Pa/m) from the run of the scene. Raises SceneError."""
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "shear.toml", Path(folder) / "out"
        file.write_text(tomlkit.dumps(scene), encoding="utf-8")
        words = module_words("iceslide_fem.cli", "run", str(file), "--out", str(out))
        try:
            done = subprocess.run(
                [*words, "--no-report"], capture_output=True, text=True, timeout=PATIENCE
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise SceneError(f"iceslide run: {error}") from None
        if done.returncode:
            said = done.stderr.strip().splitlines() or ["it says nothing"]
            raise SceneError(f"iceslide run: {said[-1].removeprefix('iceslide: ')}")
        with open(out / "probes.csv", encoding="utf-8") as table:
            rows = list(csv.DictReader(table))[-PLACES:]
    _, weights = np.polynomial.legendre.leggauss(PLACES)
    moved = {row["probe"]: float(row["displacement_x_m"]) for row in rows}
    mean = 0.5 * weights @ [moved[name] for name in sorted(moved)]
    return MU * float(scene["load"]["pressure"]) / abs(float(mean))
