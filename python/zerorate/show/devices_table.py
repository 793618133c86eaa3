"""Gyros for simulation, as plain text."""

from __future__ import annotations

from zerorate.show.tables import Table, as_text, wrap_prose
from zerorate.simulation.devices import DEVICES, Device
from zerorate.units import convert


def format_devices() -> str:
    """Return a table of the gyros with their noise and the sources of the numbers."""
    head = ("device", "N, deg/s/√Hz", "B, deg/h", "turn-on, deg/s", "step, deg/s")
    note = "N: noise density; B: bias instability; step: resolution."
    rows = tuple(map(_row, DEVICES.values()))
    table = as_text(Table("Gyros that can be simulated", head, rows, note=note))
    sources = (wrap_prose(f"{gyro.name}: {gyro.source}", hang="  ") for gyro in DEVICES.values())
    return "\n".join((table, "", *sources))


def _row(gyro: Device) -> tuple[str, ...]:
    noise = convert(gyro.noise.angle_random_walk, "rad/s/sqrt(Hz)", "deg/s/sqrt(Hz)")
    bias = convert(gyro.noise.bias_instability, "rad/s", "deg/h")
    turn_on, step = (convert(v, "rad/s", "deg/s") for v in (gyro.turn_on_bias, gyro.resolution))
    return (gyro.name, *(f"{value:.3g}" for value in (noise, bias, turn_on, step)))
