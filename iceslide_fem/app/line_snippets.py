"""A command and Python code that compute the line of the page."""

from __future__ import annotations

import shlex
from dataclasses import fields

from iceslide_fem.app.line_case import POINTS, LineCase
from iceslide_fem.app.snippets import command, joined, strength_lines


def line_command(case: LineCase) -> str:
    """Command that computes the same line (and of the balance both sources of heat)."""
    p = case.parameters
    words: dict[str, object] = {}
    source = ""
    if case.profile == "gaussian":
        words["gaussian"] = joined(case.length, case.peak, case.sigma)
    elif case.profile == "file":
        words["line"] = case.file
    else:
        source = f" {shlex.quote(str(case.image))}"
        words |= {"length": case.length, "width": case.length, "max-pressure": case.max_pressure}
        boxes = {"legend": case.legend, "crop": case.crop}
        words |= {name: joined(*box) for name, box in boxes.items() if box}
        last = len(case.pressures()[0]) - 1
        words["row"] = last - round(case.row * last)
    words |= {"speed": p.speed, "temperature": p.ice_temperature, "slip": p.slip}
    words |= case.film_words
    if case.thesis_balance == "no":
        return command(f"iceslide footprint{source}", words)
    if p.source == "next pixel":
        words |= {"thesis-slip": p.slip, "thesis-time": p.time}
    if p.air_temperature is not None:
        words["air-temperature"] = p.air_temperature
    words |= {
        "static-friction": p.static_friction,
        "depth": p.depth,
        "ice-material": joined(*p.ice[:3]),
        "tread-material": joined(*p.tread[:3]),
        "water-conductivity": p.water_conductivity,
    }
    return command(f"iceslide footprint{source} --thesis-balance", words)


def line_lines(case: LineCase) -> str:
    """Lines of Python that compute the same line."""
    before, other, names = "", "", ["film_line"]
    if case.profile == "gaussian":
        names.append("gaussian_profile")
        pressure = (
            f"x, pressure = gaussian_profile({case.length!r}, {case.peak!r}, {POINTS}, "
            f"{case.sigma!r})\ndx = x[1] - x[0]"
        )
    elif case.profile == "file":
        before = "from pathlib import Path\n\n"
        other = "from iceslide_fem.preprocess.footprint.profile import read_profile\n"
        pressure = (
            f"profile = read_profile(Path({str(case.file)!r}))\n"
            "pressure, dx = profile.pressure, profile.dx"
        )
    else:
        before = "from iceslide_fem.preprocess.footprint.case import FootprintCase\n"
        other = "from iceslide_fem.preprocess.footprint.reading import read_footprint\n"
        options = {"image": str(case.image), "length": case.length, "width": case.length}
        options |= {"max_pressure": case.max_pressure}
        boxes = {"legend": case.legend, "crop": case.crop}
        options |= {name: joined(*box) for name, box in boxes.items() if box}
        pressure = (
            f"footprint = read_footprint(FootprintCase.of({options!r})).pressure_map\n"
            f"pressure = footprint.pressure[round({case.row!r} * (len(footprint.pressure) - 1))]\n"
            "dx = footprint.dx"
        )
    p = case.parameters
    values = {field.name: repr(getattr(p, field.name)) for field in fields(p)}
    values |= {"ice": f"Solid{p.ice[:3]}", "tread": f"Solid{p.tread[:3]}"}
    given = "\n".join(f"    {name}={value}," for name, value in values.items())
    model = ""
    if case.thesis_balance == "yes":
        names.append("macroscopic_line")
        model = "\nline = macroscopic_line(pressure, dx, parameters)\nprint(line.mu_mean)\n"
    return f"""\
{before}from iceslide_fem.preprocess.footprint.line import {", ".join(sorted(names))}
from iceslide_fem.preprocess.footprint.macroscopic import Macroscopic
{other}from iceslide_fem.scene.materials import Solid

{pressure}
parameters = Macroscopic(
{given}
)
{_film_lines(case)}{model}"""


def _film_lines(case: LineCase) -> str:
    """Additional Python code for the film law along the line."""
    before, strength = strength_lines(case.dry_shear)
    return f"""\
{before}from iceslide_fem.scene.materials import CONTACT_TABLES, MELTING_TEMPERATURE

strength = {strength}
film = film_line(pressure, dx, parameters, CONTACT_TABLES["B"], strength, {case.initial_height!r})
print(film.shear.sum() / pressure.sum())
"""
