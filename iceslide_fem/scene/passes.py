"""Checks of scenes with several passes over the same ice, or rows of blocks."""

from __future__ import annotations

from iceslide_fem.runtime.units import readable
from iceslide_fem.scene.tables import Tables


def check_passes(scene: Tables) -> None:
    """Raise ValueError where passes, or rows of blocks, contradict the other tables."""
    load, rubber, speeds = scene.load, scene.rubber, scene.load.speeds
    for given, key, spacing, unit in (
        (load.passes > 1, "load.passes", "load.period", load.period),
        (rubber.rows > 1, "rubber.rows", "rubber.row_pitch", rubber.row_pitch),
    ):
        if given and unit is None:
            raise ValueError(f"{spacing} is missing; it says how far apart {key} are")
        if unit is not None and not given:
            raise ValueError(f"{spacing} has a meaning only with {key} of more than 1")
    if load.passes == 1 and rubber.rows == 1:
        return
    if load.passes > 1 and rubber.rows > 1:
        raise ValueError(
            "load.passes and rubber.rows contradict each other: rows are passes of the period "
            "rubber.row_pitch / load.speed; allowed: one of them"
        )
    key = "load.passes" if load.passes > 1 else "rubber.rows"
    if scene.model != "point":
        _blocks_pass(scene, key)
    if scene.friction.law != "film":
        raise ValueError(
            f'{key} and friction.law = "{scene.friction.law}" contradict each other; allowed: '
            'friction.law = "film"'
        )
    kept = rubber.rows > 1 or scene.film.between == "keep"
    if kept and scene.film.refreeze != "nothing":
        raise ValueError(
            f'{key} whose water is kept and film.refreeze = "{scene.film.refreeze}" contradict '
            'each other; allowed: film.between = "freeze" or "drain" with load.passes'
        )
    if rubber.heat:
        raise ValueError(
            f"{key} and rubber.heat contradict each other: the ice rests between passes, and "
            "the heat of the rubber then is unknown; allowed: rubber.heat = false"
        )
    if scene.ice.heat == "half-space":
        raise ValueError(
            f'{key} and ice.heat = "half-space" contradict each other: the closed form holds for '
            "ice that was never warmed before; allowed: ice.heat = 'column'"
        )
    taken = load.duration
    if rubber.rows > 1:
        if scene.ice.motion == "attached" or load.changes:
            raise ValueError(
                "rubber.rows needs ice that passes below them at one speed; allowed: "
                'ice.motion = "sliding", and load.speed and load.pressure as numbers'
            )
        if rubber.row_pitch is not None and not rubber.row_pitch > rubber.length:
            raise ValueError(
                f"rubber.row_pitch = {readable(rubber.row_pitch, 'm')} is not more than "
                f"rubber.length = {readable(rubber.length, 'm')}; it goes from leading edge to "
                "leading edge"
            )
        if rubber.row_pitch is not None and not rubber.row_pitch / speeds.mean > taken:
            raise ValueError(
                f"load.duration = {readable(taken, 's')} is not less than the "
                f"{readable(rubber.row_pitch / speeds.mean, 's')} from row to row; "
                "rubber.length / load.speed is enough"
            )
    elif load.period is not None and not load.period > taken:
        raise ValueError(
            f"load.period = {readable(load.period, 's')} is not more than the "
            f"{readable(taken, 's')} that a pass takes; it goes from beginning to beginning"
        )


def _blocks_pass(scene: Tables, key: str) -> None:
    """Raise ValueError where passes of a slice or block contradict the other tables."""
    for wrong, what, allowed in (
        (scene.rubber.rows > 1, "rubber.rows", 'model = "point"'),
        (scene.ice.motion == "sliding", 'ice.motion = "sliding"', "ice.motion = 'attached'"),
        (scene.load.changes, "rows of load.pressure or load.speed", "numbers"),
        (scene.rubber.wall_friction > 0.0, "rubber.wall_friction", "0"),
    ):
        if wrong:
            raise ValueError(
                f'{key}, model = "{scene.model}" and {what} contradict each other; allowed: '
                f'{allowed}, or model = "point"'
            )
