"""A picture of stops: speed of car and wheel, slip, friction and distance over time."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from iceslide_fem.postprocess.results.style import BLUE, GREEN, RED
from iceslide_fem.preprocess.wheel.quarter_car import QuarterCar
from iceslide_fem.preprocess.wheel.slip_table import KMH
from iceslide_fem.preprocess.wheel.stop import Stop

COLOURS = {"locked": RED, "threshold": BLUE, "ideal": GREEN}


def braking_figure(stops: Mapping[str, Stop], car: QuarterCar, title: str = "") -> Figure:
    """Four panels over time of `stops`, named as in `braking.compare_controls`."""
    figure = Figure(figsize=(11.5, 7.5), layout="constrained")
    figure.suptitle(title, fontsize=13)
    panels = figure.subplots(2, 2, sharex=True)
    speed, slip, mu, distance = panels.flat
    for name, stop in stops.items():
        colour, history = COLOURS[name], stop.history
        speed.plot(history.time, KMH * history.speed, color=colour, label=name)
        rim = KMH * car.radius * history.wheel_speed
        speed.plot(history.time, rim, color=colour, linewidth=0.8, alpha=0.7)
        slip.plot(history.time, history.slip, color=colour, linewidth=1.1)
        mu.plot(history.time, history.mu, color=colour, linewidth=1.1)
        label = f"{name}: {stop.distance:.1f} m, {stop.time:.1f} s"
        distance.plot(history.time, history.distance, color=colour, label=label)
        distance.plot(stop.time, stop.distance, "o", color=colour)
    speed.set(title="Speed of the car (thick) and of the tread on the wheel (thin)", ylabel="km/h")
    slip.set(title="Slip ratio S", ylabel="S (1)", ylim=(-0.02, 1.02))
    mu.set(title="Friction", ylabel=r"$\mu$ (1)")
    distance.set(title="Distance", ylabel="x (m)")
    for panel in panels.flat:
        panel.grid(alpha=0.3)
        panel.set_xlim(left=0.0)
    for panel in (mu, distance):
        panel.set(xlabel="time (s)")
    for panel in (speed, mu, distance):
        panel.set_ylim(bottom=0.0)
    speed.legend(loc="upper right")
    distance.legend(loc="lower right")
    return figure
