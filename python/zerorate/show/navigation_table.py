"""Track as plain text: fixes, estimates at the end, and errors after outages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from zerorate.geometry.rotations import euler_angles
from zerorate.navigation.aids import OUTPUTS
from zerorate.navigation.heading import format_heading
from zerorate.navigation.outage import FILTER
from zerorate.navigation.track import STATUSES, VERDICTS
from zerorate.numerals import format_with_error, shorten
from zerorate.show.tables import Table, as_text, bullet_list, wrap_prose

if TYPE_CHECKING:
    from zerorate.metrics.tracks import TrackErrors
    from zerorate.navigation.alignment import Alignment
    from zerorate.navigation.outage import OutageErrors, Outages
    from zerorate.navigation.track import Track
    from zerorate.record.offset import TimeOffset
    from zerorate.tasks.navigate import Navigation
    from zerorate.types import Floats

_OVER_SIGMA: Final = (
    "over σ: RMS of the error over its standard deviation, including that of the fix; 1 is right."
)
_NO_HEADING_TEXT: Final = {True: "from the course", False: "no heading"}
_ROW_NAMES: Final = {"smoothed": "smoothed, largest inside"}
"""Clearer names of some rows."""
_OUTPUT_UNITS: Final = {
    "position": (1.0, "m"),
    "height": (1.0, "m"),
    "velocity": (1.0, "m/s"),
    "attitude": (math.degrees(1.0), "deg"),
    "heading": (math.degrees(1.0), "deg"),
}
"""Factors and units for the limits of outputs."""


def format_track(track: Track, *, nis: Floats | None = None) -> str:
    """Return the tables of a track, at most `WIDTH` characters wide.

    They have the numbers of fixes, the duration of each status, the estimates at the end with
    standard deviations, and notes.

    `nis`: result of `Track.nis`.
    """
    return "\n\n".join(filter(None, _format_parts(track, nis)))


def format_navigation(navigation: Navigation) -> str:
    """Return the requested errors, the tables of the track, and its start."""
    errors = navigation.errors()
    parts = [] if errors is None else [format_errors(*errors)]
    if navigation.outages is not None:
        parts.append(format_outages(navigation.outages))
    return "\n\n".join(
        (*parts, format_track(navigation.track, nis=navigation.nis), navigation.start.table())
    )


def format_outages(outages: Outages) -> str:
    """Return a table of the errors after outages; held position and velocity come first."""
    rows = tuple(row for outage in outages.lengths for row in _make_outage_rows(outage))
    head = ("outage", "", "n", "rms", "median", "largest", "over σ")
    title = "Horizontal error at the end of outages of the receiver, m"
    notes = f"Notes\n{bullet_list(outages.notes)}" if outages.notes else ""
    table = as_text(Table(title, head, rows, words=2, legend={6: _OVER_SIGMA}))
    return "\n\n".join(filter(None, (table, notes)))


def format_errors(errors: TrackErrors, steps: TrackErrors | None, fitted: str) -> str:
    """Return the errors of a track relative to the truth.

    `found, steps`: results of `zerorate.metrics.ate`, and of `rpe` over a second. They are None
    without orientations. `fitted`: rotation and shift of the best fit, as text.
    """
    listed = [("position, m (ATE)", errors.metres), ("orientation, deg", errors.degrees)]
    if steps is not None:
        listed += [("step of 1 s, m (RPE)", steps.metres), ("its rotation, deg", steps.degrees)]
    rows = tuple(
        (
            name,
            str(errors_of.of),
            *(
                f"{shorten(value, 3)}"
                for value in (errors_of.rmse, errors_of.median, errors_of.largest)
            ),
        )
        for name, errors_of in listed
        if errors_of.of
    )
    head = ("", "poses", "rms", "median", "largest")
    note = f"The track is {fitted}, to fit best." if fitted else ""
    return as_text(Table("Errors against the reference", head, rows, note=note))


def format_alignment(alignment: Alignment) -> str:
    """Return the angles at the end of the rest, and the biases, with standard deviations."""
    angles = np.degrees(euler_angles(alignment.quaternion[np.newaxis])[0])
    angles[2] %= 360.0
    level, heading = math.degrees(alignment.level_sigma), math.degrees(alignment.heading_sigma)
    heading_text = (
        format_with_error(angles[2], heading)
        if alignment.heading_known
        else _NO_HEADING_TEXT[alignment.course]
    )
    gyro, sigma = np.degrees(alignment.gyro_bias), math.degrees(alignment.gyro_bias_sigma)
    rows = (
        ("roll, pitch, deg", ", ".join(format_with_error(value, level) for value in angles[:2])),
        ("heading, deg", heading_text),
        ("gyro bias, deg/s", ", ".join(format_with_error(value, sigma) for value in gyro)),
        (
            "accelerometer bias, m/s^2",
            ", ".join(
                format_with_error(value, alignment.accel_bias_sigma)
                for value in alignment.accel_bias
            ),
        ),
    )
    table = as_text(Table(f"Aligned at {alignment.time:g} s", (), rows, words=2))
    return f"{table}\n\n{bullet_list(alignment.notes)}" if alignment.notes else table


def format_time_offset(offset: TimeOffset) -> str:
    """Return the offset with its standard deviation."""
    if not offset.identifiable:
        return "time offset not identifiable: the vehicle hardly changes its velocity"
    lines = [f"time offset {offset.seconds:.3f} s (sigma {offset.sigma:.3f} s)"]
    lines += [
        f"{name} {shorten(value, 3)} (sigma {shorten(sigma, 1)})"
        for name, value, sigma in offset.parts[1:]
    ]
    return "\n".join(lines)


def track_title(track: Track) -> str:
    """Return the title of a track."""
    smoothed_text = ", smoothed" if track.smoothed else ""
    return f"{Path(track.source).name}{smoothed_text}"


def _make_outage_rows(outage: OutageErrors) -> Iterator[tuple[str, ...]]:
    for i, name in enumerate(outage.end):
        values = (outage.rms(name), outage.median(name), outage.largest(name))
        first = (f"{outage.seconds:g} s", str(outage.n)) if i == 0 else ("", "")
        metres = (_format_metres(value) for value in values)
        ratio = f"{outage.error_over_sigma():.2f}" if name == FILTER else ""
        yield first[0], _ROW_NAMES.get(name, name), first[1], *metres, ratio


def _format_metres(value: float) -> str:
    return f"{value:.1f}" if value < 100.0 else f"{value:.0f}"


def _format_parts(track: Track, nis: Floats | None) -> Iterator[str]:
    yield wrap_prose(f"Track of {track_title(track)}")
    navigating = np.flatnonzero(track.navigating)
    if navigating.size:
        yield as_text(_make_end_table(track, int(navigating[-1])))
    yield as_text(_make_fixes_table(track, nis))
    if track.aids:
        yield as_text(_make_aids_table(track))
    yield as_text(_make_states_table(track))
    if track.limits:
        yield as_text(_make_usable_table(track))
    if navigating.size:
        yield as_text(_make_bias_table(track, int(navigating[-1])))
    if track.notes:
        yield f"Notes\n{bullet_list(track.notes)}"


def _make_fixes_table(track: Track, nis: Floats | None) -> Table:
    rows = [(name, str(count)) for name, count in track.fix_count.items()]
    if any(track.rejected_count.values()):
        rows += [(f"{name} rejected", str(count)) for name, count in track.rejected_count.items()]
    note = ""
    if nis is not None:
        for name, values in zip(("position", "velocity"), nis.T, strict=True):
            finite = np.isfinite(values)
            if finite.any():
                rows.append((f"NIS of {name}, mean", f"{values[finite].mean():.2f}"))
                rows.append((f"NIS of {name}, median", f"{np.median(values[finite]):.2f}"))
        note = (
            "NIS: normalised innovation squared, rejected fixes included; mean 3 and median 2.4 "
            "if the standard deviations are right."
        )
    return Table("Fixes", (), tuple(rows), note=note)


def _make_aids_table(track: Track) -> Table:
    rows = []
    for kind, aid in track.aids.items():
        counts = np.bincount(aid.verdict, minlength=len(VERDICTS)).tolist()
        finite = np.isfinite(aid.nis)
        mean = f"{aid.nis[finite].mean():.2f}" if finite.any() else ""
        rows.append((kind, *map(str, counts[:3]), mean))
    note = "NIS: 1 on average, 3 of a baseline, if standard deviations are right."
    return Table("Aids", ("", *VERDICTS[:3], "NIS, mean"), tuple(rows), note=note)


def _make_usable_table(track: Track) -> Table:
    rows = []
    for output, usable in zip(OUTPUTS, track.usable.T, strict=True):
        limit, factor, unit = track.limits[output], *_OUTPUT_UNITS[output]
        share = 100.0 * float(usable.mean()) if usable.size else 0.0
        end = "yes" if usable.size and usable[-1] else "no"
        rows.append((f"{output}, {unit}", shorten(limit * factor, 3), f"{share:.1f}", end))
    return Table("Usable", ("", "σ at most", "% of the time", "at the end"), tuple(rows))


def _make_states_table(track: Track) -> Table:
    span = float(np.ptp(track.time)) / max(track.n - 1, 1)
    counts = np.bincount(track.status, minlength=len(STATUSES))
    rows = [
        (name, f"{count * span:.1f}", f"{100.0 * count / max(track.n, 1):.1f}")
        for name, count in zip(STATUSES, counts.tolist(), strict=True)
        if count
    ]
    return Table("Time", ("", "s", "%"), tuple(rows))


def _make_end_table(track: Track, last: int) -> Table:
    latitude, longitude, height = track.position[last].tolist()
    sigma = track.sigma[last]
    euler = np.degrees(euler_angles(track.quaternion[last : last + 1])[0])
    rows = [
        ("latitude, deg; north, m", f"{latitude:.8f}", shorten(sigma[0])),
        ("longitude, deg; east, m", f"{longitude:.8f}", shorten(sigma[1])),
        ("height, m", f"{height:.2f}", shorten(sigma[2])),
    ]
    ways = zip(("north", "east", "down"), track.velocity[last], sigma[3:6], strict=True)
    rows += [(f"velocity {way}, m/s", f"{v:.3f}", shorten(s)) for way, v, s in ways]
    tilt = float(np.degrees(np.hypot(*sigma[6:8])))
    heading = float(np.degrees(sigma[8]))
    rows += [
        ("roll, deg", f"{euler[0]:.2f}", shorten(tilt)),
        ("pitch, deg", f"{euler[1]:.2f}", shorten(tilt)),
        (
            "heading, deg",
            format_heading(math.radians(euler[2]), 2),
            shorten(heading),
        ),
    ]
    return Table("At the end", ("", "", "σ"), tuple(rows))


def _make_bias_table(track: Track, last: int) -> Table:
    gyro = np.degrees(track.gyro_bias[last]), np.degrees(track.sigma[last, 9:12])
    accel = track.accel_bias[last], track.sigma[last, 12:15]
    rows = tuple(
        (name, unit, *(format_with_error(float(v), float(s)) for v, s in zip(*both, strict=True)))
        for name, unit, both in (("gyro", "deg/s", gyro), ("accelerometer", "m/s^2", accel))
    )
    return Table("Bias at the end", ("", "", *"xyz"), rows, words=2, note="With ± σ.", blocks=True)
