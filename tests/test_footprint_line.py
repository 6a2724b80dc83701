"""The mono-dimensional model against the map, closed forms and figures by hand."""

from dataclasses import replace

import numpy as np
import pytest

from iceslide_fem import reference
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.jaeger import TABLE_1_ICE, jaeger_rise
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic, State, heat_model
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap, as_map, gaussian_profile
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene.materials import CONTACT_TABLES, MELTING_TEMPERATURE, Solid

pytestmark = pytest.mark.quick

LENGTH, PEAK = 0.18, 2e5
PRINTED, MOVING = Macroscopic(), Macroscopic(source="moving", slip=1.0)


def macroscopic_line(pressure, dx, parameters, *own):
    """The one row of the map that the line is."""
    model = heat_model(as_map(pressure, dx), parameters, *own)
    rows = ("pressure", "flux", "rise", "temperature", "state", "mu")
    return model._replace(**{name: getattr(model, name)[0] for name in rows})


@pytest.mark.parametrize("parameters", [PRINTED, MOVING], ids=["next pixel", "moving"])
def test_the_line_is_the_map_that_is_constant_across(parameters):
    x, pressure = gaussian_profile(LENGTH, PEAK, 90)
    pressure[:7] = 0.0  # the tyre has lifted off at the trailing edge
    line = macroscopic_line(pressure, LENGTH / 90, parameters)
    footprint = PressureMap(np.tile(pressure, (5, 1)), LENGTH / 90, 2e-3)
    model = heat_model(footprint, parameters)
    assert line.x == pytest.approx(x)
    for name in ("flux", "rise", "temperature", "state", "mu"):
        whole = getattr(model, name)
        assert whole == pytest.approx(np.tile(getattr(line, name), (5, 1)), rel=1e-12, abs=1e-12)
    assert model.balance.mu == pytest.approx(line.balance.mu)
    assert model.edges == pytest.approx(line.edges)
    assert model.mu[footprint.contact].mean() == pytest.approx(line.mu_mean)


def test_the_film_along_a_line_is_that_of_the_map():
    _, pressure = gaussian_profile(LENGTH, PEAK, 30)
    line = as_map(pressure, LENGTH / 30)
    footprint = PressureMap(np.tile(pressure, (3, 1)), LENGTH / 30, 1e-3)
    film, whole = (
        film_map(each, Ride(3.0, 3.0, MELTING_TEMPERATURE - 4.0), CONTACT_TABLES["B"])
        for each in (line, footprint)
    )
    assert whole.shear == pytest.approx(np.tile(film.shear, (3, 1)), rel=1e-12)


def test_module_2_is_jaegers_formula_with_the_neighbour_on_the_right():
    _, pressure = gaussian_profile(LENGTH, PEAK)
    dx = LENGTH / pressure.size
    line = macroscopic_line(pressure, dx, PRINTED)
    assert line.flux == pytest.approx(0.1 * pressure * 3.0 * 1e-5)
    expected = jaeger_rise(line.flux[1:], dx, 1.0, TABLE_1_ICE)
    assert line.rise[:-1] == pytest.approx(expected) and line.rise[-1] == 0.0
    assert line.temperature == pytest.approx(269.15 + line.rise)


def test_a_uniform_line_under_a_moving_source_has_the_closed_form_of_the_band():
    line = macroscopic_line(np.full(400, PEAK), LENGTH / 400, replace(MOVING, slip=0.3))
    rise = float(reference.band_source_rise(0.1 * PEAK * 3.0 * 0.3, LENGTH, 3.0))
    assert line.rise[0] == pytest.approx(rise)
    assert line.edges.trailing == pytest.approx(269.15 + rise)
    # the last pixel is left after dx: sqrt(dx / L) of the band's rise
    assert line.edges.leading == pytest.approx(269.15 + rise / 20.0)
    twice = replace(MOVING, slip=0.3, effusivity=2.0 * MOVING.effusivity)
    assert macroscopic_line(np.full(400, PEAK), LENGTH / 400, twice).rise[0] == pytest.approx(
        rise / 2.0
    )


def test_every_module_can_be_entered_with_data_of_ones_own():
    pressure = np.array([0.0, 1e5, 2e5, 2e5])
    temperature = np.array([300.0, 273.15, 272.15, 269.15])
    own = macroscopic_line(pressure, 1e-3, MOVING, temperature)
    assert own.state.tolist() == [State.NO_CONTACT, State.WET, State.MIXED, State.DRY]
    assert own.rise == pytest.approx([0.0, 4.0, 3.0, 0.0])
    power = 3.0 * pressure[1:].mean()
    wet = (0.19 + 0.56) * 4.0 / 3.0 / 1e-4 / power
    mixed = (0.19 + 2.22 + 0.56) * 3.0 / 3.0 / 1e-4 / power
    assert own.mu == pytest.approx([0.0, wet, mixed, 0.0])
    camera = macroscopic_line(pressure, 1e-3, MOVING, temperature, np.full(4, State.DRY))
    assert camera.state.tolist() == [0, 1, 1, 1]
    assert camera.mu_mean == pytest.approx(camera.balance.mu)  # all of one state
    assert camera.balance.mu == pytest.approx((0.19 + 2.22) * 7.0 / 3.0 / 1e-4 / power)


def test_a_tread_as_warm_as_the_air_takes_its_own_share():
    """(3.6) over the tread's own rise; with the ice's temperature it is what is printed."""
    _, pressure = gaussian_profile(LENGTH, PEAK, 60)
    printed, same, warm = (
        macroscopic_line(pressure, LENGTH / 60, replace(MOVING, air_temperature=air))
        for air in (None, 269.15, 271.15)
    )
    assert same.mu == pytest.approx(printed.mu)
    area = LENGTH  # 1 m wide
    assert warm.balance.tread == pytest.approx(printed.balance.tread - 0.19 / 1e-4 * 2.0 * area)
    assert warm.balance.ice == printed.balance.ice
    generated = warm.balance.mu * pressure.mean() * 3.0 * area
    assert generated == pytest.approx(warm.balance.ice + warm.balance.tread + warm.balance.water)


def test_materials_enter_where_the_formulas_have_them():
    _, pressure = gaussian_profile(LENGTH, PEAK, 60)
    dx = LENGTH / 60
    line = macroscopic_line(pressure, dx, MOVING)
    more = macroscopic_line(pressure, dx, replace(MOVING, tread=Solid(0.38, 940.0, 1500.0)))
    assert more.balance.tread == pytest.approx(2.0 * line.balance.tread) and line.balance.tread > 0
    assert more.rise == pytest.approx(line.rise)
    water = macroscopic_line(pressure, dx, replace(MOVING, water_conductivity=1.12))
    assert water.balance.water == pytest.approx(2.0 * line.balance.water)
    assert line.balance.water > 0.0
    ice = Solid(3.0, 900.0, 1000.0)
    rise = macroscopic_line(pressure, dx, replace(PRINTED, ice=ice, time=2.0)).rise
    assert rise[:-1] == pytest.approx(jaeger_rise(0.1 * 3e-5 * pressure[1:], dx, 2.0, ice))


def test_a_line_that_touches_nowhere_is_refused():
    with pytest.raises(SceneError, match="touches nowhere"):
        macroscopic_line(np.zeros(5), 1e-3, PRINTED)
