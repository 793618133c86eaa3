"""Deviations along a record: each window is a record of its own."""

import numpy as np
import pytest

import zerorate as zr

NOISE = np.random.default_rng(3).standard_normal(5000)


@pytest.mark.parametrize("kind", ["oadev", "mdev", "tdev", "totdev"])
def test_each_window_is_a_record(kind):
    d = zr.noise.dynamic_allan(NOISE, 50.0, window=10.0, step=3.0, kind=kind)
    assert d.deviation.shape == (d.times.size, d.taus.size)
    for i, time in enumerate(d.times):
        start = round((time - 5.0) * 50.0)
        alone = zr.allan(NOISE[start : start + 500], 50.0, kind, d.taus)
        np.testing.assert_array_equal(d.deviation[i], alone.deviation)


def test_windows_follow_at_the_step_and_end_with_the_record():
    d = zr.noise.dynamic_allan(NOISE, 50.0, window=10.0, step=3.0)
    np.testing.assert_array_equal(d.times, 5.0 + 3.0 * np.arange(31))
    assert d.times[-1] + 5.0 <= 100.0 < d.times[-1] + 5.0 + 3.0
    assert (d.window, d.unit, d.kind) == (10.0, "unit", "oadev")


def test_defaults_are_a_tenth_and_some_fifty_windows():
    d = zr.noise.dynamic_allan(NOISE, 50.0, unit="deg/s")
    assert d.window == 10.0
    assert 50 <= d.times.size <= 52
    # Averaging times go up to a tenth of the window.
    assert 0.5 < d.taus[-1] <= 1.0
    assert d.unit == "deg/s"


def test_louder_noise_is_seen_where_it_is():
    z = np.where((np.arange(5000) >= 2000) & (np.arange(5000) < 3000), 3.0, 1.0) * NOISE
    d = zr.noise.dynamic_allan(z, 50.0, window=4.0, step=4.0)
    loud = (d.times > 40.0) & (d.times < 60.0)
    # 200 samples tell a deviation to 6 %; four of those.
    np.testing.assert_allclose(d.deviation[loud, 0], 3.0, rtol=0.24)
    np.testing.assert_allclose(d.deviation[~loud, 0], 1.0, rtol=0.24)


def test_gaps_leave_windows_without_a_deviation():
    z = NOISE.copy()
    z[1000:2000] = np.nan
    d = zr.noise.dynamic_allan(z, 50.0, window=10.0, step=10.0)
    assert np.isnan(d.deviation[2:4]).all()
    assert np.isfinite(d.deviation[[0, 1, 4, 9]]).all()


def test_threads_change_no_bit():
    one, two = (zr.noise.dynamic_allan(NOISE, 50.0, threads=n).deviation for n in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_averaging_times_are_chosen():
    d = zr.noise.dynamic_allan(NOISE, 50.0, window=20.0, taus=[0.02, 0.1, 1.0])
    np.testing.assert_allclose(d.taus, [0.02, 0.1, 1.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"window": 0.3}, "a window must hold 20 to 5000 samples .*, 0.3 s hold 15"),
        ({"window": 100.1}, "a window must hold 20 to 5000 samples .*, 100.1 s hold 5005"),
        ({"window": -1.0}, "a window must hold 20 to 5000 samples"),
        ({"window": 1.7e308}, "a window must hold 20 to 5000 samples"),
        ({"window": np.nan}, "window must be a finite time in s, got nan"),
        ({"window": np.inf}, "window must be a finite time in s, got inf"),
        ({"step": 0.0}, "step must be at least one sample, 0.02 s, got 0"),
        ({"step": -1.0}, "step must be at least one sample, 0.02 s, got -1"),
        ({"step": np.nan}, "step must be a finite time in s, got nan"),
        ({"rate": 0.0}, "rate must be a positive finite number of Hz"),
        ({"kind": "adve"}, "unknown kind 'adve'"),
        ({"unit": "deg"}, "unit must be one of an angular rate"),
        ({"z": NOISE.reshape(-1, 2)}, r"z must have shape \(n,\), got \(2500, 2\)"),
        ({"z": NOISE[:100]}, "a window must hold 20 to 100 samples .*, 0.2 s hold 10"),
        ({"taus": [2.0], "window": 10.0}, "tau 2 s is beyond"),
    ],
)
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        zr.noise.dynamic_allan(**({"z": NOISE, "rate": 50.0} | arguments))


def test_a_window_too_short_for_the_kind_says_so():
    with pytest.raises(ValueError, match=r"a window of 0.5 s is too short for theo1"):
        zr.noise.dynamic_allan(NOISE, 50.0, window=0.5, kind="theo1")


def test_masked_samples_are_missing():
    masked = np.ma.masked_array(NOISE, mask=np.arange(5000) % 1000 < 100)
    d = zr.noise.dynamic_allan(masked, 50.0, window=10.0, step=10.0)
    filled = zr.noise.dynamic_allan(masked.filled(np.nan), 50.0, window=10.0, step=10.0)
    np.testing.assert_array_equal(d.deviation, filled.deviation)
    assert np.any(
        d.deviation != zr.noise.dynamic_allan(NOISE, 50.0, window=10.0, step=10.0).deviation
    )
