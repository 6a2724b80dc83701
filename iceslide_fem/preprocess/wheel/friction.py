"""Friction of a wheel at one slip ratio: the brush over all lines of its footprint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from iceslide_fem.film.doubts import MOST
from iceslide_fem.preprocess.footprint.pressure_map import PressureMap
from iceslide_fem.preprocess.wheel.brush import (
    Ends,
    Memory,
    Rolling,
    Traction,
    tractions,
)
from iceslide_fem.preprocess.wheel.case import WheelCase
from iceslide_fem.preprocess.wheel.case_contact import below_wheel
from iceslide_fem.preprocess.wheel.contact import SLOWEST, Slid, SlidingContact
from iceslide_fem.preprocess.wheel.tread import Tread, TreadStiffness
from iceslide_fem.runtime.arrays import Array
from iceslide_fem.runtime.errors import SimulationStopped
from iceslide_fem.runtime.units import ZERO_CELSIUS

PASSES = 20  # iterations of sliding area and friction, until no more area starts to slide


class SlipPoint(NamedTuple):
    """A wheel at one slip ratio; fractions and means are over the area in contact.

    mu, mu_across: friction over load against the motion along and across the wheel's plane; trail:
    distance of the side force behind the middle of the patch, m; sliding, melting, saturated:
    fractions; film_height (m), temperature (K): of sliding contact, NaN without any.
    """

    slip: float
    mu: float
    mu_across: float
    trail: float
    sliding: float
    melting: float
    saturated: float
    film_height: float
    temperature: float


def friction(
    footprint: PressureMap, rolls: Sequence[Rolling], tread: Tread, contact: SlidingContact
) -> list[SlipPoint]:
    """Friction of wheels that roll over the same footprint; ice enters at the last column.

    It is that of the last pass over the same ice; before it are others of the same slip ratio. A
    pattern that slides faster over the ice has finer pixels. Raises SimulationStopped if a step
    fails.
    """
    pattern, parts = tread.pattern, np.ones(len(rolls), dtype=int)
    ways = [footprint.dx * one.sliding_speed / one.forward for one in rolls]
    if pattern is not None:
        parts = np.array([pattern.refinement(way) for way in ways])
    columns = footprint.pressure.shape[1] * parts.max()
    seen = []
    for way, finer in zip(ways, parts, strict=True):
        pressure = np.repeat(footprint.pressure[:, ::-1], finer, axis=1)
        if pattern is not None:
            pressure = pattern.over(pressure, way / finer)
        seen.append(np.pad(pressure, ((0, 0), (0, columns - pressure.shape[1]))))
    lines = len(seen[0])
    rise, speed, passing_of_tread, passing = (
        np.repeat([getattr(one, name) for one in rolls], lines)
        for name in ("stretch", "sliding_speed", "passing", "forward")
    )
    dx = np.repeat(footprint.dx / parts, lines)
    with np.errstate(divide="ignore"):
        memory = tread.memory(dx / passing_of_tread)
    lines_seen, stress = np.concatenate(seen), tread.stiffness * dx * rise
    brush = partial(_brush, lines_seen, dx, passing, stress, speed, memory)
    traction, slid = brush(contact)
    for _ in range(1, contact.passes):
        contact = contact.after(slid)
        traction, slid = brush(contact)

    def of(number: int) -> SlipPoint:
        some = slice(number * lines, (number + 1) * lines)
        here = Traction(*(field[some] for field in traction))
        return _point(seen[number], dx[some][0], rolls[number], here, slid.lines(some))

    return [of(number) for number in range(len(rolls))]


def _point(
    pressure: Array, dx: float, rolling: Rolling, traction: Traction, slid: Slid
) -> SlipPoint:
    """The slip point from lines (n, nx) of one wheel."""
    touching, slides = pressure > 0.0, traction.sliding
    area, whole = np.count_nonzero(touching), traction.stress.sum()
    along, across = (float(whole / pressure.sum() * part) for part in rolling.direction)
    columns = np.flatnonzero(touching.any(axis=0))
    lever = (np.arange(pressure.shape[1]) - 0.5 * (columns[0] + columns[-1])) * dx
    behind = traction.stress.sum(axis=0) @ lever

    def mean(values: Array) -> float:
        there = slides > 0.0
        return float(values[there] @ slides[there] / slides.sum()) if there.any() else np.nan

    return SlipPoint(
        slip=rolling.slip,
        mu=along,
        mu_across=across,
        trail=float(behind / whole) if whole > 0.0 else 0.0,
        sliding=float(slides.sum() / area),
        melting=float((slides * slid.melting).sum() / area),
        saturated=float((slides * slid.saturated).sum() / area),
        film_height=mean(slid.height),
        temperature=mean(slid.temperature),
    )


def _brush(
    pressure: Array,
    dx: Array,
    passing: Array,
    rise: Array,
    speed: Array,
    memory: Memory,
    contact: SlidingContact,
) -> tuple[Traction, Slid]:
    """Bristle stress and sliding contact of lines (n, nx), leading edge first.

    The first sliding area follows from the friction at the onset of sliding. If friction then
    falls, more bristles slide. A film that freezes may rub more than rubber that sticks: bristles
    break at the larger friction.
    """
    touching, speed = pressure > 0.0, np.maximum(speed, SLOWEST)
    rise = np.where(speed > SLOWEST, rise, 0.0)
    onset = contact.onset(pressure, dx, passing, speed)
    begins, static = onset.begins, onset.static
    slides = tractions(rise, touching, static, begins, memory).sliding > 0.0
    for _ in range(PASSES):
        slid = contact.slid(pressure, slides, dx, passing, speed)
        sliding = Ends(*(np.where(slides, *pair) for pair in zip(slid.stress, begins, strict=True)))
        held = Ends(*(np.maximum(*pair) for pair in zip(static, sliding, strict=True)))
        traction = tractions(rise, touching, held, sliding, memory)
        more = (traction.sliding > 0.0) & ~slides
        if not more.any():
            return traction, slid
        slides |= more
    raise SimulationStopped(
        "what slides below the wheel is not found: its friction falls from pass to pass"
    )


SMALL = 1e-4  # slip ratio for the slope at 0
TOGETHER = 2_000_000  # largest number of pixels of all wheels per call


def calls_for(wheels: int, footprint: PressureMap, tread: Tread) -> int:
    """Number of calls of `friction` for so many `wheels`, each with at most `TOGETHER` pixels."""
    phases = 1 if tread.pattern is None else tread.pattern.phases
    each = max(1, TOGETHER // (phases * footprint.pressure.size))
    return -(-wheels // each)


class Curve(NamedTuple):
    """Friction of one wheel over its slip ratios, ascending.

    speed: of the vehicle, m/s; temperature: of the ice, K; slope: dmu/dS at S = 0, from mu at the
    slip ratio 1e-4; stiffness: stress over stretch, with the carcass, of a bristle that sticks to
    the end of the patch and rolls freely, Pa/m.
    """

    speed: float
    temperature: float
    points: list[SlipPoint]
    slope: float
    stiffness: float

    @property
    def peak(self) -> SlipPoint | None:
        """The point of the largest braking friction; None without slip ratios above 0."""
        return max(self.braking, key=lambda point: point.mu, default=None)

    @property
    def locked(self) -> SlipPoint | None:
        """The point of the locked wheel, if it is computed."""
        return next((point for point in self.points if point.slip == 1.0), None)

    @property
    def braking(self) -> list[SlipPoint]:
        """Points above S = 0."""
        return [point for point in self.points if point.slip > 0.0]

    @property
    def without_melting(self) -> list[float]:
        """Slip ratios at which rubber slides and ice melts on less than half of the contact."""
        return [p.slip for p in self.points if p.sliding > 0.0 and p.melting < 1.0 - MOST]

    @property
    def name(self) -> str:
        """Name in pictures."""
        return f"{3.6 * self.speed:.4g} km/h, {self.temperature - ZERO_CELSIUS:.4g} °C"


def curves(
    case: WheelCase,
    footprint: PressureMap,
    stiffness: TreadStiffness,
    tell: Callable[[float], None] = lambda fraction: None,
) -> list[Curve]:
    """Every member of the family on `footprint`; stiffness: of the tread.

    tell: called with the finished fraction. Raises SceneError, before computing, if a law or the
    tread's rubber does not fit a wheel, and SimulationStopped if a step fails.
    """
    members = [(member, *below_wheel(member, footprint, stiffness)) for member in case.members]
    slips = np.array([*case.slip, SMALL])
    pieces = np.array_split(slips, calls_for(slips.size, footprint, members[0][1]))
    found = []
    for number, (member, tread, contact) in enumerate(members):
        points: list[SlipPoint] = []
        for part in pieces:
            rolls = [member.rolling(float(slip)) for slip in part]
            points += friction(footprint, rolls, tread, contact)
            tell((number + len(points) / slips.size) / len(members))
        *asked, small = points
        over = tread.after(footprint.contact_length / member.speed)
        found.append(Curve(member.speed, member.temperature, asked, small.mu / SMALL, over))
    return found
