"""A quarter car that brakes: exact stops, works, controls, and what is refused."""

import numpy as np
import pandas as pd
import pytest

from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.braking import brake, brake_ideally, compare_controls, starts
from iceslide_fem.preprocess.wheel.brush import Rolling
from iceslide_fem.preprocess.wheel.charts import charts_of_stops
from iceslide_fem.preprocess.wheel.film_contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import Tread, friction
from iceslide_fem.preprocess.wheel.output import stop_columns, stop_figures
from iceslide_fem.preprocess.wheel.quarter_car import GRAVITY, Brake, QuarterCar, Threshold
from iceslide_fem.preprocess.wheel.slip_table import SlipTable, axes_of_a_stop, slip_table
from iceslide_fem.preprocess.wheel.stops import Stops, thinned
from iceslide_fem.runtime.errors import SceneError, SimulationStopped
from iceslide_fem.scene.materials import CONTACT_TABLES

pytestmark = pytest.mark.quick
CAR = QuarterCar()
SPEEDS = np.array([1.0, 20.0])


def table_of(slips, mu, speeds=SPEEDS):
    """mu over slip, the same at all speeds."""
    return SlipTable(speeds, np.array(slips), np.tile(np.array(mu), (len(speeds), 1)))


CONSTANT = table_of([0.0, 1e-3, 1.0], [0.0, 0.1, 0.1])
PEAKED = table_of([0.0, 0.1, 0.2, 1.0], [0.0, 0.2, 0.2, 0.08])


def test_a_locked_wheel_stops_within_the_distance_of_the_closed_form():
    stop = brake(CONSTANT, 15.0, 1.5, CAR, Brake(1500.0, 0.1))
    history = stop.history
    locks = np.flatnonzero(history.slip == 1.0)[0]
    assert 0 < locks < len(history.time) // 2 and (history.slip[locks:] == 1.0).all()
    v = history.speed[locks]
    rest = stop.distance - history.distance[locks]
    assert np.isclose(rest, (v**2 - 1.5**2) / (2.0 * 0.1 * GRAVITY), rtol=1e-8, atol=0.0)
    due = (v - 1.5) / (0.1 * GRAVITY)
    assert np.isclose(stop.time - history.time[locks], due, rtol=1e-8, atol=0.0)
    assert np.isclose(history.speed[-1], 1.5, rtol=1e-12)


def test_the_load_may_be_another_one_than_the_weight():
    light = brake_ideally(CONSTANT, 15.0, 1.5, QuarterCar(load=0.5 * CAR.wheel_load))
    assert np.isclose(light.distance, (15.0**2 - 1.5**2) / (0.1 * GRAVITY), rtol=1e-8)
    assert np.isclose(light.deceleration, 0.05 * GRAVITY, rtol=1e-8)


@pytest.mark.parametrize("table", [CONSTANT, PEAKED])
def test_what_car_and_wheel_lose_is_the_heat_of_contact_and_brake(table):
    for name, stop in compare_controls(table, 15.0, 1.5).items():
        works = stop.contact_work + stop.brake_work
        assert np.isclose(works, stop.kinetic_energy, rtol=1e-6, atol=0.0), name
        assert min(stop.contact_work, stop.brake_work) > 0.0
    assert np.isclose(stop.kinetic_energy, 0.5 * CAR.mass * (15.0**2 - 1.5**2))


def test_the_heat_of_a_locked_wheel_is_that_of_its_contact():
    stop = compare_controls(PEAKED, 15.0, 1.5)["locked"]
    assert stop.brake_work < 0.05 * stop.contact_work


def test_ideal_is_shorter_than_thresholds_and_thresholds_than_locked():
    stops = compare_controls(PEAKED, 15.0, 1.5)
    distance = {name: stop.distance for name, stop in stops.items()}
    assert distance["ideal"] < 0.9 * distance["threshold"] < 0.8 * distance["locked"]
    assert np.isclose(distance["ideal"], (15.0**2 - 1.5**2) / (2.0 * 0.2 * GRAVITY), rtol=1e-8)
    slip = stops["threshold"].history.slip
    assert np.count_nonzero(np.diff(np.sign(slip - 0.3)) > 0) > 5  # it has cycled
    assert slip.max() < 0.9


def test_a_weak_brake_does_not_lock_the_wheel_and_its_torque_decides():
    stop = brake(PEAKED, 15.0, 1.5, CAR, Brake(50.0, 0.01))
    assert stop.history.slip.max() < 0.05
    # Both move together but for the slip: the mass and I / r^2 are braked by T / r.
    mass = CAR.mass + CAR.inertia / CAR.radius**2
    due = (15.0**2 - 1.5**2) * mass / (2.0 * 50.0 / CAR.radius)
    assert np.isclose(stop.distance, due, rtol=2e-3)
    controlled = brake(PEAKED, 15.0, 1.5, CAR, Brake(50.0, 0.01), Threshold())
    assert controlled.distance == stop.distance


def test_a_locked_wheel_turns_again_where_friction_has_become_stronger_than_the_brake():
    mu = np.array([[0.0, 0.3, 0.3], [0.0, 0.1, 0.05]])
    table = SlipTable(SPEEDS, np.array([0.0, 0.2, 1.0]), mu)
    history = brake(table, 19.0, 1.5, CAR, Brake(150.0, 0.1)).history
    locked = history.slip == 1.0
    assert locked.any() and not locked[-1] and history.slip[-1] < 0.5
    torque = CAR.radius * CAR.wheel_load * history.mu[np.flatnonzero(locked)[-1]]
    assert np.isclose(torque, 150.0, rtol=1e-6)


@pytest.mark.parametrize("threshold", [None, Threshold(), Threshold(0.5, 0.05, 2000.0, 4000.0)])
def test_distances_do_not_depend_on_the_step(threshold):
    stops = [
        brake(PEAKED, 15.0, 1.5, CAR, Brake(), threshold, tolerance) for tolerance in (1e-6, 1e-8)
    ]
    assert np.isclose(*(stop.distance for stop in stops), rtol=3e-5)


def test_a_light_wheel_that_follows_its_torque_at_once_takes_no_tiny_steps():
    steep = table_of([0.0, 1e-3, 0.02, 1.0], [0.0, 0.05, 0.25, 0.08])
    stop = brake(steep, 15.0, 1.5, QuarterCar(inertia=0.01), Brake(80.0, 0.2))
    assert stop.history.time.size < 2000
    mu = 80.0 / (CAR.radius * CAR.wheel_load)
    assert np.isclose(stop.history.mu[-1], mu, rtol=1e-3)


def test_rates_of_the_torque_are_those_of_brake_and_thresholds():
    stop = brake(PEAKED, 15.0, 1.5, CAR, Brake(800.0, 0.4), Threshold(release=3000.0, build=500.0))
    history = stop.history
    longer = np.diff(history.time) > 1e-6
    rates = (np.diff(history.torque)[longer] / np.diff(history.time)[longer]).round(3)
    assert set(rates) <= {2000.0, 500.0, -3000.0, 0.0, -0.0}
    assert 0.0 <= history.torque.min() and history.torque.max() <= 800.0


def test_a_table_of_the_brush_holds_its_points_and_is_straight_between():
    pressure = PressureMap(np.full((1, 20), 2e5), 0.006, 0.006)
    contact = FilmContact(Ride(10.0, 10.0, 269.15), CONTACT_TABLES["B"])
    speeds, slips, tread = [2.0, 10.0], [0.0, 0.2, 1.0], Tread(68e6)
    table = slip_table(pressure, speeds, slips, tread, contact)
    (point,) = friction(pressure, [Rolling(10.0, 0.2)], tread, contact)
    assert np.isclose(table(10.0, 0.2), point.mu, rtol=2e-2)  # both within the law's tolerance
    corners = table.mu[:, 1:].mean()
    assert np.isclose(table(6.0, 0.6), corners, rtol=1e-12)
    slip, mu = table.peak(6.0)
    assert slip == 0.2 and np.isclose(mu, table.mu[:, 1].mean())


REFUSED = [
    (lambda: table_of([0.0, 0.5], [0.0, 0.1]), "go from 0 to 1; given: 0 to 0.5"),
    (lambda: table_of([0.0, 1.0], [0.1, 0.1]), "rolls freely"),
    (lambda: table_of([0.0, 1.0], [0.0, np.nan]), "finite number of 0 or more"),
    (lambda: table_of([0.0, 1.0], [0.0, 0.1], np.array([5.0, 2.0])), "two or more rising speeds"),
    (lambda: table_of([0.0, 1.0], [0.0, 0.1], np.array([0.0, 2.0])), "finite and above 0"),
    (lambda: table_of([0.0, 1.0], [0.0, 0.1, 0.1]), "cannot have the shape"),
    (lambda: CONSTANT(30.0, 0.5), "108 km/h is outside the table of mu, 3.6 to 72 km/h"),
    (lambda: CONSTANT(10.0, -0.1), "outside the table of mu, 0 to 1"),
    (lambda: brake(CONSTANT, 30.0, 2.0, CAR, Brake()), "108 km/h is outside the table"),
    (lambda: brake(CONSTANT, 10.0, 0.5, CAR, Brake()), "1.8 km/h is outside the table"),
    (lambda: brake_ideally(CONSTANT, 10.0, np.nan, CAR), "nan km/h is outside the table"),
    (lambda: brake(CONSTANT, 2.0, 10.0, CAR, Brake()), "the second speed must be below the first"),
    (lambda: axes_of_a_stop(2.0, 10.0), "from 7.2 km/h to 36 km/h is no braking"),
    (lambda: axes_of_a_stop(2.0, 0.0), "to a lower speed above 0"),
    (lambda: QuarterCar(mass=0.0), "the mass of the car is 0; it must be above 0"),
    (lambda: QuarterCar(load=-1.0), "the load of the car is -1"),
    (lambda: Brake(ramp_time=np.inf), "the ramp time of the brake is inf"),
    (lambda: Threshold(0.1, 0.3), "0 < low < high < 1"),
    (lambda: Threshold(release=0.0), "the release of the threshold control is 0"),
]


@pytest.mark.parametrize("make, sentence", REFUSED)
def test_wrong_input_is_one_sentence(make, sentence):
    with pytest.raises(SceneError) as refused:
        make()
    assert sentence in str(refused.value)


def test_a_car_that_does_not_stop_says_so():
    slippery = table_of([0.0, 1.0], [0.0, 1e-4])
    for stop in (lambda: brake(slippery, 15.0, 1.5, CAR, Brake()),
                 lambda: brake_ideally(slippery, 15.0, 1.5, CAR)):  # fmt: skip
        with pytest.raises(SimulationStopped, match="too weak"):
            stop()


def test_a_stop_says_what_it_is():
    stop = brake_ideally(CONSTANT, 50 / 3.6, 5 / 3.6, CAR)
    assert str(stop) == "from 50 km/h to 5 km/h in 97.37 m, 12.75 s, at 0.981 m/s2"


def test_what_is_written_and_drawn_is_the_stop():
    stops = compare_controls(PEAKED, 15.0, 1.5)
    table = pd.DataFrame(stop_columns(stops))
    for name, figures in stop_figures(Stops(stops, [stops["threshold"]], (12.0, 1.5))).items():
        last = table[table["control"] == name].iloc[-1]
        assert last["distance_m"] == figures["distance_m"]
        assert last["time_s"] == figures["time_s"]
        assert np.isclose(figures["end_speed_m_s"], 1.5)
    speed, *_, distance = charts_of_stops(table)
    assert [curve.name for curve in speed.curves] == list(stops)
    ends = [curve.y[-1] for curve in distance.curves]
    assert ends == [stop.distance for stop in stops.values()]
    speeds, slips = axes_of_a_stop(15.0, 1.5)
    assert (speeds[0], slips[0], slips[-1]) == (1.5, 0.0, 1.0) and speeds[-1] > 15.0
    assert slips[1] < 0.005 and np.allclose(np.diff(np.log(slips[1:]), 2), 0.0, atol=1e-12)


def test_a_deceleration_is_measured_between_two_speeds():
    stop = brake_ideally(CONSTANT, 15.0, 1.5, CAR)
    assert np.isclose(stop.between(12.0, 3.0), 0.1 * GRAVITY, rtol=1e-6)
    late = brake(CONSTANT, 15.0, 1.5, CAR, Brake(1500.0, 5.0))
    assert late.deceleration < 0.99 * late.between(12.0, 3.0)  # the torque rises before
    assert np.isclose(late.between(12.0, 3.0), 0.1 * GRAVITY, rtol=1e-3)


def test_starts_are_phases_of_one_cycle_of_the_control():
    table = table_of([0.0, 0.1, 0.2, 1.0], [0.0, 0.2, 0.2, 0.08], np.array([1.0, 20.0]))
    first = compare_controls(table, 15.0, 1.5)["threshold"]
    tops = np.flatnonzero(np.diff(np.sign(np.diff(first.history.torque))) < 0)
    assert 0.0 < first.cycle < 15.0 / (tops.size - 1)
    speeds = starts(first, 4, 20.0)
    assert np.allclose(speeds, 15.0 + first.cycle * np.arange(4) / 4)
    assert starts(first, 4, 15.1).max() < 15.1
    locked = compare_controls(table, 15.0, 1.5)["locked"]
    assert locked.cycle == 0.0 and (starts(locked, 4, 20.0) == 15.0).all()


def test_means_over_phases_differ_less_than_stops():
    brakes, control = Brake(), Threshold()
    table = table_of([0.0, 0.1, 0.2, 1.0], [0.0, 0.2, 0.2, 0.08], np.array([1.0, 20.0]))

    def decelerations(speed):
        first = brake(table, speed, 1.5, CAR, brakes, control)
        more = [brake(table, v, 1.5, CAR, brakes, control) for v in starts(first, 8, 20.0)[1:]]
        stops = Stops({"threshold": first}, [first, *more], (7.0, 3.0))
        return stops.decelerations("threshold")

    found = np.array([decelerations(speed) for speed in (9.0, 9.2, 9.4)])
    assert np.ptp(found.mean(axis=1)) < 0.3 * np.ptp(found)


def test_a_coarser_axis_has_the_ends_of_the_finer_one():
    axis = np.linspace(0.0, 1.0, 8)
    assert np.array_equal(thinned(axis, 1), axis)
    assert np.array_equal(thinned(axis, 3), axis[[0, 3, 6, 7]])
