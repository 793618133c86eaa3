"""Simulated motions as ``zerorate simulate`` writes them: a recording, and a receiver's fixes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from zerorate.faults import ArgumentError
from zerorate.io import write_log
from zerorate.record.fixes import Fixes
from zerorate.record.recording import Recording
from zerorate.simulation.drive import simulate_drive
from zerorate.simulation.motion import simulate_motion
from zerorate.simulation.walk import simulate_walk

MOTIONS: Final = {"hand": 60.0, "drive": 240.0, "walk": 46.0}
"""Motions and their default lengths, s."""

_STRIDE_S: Final = 1.05
_STANDING_S: Final = 4.0
"""Durations (s) of a stride of `zerorate.simulate_walk`, and of standing before and after."""
_WALK_TURN_RAD: Final = 0.1
_FIXES_COLUMNS: Final = (
    "time_s,latitude_deg,longitude_deg,height_m,"
    "velocity_north_mps,velocity_east_mps,velocity_down_mps"
)


def simulated_motion(
    kind: str,
    rate: float,
    duration: float | None = None,
    seed: int = 1,
    *,
    magnet: Sequence[float] = (),
    iron: Sequence[float] = (),
) -> tuple[Recording, Fixes | None]:
    """Return the recording of an IMU in motion, and the fixes of a receiver that moves with it.

    Parameters
    ----------
    kind : {"hand", "drive", "walk"}
        "hand": an IMU with a magnetometer, rotated by hand, with its true orientation as reference.
        "drive": IMU and receiver of a car. "walk": an IMU on a foot.
    rate : float
        Samples per second, Hz.
    duration : float, optional
        Length, s; default in `MOTIONS`. A walk consists of complete strides.
    seed : int
        Seed, not negative. The same arguments give the same samples.
    magnet : sequence of float
        For "hand": start and end of the interval with a magnet nearby, s.
    iron : sequence of float
        For "hand": hard iron of the magnetometer, uT.

    Raises
    ------
    ValueError
        If an argument is not as described.
    """
    if kind not in MOTIONS:
        raise ArgumentError("kind", f"must be one of {', '.join(MOTIONS)}, got {kind!r}")
    if kind != "hand" and (magnet or iron):
        raise ArgumentError("magnet" if magnet else "iron", "acts on the motion 'hand' only")
    seconds = MOTIONS[kind] if duration is None else duration
    if kind == "drive":
        drive = simulate_drive(rate, seconds, seed=seed)
        return drive.recording(), drive.fixes
    if kind == "walk":
        strides = max(1, round((seconds - _STANDING_S) / _STRIDE_S))
        walk = simulate_walk(rate, strides, seed=seed, turn=_WALK_TURN_RAD)
        return walk.recording(), None
    spans = [magnet] if magnet else ()
    recording = simulate_motion("hand", rate, seconds, seed=seed, magnet=spans).recording()
    mag = recording.mag
    if iron and mag is not None:
        logs = {**recording, "mag": mag.with_data(mag.data + np.asarray(iron, dtype=np.float64))}
        recording = replace(recording, logs=logs)
    return recording, None


def write_motion(recording: Recording, fixes: Fixes | None, log: Path, *fixes_path: Path) -> None:
    """Write the sensors of a recording into one table, and the fixes, if any, into another."""
    gyro, *others = recording.values()
    extra = {n: x for one in others for n, x in zip(one.names, one.data.T, strict=True)}
    write_log(replace(gyro, extra=extra), log)
    if fixes is not None:
        assert fixes.velocity is not None
        rows = np.column_stack((fixes.time, fixes.position, fixes.velocity))
        (path,) = fixes_path
        np.savetxt(path, rows, "%.12g", ",", header=_FIXES_COLUMNS, comments="")
