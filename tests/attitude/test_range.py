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
