"""Processing of a whole recording by the navigation filter."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from zerorate._native import NavigationFilter
from zerorate.faults import ArgumentError, keyword_argument, make_sentence
from zerorate.navigation.aids import AID_KINDS, Aid, AidRows
from zerorate.navigation.events import Events
from zerorate.navigation.track import Inputs, Track, run_navigation
from zerorate.navigation.wheels import Wheels
from zerorate.record import Recording
from zerorate.record.fixes import Fixes
from zerorate.record.missing import floats
from zerorate.record.offset import TimeOffset
from zerorate.record.samples import Samples
from zerorate.types import Floats


def processed(
    nav: NavigationFilter,
    imu: Recording,
    gnss: Fixes | None,
    known: tuple[
        npt.ArrayLike | None,
        npt.ArrayLike | Wheels | None,
        tuple[npt.ArrayLike | Aid | None, ...],
    ],
    time_offset: float | TimeOffset | None,
    keep: bool,
) -> Track:
    """Do the work of ``NavigationFilter.process``. With `keep` the track can be smoothed.

    `known` has the mask of rest, the wheel speeds and the readings of aids.
    """
    rest, speed, aids = known
    samples = Samples.of(imu, mag=False, what="navigation")
    if gnss is not None and not isinstance(gnss, Fixes):
        raise TypeError(
            f"gnss must be Fixes, as zr.read_fixes returns them, got {_type_name(gnss)}"
        )
    offset = TimeOffset.of(0.0 if time_offset is None else time_offset)
    fixes = None if gnss is None else offset.applied(gnss)
    time = samples.time
    inputs = Inputs(
        time,
        samples.gyro,
        samples.accel,
        Events.of(fixes),
        None if rest is None else _check_flags(rest, len(time)),
        _wheel_rows(speed),
        AidRows.of(dict(zip(AID_KINDS, aids, strict=True)), time),
    )
    notes = [*samples.notes, *(() if gnss is None else gnss.notes)]
    epoch = None if fixes is None else fixes.epoch
    if fixes is not None and len(fixes) and len(time) and not len(fixes.between(time[0], time[-1])):
        notes.insert(
            0,
            make_sentence(
                f"none of the fixes is used: they are from {fixes.time[0]:.1f} to "
                f"{fixes.time[-1]:.1f} s and the samples from {time[0]:.1f} to {time[-1]:.1f} s, "
                f"which suggests different clocks; ",
                keyword_argument("time_offset"),
                " moves them",
            ),
        )
    all_notes = tuple(dict.fromkeys(notes))
    return run_navigation(nav, inputs, source=imu.source, epoch=epoch, notes=all_notes, keep=keep)


def _wheel_rows(wheel_speed: npt.ArrayLike | Wheels | None) -> Floats | None:
    if wheel_speed is None:
        return None
    return (
        wheel_speed.rows if isinstance(wheel_speed, Wheels) else floats(wheel_speed, "wheel_speed")
    )


def _check_flags(rest: npt.ArrayLike, n: int) -> npt.NDArray[np.bool_]:
    flags = np.asarray(rest)
    if flags.shape != (n,) or flags.dtype != np.bool_:
        raise ArgumentError(
            "rest",
            f"must be an array of bool, shape ({n},), got {flags.dtype} of shape {flags.shape}",
        )
    return flags


def _type_name(given: object) -> str:
    return type(given).__name__
