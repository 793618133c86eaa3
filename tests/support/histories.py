"""Hostile histories: blocks of samples with steps of time from nothing to ages, for any stream."""

import numpy as np

import zerorate as zr
from support.feeding import NAVIGATORS, STEP, arguments_of, process
from support.records import one_of, stretch_of_misbehaviour

# Seconds between two samples; a year of gaps comes together within one history.
STEPS_S = (
    0.0,
    5e-324,
    1e-9,
    1e-3,
    0.01,
    1.0,
    60.0,
    3600.0,
    1e6,
    3.2e7,
    1e12,
    1e300,
    np.inf,
    np.nan,
)
# Of a navigation filter, whose time only grows.
STARTS_S = (0.0, -0.01, -1e9, 1e-300, 1.7e9, 1e15)
LEVELS = (0.0, 1.0, -1.0, 0.01, 9.81, 50.0)
MAX_ROWS = 60


def blocks(rng, width):
    """Yield blocks of samples, shape (n, width): axes, constants, zeros or hostile ones."""
    for _ in range(rng.integers(2, 9)):
        kind = rng.integers(4)
        n = int(rng.integers(1, MAX_ROWS))
        if kind == 0:
            yield np.tile(rng.choice(LEVELS, width), (n, 1))
        elif kind == 1:
            yield np.zeros((n, width))
        elif kind == 2:
            yield rng.choice(LEVELS, width) + one_of(rng, LEVELS) * rng.standard_normal((n, width))
        else:
            columns = [stretch_of_misbehaviour(rng) for _ in range(width)]
            n = min(map(len, columns))
            yield np.stack([column[:n] for column in columns], axis=-1)


def take(rng, f, z):
    """Give a block to a stream, with a step of time where it takes one."""
    if isinstance(f, NAVIGATORS):
        return take_events(rng, f, z)
    arguments = arguments_of(f, z)
    if isinstance(f, (zr.Attitude, zr.Tilt, zr.PositionFilter)):
        return f.process(*arguments, dt=np.full(len(z), one_of(rng, STEPS_S)))
    return process(f, z)


def take_events(rng, f, z):
    """Samples, fixes and wheels at times that grow by steps of any size."""
    time = f.time if np.isfinite(f.time) else one_of(rng, STARTS_S)
    step = one_of(rng, [STEP, 1e-3, 1.0, 3600.0, 3.2e7])
    for row in z:
        time += step
        for update in (
            lambda row=row, time=time: f.update(time, row[:3], row[3:6], bool(rng.integers(2))),
            lambda row=row, time=time: f.update_gnss(time, row[7:10], row[10:13]),
            lambda row=row, time=time: f.update_wheels(time, row[13]),
            lambda row=row, time=time: f.update_height(time, row[7]),
            lambda row=row, time=time: f.update_pressure(time, 9e4 + row[8]),
            lambda row=row, time=time: f.update_heading(time, row[9]),
            lambda row=row, time=time: f.update_baseline(time, row[10:13], (0.8, 0.0, 0.1)),
        ):
            try:
                update()
            except ValueError:
                # Refused: the state is what it was.
                continue
