"""Water that freezes where friction does not keep it warm: exact times, heat, no chatter."""

import numpy as np
import pytest

from iceslide_fem import reference
from iceslide_fem.film.conditions import scene_conditions
from iceslide_fem.runs.point import point_history
from iceslide_fem.runtime.errors import SceneError
from iceslide_fem.scene import scene_from_dict
from iceslide_fem.scene.materials import MELTING_ENTHALPY
from iceslide_fem.workflow.sweep.points import simulate_points

# Flux (W/m2), undercooling (K), melt onset (s), height (m) after 5 ms, frozen after that (s)
STEFAN = (
    (160e3, 4.0, 2.2460e-3, 570.97e-9, 2.6318e-3),
    (230e3, 4.0, 1.0869e-3, 1630.71e-9, 9.5526e-3),
    (320e3, 10.0, 3.5093e-3, 404.93e-9, 0.6329e-3),
)
LENGTH = 0.02  # m, of the block's sides


def point(speed, duration, celsius, tolerance=1e-3, viscosity=1.8e-3, **film):
    return scene_from_dict(
        {
            "name": "refreezing",
            "model": "point",
            "rubber": {"compound": "B", "length": LENGTH, "width": LENGTH, "height": 0.01},
            "load": {"pressure": 2e5, "speed": speed, "duration": duration},
            "ice": {"temperature": 273.15 + celsius},
            "water": {"viscosity": viscosity},
            "film": {"initial_height": 0.0, "refreeze": "film"} | film,
            "numerics": {"tolerance": tolerance},
        }
    )


def stops(flux, undercooling, **film):
    """Constant friction power for 5 ms, then none: water so viscous that it rubs as dry contact."""
    k, v, stop, end = 0.4, 4.0, 5e-3, 20e-3
    speed = [[0.0, v], [stop, v], [stop + 1e-7, 0.0], [end, 0.0]]
    contact = {"k": k, "D": 1e-2, "H_V": 1e-2, "dry_stress": flux / (k * v)}
    return point(speed, end, -undercooling, viscosity=10.0, **contact, **film)


def stop_and_go(cycles, celsius, period=4e-3, slow=0.0, **film):
    """Half of the period (s) at 4 m/s and half at rest, in turn."""
    speed = []
    for start in period * np.arange(cycles):
        speed += [[start, 4.0], [start + 0.5 * period, 4.0]]
        speed += [[start + 0.5 * period + 1e-5, slow], [start + period - 1e-5, slow]]
    dry = {"dry_stress": 3.3e5, "dry_softening": 10.0, "dry_residual": 3.0}
    return point([[float(t), v] for t, v in speed], cycles * period, celsius, **dry, **film)


def column(rows, name):
    return np.array([getattr(row, name) for row in rows])


@pytest.mark.quick
@pytest.mark.parametrize(("flux", "undercooling", "onset", "height", "frozen"), STEFAN)
def test_a_film_freezes_in_the_exact_time(flux, undercooling, onset, height, frozen):
    """The friction of films 1 to 2 um high is 0.3 to 0.6 % less than of dry contact here."""
    rows, entries = point_history(stops(flux, undercooling))
    time, films = column(rows, "time_s"), column(rows, "film_height_m")
    assert entries["melt_onset_s"] == pytest.approx(onset, rel=2e-3)
    assert films[np.abs(time - 5e-3).argmin()] == pytest.approx(height, rel=1e-2)
    gone = time[(time > 5e-3) & (films == 0.0)][0] - 5e-3
    assert gone == pytest.approx(frozen, rel=1e-2)
    assert reference.refrozen_height(flux, onset, 5e-3, 5e-3) == pytest.approx(height, rel=1e-3)
    assert abs(reference.refrozen_height(flux, onset, 5e-3, 5e-3 + frozen)) < 2e-3 * height


@pytest.mark.quick
def test_latent_heat_comes_back_and_no_more_freezes_than_there_is():
    rows, entries = point_history(stops(160e3, 4.0))
    latent = column(rows, "latent_heat_J")
    assert abs(latent[-1]) < 1e-3 * latent.max()
    assert abs(entries["energy_imbalance"]) < 1e-4
    assert column(rows, "film_height_m").min() == 0.0
    assert (column(rows, "surface_temperature_C") < 1e-9).all()
    assert rows[-1].surface_temperature_C < -0.5


@pytest.mark.quick
@pytest.mark.parametrize("refreeze", ["film", "all"])
@pytest.mark.parametrize("celsius", [-0.5, -2.0, -8.0])
def test_melting_and_freezing_in_turn_do_not_chatter(refreeze, celsius):
    """Once on and once off in every cycle, and water and latent heat agree at every moment."""
    rows, entries = point_history(stop_and_go(6, celsius, refreeze=refreeze))
    melting = column(rows, "melted_fraction")
    assert np.abs(np.diff(melting)).sum() <= 2 * 6
    assert len(rows) < 6 * 200
    water = column(rows, "film_height_m") + column(rows, "squeezed_height_m")
    molten = column(rows, "latent_heat_J") / LENGTH**2 / MELTING_ENTHALPY
    np.testing.assert_allclose(water, molten, atol=5e-3 * water.max())
    assert water.min() >= 0.0
    assert abs(entries["energy_imbalance"]) < 1e-4


@pytest.mark.quick
def test_voids_empty_by_freezing_if_told():
    """With films alone what has been squeezed out stays water."""
    stored = {
        kind: point_history(stop_and_go(10, -10.0, 20e-3, tolerance=1e-2, refreeze=kind))[0][
            -1
        ].squeezed_height_m
        for kind in ("film", "all")
    }
    assert stored["film"] > 50e-9
    assert stored["all"] < 0.05 * stored["film"]


@pytest.mark.quick
def test_a_sweep_freezes_what_each_of_its_scenes_says():
    """Whatever scenes are computed beside it."""
    dry = {"dry_stress": 3.3e5, "dry_softening": 10.0, "dry_residual": 5.0}
    scenes = [point(4.0, 5e-3, -2.0, **dry, refreeze=kind) for kind in ("nothing", "film", "all")]
    together = simulate_points(scenes)
    assert [scene_conditions(scene).refreeze for scene in scenes] == ["nothing", "film", "all"]
    for outcome, scene in zip(together, scenes, strict=True):
        alone = point_history(scene)[1]
        assert outcome.summary["mu_mean"] == pytest.approx(alone["mu_mean"], rel=1e-9)
        assert outcome.summary["steps"] == alone["steps"]


@pytest.mark.quick
def test_what_freezes_rubs_dry_and_begins_without_water():
    with pytest.raises(SceneError, match=r"film\.refreeze.*no film\.dry_stress"):
        point(4.0, 1e-3, -4.0)
    with pytest.raises(SceneError, match=r"film\.initial_height"):
        point(4.0, 1e-3, -4.0, dry_stress=3e5, initial_height=70e-9)


@pytest.mark.fe
def test_water_left_behind_a_block_gives_its_heat_to_the_ice():
    pytest.importorskip("dolfinx")
    from slides import slide, thesis

    changes = (
        "model=slice", "ice.motion=sliding", "film.carrier=ice", "ice.temperature=-0.2degC",
        "ice.trail=1mm", "numerics.refinement=0.5", "numerics.tolerance=1e-2",
        "load.duration=0.5ms", "rubber.inertia=true", "film.initial_height=0",
        "film.dry_stress=0.33MPa", "film.dry_softening=10K", "film.dry_residual=3K",
    )  # fmt: skip
    ends = []
    for refreeze in ("nothing", "film"):
        rows = slide(thesis(*changes, f"film.refreeze={refreeze}"))
        ends.append({name: values[-1] for name, values in rows.items()})
    liquid, frozen = ends
    assert abs(frozen["energy_imbalance"]) < 1e-3
    assert frozen["mu"] == pytest.approx(liquid["mu"], rel=2e-3)
    assert frozen["latent_heat_J"] < 0.95 * liquid["latent_heat_J"]
    heat = [end["ice_heat_J"] + end["latent_heat_J"] for end in ends]
    assert heat[0] == pytest.approx(heat[1], rel=2e-3)
