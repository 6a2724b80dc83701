"""Ice of a depth on layers and a base, below single points: elements, closed forms, scenes."""

import numpy as np
import pytest

from iceslide_fem.materials import ICE, Layer, Solid
from iceslide_fem.thermal_layers import FIRST_LAYER, LAYER_RATIO, layers, stacked_layers

pytestmark = pytest.mark.quick

STEEL = Solid(50.0, 7850.0, 470.0)
FOAM = Solid(0.035, 30.0, 1400.0)
DURATION = 0.3  # s


def a_stack(*parts):
    """Layers of (thickness, solid), downwards."""
    return [Layer(f"layer {i}", *part) for i, part in enumerate(parts)]


@pytest.mark.parametrize("duration", [1e-4, 0.3, (1e-3, 0.3)])
def test_a_half_space_has_the_elements_of_layers(duration):
    found = stacked_layers(a_stack((np.inf, ICE)), duration)
    np.testing.assert_array_equal(found.thickness, layers(ICE.diffusivity, duration))
    assert not found.layer.any() and not found.base


@pytest.mark.parametrize("to_base", [False, True])
@pytest.mark.parametrize(
    "parts",
    [
        [(1e-3, ICE), (10e-3, STEEL)],
        [(10e-6, ICE), (10e-3, STEEL)],
        [(1e-3, ICE), (1e-6, FOAM), (3e-3, STEEL)],
        [(0.4e-3, ICE), (0.3e-3, ICE), (0.3e-3, ICE)],
    ],
)
def test_elements_end_on_interfaces_and_grow_no_faster_than_in_one_solid(parts, to_base):
    found = stacked_layers(a_stack(*parts), DURATION, to_base=to_base)
    for place, (thickness, _) in enumerate(parts[: None if found.base else -1]):
        assert found.thickness[found.layer == place].sum() == pytest.approx(thickness, rel=1e-9)
    thermal = found.thickness / np.sqrt([parts[i][1].diffusivity for i in found.layer])
    above = np.cumsum(thermal) - thermal
    first = FIRST_LAYER * DURATION**0.5
    assert (thermal <= (first + (LAYER_RATIO - 1.0) * above) * (1.0 + 1e-9)).all()
    assert found.base == (to_base or above[-1] + thermal[-1] < 4.0 * DURATION**0.5)


def test_a_stack_is_cut_where_heat_does_not_reach():
    found = stacked_layers(a_stack((1e-3, ICE), (1.0, STEEL), (1.0, ICE)), DURATION)
    assert not found.base
    assert found.layer[-1] == 1
    alpha = np.where(found.layer == 0, ICE.diffusivity, STEEL.diffusivity)
    assert 4.0 < np.sum(found.thickness / np.sqrt(alpha * DURATION)) < 4.0 * LAYER_RATIO
    whole = stacked_layers(a_stack((1e-3, ICE), (1.0, STEEL)), DURATION, to_base=True)
    assert whole.base
    assert whole.thickness.sum() == pytest.approx(1.001)
