"""Without DOLFINx, petsc4py, MPI and fcntl, all that needs none of them works."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iceslide_fem.preprocess.footprint.synthetic import Tread, grey_picture, save

CASES = Path(__file__).parent.parent / "cases"

# As if they were not installed: what `pip install .` gives on a laptop or on Windows.
PLAIN = """
import sys

class Missing:
    names = {"basix", "dolfinx", "dolfinx_solver", "fcntl", "ffcx", "mpi4py", "petsc4py", "ufl"}

    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in self.names:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

for name in [*sys.modules]:
    if name.split(".")[0] in Missing.names:
        del sys.modules[name]
sys.meta_path.insert(0, Missing())
from iceslide_fem.cli import main

main(sys.argv[1:])
"""


def plain(folder, *words):
    """The command, run in `folder` on such a Python."""
    command = [sys.executable, "-c", PLAIN, *map(str, words)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


POINT = (CASES / "thesis_1bar.toml", "--set", "model=point", "--set", "ice.heat=column")


def test_a_point_its_pictures_and_a_sweep_of_points(tmp_path):
    done = plain(tmp_path, "run", *POINT, "--out", "point")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "point" / "report.png").stat().st_size > 10_000
    done = plain(tmp_path, "view", "point")
    assert done.returncode == 0, done.stderr
    assert "report.png" in done.stdout
    done = plain(tmp_path, "sweep", *POINT, "--vary", "load.speed=1,2,3", "--out", "sweep")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "sweep" / "sweep.csv").read_text().count("done") == 3


@pytest.mark.parametrize("model", ["point", "slice", "block"])
def test_info_of_every_model(model, tmp_path):
    heat = ["--set", "ice.heat=column"]
    done = plain(tmp_path, "info", CASES / "thesis_1bar.toml", "--set", f"model={model}", *heat)
    assert done.returncode == 0, done.stderr


def test_a_footprint(tmp_path):
    tread = Tread(ribs=3, pitch=36e-3, sipe=4e-3).footprint((84, 108))
    save(grey_picture(tread, 4e5), tmp_path / "tread.png")
    size = ["--length", "0.18", "--width", "140 mm"]
    words = ["tread.png", "--max-pressure", "4bar", *size, "--out", "map"]
    done = plain(tmp_path, "footprint", *words)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("model", ["slice", "block"])
def test_finite_elements_say_in_a_sentence_what_to_install(model, tmp_path):
    done = plain(tmp_path, "run", CASES / "thesis_1bar.toml", "--set", f"model={model}")
    assert done.returncode == 2
    assert all(line.startswith("Note: ") for line in done.stdout.splitlines())
    assert done.stderr.count("\n") == 1 and "DOLFINx" in done.stderr and not [*tmp_path.iterdir()]


def test_the_python_interface_of_the_point(tmp_path):
    code = PLAIN.split("from iceslide_fem.cli")[0] + (
        "from iceslide_fem import point\n"
        "conditions = point.Conditions.of(pressure=1e5, speed=3.0, temperature=269.15, k=0.266,\n"
        "    D=29e-6, H_V=2.86e-6, initial_height=70e-9, duration=7e-3)\n"
        "print(point.simulate(conditions).mu_peak[0])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert np.isclose(float(done.stdout), 0.5307, rtol=5e-3)
