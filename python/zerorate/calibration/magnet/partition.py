"""Partition of a record into spans of one hard iron, and wild ones, by dynamic programming."""

from __future__ import annotations

from zerorate._native import magnet_partition
from zerorate.calibration.magnet.spans import WALKS, Span
from zerorate.calibration.magnet.ticks import Ticks, noise_of


def spans_of(ticks: Ticks) -> list[Span]:
    """Return the spans of least cost, of the walk of the field that has most evidence."""
    noise = noise_of(ticks)
    found = magnet_partition(ticks.number, ticks.turned, ticks.rotation, noise, WALKS)
    spans = min(found, key=lambda one: one[0])[1]
    return [Span(i, j, "disturbed" if wild else "plain") for i, j, wild in spans]
