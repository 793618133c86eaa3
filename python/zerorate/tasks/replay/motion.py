"""Motion detected by the accelerometer of a body, at the samples of its gyro."""

from contextlib import closing
from typing import Final

import numpy as np

from zerorate._native import MotionDetector
from zerorate.io import LogFile
from zerorate.record import LogError
from zerorate.tasks.workers import prefetch
from zerorate.types import Booleans

_BLOCK_ROWS: Final = 1 << 15


def motion_of(accel: LogFile, gyro: LogFile) -> Booleans:
    """Return the mask of known motion of a gyro's body, shape (n,), from its accelerometer.

    Both clocks have the same zero. Each accelerometer sample is valid until the next one. Before
    the first sample, motion is unknown.

    Raises
    ------
    LogError
        If the accelerometer does not have three axes.
    """
    header = accel.header
    if header.channels != 3:
        raise LogError(
            f"{', '.join(header.names)}: an accelerometer has three axes, got {header.channels}"
        )
    detector = MotionDetector(header.rate)
    with closing(prefetch(accel.blocks(_BLOCK_ROWS))) as blocks:
        moving_blocks = [detector.process(np.ascontiguousarray(block.T)) for block in blocks]
    moving = np.concatenate((*moving_blocks, np.zeros(1, dtype=np.bool_)))
    start = float(accel.time(0, 1)[0])
    is_moving = np.empty(gyro.header.n, dtype=np.bool_)
    for first in range(0, gyro.header.n, _BLOCK_ROWS):
        end = min(first + _BLOCK_ROWS, gyro.header.n)
        # Stamps are rounded; a sample at the same instant is valid.
        last = np.floor((gyro.time(first, end) - start) * header.rate + 1e-3).astype(np.int64)
        # The last element means unknown.
        is_moving[first:end] = moving[np.where((last < 0) | (last >= header.n), header.n, last)]
    return is_moving


def note_on_motion(accel: LogFile, moving: Booleans, rate: float) -> str:
    """Return a sentence on the use of the accelerometer."""
    names = ", ".join(accel.header.names)
    if not moving.any():
        return f"the accelerometer ({names}) shows no motion"
    seconds = np.count_nonzero(moving) / rate
    return (
        f"the accelerometer ({names}) shows motion for {seconds:.4g} s, in which no rate counts as "
        "a bias"
    )
