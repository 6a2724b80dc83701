"""All components of the film law together in slices: ledgers, frames, restart, ranks."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")  # before anything of DOLFINx
from slides import slide, started  # noqa: E402

from iceslide_fem.coupling.ledger import Ledger  # noqa: E402
from iceslide_fem.coupling.restart import checkpoint_tables, resumed  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.output.history import slide_row  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = pytest.mark.fe
SURFACE = Path(__file__).parent.parent / "cases" / "surfaces" / "compound_B.csv"
FRAMES = {"attached": {"motion": "attached"}, "on ice": {"motion": "sliding"}}


def scene(frame, heat="column", duration=0.1e-3, **film):
    """Rubber of 5 mm that relaxes and takes heat, on wet and rough ice; water carries, dry contact
    limits.
    """
    return scene_from_dict(
        {
            "name": "all", "model": "slice",
            "rubber": {
                "C10": 0.8e6, "C01": 0.2e6, "nu": 0.48, "length": 5e-3, "width": 5e-3,
                "height": 3e-3, "heat": True, "inertia": True,
                "prony": [[0.2, 1e-5], [0.3, 1e-3]], "modulus_is": "instantaneous",
                "roughness": {"rms": 5e-6, "longest": 1e-4, "shortest": 1e-5},
            },
            "load": {"pressure": 2e5, "speed": 4.0, "duration": duration},
            "ice": {
                "temperature": "-5 degC", "water": 3e-6, "heat": heat, **FRAMES[frame],
                "roughness": {"rms": 1e-6, "longest": 1e-3, "shortest": 1e-5},
            },
            "water": {"viscosity": [[253.15, 4e-3], [273.15, 1.8e-3]]},
            "film": {
                "voids": "carry", "contact": str(SURFACE), "contact_age": True,
                "dry_stress": 3e5, "initial_height": 0.0, **film,
            },
            "numerics": {"tolerance": 1e-2, "refinement": 0.5},
        }
    )  # fmt: skip


def unaccounted(row):
    """What the ledger of the water misses, over what the ice has brought."""
    kept = ("below", "left", "in_sipes", "pushed_out")
    there = sum(row[f"water_{name}_m3"] for name in kept)
    return abs(row["water_squeezed_m3"] + row["water_brought_m3"] - there) / row["water_brought_m3"]


@pytest.mark.parametrize(("frame", "heat"), [("attached", "column"), ("on ice", "column")])
def test_energy_and_water_are_accounted_for(frame, heat):
    sliding = started(scene(frame, heat))
    ledger, rows = Ledger(sliding), []
    for accepted in sliding.steps():
        ledger.add(accepted)
        rows.append(slide_row(sliding, ledger, accepted)._asdict())
        assert unaccounted(rows[-1]) < 1e-10
    assert abs(ledger.imbalance) < 5e-3
    assert 1e-3 * ledger.friction_work < ledger.hysteresis_heat < ledger.friction_work
    last = rows[-1]
    assert last["rubber_heat_J"] > 0.0 and last["latent_heat_J"] < 0.0  # it freezes
    assert 0.0 < last["water_borne_fraction"] < 1.0
    assert last["contact_area_fraction"] > rows[0]["contact_area_fraction"]


def test_a_restart_goes_on():
    whole = scene("on ice")
    sliding = started(whole)
    steps = sliding.steps()
    for _ in range(12):
        next(steps)
    again = resumed(build_block(whole, MPI.COMM_SELF), checkpoint_tables(sliding))
    for _ in range(3):
        next(steps)
        again.advance()
    here, there = (one.current for one in (sliding, again))
    for name in ("log_height", "squeezed_height", "age"):
        values = (getattr(one.interface, name) for one in (there, here))
        np.testing.assert_allclose(*values, rtol=3e-4, atol=1e-15)
    force = here.mechanics.friction_force
    assert there.mechanics.friction_force == pytest.approx(force, rel=1e-4)


@pytest.mark.mpi
def test_all_components_are_the_same_on_any_number_of_ranks():
    alone, together = (
        slide(scene("on ice", duration=0.02e-3), comm) for comm in (MPI.COMM_SELF, MPI.COMM_WORLD)
    )
    mu = np.interp(together["time_s"], alone["time_s"], alone["mu"])
    assert together["mu"] == pytest.approx(mu, rel=1e-5)
