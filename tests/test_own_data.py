"""Data of ice, water and rubber that a scene gives: exact scalings, and what follows from them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from iceslide_fem.film import conditions, law, loads
from iceslide_fem.film.half_space import HalfSpace
from iceslide_fem.film.ice_heat import Column
from iceslide_fem.film.integrators import InterfaceState, advance
from iceslide_fem.film.point import Conditions, simulate
from iceslide_fem.film.runge_kutta import INTEGRATORS
from iceslide_fem.preprocess.footprint.case import FootprintCase
from iceslide_fem.preprocess.footprint.film_map import film_map
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.runs.notes import notes
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict, unit_of
from iceslide_fem.scene.contact_table import ConstantContact
from iceslide_fem.scene.fingerprint import scene_hash
from iceslide_fem.scene.materials import ICE, Solid, rubber_solid

DURATION = 7e-3
SCENE = {
    "name": "own",
    "model": "point",
    "rubber": {"compound": "B"},
    "load": {"pressure": "1 bar", "speed": "3 m/s", "duration": "7 ms"},
}
THESIS = {
    "pressure": 1e5, "speed": 3.0, "temperature": 269.15, "k": 0.266, "D": 29e-6, "H_V": 2.86e-6,
    "initial_height": 70e-9, "duration": DURATION,
}  # fmt: skip


def scene(**tables):
    return scene_from_dict(SCENE | {name: SCENE.get(name, {}) | tables[name] for name in tables})


class ConstantFlux:
    """A film that gives its surface a flux, whatever its temperature."""

    def __init__(self, flux):
        self.flux = flux

    def height(self, log_height):
        return np.exp(log_height)

    def solve(self, ice, near=None):
        taken = np.broadcast_to(self.flux, ice.offset.shape).copy()
        nothing = np.zeros_like(taken)
        off = nothing > 0.0
        return law.FilmStage(
            nothing, nothing, taken, taken, nothing, ice.offset, off, off, nothing, nothing, nothing
        )


def rise(solid, flux, n=1, steps=400):
    """Rise of a column's surface (K) under `flux` (W/m2) over the duration."""
    column = Column(np.full(n, 200.0), DURATION, solid=solid)
    heat_state = column.initial(n)
    for dt in DURATION * np.diff(np.linspace(0.0, 1.0, steps + 1) ** 2):
        heat_state, _ = column.stage(heat_state, dt, ConstantFlux(flux))
    return column.surface_temperature(heat_state) - 200.0, column.heat(heat_state)


def test_a_surface_warms_with_one_over_the_effusivity():
    """2 q sqrt(t / pi) / sqrt(lambda rho c), each point with a solid of its own."""
    solids = [ICE, Solid(1.0, 500.0, 3000.0, 270.0, 2e5), Solid(5.0, 916.0, 1000.0, 271.0, 1e5)]
    together = Solid(*(np.array(part) for part in zip(*solids, strict=True)))
    q = 1e5
    warmer, heat = rise(together, q, 3)
    exact = [2.0 * q * np.sqrt(DURATION / np.pi) / solid.effusivity for solid in solids]
    np.testing.assert_allclose(warmer, exact, rtol=3e-3)
    np.testing.assert_allclose(heat, q * DURATION, rtol=1e-9)
    alone = np.concatenate([rise(solid, q)[0] for solid in solids])
    np.testing.assert_allclose(warmer, alone, rtol=1e-9)


def test_the_closed_form_flux_is_that_of_the_given_ice():
    solid = Solid(1.0, 500.0, 3000.0, 271.0, 2e5)
    ice = HalfSpace(np.array([267.0]), DURATION, solid)
    heat_state = ice.initial(1)
    for _ in range(20):
        stage_film = loads.FilmOnIce(
            law.implicit_stage, np.log([70e-9]), np.zeros(1), 1e-4, loads_of(1e6)
        )
        heat_state, stage = ice.stage(heat_state, 1e-4, stage_film)
    expected = 1.0 * 4.0 / np.sqrt(np.pi * solid.diffusivity * 2e-3)
    assert stage.melting[0] and stage.ice_flux[0] == pytest.approx(expected, rel=1e-12)
    assert ice.surface_temperature(heat_state)[0] == pytest.approx(271.0, abs=1e-9)


def loads_of(power):
    """Loads of a film of 70 nm that makes `power` (W/m2), and does not squeeze out."""
    one = np.ones(1)
    return loads.FilmLoads(power * 70e-9 * one, one, 0.0 * one, one)


def test_melting_starts_and_stays_at_the_temperature_given():
    """Salt ice at -6 degC that melts at -2 degC is as far from it as the thesis's ice at -4."""
    usual = simulate(Conditions.of(**THESIS))
    salt = simulate(
        Conditions.of(**THESIS | {"temperature": 267.15}, melting_temperature=271.15),
        times=[DURATION],
    )
    assert salt.mu_peak == pytest.approx(usual.mu_peak, rel=1e-9)
    assert salt.melt_onset == pytest.approx(usual.melt_onset, rel=1e-9)
    nearer = simulate(Conditions.of(**THESIS, melting_temperature=271.15))
    assert nearer.melt_onset < 0.5 * usual.melt_onset


def test_latent_heat_and_viscosity_act_as_the_equations_say():
    """With heat capacities to match, a tenth of latent heat melts ten times: exact scalings.

    tau = k eta v / h and K3 = 8 p / (3 eta D2): twice eta is twice k and half of K3, D sqrt(2).
    """
    twice = simulate(Conditions.of(**THESIS, viscosity=3.6e-3))
    same = simulate(Conditions.of(**THESIS | {"k": 0.532, "D": 29e-6 * 2**0.5}))
    assert twice.mu_end == pytest.approx(same.mu_end, rel=1e-12)
    # melt only on ice that conducts next to nothing: h^2 = h0^2 + 2 K1 t
    bare = THESIS | {"H_V": 1e-10, "temperature": 273.149}
    given = {"conductivity": 1e-3, "heat_capacity": 1.0, "density": 800.0, "latent_heat": 1e5}
    film = simulate(Conditions.of(**bare, **given), tolerance=1e-4)
    K1 = 0.266 * 1.8e-3 * 3.0**2 / (800.0 * 1e5)
    expected = np.sqrt(70e-9**2 + 2.0 * K1 * DURATION)
    assert film.film_height == pytest.approx(expected, rel=2e-3)


def test_a_scene_hands_on_what_it_says():
    own = scene(
        ice={
            "temperature": "-9 degC", "conductivity": 2.0, "density": 900.0,
            "heat_capacity": "2 kJ/kg/K", "melting_temperature": "-5 degC",
            "latent_heat": "300 kJ/kg",
        },
        water={"viscosity": "2 mPa*s", "conductivity": 0.6},
        rubber={"compound": "B", "conductivity": 0.3, "heat_capacity": 1700.0, "heat": True},
    )  # fmt: skip
    here = conditions.scene_conditions(own)
    assert own.ice.solid == Solid(2.0, 900.0, 2000.0, 268.15, 3e5)
    assert [float(part) for part in here.solid] == list(own.ice.solid)
    assert here.viscosity == 2e-3
    rubber = conditions.rubber_columns(own)
    assert rubber.column.solid == rubber_solid(1100.0, 0.3, 1700.0)
    assert (rubber.half_film.water, rubber.melting_temperature) == (0.6, 268.15)
    usual = scene()
    assert usual.ice.solid == ICE and scene_hash(usual) != scene_hash(own)
    assert scene_from_dict(own.as_dict()) == own


def test_the_first_film_may_follow_the_temperature_of_the_ice(tmp_path):
    rows = [["-10 degC", "50 nm"], ["-2 degC", "90 nm"]]
    made = scene(film={"initial_height": rows}, ice={"temperature": "-4 degC"})
    assert made.initial_height == pytest.approx(80e-9, rel=1e-12)
    assert conditions.scene_conditions(made).initial_height[0] == made.initial_height
    warmer = scene(film={"initial_height": rows}, ice={"temperature": "-1 degC"})
    assert warmer.initial_height == 9e-8
    (tmp_path / "h0.csv").write_text("ice temperature (degC), height (nm)\n-10, 50\n-2, 90\n")
    read = scene(film={"initial_height": str(tmp_path / "h0.csv")})
    assert read.initial_height == pytest.approx(made.initial_height, rel=1e-12)
    assert scene().initial_height == 70e-9
    with pytest.raises(SceneError, match="ice temperature must rise from row 1 to row 2"):
        scene(film={"initial_height": rows[::-1]})


def test_poissons_ratio_beside_a_compound_replaces_its_compressibility():
    B = scene().mooney_rivlin
    for name in ("nu", "poisson_ratio"):
        stiffer = scene(rubber={"compound": "B", name: 0.495}).mooney_rivlin
        assert (stiffer.C10, stiffer.C01) == (B.C10, B.C01)
        assert stiffer.poissons_ratio == pytest.approx(0.495, abs=1e-12)
    assert scene(rubber={"compound": "B", "D1": "0.05 1/MPa"}).mooney_rivlin.D1 == 5e-8
    assert unit_of("rubber.poisson_ratio") == unit_of("rubber.nu") == ""


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"ice": {"melting_temperature": "-5 degC"}}, "ice.temperature = -4 degC is not below"),
        ({"ice": {"conductivity": 0.0}}, "ice.conductivity = 0.0 is out of range"),
        ({"ice": {"latent_heat": "330 J"}}, 'ice.latent_heat = "330 J" has the wrong unit'),
        ({"water": {"viscosity": float("nan")}}, "water.viscosity = NaN is out of range"),
        ({"water": {"viscocity": 1.0}}, "did you mean water.viscosity?"),
        ({"rubber": {"nu": 0.495, "D1": 7e-8}}, "rubber.D1 and rubber.nu contradict each other"),
        ({"rubber": {"C10": 1e5}}, 'rubber.compound = "B" and rubber.C10 contradict'),
    ],
)
def test_bad_data_is_one_sentence(tables, words):
    with pytest.raises(SceneError) as refusal:
        scene(**tables)
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_data_without_effect_is_noted():
    found = " ".join(notes(scene(water={"conductivity": 0.6}, rubber={"conductivity": 0.3})))
    assert "rubber.conductivity and water.conductivity have no effect without rubber.heat" in found


def test_many_solids_in_one_call_are_the_same_as_one_by_one():
    """Points of a sweep share a call, and each has its own ice and water."""
    given = {"conductivity": [2.25, 1.5, 3.0], "melting_temperature": [273.15, 272.0, 271.0],
             "latent_heat": [330e3, 200e3, 400e3], "viscosity": [1.8e-3, 1e-3, 2.5e-3]}  # fmt: skip
    together = simulate(Conditions.of(**THESIS, **given), tolerance=1e-4)
    for i in range(3):
        own = {name: values[i] for name, values in given.items()}
        alone = simulate(Conditions.of(**THESIS, **own), tolerance=1e-4)
        assert together.mu_end[i] == pytest.approx(alone.mu_end[0], rel=2e-4)


def test_an_integrated_step_keeps_energy_with_other_data():
    here = Conditions.of(**THESIS, density=800.0, latent_heat=2e5, melting_temperature=270.0)
    column = Column(here.temperature, here.duration, solid=here.solid)
    state = InterfaceState(np.log(here.initial_height), np.zeros(1), column.initial(1))
    melted = 0.0
    for _ in range(100):
        step = advance(state, here.loads(), here.loads(), 7e-5, column, INTEGRATORS["sdirk2"])
        state = step.state
        melted += float(step.latent_heat[0]) / (800.0 * 2e5)
    water = np.exp(state.log_height[0]) + state.squeezed_height[0] - 70e-9
    assert melted == pytest.approx(water, rel=0.05)  # steps of 1 %: first order in ln h


def test_a_footprint_takes_ice_and_water_of_its_own():
    given = {"image": "a.png", "length": "0.1", "width": "0.1", "max_pressure": "4bar"}
    own = {"ice_material": "2,900,2000", "melting_temperature": "-2degC", "viscosity": "2mPa*s"}
    case = FootprintCase.of(given | own)
    ride = case.ride()
    assert ride.solid == Solid(2.0, 900.0, 2000.0, 271.15, ICE.latent_heat)
    assert ride.viscosity == 2e-3
    assert FootprintCase.of(given).ride().solid == ICE
    with pytest.raises(SceneError, match="not below --melting-temperature = -5 degC"):
        FootprintCase.of(given | {"melting_temperature": "-5degC"})


ROWS = [["-10 degC", "2.64 mPa*s"], ["-5 degC", "2.14 mPa*s"], ["0 degC", "1.79 mPa*s"]]


def history(**tables):
    """Columns of a scene on the point level, and its results."""
    rows, entries = point_history(scene(**tables))
    columns = zip(*rows, strict=True)
    return dict(zip(rows[0]._fields, map(np.array, columns), strict=True)), entries


def test_a_viscosity_table_of_equal_values_is_the_constant():
    _, usual = history()
    _, level = history(water={"viscosity": [[263.15, 1.8e-3], [273.15, 1.8e-3]]})
    for name in ("mu_peak", "mu_mean", "mu_end", "melt_onset_s", "steps"):
        assert level[name] == pytest.approx(usual[name], rel=1e-8), name


@pytest.mark.parametrize("heated", [False, True])
def test_the_viscosity_is_that_of_the_films_temperature(heated):
    """Against SciPy with films of eta(T) on the modes of the ice (and of the rubber)."""
    end = 3e-3
    own = scene(
        water={"viscosity": ROWS},
        load={"pressure": "1 bar", "speed": "3 m/s", "duration": end},
        rubber={"compound": "B", "heat": heated},
        film={"conductance": 1e6} if heated else {},
    )
    found, _ = point_history(own)
    here = conditions.scene_conditions(own)
    ice = Column(own.ice.temperature, end, solid=own.ice.solid)
    rubber = Column(own.ice.temperature, end, solid=own.rubber.solid)
    kelvin, values = zip(*own.water.viscosity, strict=True)
    k, D, v, modes = float(here.k[0]), float(here.D[0]), 3.0, ice.rates.size

    def state(x):
        """T_f and q_f of ln h and the amplitudes, and the fluxes into both bodies."""
        T_i = own.ice.temperature + ice.surface @ x[1 : 1 + modes]
        T_r = own.ice.temperature + rubber.surface @ x[1 + modes :]

        def temperature(T):
            q = k * np.interp(T, kelvin, values) * v**2 / np.exp(x[0])
            return T - (0.5 * (T_i + T_r + q / 1e6) if heated else T_i)

        T_f = brentq(temperature, 250.0, 280.0, xtol=1e-10)
        q = k * np.interp(T_f, kelvin, values) * v**2 / np.exp(x[0])
        return T_f, q, (1e6 * (T_f - T_i), 1e6 * (T_f - T_r)) if heated else (q, 0.0)

    def rate(t, x):
        T_f, _, (q_ice, q_rubber) = state(x)
        eta = np.interp(T_f, kelvin, values)
        thinning = -loads.squeeze_rate(1e5, D, eta) * np.exp(2.0 * x[0])
        amplitudes = x[1 : 1 + modes], x[1 + modes :]
        return np.concatenate(
            [
                [thinning],
                -ice.rates * amplitudes[0] + ice.surface * q_ice,
                -rubber.rates * amplitudes[1] + rubber.surface * q_rubber,
            ]
        )

    start = np.concatenate([[np.log(70e-9)], np.zeros(modes + rubber.rates.size)])
    times = [row.time_s for row in found][::10]
    run = solve_ivp(rate, (0.0, end), start, "BDF", times, rtol=1e-6, atol=1e-9)
    exact = [state(x)[1] / (v * 1e5) for x in run.y.T]
    assert max(state(x)[0] for x in run.y.T) < 273.15  # nothing melts: the film is supercooled
    np.testing.assert_allclose([row.mu for row in found][10::10], exact[1:], rtol=5e-4)
    assert exact[-1] / exact[0] > 1.3


def test_a_viscosity_is_read_from_rows_or_a_file_and_must_fall(tmp_path):
    made = scene(water={"viscosity": ROWS})
    assert made.viscosity == pytest.approx(2.07e-3, rel=1e-12)  # at -4 degC
    (tmp_path / "eta.csv").write_text("water temperature (degC), viscosity (mPa s)\n-5,2\n0,1.8\n")
    read = scene(water={"viscosity": str(tmp_path / "eta.csv")})
    assert read.viscosity == pytest.approx(1.96e-3, rel=1e-12)
    assert scene_from_dict(made.as_dict()) == made and scene_hash(made) != scene_hash(read)
    assert scene().viscosity == 1.8e-3 and scene().water.table is None
    for rows, words in (
        (ROWS[:1], "has 1 row; allowed: a number, or 2 to"),
        ([ROWS[0], ["0 degC", "3 mPa*s"]], "water.viscosity rises from row 1 to row 2"),
        ([ROWS[1], ROWS[0]], "water temperature must rise from row 1 to row 2"),
        ([["0 degC", "1 m"], ROWS[2]], "row 1"),
    ):
        with pytest.raises(SceneError, match=words):
            scene(water={"viscosity": rows})
    other = scene(water={"viscosity": ROWS}, friction={"law": "coulomb", "mu": 0.2})
    assert any("water.viscosity has no effect" in note for note in notes(other))


def test_points_and_footprints_take_a_table_of_viscosities(tmp_path):
    """Warmer ice starts with thinner water; a line of pixels is the point in time of contact."""
    table = scene(water={"viscosity": ROWS}).water.table
    colder = THESIS | {"temperature": [263.15, 269.15]}
    together = simulate(Conditions.of(**colder), water=table, tolerance=1e-4, times=[0.0])
    np.testing.assert_allclose(together.samples[0], 0.266 * table([263.15, 269.15]) * 3 / 7e-3)
    alone = simulate(Conditions.of(**THESIS), water=table, tolerance=1e-4)
    assert together.mu_mean[1] == pytest.approx(alone.mu_mean[0], rel=1e-4)
    path = tmp_path / "eta.csv"
    path.write_text("water temperature (degC), viscosity (mPa s)\n-10,2.64\n-5,2.14\n0,1.79\n")
    line = {"line": str(path), "viscosity": str(path), "speed": "3"}
    case = FootprintCase.of(line)
    ride = case.ride()
    assert ride.viscosity == table
    contact = ConstantContact(0.266, 29e-6, 2.86e-6)
    footprint = PressureMap(np.full((2, 70), 1e5), 3.0 * DURATION / 70, 1e-3)
    found = film_map(footprint, ride, contact, 1e-3)
    assert found.mean_friction(footprint) == pytest.approx(alone.mu_mean[0], rel=1e-3)
    path.write_text("water temperature (degC), viscosity (mPa s)\n-10,1\n0,2\n")
    with pytest.raises(SceneError, match="--viscosity rises from row 1 to row 2"):
        FootprintCase.of(line)
