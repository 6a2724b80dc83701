"""Lugs: how far water has to go, and which sipe takes it."""

import numpy as np
import pytest

from iceslide_fem.film.voids import Lugs, lugs_of, open_sipes
from iceslide_fem.scene.rubber import Rubber

pytestmark = pytest.mark.quick

ENDS = np.array([[-10.0, -4.0], [-3.0, 3.0], [4.0, 10.0]]) * 1e-3
STRIP = Lugs(ENDS, np.inf, np.full(2, 1e-6))


def squeezed(aspect, terms=200):
    """beta of the torsion constant beta a b^3 of a rectangle: the series of Saint-Venant."""
    n = np.arange(1, 2 * terms, 2)
    return (1.0 - 192.0 / (np.pi**5 * aspect) * np.sum(np.tanh(n * np.pi * aspect / 2) / n**5)) / 3


@pytest.mark.parametrize("aspect", [1.0, 1.3, 2.0, 5.0, 20.0])
def test_a_rectangular_lug_drains_to_all_sides(aspect):
    lug = Lugs(np.array([[0.0, 1.0]]), aspect, np.zeros(0))
    assert lug.longest**2 == pytest.approx(3.0 * squeezed(aspect), rel=6e-3)
    turned = Lugs(np.array([[0.0, aspect]]), 1.0, np.zeros(0))
    assert turned.longest == pytest.approx(lug.longest)


def test_a_full_sipe_makes_two_lugs_one():
    for openness, lengths in (
        ([1.0, 1.0], [6, 6, 6]),
        ([0.0, 1.0], [13, 13, 6]),
        ([0.0, 0.0], [20, 20, 20]),
        ([0.5, 1.0], [9.5, 9.5, 6]),
    ):
        found = STRIP.outflow_lengths(np.array(openness))
        np.testing.assert_allclose(found, 1e-3 * np.array(lengths))


def test_all_that_flows_out_gets_somewhere():
    outflow = np.array([1.0, 2.0, 4.0])
    both = STRIP.into_sipes(outflow, np.ones(2))
    np.testing.assert_allclose(both, [1.5, 3.0])
    past = STRIP.into_sipes(outflow, np.array([0.0, 1.0]))
    np.testing.assert_allclose(past, [0.0, 0.5 + 1.0 + 2.0])
    assert not STRIP.into_sipes(outflow, np.zeros(2)).any()
    narrow = Lugs(ENDS, 6e-3, np.full(2, 1e-6))  # as much goes to its sides
    np.testing.assert_allclose(narrow.into_sipes(outflow, np.ones(2)), [0.75, 1.5])


def test_sipes_close_over_the_last_of_their_volume():
    filled = np.array([0.0, 0.9, 0.95, 1.0, 1.2])
    np.testing.assert_allclose(open_sipes(filled), [1.0, 1.0, 0.5, 0.0, 0.0])


def test_lugs_are_those_of_the_block():
    rubber = Rubber.model_validate(
        {"compound": "B", "length": 20e-3, "width": 12e-3, "height": 8e-3, "stores_water": True,
         "sipes": [{"position": -2e-3, "width": 5e-4, "depth": 4e-3}],
         "grooves": [{"position": 3e-3, "width": 1e-3, "depth": 4e-3}]}
    )  # fmt: skip
    lugs = lugs_of(rubber)
    np.testing.assert_allclose(lugs.ends, [[-10e-3, -2.25e-3], [-1.75e-3, 10e-3]])
    assert lugs.width == pytest.approx(5e-3) and lugs.volumes.tolist() == [pytest.approx(2e-6)]
    assert lugs_of(rubber, wide=True).width == np.inf
    np.testing.assert_array_equal(lugs.at(np.array([-3e-3, 0.0])), [0, 1])
    assert lugs_of(rubber.model_copy(update={"stores_water": False})).volumes.tolist() == [np.inf]
