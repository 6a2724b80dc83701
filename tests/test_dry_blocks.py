"""Dry shear below a block on a mesh of the user's own."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

from program import run  # noqa: E402

from iceslide_fem.postprocess.results import read_run  # noqa: E402
from iceslide_fem.scene import load_scene  # noqa: E402

pytestmark = pytest.mark.fe

CASE = Path(__file__).parent.parent / "cases" / "user_mesh.toml"
SHORT = ["film.initial_height=0nm", "numerics.tolerance=1e-2", "load.duration=0.3ms"]


def history(folder, *changes):
    """The history of the case on its own mesh."""
    run(load_scene(CASE, [*SHORT, *changes]), folder)
    return read_run(folder).history


def test_dry_contact_of_one_strength_shears_with_it(tmp_path):
    """mu = k tau_b / p on what touches, at all times, of ice that is too cold to melt."""
    contact = ["film.k=0.3", "film.D=50um", "film.H_V=5um"]
    found = history(tmp_path, "film.dry_stress=1bar", "ice.temperature=-20degC", *contact)
    np.testing.assert_allclose(found["mu"], 0.3 * found["contact_fraction"], rtol=1e-6)
    assert 0.5 < found["contact_fraction"][0] < 1.0
    assert np.abs(found["energy_imbalance"]).max() < 1e-9


def test_dry_contact_that_softens_warms_the_ice_and_keeps_energy(tmp_path):
    dry = ["film.dry_stress=3.3bar", "film.dry_softening=10K", "rubber.inertia=true"]
    found = history(tmp_path, *dry)
    mu, strength = found["mu"], found["shear_strength_Pa"]
    assert mu[-1] < 0.9 * mu[0]
    assert strength[-1] < strength[0] == pytest.approx(3.3e5 * 0.45, rel=1e-6)
    assert np.abs(found["energy_imbalance"]).max() < 1e-3
