"""Rubber of a temperature of its own, against half-spaces that touch."""

import numpy as np
import pytest

from iceslide_fem.film.contact_age import contact_age
from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.point import point_history
from iceslide_fem.scene import scene_from_dict

SIDE, TIME = 20e-3, 5e-3


def scene(cold, warm, model="point", **changes):
    """Nearly no friction: 1 mm/s, and a film that conducts perfectly."""
    tables = {
        "rubber": {
            "compound": "B", "length": SIDE, "width": SIDE, "height": 5e-3, "heat": True,
            "temperature": warm + 273.15,
        },
        "load": {"pressure": 2e5, "speed": 1e-3, "duration": TIME},
        "ice": {"temperature": cold + 273.15},
        "film": {"k": 0.4, "D": 4e-5, "H_V": 1.2e-6, "conductance": 1e9, "initial_height": 0.0,
                 "dry_stress": 1.0},
    }  # fmt: skip
    for name, table in changes.items():
        tables[name] = tables.get(name, {}) | table
    return scene_from_dict({"name": "warm", "model": model, **tables})


def given(solid, rise):
    """Heat (J/m2) that a half-space takes in `TIME` at a constant rise of its surface."""
    return 2.0 * solid.effusivity * rise * np.sqrt(TIME / np.pi)


@pytest.mark.quick
def test_warm_rubber_and_cold_ice_meet_at_their_contact_temperature():
    here = scene(-20.0, 10.0)
    last = point_history(here)[0][-1]
    ice, rubber = here.ice.solid, here.rubber.solid
    meet = (ice.effusivity * -20.0 + rubber.effusivity * 10.0) / (
        ice.effusivity + rubber.effusivity
    )
    assert last.surface_temperature_C == pytest.approx(meet, abs=2e-3)
    assert last.ice_heat_J == pytest.approx(SIDE**2 * given(ice, meet + 20.0), rel=3e-3)
    assert last.rubber_heat_J == pytest.approx(-last.ice_heat_J, rel=1e-3)
    assert last.film_height_m == 0.0


@pytest.mark.quick
@pytest.mark.parametrize("kelvin", [20.0, 60.0])
def test_warm_rubber_melts_ice_with_what_the_ice_does_not_take(kelvin):
    here = scene(-4.0, kelvin)
    last = point_history(here)[0][-1]
    of_ice, of_rubber = given(here.ice.solid, 4.0), given(here.rubber.solid, -kelvin)
    assert last.surface_temperature_C == pytest.approx(0.0, abs=1e-3)
    assert last.ice_heat_J == pytest.approx(SIDE**2 * of_ice, rel=3e-3)
    assert last.rubber_heat_J == pytest.approx(SIDE**2 * of_rubber, rel=3e-3)
    melted = -(of_ice + of_rubber) / here.ice.solid.melting_enthalpy
    assert last.film_height_m + last.squeezed_height_m == pytest.approx(melted, rel=1e-2)


@pytest.mark.quick
def test_insulated_rubber_ages_at_its_own_temperature():
    """Against the creep compliance at that temperature; the ice stays at its own."""
    arms = {"prony": [[0.3, 1e-3], [0.3, 1e-1]], "modulus_is": "instantaneous",
            "wlf": {"reference": 293.15, "C1": 7.0, "C2": 120.0}, "heat": False}  # fmt: skip
    film = {"contact_age": True, "k": None, "D": None, "H_V": None, "conductance": None}
    for celsius in (-4.0, 15.0):
        here = scene(-4.0, celsius, rubber=arms, film=film)
        rows, _ = point_history(here)
        age, p = contact_age(here), np.full(1, 2e5)
        for row in (rows[len(rows) // 2], rows[-1]):
            due, *_ = age.under_constant(p, np.full(1, row.time_s), np.full(1, celsius + 273.15))
            assert row.contact_area_fraction == pytest.approx(due[0], rel=1e-6)


def test_a_temperature_that_does_nothing_is_noted():
    cold = scene(-4.0, 20.0, rubber={"heat": False}, film={"conductance": None})
    said = [one for one in notes(cold) if "rubber.temperature" in one]
    assert said == ["rubber.temperature has no effect without rubber.heat or relaxation"]


@pytest.mark.fe
@pytest.mark.parametrize(
    ("heat", "ice"),
    [
        (True, {"motion": "attached"}),
        (True, {"motion": "sliding"}),
        ("mesh", {"motion": "attached", "heat": "mesh"}),
    ],
)
def test_slices_take_the_heat_of_warm_rubber(heat, ice):
    """As a point below a nearly uniform pressure; meshes begin with the error of one element."""
    pytest.importorskip("dolfinx")
    from slides import slide

    rubber = {"heat": heat, "length": 5e-3, "width": 5e-3, "height": 1e-3, "C10": 50e6,
              "C01": 50e6, "nu": 0.49, "compound": None}  # fmt: skip
    short = {"duration": 0.5e-3}
    tables = {"rubber": rubber, "load": short, "ice": ice}
    found = slide(scene(-20.0, 10.0, "slice", **tables))
    alone = scene(-20.0, 10.0, rubber={"length": 5e-3, "width": 5e-3}, load=short)
    last = point_history(alone)[0][-1]
    for name in ("ice_heat_J", "rubber_heat_J"):
        assert found[name][-1] == pytest.approx(getattr(last, name), rel=3e-2)
