"""Components of the film law, drawn at random and together: what `hostile` changes of a scene."""

from __future__ import annotations

import random
from collections.abc import Iterator

from scripts.studies.wet_changes import KINEMATICS, PRESSURES, SPEEDS, between, course

COUNT = 300
COLDEST, WARMEST = -40.0, -0.1  # degC
LENGTHS = 1.0, 5.0, 20.0  # mm


def component_changes(seed: int = 3) -> Iterator[tuple[str, str, list[str]]]:
    """Model, kinematics, by their names in `hostile`, and changes of every scene."""
    draw = random.Random(seed)
    for number in range(COUNT):
        model = "slice" if number % 3 == 0 else "point"
        yield model, draw.choice(KINEMATICS[model]), _changes(draw, model)


def _changes(draw: random.Random, model: str) -> list[str]:
    duration, length = (
        draw.choice([0.2, 0.5, 5.0 if model == "point" else 1.0]),
        draw.choice(LENGTHS),
    )
    pressure, speed = between(draw, PRESSURES), between(draw, SPEEDS)
    changes = [
        "surface",
        f"ice.temperature={draw.uniform(COLDEST, WARMEST):.3g}degC",
        f"rubber.length={length:g}mm",
        f"rubber.height={min(length, 8.0):g}mm",
        f"load.duration={duration:g}ms",
        f"load.pressure={course(draw, duration, pressure, [between(draw, PRESSURES)], 'bar')}",
        f"load.speed={course(draw, duration, speed, [0.0, 0.0, 0.5 * speed], 'm/s')}",
        f"numerics.tolerance={draw.choice([0.05, 0.01, 0.01, 0.002]):g}",
    ]
    if model == "slice":
        changes.append("rubber.inertia=true")
    carries = draw.random() < 0.6
    if carries:
        changes.append("film.voids=carry")
        if draw.random() < 0.7:
            changes.append(f"ice.water={between(draw, (0.1, 200.0)):.3g}um")
    if dry := draw.random() < 0.6:
        changes += [
            f"film.dry_stress={between(draw, (0.05, 2.0)):.3g}MPa",
            "film.initial_height=0nm",
        ]
        if draw.random() < 0.7:
            changes.append(f"film.dry_softening={between(draw, (2.0, 30.0)):.3g}K")
    if draw.random() < 0.5:
        arms = f"[[{draw.uniform(0.1, 0.5):.2g},1e-4],[{draw.uniform(0.1, 0.4):.2g},1e-2]]"
        changes += [f"rubber.prony={arms}", "rubber.modulus_is=instantaneous"]
        if draw.random() < 0.8:
            changes.append("film.contact_age=true")
    if draw.random() < 0.5:
        changes.append("rubber.heat=true")
    if draw.random() < 0.3:
        changes.append(f"rubber.temperature={draw.uniform(-40.0, 60.0):.3g}degC")
    if draw.random() < 0.5:
        changes.append("water.viscosity=[[253.15,4e-3],[273.15,1.8e-3]]")
    if draw.random() < 0.3:
        modes = (
            ("nothing", "area") if carries else ("nothing", "film", "all") if dry else ("nothing",)
        )
        changes.append(f"film.refreeze={draw.choice(modes)}")
    if draw.random() < 0.3:
        changes += [
            f"load.passes={draw.randint(2, 4)}",
            f"load.period={duration + between(draw, (0.1, 1e4)):.5g}ms",
            f"film.between={draw.choice(['keep', 'drain', 'freeze'])}",
        ]
    return changes
