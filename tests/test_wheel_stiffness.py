"""Shear stiffness of a tread block by finite elements: near G / H of a flat one, and kept."""

import subprocess

import pytest

pytest.importorskip("iceslide_fem.fenics.compat")

from iceslide_fem.preprocess.wheel import block_shear
from iceslide_fem.scene.materials import COMPOUNDS

pytestmark = pytest.mark.fe

HEIGHT = 8e-3


def test_a_flat_block_has_g_over_h_and_is_computed_once(tmp_path, monkeypatch):
    monkeypatch.setenv("ICESLIDE_CACHE", str(tmp_path))
    rubber = COMPOUNDS["B"]
    flat = rubber.shear_modulus / HEIGHT
    ratios = [
        block_shear.block_stiffness(rubber, times * HEIGHT, HEIGHT) / flat for times in (2.5, 25.0)
    ]
    # The ends give way: what lacks falls as H / L.
    assert ratios[0] == pytest.approx(0.9025, abs=0.003)
    assert 1.0 - ratios[1] == pytest.approx(0.1 * (1.0 - ratios[0]), rel=0.2)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("not kept"))
    again = block_shear.block_stiffness(rubber, 2.5 * HEIGHT, HEIGHT)
    assert again == pytest.approx(ratios[0] * flat, rel=1e-12)
