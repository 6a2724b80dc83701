"""Combinations at which the solver once failed, and what it says where nothing holds."""

import numpy as np
import pytest

pytest.importorskip("iceslide_fem.fenics.compat")
from iceslide_fem.coupling.sliding import Sliding  # noqa: E402
from iceslide_fem.fenics.compat import MPI  # noqa: E402
from iceslide_fem.mechanics.block import build_block  # noqa: E402
from iceslide_fem.mechanics.contact import default_penalty  # noqa: E402
from iceslide_fem.mechanics.press import press, start_sliding  # noqa: E402
from iceslide_fem.runtime.errors import SimulationStopped  # noqa: E402
from iceslide_fem.scene import scene_from_dict  # noqa: E402
from iceslide_fem.scene.materials import COMPOUNDS  # noqa: E402

pytestmark = pytest.mark.fe


def a_slice(numerics, **load):
    return scene_from_dict(
        {
            "name": "stability",
            "model": "slice",
            "rubber": {"compound": "B"},
            "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "4 ms"} | load,
            "numerics": {"tolerance": 1e-2, "refinement": 0.5} | numerics,
        }
    )


@pytest.mark.parametrize(
    ("penalty", "step"), [(0.25, 3e-4), (1.0, 1e-3), (2.0, 1e-3), (10.0, 1e-3), (10.0, 3e-4)]
)
def test_long_steps_across_the_lift_off_of_points_find_equilibrium(penalty, step):
    """Monotone damping alone stalls where one point lifts off on the way."""
    usual = default_penalty(COMPOUNDS["B"], 1e-3, 0.1)
    numerics = {"penalty": penalty * usual, "max_step": step, "film_integrator": "implicit-euler"}
    block = build_block(a_slice(numerics), MPI.COMM_SELF)
    press(block, lambda _: None)
    start_sliding(block, lambda _: None)
    sliding = Sliding(block)
    while sliding.current.time < 4e-3:
        assert sliding.advance().rejected == 0
    contact = block.contact
    assert block.normal_force(contact) == pytest.approx(block.scale * block.force, rel=1e-3)
    assert np.isfinite(sliding.shear(sliding.current.interface, sliding.current.loads)).all()


def test_a_stop_names_the_physical_limit():
    block = build_block(a_slice({}, pressure="5 bar", speed="100 m/s"), MPI.COMM_SELF)
    press(block, lambda _: None)
    with pytest.raises(SimulationStopped, match="no equilibrium when bringing it to") as stop:
        start_sliding(block, lambda _: None)
    words = str(stop.value)
    assert "an edge folds under the block: the sides carry" in words
    assert "it carries its load of 5 bar up to mu = 0." in words
