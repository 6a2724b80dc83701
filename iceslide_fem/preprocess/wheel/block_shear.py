"""Shear stiffness of a tread block by the program's own slice, kept for the next time.

The block slides under Coulomb's friction that shears it by 0.1 %. Then the friction stress is
mu p, and the stiffness is that over the mean displacement of its foot relative to its top.
"""

from __future__ import annotations

import contextlib
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from iceslide_fem.fenics.cache import cache_folder
from iceslide_fem.runtime.errors import OutputError, SceneError
from iceslide_fem.runtime.files import replace_file
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.fingerprint import fingerprint
from iceslide_fem.scene.materials import MooneyRivlin

STRAIN = 1e-3  # shear of the block: small, so that c is that of small displacements
MU = 0.05  # so that the block does not tip
PLACES = 16  # on the foot, of Gauss's rule
SPEED, DURATION = 1.0, 1e-6  # m/s, s: a moment of sliding, equilibrium is before it
PATIENCE = 600.0  # s


def block_stiffness(rubber: MooneyRivlin, length: float, height: float) -> float:
    """c (Pa/m) of a block in plane strain, m, whose top is held: near G / H of a flat one.

    Found once by each version of the program, and then kept in the user's cache folder. Raises
    SceneError where the slice cannot be run.
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
    with contextlib.suppress(OSError, OutputError):  # what cannot be kept is computed again
        kept.parent.mkdir(parents=True, exist_ok=True)
        replace_file(kept, json.dumps({"stiffness_Pa_per_m": found}) + "\n")
    return found


def _scene(rubber: MooneyRivlin, length: float, height: float) -> dict[str, Any]:
    """The slide of a block, as a scene's tables."""
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
    """c (Pa/m) of the slide. Raises SceneError."""
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "shear.toml", Path(folder) / "out"
        file.write_text(tomlkit.dumps(scene), encoding="utf-8")
        words = [sys.executable, "-m", "iceslide_fem.cli", "run", str(file), "--out", str(out)]
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
