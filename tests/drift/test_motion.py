"""What a sensor that was moved leaves of the drift, by method and with what is told of motion."""

import numpy as np
import pytest

import zerorate as zr
from support.checks import assert_same_bits
from support.recordings import needs_recordings, recorded
from support.settings import METHODS

RATE = 100.0
NOISE, BIAS = 0.1, 0.5
MOVED = slice(12_000, 15_000)
BY_METHOD = pytest.mark.parametrize("method", [*METHODS, "auto"])


def turning(n=3000):
    """Turning to and fro, in half a minute: of 300 noises, and as often to either side."""
    t = np.arange(n) / RATE
    return 30.0 * np.sin(2.0 * np.pi * t / 5.0) * np.sin(np.pi * t / t[-1])


def moved(seed=1):
    """Two minutes of rest, half a minute of motion, two of rest: signal and true rate."""
    rate = np.zeros(27_000)
    rate[MOVED] = turning()
    noise = NOISE * np.random.default_rng(seed).standard_normal(rate.size)
    return BIAS + rate + noise, rate


def traced(method, motion, z=None, **arguments):
    f = zr.DriftFilter(RATE, method=method, motion=motion, **arguments)
    return f.trace(moved()[0] if z is None else z)


@BY_METHOD
def test_motion_is_seen(method):
    at_rest = traced(method, "hold").at_rest
    assert not at_rest[MOVED][200:-200].any()
    assert at_rest[MOVED.start - 1000 : MOVED.start].all()
    # Ten seconds after the motion it is over for every rule.
    assert at_rest[MOVED.stop + 1000 :].all()


@BY_METHOD
def test_motion_matters(method):
    held, ignored = (traced(method, motion) for motion in ("hold", "ignore"))
    assert ignored.at_rest.all()
    # The published filters follow the rate; the other takes it for noise and believes it little.
    least = 10.0 * NOISE if method != "auto" else 2.0 * np.sqrt(held.covariance[MOVED.start, 0, 0])
    assert np.max(np.abs(ignored.bias[MOVED] - held.bias[MOVED])) > least


def test_the_bias_is_held_in_motion():
    trace = traced("auto", "hold")
    # Five of its own deviations: two minutes of white noise leave 0.1/sqrt(12000) = 0.001.
    assert np.all(np.abs(trace.bias[MOVED] - BIAS) <= 5.0 * trace.bias_sigma[MOVED])
    assert np.all(np.abs(trace.bias[MOVED] - BIAS) < 0.01)


def test_what_is_not_seen_grows_uncertain():
    sigma = traced("auto", "hold").bias_sigma[MOVED][200:-200]
    assert np.all(np.diff(sigma) >= 0.0)
    assert sigma[-1] > sigma[0]


@BY_METHOD
def test_the_rate_in_motion_is_compensated_without_delay(method):
    z, rate = moved()
    f = zr.DriftFilter(RATE, method=method, motion="hold", output="compensated")
    error = f.process(z)[MOVED] - rate[MOVED]
    # The noise of the samples, to sqrt(1/6000) five times, and a bias known to a tenth of it: that
    # of the published filters follows the noise at rest.
    assert np.sqrt(np.mean(error**2)) < 1.1 * NOISE + 0.5 * NOISE * (method != "auto")


@BY_METHOD
def test_the_channel_that_moves_does_not_hold_the_one_that_rests(method):
    z, _ = moved()
    still = z - moved()[1]
    together = traced(method, "hold", np.stack([z, still], axis=1), channels=2)
    assert together.at_rest[MOVED][200:-200, 1].all()
    assert_same_bits(together.bias[:, 1].copy(), traced(method, "hold", still).bias)


@BY_METHOD
def test_a_filter_saved_in_motion_goes_on_equal(method):
    z, _ = moved()
    for stop in (MOVED.start + 3, MOVED.start + 1500, MOVED.stop + 40):
        f = zr.DriftFilter(RATE, method=method, motion="hold", output="estimate")
        f.process(z[:stop])
        twin = zr.DriftFilter.from_bytes(f.to_bytes())
        assert_same_bits(twin.process(z[stop:]), f.process(z[stop:]))
        assert twin.to_bytes() == f.to_bytes()


@pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
@BY_METHOD
def test_motion_has_no_unit(method, factor):
    z, _ = moved()
    plain, scaled = traced(method, "hold"), traced(method, "hold", z * factor)
    assert_same_bits(scaled.at_rest, plain.at_rest)
    assert_same_bits(scaled.bias, plain.bias * factor)


def test_a_sensor_that_moves_from_the_start_is_learned_once_it_rests():
    rest = BIAS + NOISE * np.random.default_rng(2).standard_normal(12_000)
    z = np.append(rest[:3000] + turning() + 30.0, rest)
    f = zr.DriftFilter(RATE, method="auto", output="estimate")
    f.process(z)
    assert f.status == "at rest"
    # Rest of at least a minute, with the price of an unknown drift.
    assert abs(f.bias - BIAS) < 5.0 * 1.25 * NOISE / np.sqrt(6000.0)


def test_motion_after_switching_on_again_does_not_bring_the_old_drift_back():
    z, _ = moved()
    f = zr.DriftFilter(RATE, method="auto", startup=20.0, output="estimate")
    f.process(z)
    f.power_on()
    later = 10.0 + z[: MOVED.start] - BIAS
    later[1500:2500] += turning()[1000:2000]
    f.process(later)
    # A minute and a half of rest at the new level.
    assert abs(f.bias - 10.0) < 5.0 * 1.25 * NOISE / np.sqrt(6000.0)


@needs_recordings
@pytest.mark.parametrize("axis", "xyz")
def test_the_bias_of_a_recording_survives_its_motion(axis):
    rate = 2000.0 / 7.0
    name = "broad_05_undisturbed_slow_rotation_with_breaks_B"
    z = recorded(name, rate, f"gyro_{axis}_radps")
    bias = zr.DriftFilter(rate, method="auto", output="estimate").process(z)
    first, last = (np.mean(z[int(a * rate) : int(b * rate)]) for a, b in [(5, 34), (181, 206)])
    # Its mean at rest before all motion and after it, and what it changed in between; 0.1 deg/s
    # is the noise of a sample, and a hundredth of what the motion would leave.
    change = abs(last - first) + np.radians(0.1)
    assert np.all(np.abs(bias[int(34 * rate) :] - last) <= change)
