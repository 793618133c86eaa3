"""Changes of a magnetometer's hard iron within a recording: their times and sizes."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zerorate.calibration.magnet.calibrate import calibrate_magnetometer
from zerorate.record.log import Log, LogError
from zerorate.record.recording import Recording
from zerorate.record.samples import partner_name
from zerorate.types import Floats

_MAX_ANALYSED_S: Final = 240.0
"""Longest part that is analysed, s; it takes a second or two to compute."""
_MIN_SIZE_CHANGE: Final = 0.15
"""Smallest relative variation of the field's size that is analysed. Twice this rotates a heading by
ten degrees at a dip of 65 deg.
"""


def note_iron_changes(recording: Recording, gyro: str = "gyro") -> tuple[str, ...]:
    """Return the sentence on changes of the hard iron, if there are any.

    Parameters
    ----------
    recording : Recording
        Recording with the gyro, its accelerometer and a magnetometer, of three axes each.
    gyro : str
        Name of the gyro.

    Returns
    -------
    tuple of str
        Sentences; empty if the field's size varies by less than 15 % or the hard iron is constant.
        In a recording over four minutes, only the part around the largest variation is analysed.
    """
    mag = recording.get(partner_name(recording, gyro, "mag"))
    if mag is None or mag.channels != 3 or (centre := _largest_variation(mag)) is None:
        return ()
    start = float(recording[gyro].sampled[0])
    try:
        calibration = calibrate_magnetometer(_cut_around(recording, gyro, centre), gyro=gyro)
    except LogError:
        return ()
    changes = [
        f"by {change:.3g} {calibration.unit} at {time - start:.0f} s"
        for time, change in calibration.iron_changes
    ]
    if not changes:
        return ()
    listed = ", ".join(changes)
    return (
        f"the magnetometer's hard iron changed {listed}: something magnetic was attached or "
        f"removed, and the heading was wrong meanwhile",
    )


def _largest_variation(mag: Log) -> float | None:
    """Return the time of the field's largest distance from its median size, None if it is even."""
    width = max(1, round(mag.rate))
    sizes: Floats = np.linalg.norm(mag.data, axis=1)
    starts = np.arange(0, mag.n, width)
    counts = np.add.reduceat(np.isfinite(sizes).astype(np.float64), starts)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        means = np.add.reduceat(np.nan_to_num(sizes), starts) / counts
        variation = np.abs(means / np.nanmedian(means) - 1.0)
    variation = np.nan_to_num(variation)
    worst = int(variation.argmax())
    return float(mag.sampled[starts[worst]]) if variation[worst] > _MIN_SIZE_CHANGE else None


def _cut_around(recording: Recording, gyro: str, centre: float) -> Recording:
    """Return four minutes at most of the three sensors around a time."""
    names = [partner_name(recording, gyro, kind) for kind in ("gyro", "accel", "mag")]
    logs = {}
    for name in names:
        log = recording[name]
        first = min(centre - 0.5 * _MAX_ANALYSED_S, float(log.sampled[-1]) - _MAX_ANALYSED_S)
        first = max(first, float(log.sampled[0]))
        edges = np.searchsorted(log.sampled, [first, first + _MAX_ANALYSED_S])
        logs[name] = log.part(slice(int(edges[0]), int(edges[1])))
    return replace(recording, logs=logs)
