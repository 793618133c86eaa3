"""How streaming classes take records of the table in support/classes.py: by samples, or at once.

Most take a sample as one or several arguments. A linear filter takes one in two calls, an array as
a matrix; what navigates takes events, a sample of the sensors or a fix.
"""

import warnings

import numpy as np

import zerorate as zr

# Seconds between two samples of a navigation filter, and where its fixes lie about.
STEP = 0.02
HOME = np.array([48.0, 11.0, 400.0])
METRES = np.array([1e-5, 1e-5, 1.0])
NAVIGATORS = (zr.NavigationFilter, zr.navigation.NavigationBank)
NAVIGATED = ("position", "velocity", "quaternion", "gyro_bias", "accel_bias", "sigma")
STATUSES = ("waiting", "no heading", "navigating", "coasting", "missing")


def arguments_of(f, z):
    """What an object takes a sample by, or a record."""
    if isinstance(f, (zr.TemperatureFilter, zr.Tilt)):
        return tuple(np.moveaxis(np.asarray(z), -1, 0))
    if isinstance(f, zr.Attitude):
        # The field comes first, for its unit alone is free; it is the last argument.
        sensors = np.split(np.asarray(z), np.shape(z)[-1] // 3, axis=-1)
        if not f.mag:
            # Of a state that was forged: it takes no field.
            return tuple(sensors[-2:])
        return (*sensors[-2:], *sensors[:-2])
    if isinstance(f, zr.FootFilter):
        return tuple(np.split(np.asarray(z, dtype=float), 2, axis=-1))
    if isinstance(f, zr.PositionFilter):
        # East and north of both, strength, rest where the number is positive.
        numbers = np.asarray(z, dtype=float)
        plane, others = np.split(numbers[..., :4], 2, axis=-1), np.moveaxis(numbers, -1, 0)[4:]
        return (*plane, others[0], is_positive(others[1]))
    if isinstance(f, zr.GyroArray):
        axes = (f.sensors, 3) if f.axes == 3 else (f.sensors,)
        return (np.reshape(z, (*np.shape(z)[:-1], *axes)),)
    if isinstance(f, NAVIGATORS):
        return events_of(f, np.asarray(z, dtype=float))
    return (z,)


def is_positive(numbers):
    return np.isfinite(numbers) & (numbers > 0.0)


def events_of(f, z):
    """Times, gyro, accelerometer, the fixes that come with some samples, and where it rests.

    A row is six numbers of the sensors, whether there is a fix, its position in metres and its
    velocity, and whether the vehicle is known to rest; of one with aids also whether there are
    readings, of which height, heading, and which of height and pressure.
    """
    time = STEP * (f.samples_seen + np.arange(len(z)))
    if f.time >= STEP * f.samples_seen:
        # Of a forged state, whose time its samples do not tell.
        time = f.time + STEP * (1 + np.arange(len(z)))
    there = is_positive(z[:, 6])
    fixes = np.full((there.sum(), 13), 0.1)
    fixes[:, 0] = time[there]
    fixes[:, 1:4] = HOME + METRES * z[there, 7:10]
    fixes[:, 4:7], fixes[:, 7:10] = z[there, 10:13], 2.0
    samples = time, z[:, :3], z[:, 3:6], fixes, is_positive(z[:, 13])
    return samples if z.shape[1] == 14 else (*samples, False, None, aids_of(time, z[:, 14:]))


def aids_of(time, z):
    """Rows of the readings that come with some samples."""
    there = is_positive(z[:, 0])
    time, (height, heading, pressure) = time[there], z[there, 1:].T
    rows = np.full((2 * len(time), 8), np.nan)
    rows[:, 1] = np.repeat(time, 2)
    rows[:, 2:5] = 0.0
    rows[::2, 0], rows[1::2, 0] = is_positive(pressure), 2
    rows[::2, 2] = np.where(is_positive(pressure), 96000.0 - height, HOME[2] + height)
    rows[1::2, 2] = heading
    return rows


def called(f):
    """The name of the method that takes a record."""
    return "process_arrays" if isinstance(f, NAVIGATORS) else "process"


def process(f, z, **how):
    """What a record gives, as one array or None."""
    if isinstance(f, (zr.LinearKalman, *NAVIGATORS)):
        # Their records are no work for several threads.
        how.pop("threads", None)
    with warnings.catch_warnings():
        # Of forces at rest that are not those of gravity.
        warnings.filterwarnings("ignore", "the accelerometer shows")
        return flat(getattr(f, called(f))(*arguments_of(f, z), **how))


def flat(answers):
    """Answers of any kind as one array, side by side."""
    if isinstance(answers, zr.linear.LinearRun):
        return answers.state
    if isinstance(answers, tuple) and isinstance(answers[0], dict):
        known = answers[0]
        return np.column_stack([*(known[name] for name in NAVIGATED), known["status"]])
    return np.concatenate(answers, axis=-1) if isinstance(answers, tuple) else answers


def step(f, sample):
    """What one sample gives."""
    if isinstance(f, zr.LinearKalman):
        f.predict()
        return f.update(sample)
    if not isinstance(f, NAVIGATORS):
        return flat(f.update(*arguments_of(f, sample)))
    time, gyro, accel, fixes, rest, *aids = events_of(f, np.array([sample], dtype=float))
    f.update(time[0], gyro[0], accel[0], bool(rest[0]))
    for kind, at, value in aids[-1][:, :3] if aids else ():
        (f.update_height, f.update_pressure, f.update_heading)[int(kind)](at, value)
    for fix in fixes:
        f.update_gnss(fix[0], fix[1:4], fix[4:7], fix[7:10], fix[10:13])
    return np.hstack([*(getattr(f, name) for name in NAVIGATED), STATUSES.index(f.status)])


def joined(parts):
    """What several calls returned, as one; of StreamingAllan, which returns nothing, None."""
    if all(part is None for part in parts):
        return None
    return np.concatenate([np.atleast_1d(part) for part in parts])


def one_by_one(f, z):
    """What each sample gives, in calls of its own."""
    if isinstance(f, (zr.LinearKalman, *NAVIGATORS)):
        answers = [step(f, sample) for sample in z.tolist()]
    else:
        columns = (np.asarray(part).tolist() for part in arguments_of(f, z))
        answers = [flat(f.update(*row)) for row in zip(*columns, strict=True)]
    if all(answer is None for answer in answers):
        return None
    return np.array(answers)
