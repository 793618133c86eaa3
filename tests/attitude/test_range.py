"""What no gyro measures, what clips, and rates in another unit than the one said."""

import numpy as np
import pytest

import zerorate as zr

RATE = 100.0
LEVEL = [0.0, 0.0, 9.81]
DEG = np.pi / 180.0


def still(n=300):
    return np.zeros((n, 3)) + 0.01, np.tile(LEVEL, (n, 1))


@pytest.mark.parametrize("method", ["auto", "mahony", "ekf"])
@pytest.mark.parametrize("value", [6.0, -40.0, 900.0])
def test_a_rate_beyond_the_range_is_missing(method, value):
    gyro, accel = still()
    gone = gyro.copy()
    gyro[200:202, 1], gone[200:202] = value, np.nan
    f = zr.Attitude(RATE, mag=False, method=method, gyro_range=5.0)
    expected = zr.Attitude(RATE, mag=False, method=method).process(gone, accel)
    np.testing.assert_array_equal(f.process(gyro, accel), expected)
    assert f.rates_left_out == 2


def test_what_no_body_feels_is_counted_without_a_range():
    gyro, accel = still()
    gyro[100], gyro[150, 0], gyro[200], gyro[210] = np.inf, 2000.0, np.nan, 0.0
    gyro[220] = -1e9
    f = zr.Attitude(RATE, mag=False)
    f.process(gyro, accel)
    assert f.rates_left_out == 2, (
        "what is not finite and a vector of zeros are missing, and no fault"
    )
    two = zr.Attitude(RATE, mag=False, channels=2)
    two.process(np.stack([gyro, still()[0]], axis=1), np.stack([accel, accel], axis=1))
    np.testing.assert_array_equal(two.rates_left_out, [2, 0])
    f.reset()
    assert f.rates_left_out == 0


def test_a_rate_at_the_range_counts_and_is_said():
    gyro, accel = still()
    f = zr.Attitude(RATE, mag=False, gyro_range=250.0, gyro_unit="deg/s")
    f.process(gyro, accel)
    assert f.status != "clipped"
    f.update([0.0, 0.0, 250.0], LEVEL)
    assert (f.status, f.rates_left_out) == ("clipped", 0)
    f.update([0.0, 0.0, 100.0], LEVEL)
    assert f.status != "clipped"


def test_a_range_is_part_of_what_was_chosen():
    f = zr.Attitude(RATE, gyro_range=2000.0, gyro_unit="deg/s")
    assert "gyro_range=2000.0" in repr(f)
    assert repr(zr.Attitude.from_bytes(f.to_bytes())) == repr(f)
    for wrong in (0.0, -1.0, np.nan, 1e6):
        with pytest.raises(ValueError, match="gyro_range"):
            zr.Attitude(RATE, gyro_range=wrong)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("times", [DEG, 1.0 / DEG])
def test_a_gyro_in_another_unit_is_named(seed, times):
    """Within ten seconds of a hand's motion, which begins after six of rest."""
    motion = zr.simulate_motion("hand", RATE, 16.0, seed=seed)
    f = zr.Attitude(RATE, mag=False)
    f.process(times * motion.gyro, motion.accel)
    assert f.status == "wrong unit?"


@pytest.mark.parametrize(
    "kind", ["hand", "arm", "pendulum", "spinning pendulum", "circle", "vehicle"]
)
def test_right_units_are_not(kind):
    motion = zr.simulate_motion(kind, RATE, 40.0, seed=5)
    f = zr.Attitude(RATE, mag=False)
    for first in range(0, 4000, 100):
        part = slice(first, first + 100)
        f.process(motion.gyro[part], motion.accel[part])
        assert f.status != "wrong unit?", first


KINDS = ("hand", "arm", "pendulum", "spinning pendulum", "circle", "vehicle")


def named_within(motion, seconds, times, *, nine):
    """Return whether the status says it within so many seconds."""
    f = zr.Attitude(RATE, mag=nine)
    for first in range(0, round(seconds * RATE), 50):
        part = slice(first, first + 50)
        f.process(times * motion.gyro[part], motion.accel[part], motion.mag[part] if nine else None)
        if f.status == "wrong unit?":
            return True
    return False


# A car whose rates are too small turns its field by less than its noise in ten seconds.
WRONG_UNITS = [
    (kind, times)
    for kind in KINDS
    for times in (np.degrees(1.0), np.radians(1.0))
    if kind != "vehicle" or times > 1.0
]


@pytest.mark.parametrize(("kind", "times"), WRONG_UNITS)
@pytest.mark.parametrize("start", ["rest", "motion"])
def test_a_field_shows_a_wrong_unit(kind, times, start):
    seconds = 16.0 if start == "rest" else 11.0
    found = [
        named_within(zr.simulate_motion(kind, RATE, 17.0, seed=s, start=start), seconds, times,
                     nine=True)
        for s in range(3)
    ]  # fmt: skip
    # Rates beyond 1000 rad/s are none, and nothing is compared beside them.
    assert sum(found) >= (2 if kind == "arm" and times > 1.0 else 3)


@pytest.mark.parametrize("kind", KINDS)
def test_gravity_tells_rates_that_are_too_large(kind):
    motion = zr.simulate_motion(kind, RATE, 17.0, seed=1)
    assert named_within(motion, 16.0, np.degrees(1.0), nine=False)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("start", ["rest", "motion"])
@pytest.mark.parametrize("nine", [True, False])
def test_right_rates_are_never_another_unit(kind, start, nine):
    for seed in range(2):
        motion = zr.simulate_motion(kind, RATE, 40.0, seed=seed, start=start)
        mag = motion.mag if nine else None
        events = zr.Attitude(RATE, mag=nine).trace(motion.gyro, motion.accel, mag)["events"]
        assert not (events.astype(int) & zr.attitude.Event.WRONG_UNIT).any()


@pytest.mark.parametrize(("rate", "radius"), [(4.7, 0.3), (8.0, 0.3), (10.0, 0.5)])
def test_a_centrifuge_is_none(rate, radius):
    """Its force stays, and so does its rate."""
    t = np.arange(0.0, 40.0, 1.0 / RATE)
    turning = rate * np.clip((t - 10.0) / 2.0, 0.0, 1.0)
    gyro = np.stack((0.0 * t, 0.0 * t, turning), axis=1)
    forces = (-(turning**2) * radius, radius * np.gradient(turning, t), np.full(t.size, 9.81))
    accel = np.stack(forces, axis=1) + np.random.default_rng(0).normal(0.0, 0.05, (t.size, 3))
    events = zr.Attitude(RATE, mag=False).trace(gyro, accel)["events"].astype(int)
    assert not (events & zr.attitude.Event.WRONG_UNIT).any()


@pytest.mark.parametrize("nine", [True, False])
def test_the_offline_pass_leaves_out_what_is_beyond_the_range(nine):
    """As live: one garbage row of 50 rad/s, and rates at the range that stay."""
    motion = zr.simulate_motion("hand", RATE, 40.0, seed=4)
    mag = motion.mag if nine else None
    gyro, missing = motion.gyro.copy(), motion.gyro.copy()
    gyro[2000:2010], missing[2000:2010] = 50.0, np.nan
    limited = zr.Attitude(RATE, mag=nine, gyro_range=35.0).smooth(gyro, motion.accel, mag)
    expected = zr.Attitude(RATE, mag=nine).smooth(missing, motion.accel, mag)
    np.testing.assert_array_equal(limited["quaternion"], expected["quaternion"])
    top = float(np.abs(motion.gyro).max())
    at_range = zr.Attitude(RATE, mag=nine, gyro_range=top).smooth(motion.gyro, motion.accel, mag)
    whole = zr.Attitude(RATE, mag=nine).smooth(motion.gyro, motion.accel, mag)
    np.testing.assert_array_equal(at_range["quaternion"], whole["quaternion"])
