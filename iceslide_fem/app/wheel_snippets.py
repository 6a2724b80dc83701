"""A command and Python code that compute the friction of the page's wheel."""

from __future__ import annotations

from iceslide_fem.app.snippets import command, joined, strength_lines
from iceslide_fem.app.wheel_case import CELLS, COMPOUND, PHASES, SLIPS, TOLERANCE, WheelLine

EVEN = 5.0  # m, standard deviation of a Gaussian that is uniform over any patch


def wheel_command(case: WheelLine) -> str:
    """Command that computes the same wheel, on the finer pixels of the command.

    There a uniform pressure is a Gaussian much wider than the patch.
    """
    sigma = case.sigma if case.profile == "gaussian" else EVEN
    words: dict[str, object] = {
        "gaussian": joined(case.length, case.pressure, sigma),
        "speed": case.speed,
        "slip": ",".join(f"{slip:g}" for slip in SLIPS),
        "temperature": case.ice_temperature,
        "stiffness": f"{case.stiffness!r} Pa/m",
    }
    if case.tread == "blocks":
        words |= {"pitch": case.pitch, "groove": case.groove}
    return command("iceslide wheel", words | case.film_words)


def wheel_lines(case: WheelLine) -> str:
    """Lines of Python that compute the same curve."""
    imported, strength = strength_lines(case.dry_shear)
    melting = ", MELTING_TEMPERATURE" if imported else ""
    profile, pattern, tread = "", "", f"Tread({case.stiffness!r})"
    pressure, line = f"{CELLS} * [{case.pressure!r}]", "as_map"
    if case.profile == "gaussian":
        line = "as_map, gaussian_profile"
        given = f"{case.length!r}, {case.pressure!r}, {CELLS}, {case.sigma!r}"
        profile = f"_, pressure = gaussian_profile({given})\n"
        pressure = "pressure"
    if case.tread == "blocks":
        pattern = "from iceslide_fem.preprocess.wheel.brush import Pattern\n"
        tread = f"Tread({case.stiffness!r}, Pattern({case.pitch!r}, {case.groove!r}, {PHASES}))"
    return f"""\
from iceslide_fem.preprocess.footprint.line import {line}
from iceslide_fem.preprocess.footprint.ride import Ride
from iceslide_fem.preprocess.wheel.contact import FilmContact
from iceslide_fem.preprocess.wheel.friction import Tread, friction
{pattern}from iceslide_fem.preprocess.wheel.brush import Rolling
{imported}from iceslide_fem.scene.materials import CONTACT_TABLES{melting}

{profile}footprint = as_map({pressure}, {case.length!r} / {CELLS})
ride = Ride(
    speed={case.speed!r},
    sliding_speed={case.speed!r},
    temperature={case.ice_temperature!r},
    initial_height={case.initial_height!r},
    strength={strength},
)
contact = FilmContact(ride, CONTACT_TABLES[{COMPOUND!r}], {TOLERANCE!r})
rolls = [Rolling(ride.speed, round((i / 20) ** 2, 4)) for i in range({len(SLIPS)})]
points = friction(footprint, rolls, {tread}, contact)
for point in points:
    print(point.slip, point.mu)
"""
