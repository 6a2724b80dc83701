"""Blocks that come to rest and start again under friction that is not viscous."""

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from slides import slide  # noqa: E402

from iceslide_fem.scene import scene_from_dict  # noqa: E402

pytestmark = pytest.mark.fe

PENALTY, HEIGHT, LENGTH, WIDTH = 1e12, 5e-5, 1e-3, 1e-3
MODULUS = 2.0 * (166.2e6 + 106.8e6)  # G of the rubber, Pa
# Shear stress per displacement of the plate while the bottom sticks: rubber and contact in series.
STIFFNESS = 1.0 / (HEIGHT / MODULUS + 1.0 / PENALTY)


def uniform(load, **tables):
    """A block of one degree of freedom: flat and stiff, on a contact softer than itself."""
    size = {"length": LENGTH, "width": WIDTH, "height": HEIGHT}
    whole = {
        "name": "uniform",
        "model": "slice",
        "rubber": {"C10": 166.2e6, "C01": 106.8e6, "D1": 0.0055e-6} | size,
        "load": {"pressure": 5e5} | load,
        "ice": {"temperature": 253.15, "heat": "column"},
        "numerics": {"penalty": PENALTY, "tolerance": 1e-2},
    }
    return scene_from_dict(whole | tables)


def block_on_spring(times, way, strength, first):
    """tau of a block on a spring of this stiffness that slips where its strength is reached."""
    shear = [first]
    for step, most in zip(np.diff(way), strength[1:], strict=True):
        shear.append(np.clip(shear[-1] + STIFFNESS * step, -most, most))
    return np.interp(times, np.linspace(0.0, times[-1], len(way)), shear)


def fine(course, end):
    """Values of rows at 20,001 times, and their integral."""
    times = np.linspace(0.0, end, 20_001)
    values = np.interp(times, *np.array(course).T)
    steps = 0.5 * np.diff(times) * (values[1:] + values[:-1])
    return values, np.concatenate([[0.0], np.cumsum(steps)])


def test_a_block_that_stops_holds_what_its_contact_holds_and_starts_with_its_stiffness():
    """Less pressure at rest lets it spring back to the new limit; more pressure changes nothing."""
    speed = [[0.0, 1e-3], [1e-3, 1e-3], [1.2e-3, 0.0], [3e-3, 0.0], [3.2e-3, 1e-3]]
    pressure = [[1.4e-3, 5e5], [1.8e-3, 2e5], [2.2e-3, 2e5], [2.6e-3, 5e5]]
    load = {"speed": speed, "pressure": pressure, "duration": 4e-3}
    found = slide(uniform(load, friction={"law": "coulomb", "mu": 0.3}))
    _, way = fine(speed, 4e-3)
    nominal, _ = fine(pressure, 4e-3)
    times = found["time_s"]
    exact = block_on_spring(times, way, 0.3 * nominal, 1.5e5)
    shear = found["friction_force_N"] / (LENGTH * WIDTH)
    at_rest = np.interp([1.3e-3, 2.0e-3, 2.8e-3, 4e-3], times, shear)
    np.testing.assert_allclose(at_rest, [1.5e5, 6e4, 6e4, 1.5e5], rtol=5e-3)
    np.testing.assert_allclose(shear, exact, atol=5e-3 * 1.5e5)
    rises = (times > 3.0e-3) & (shear > 7e4) & (shear < 1.4e5)
    assert rises.sum() >= 3
    assert abs(found["energy_imbalance"][-1]) < 1e-3


def test_dry_contact_that_starts_from_rest_shears_before_it_slips():
    """tau = c x up to k tau_b; the ice gets the work less what springs keep.

    The spring of the contact is of first order in the step. Here it is nine tenths of what yields.
    """
    speed = [[0.0, 0.0], [1e-3, 1e-3], [2e-3, 1e-3]]
    film = {"k": 0.3, "D": 5e-5, "H_V": 5e-6, "dry_stress": 4e5, "initial_height": 0.0}
    found = slide(uniform({"speed": speed, "duration": 2e-3}, film=film))
    _, way = fine(speed, 2e-3)
    exact = block_on_spring(found["time_s"], way, np.full(way.size, 1.2e5), 0.0)
    shear = found["friction_force_N"] / (LENGTH * WIDTH)
    np.testing.assert_allclose(shear, exact, atol=3e-2 * 1.2e5)
    assert ((shear > 1e4) & (shear < 1.1e5)).sum() >= 3
    work, heat = found["friction_work_J"], found["ice_heat_J"]
    stored = 0.5 * shear**2 / STIFFNESS * LENGTH * WIDTH
    np.testing.assert_allclose(work - heat, stored, atol=1e-2 * work[-1])
    sticks = shear < 1.1e5
    assert heat[sticks].max() < 1e-2 * stored[sticks].max()


@pytest.mark.parametrize("inertia", [False, True])
@pytest.mark.parametrize("refreeze", ["nothing", "all"])
def test_a_block_over_sliding_ice_goes_through_a_stop(inertia, refreeze):
    """Its films freeze or stay; hundreds of steps, and its energies close."""
    speed = [[0.0, 4.0], [0.4e-3, 4.0], [0.7e-3, 0.0], [1.2e-3, 0.0], [1.5e-3, 4.0]]
    block = {"compound": "B", "length": 2e-3, "width": 2e-3, "height": 1e-3, "inertia": inertia}
    scene = scene_from_dict(
        {
            "name": "stop",
            "model": "slice",
            "rubber": block,
            "load": {"pressure": 2e5, "speed": speed, "duration": 2e-3},
            "ice": {"temperature": 271.15, "motion": "sliding", "heat": "column"},
            "film": {"dry_stress": 1.2e5, "initial_height": 0.0, "refreeze": refreeze},
            "numerics": {"tolerance": 3e-2},
        }
    )
    found = slide(scene)
    assert found["time_s"][-1] == pytest.approx(2e-3) and found["time_s"].size < 800
    work = found["friction_work_J"][-1]
    assert abs(found["energy_imbalance"][-1]) < 1e-2
    rests = (found["time_s"] > 0.9e-3) & (found["time_s"] < 1.2e-3)
    heat = np.ptp(found["ice_heat_J"][rests] + found["latent_heat_J"][rests])
    assert heat < 2e-2 * work
    assert found["mu"][-1] > 0.05
