"""Track of a foot as plain text: distance, end, strides."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from zerorate.numerals import format_with_error
from zerorate.show.tables import Table, as_text, bullet_list, wrap_prose

if TYPE_CHECKING:
    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats


def format_foot(track: FootTrack) -> str:
    """Return the tables of a foot's track, at most `WIDTH` characters wide.

    They have the end position with standard deviations, the strides, and notes.
    """
    return "\n\n".join(_format_parts(track))


def _format_parts(track: FootTrack) -> Iterator[str]:
    smoothed_text = ", smoothed" if track.smoothed else ""
    yield wrap_prose(
        f"Walk of {Path(track.source).name}{smoothed_text}: {track.distance:.1f} m from "
        "stance to stance, "
        f"{len(track.stances)} stances, {len(track.rests)} rests"
    )
    yield as_text(_make_end_table(track))
    strides = track.strides()
    if len(strides):
        rows = (
            _make_row("length", "m", strides.stride_length),
            _make_row("time", "s", strides.stride_time),
            _make_row("speed", "m/s", strides.gait_velocity),
            _make_row("swing", "s", strides.swing_time),
            _make_row("stance", "s", strides.stance_time),
            _make_row("lift", "m", strides.max_sensor_lift),
            _make_row("climb", "m", strides.height_change),
            _make_row("turn to the left", "deg", np.degrees(strides.turning_angle)),
        )
        head = ("", "", "median", "least", "most")
        note = f"Cadence of both feet: {strides.cadence:.0f} steps a minute."
        yield as_text(Table(f"{len(strides)} strides", head, rows, words=2, note=note))
    if track.notes:
        yield f"Notes\n{bullet_list(track.notes)}"


def _make_end_table(track: FootTrack) -> Table:
    navigating = np.flatnonzero(track.navigating)
    if not navigating.size:
        return Table("At the end", ("", "m"), (("unknown", "-"),))
    position, sigma = track.position[navigating[-1]], track.sigma[navigating[-1]]
    names = ("ahead of the start", "left of it", "above it")
    rows = tuple(
        (name, format_with_error(x, s)) for name, x, s in zip(names, position, sigma, strict=False)
    )
    return Table("At the end", ("", "m, ± σ"), rows)


def _make_row(name: str, unit: str, values: Floats) -> tuple[str, ...]:
    finite = values[np.isfinite(values)]
    if not finite.size:
        return (name, unit, "-", "-", "-")
    shown = (np.median(finite), finite.min(), finite.max())
    # Avoid a minus sign before a rounded zero.
    return (name, unit, *(f"{round(float(x), 2) + 0.0:.2f}" for x in shown))
