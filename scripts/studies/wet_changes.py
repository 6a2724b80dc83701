"""Wet ice, drawn at random: what `hostile` changes of a scene with voids that carry."""

from __future__ import annotations

import random
from collections.abc import Iterator

COUNT = 40
SPEEDS, PRESSURES = (0.05, 30.0), (0.3, 8.0)  # m/s, bar
MOST_WATER, MOST_SIPES, COLDEST = 200.0, 5, -30.0  # um, 1, degC
# Films of points on ice that slides are those on the ice.
KINEMATICS = {
    "point": ("attached", "films on the ice"),
    "slice": ("attached", "films on the ice", "films on the rubber"),
}
LENGTHS = 1.0, 5.0, 20.0  # mm


def wet_changes(seed: int = 2) -> Iterator[tuple[str, str, list[str]]]:
    """Model, kinematics, by their names in `hostile`, and changes of every scene on wet ice."""
    draw = random.Random(seed)
    for number in range(COUNT):
        model = "point" if number % 3 == 0 else "slice"
        kinematics = draw.choice(KINEMATICS[model])
        yield model, kinematics, _changes(draw)


def _changes(draw: random.Random) -> list[str]:
    duration = draw.choice([0.2, 0.5, 2.0])  # ms
    pressure, speed = between(draw, PRESSURES), between(draw, SPEEDS)
    length, sipes = draw.choice(LENGTHS), draw.randint(0, MOST_SIPES)
    changes = [
        "film.voids=carry",
        f"ice.water={draw.uniform(0.0, draw.choice([0.0, 5.0, MOST_WATER])):.3g}um",
        f"ice.temperature={draw.uniform(COLDEST, -0.1):.3g}degC",
        f"rubber.length={length:g}mm",
        f"rubber.height={min(length, 8.0):g}mm",
        f"load.duration={duration:g}ms",
        f"load.pressure={course(draw, duration, pressure, [between(draw, PRESSURES)], 'bar')}",
        f"load.speed={course(draw, duration, speed, [0.0, 0.0, 0.5 * speed], 'm/s')}",
        f"film.water_speed={draw.choice([1.0, 1.0, 0.5, 0.0]):g}",
        f"numerics.tolerance={draw.choice([0.05, 0.01, 0.01, 0.002]):g}",
    ]
    if sipes:
        changes += [
            f"rubber.sipes={sipes}",
            f"rubber.sipe_width={0.02 * length:g}mm",
            f"rubber.sipe_depth={0.5 * min(length, 8.0):g}mm",
        ]
    if draw.random() < 0.5:
        changes.append("surface")
    return changes


def between(draw: random.Random, ends: tuple[float, float]) -> float:
    """A value whose logarithm is drawn evenly."""
    low, high = ends
    return low * (high / low) ** draw.random()


def course(
    draw: random.Random, duration: float, first: float, following: list[float], unit: str
) -> str:
    """A number, or one time in three rows of times (ms) from `first` through what follows."""
    if draw.random() < 2.0 / 3.0:
        return f"{first:.3g}{unit}"
    values = [first, *following]
    steps = [duration * number / len(values) for number in range(len(values))]
    rows = (f'["{t:.3g}ms","{value:.3g}{unit}"]' for t, value in zip(steps, values, strict=True))
    return f"[{','.join(rows)}]"
