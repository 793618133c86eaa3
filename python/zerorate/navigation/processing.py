"""A whole recording through the navigation filter."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationFilter
from zerorate.faults import ArgumentError, given, said
from zerorate.io import Recording
from zerorate.io.samples import Samples
from zerorate.navigation.fixes import Fixes
from zerorate.navigation.track import Inputs, Track, track_of
from zerorate.types import Floats

__all__ = ["SIGMA_POSITION", "SIGMA_VELOCITY", "processed", "rows_of"]

SIGMA_POSITION: Final = 2.0
SIGMA_VELOCITY: Final = 0.1
"""What is taken for the deviations of a receiver that tells none, m and m/s."""


def processed(
    nav: NavigationFilter,
    imu: Recording,
    gnss: Fixes | None,
    rest: npt.ArrayLike | None,
    time_offset: float,
    keep: bool,
) -> Track:
    """Do what ``NavigationFilter.process`` says; `keep` is whether the track can be smoothed."""
    samples = Samples.of(imu, mag=False, what="navigation")
    if gnss is not None and not isinstance(gnss, Fixes):
        raise TypeError(f"gnss must be Fixes, as zr.read_fixes returns them, got {_type(gnss)}")
    if not math.isfinite(time_offset):
        raise ArgumentError("time_offset", f"must be a number of seconds, got {time_offset}")
    fixes = None if gnss is None else gnss.shifted(time_offset)
    time = samples.time
    inputs = Inputs(
        time,
        samples.gyro,
        samples.accel,
        rows_of(fixes),
        None if rest is None else _flags(rest, len(time)),
    )
    notes = [*samples.notes, *(() if gnss is None else gnss.notes)]
    epoch = None if fixes is None else fixes.epoch
    if fixes is not None and len(fixes) and len(time) and not len(fixes.between(time[0], time[-1])):
        notes.insert(
            0,
            said(
                f"none of the fixes is used: they are from {fixes.time[0]:.6g} to "
                f"{fixes.time[-1]:.6g} s and the samples from {time[0]:.6g} to {time[-1]:.6g} s, "
                "as on another clock; ",
                given("time_offset"),
                " moves them",
            ),
        )
    told = tuple(dict.fromkeys(notes))
    return track_of(nav, inputs, source=imu.source, epoch=epoch, notes=told, keep=keep)


def rows_of(fixes: Fixes | None) -> Floats:
    """Return fixes as ``NavigationFilter.process_arrays`` takes them, shape (m, 13).

    Where a receiver tells no deviation it is 2 m and 0.1 m/s.
    """
    if fixes is None:
        return np.empty((0, 13))
    rows = np.full((len(fixes), 13), np.nan)
    rows[:, 0] = fixes.time
    rows[:, 1:4] = fixes.position
    rows[:, 7:10] = _told(fixes.position_sigma, SIGMA_POSITION)
    rows[:, 10:13] = _told(fixes.velocity_sigma, SIGMA_VELOCITY)
    if fixes.velocity is not None:
        rows[:, 4:7] = fixes.velocity
    return rows


def _told(sigma: Floats | None, usual: float) -> Floats | float:
    if sigma is None:
        return usual
    told: Floats = np.where(np.isnan(sigma), usual, sigma)
    return told


def _flags(rest: npt.ArrayLike, n: int) -> npt.NDArray[np.bool_]:
    flags = np.asarray(rest)
    if flags.shape != (n,) or flags.dtype != np.bool_:
        raise ArgumentError(
            "rest",
            f"must be an array of bool, shape ({n},), got {flags.dtype} of shape {flags.shape}",
        )
    return flags


def _type(given: object) -> str:
    return type(given).__name__
