"""The track of a foot as plain text: how far, where it ends, its strides."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from zerorate.numerals import with_error
from zerorate.show.tables import Table, as_text, bulleted, prose

if TYPE_CHECKING:
    from zerorate.foot.foot import FootTrack
    from zerorate.types import Floats


def format_foot(track: FootTrack) -> str:
    """Return the tables of a foot's track, at most `WIDTH` columns wide.

    Where it ends with standard deviations, strides, notes.
    """
    return "\n\n".join(_parts(track))


def _parts(track: FootTrack) -> Iterator[str]:
    best = ", smoothed" if track.smoothed else ""
    yield prose(
        f"Walk of {Path(track.source).name}{best}: {track.distance:.1f} m from stance to stance, "
        f"{len(track.stances)} stances, {len(track.rests)} rests"
    )
    yield as_text(_end(track))
    strides = track.strides()
    if len(strides):
        rows = (
            _row("length", "m", strides.stride_length),
            _row("time", "s", strides.stride_time),
            _row("speed", "m/s", strides.gait_velocity),
            _row("swing", "s", strides.swing_time),
            _row("stance", "s", strides.stance_time),
            _row("lift", "m", strides.max_sensor_lift),
            _row("climb", "m", strides.height_change),
            _row("turn to the left", "deg", np.degrees(strides.turning_angle)),
        )
        head = ("", "", "median", "least", "most")
        note = f"Cadence of both feet: {strides.cadence:.0f} steps a minute."
        yield as_text(Table(f"{len(strides)} strides", head, rows, words=2, note=note))
    if track.notes:
        yield f"Notes\n{bulleted(track.notes)}"


def _end(track: FootTrack) -> Table:
    there = np.flatnonzero(track.navigating)
    if not there.size:
        return Table("At the end", ("", "m"), (("unknown", "-"),))
    place, sigma = track.position[there[-1]], track.sigma[there[-1]]
    names = ("ahead of the start", "left of it", "above it")
    rows = tuple((name, with_error(x, s)) for name, x, s in zip(names, place, sigma, strict=False))
    return Table("At the end", ("", "m, ± σ"), rows)


def _row(name: str, unit: str, values: Floats) -> tuple[str, ...]:
    known = values[np.isfinite(values)]
    if not known.size:
        return (name, unit, "-", "-", "-")
    shown = (np.median(known), known.min(), known.max())
    # No minus before what rounds to zero.
    return (name, unit, *(f"{round(float(x), 2) + 0.0:.2f}" for x in shown))
