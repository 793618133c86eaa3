"""A clock that leaps or is set back: heading and tilt are as unsure as the body may have turned."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zerorate as zr
from support import outside

RATE = 100.0
UP, LEVEL = (0.0, 0.0, 1.0), (1.0, 0.3, 0.0)


@cache
def cut(seed, axis, angle, rests):
    """Return a hand's sensors, truth and the row before which the body was turned, unseen."""
    motion = zr.simulate_motion("hand", RATE, 60.0, seed=seed)
    before, after = (
        (slice(0, 400), slice(400, None)) if rests else (slice(0, 3000), slice(3000, None))
    )
    turn = Rotation.from_rotvec(np.radians(angle) * np.asarray(axis) / np.linalg.norm(axis))
    sensors = [
        np.concatenate((z[before], turn.inv().apply(z[after])))
        for z in (motion.gyro, motion.accel, motion.mag)
    ]
    later = Rotation.from_quat(motion.quaternion[after], scalar_first=True) * turn
    truth = np.concatenate((motion.quaternion[before], later.as_quat(scalar_first=True)))
    return *sensors, truth, len(motion.gyro[before])


def followed(gap, seed, axis, angle, rests, nine, method="trace"):
    """Return errors over deviations after the cut, heading and tilt, and the tilt error, deg."""
    gyro, accel, mag, truth, row = cut(seed, axis, angle, rests)
    dt = np.full(len(gyro), 1.0 / RATE)
    if gap == "lost":
        missing = np.full((1000, 3), np.nan)
        gyro, accel, mag = (np.insert(z, row, missing, axis=0) for z in (gyro, accel, mag))
        truth = np.insert(truth, row, np.full((1000, 4), np.nan), axis=0)
        dt = np.full(len(gyro), 1.0 / RATE)
    else:
        dt[row] = gap
    filter_ = zr.Attitude(RATE, mag=nine)
    trace = getattr(filter_, method)(gyro, accel, mag if nine else None, dt)
    late = np.flatnonzero(np.isfinite(truth[:, 0]) & (np.arange(len(truth)) > row))
    heading, tilt = outside.parts(trace["quaternion"][late], truth[late])
    if not nine:
        first = outside.parts(trace["quaternion"][row - 1 : row], truth[row - 1 : row])[0]
        heading = np.mod(heading - first + np.pi, 2.0 * np.pi) - np.pi
    sigmas = trace["heading_sigma"][late], trace["tilt_sigma"][late]
    return np.abs(heading) / sigmas[0], tilt / sigmas[1], np.degrees(tilt[500:])


@pytest.mark.parametrize("rests", [True, False])
@pytest.mark.parametrize("nine", [True, False])
@pytest.mark.parametrize("axis", [UP, LEVEL])
@pytest.mark.parametrize("gap", [-12.0, 6.0, 12.0, "lost"])
def test_the_body_may_point_anywhere_after_it(gap, axis, nine, rests):
    for seed in range(2):
        heading, tilt, off = followed(gap, seed, axis, 120.0, rests, nine)
        assert np.mean(heading < 3.0) > 0.9
        assert np.mean(tilt < 3.0) > 0.9
        assert np.mean(off) < 10.0


@pytest.mark.parametrize("axis", [UP, LEVEL])
@pytest.mark.parametrize(("gap", "angle"), [(1.5, 25.0), (3.0, 60.0)])
def test_a_short_leap_is_that_of_a_body_that_begins_to_turn(gap, angle, axis):
    for rests in (True, False):
        heading, tilt, _ = followed(gap, 1, axis, angle, rests, nine=False)
        assert np.mean(heading < 3.0) > 0.9
        assert np.mean(tilt < 3.0) > 0.9


@pytest.mark.parametrize("gap", [-12.0, "lost"])
def test_offline_too(gap):
    heading, tilt, _ = followed(gap, 0, LEVEL, 120.0, True, nine=False, method="smooth")
    assert np.mean(heading < 3.0) > 0.9
    assert np.mean(tilt < 3.0) > 0.9


def test_a_clock_that_is_set_back_by_less_has_lost_a_second():
    """A network sets one by less; a recorder that begins again, by more."""
    motion = zr.simulate_motion("hand", RATE, 10.0, seed=1)
    sigmas = {}
    for step in (-0.01, -0.5, -1.0, -1.5, -50.0):
        f = zr.Attitude(RATE, mag=False)
        f.process(motion.gyro[:400], motion.accel[:400])
        f.update(motion.gyro[400], motion.accel[400], dt=step)
        sigmas[step] = np.degrees(f.heading_sigma)
    assert sigmas[-0.01] == sigmas[-0.5] == sigmas[-1.0] < 5.0
    assert sigmas[-1.5] == sigmas[-50.0] > 90.0


@pytest.mark.parametrize("jump", [-12.0, 20.0])
def test_a_table_whose_clock_begins_again_says_so(jump):
    gyro, accel, _, truth, row = cut(0, UP, 120.0, rests=True)
    time = np.arange(len(gyro)) / RATE
    time[row:] += jump
    columns = {"time": time}
    for name, values, unit in (("gyro", gyro, "radps"), ("accel", accel, "mps2")):
        for i, axis in enumerate("xyz"):
            columns[f"{name}_{axis}_{unit}"] = values[:, i]
    found = zr.estimate_attitude(columns)
    after = np.searchsorted(found.time, found.time[0] + row / RATE + 10.0) + 50
    assert np.degrees(found.heading_sigma[row - 5]) < 2.0
    assert np.degrees(found.heading_sigma[-1]) > 90.0
    assert after < found.n
    assert any("no rate for more than 0.05 s" in note for note in found.notes)
    if jump < 0.0:
        assert "1 new beginning" in " ".join(found.notes)
    _, tilt = outside.parts(found.quaternion[-3000:], truth[-3000:])
    assert outside.rms(tilt) < 10.0
