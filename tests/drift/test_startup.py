"""The start-up believes no few samples, and a scale proved wrong is learned anew."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import oracle
import zerorate as zr
from support.checks import assert_same_bits

RATE = 100.0
LEVEL, NOISE = 0.5, 0.1
# Method and motion: all that learn a scale.
LEARNING = [
    (method, motion) for method in ("kf", "akf", "fading", "auto") for motion in ("hold", "ignore")
]
BY_LEARNING = pytest.mark.parametrize(("method", "motion"), LEARNING)
# "No value" of some sensors and protocols, glitches of buses, ends of the range.
NO_VALUE = [9999.0, -32768.0, 2.0**31, 1e15, 1e30, 3.4028235e38, 1e300, 1.7e308, 5e-324, 0.0]
SCALES = [1e-300, 1e-150, 1e-30, 1e-9, 1e-8, 1e7, 1e9, 1e30, 1e150, 1e290]


def record(seconds, seed=1):
    rng = np.random.default_rng(seed)
    return LEVEL + NOISE * rng.standard_normal(round(seconds * RATE))


def filtered(z, method, motion):
    f = zr.DriftFilter(rate=RATE, method=method, motion=motion, output="estimate")
    return f.process(z), f


def late_error(estimates):
    return np.sqrt(np.mean((estimates[-2000:] - LEVEL) ** 2))


@pytest.mark.parametrize("first", [0, 1, 37, 99])
@pytest.mark.parametrize("value", NO_VALUE)
@BY_LEARNING
def test_one_sample_of_the_start_up_may_be_anything(method, motion, value, first):
    clean = record(120.0)
    spoilt = clean.copy()
    spoilt[first] = value
    (expected, known), (got, f) = (filtered(z, method, motion) for z in (clean, spoilt))
    # One of a hundred samples is lost: the start differs by a tenth of a deviation at most.
    assert late_error(got) <= 1.3 * late_error(expected) + 0.002
    assert f.bias_sigma == pytest.approx(known.bias_sigma, rel=0.3)
    assert f.restart_count == 0


@given(data=st.data())
def test_a_fifth_of_the_start_up_may_be_anything(data):
    method, motion = data.draw(st.sampled_from(LEARNING))
    places = data.draw(st.lists(st.integers(0, 99), max_size=20, unique=True))
    sizes = data.draw(
        st.lists(
            st.floats(10.0, 1e300) | st.floats(-1e300, -10.0),
            min_size=len(places),
            max_size=len(places),
        )
    )
    # After a minute of stillness `auto` takes rest for proven.
    z = record(90.0)
    z[places] = sizes
    estimates, f = filtered(z, method, motion)
    # The start tells the noise to a factor; the detector may take the first ticks for motion.
    assert late_error(estimates) <= 2.0 * NOISE
    assert f.bias_sigma <= 2.0 * NOISE


@pytest.mark.parametrize("scale", SCALES)
@BY_LEARNING
def test_a_scale_proved_wrong_is_learned_anew(method, motion, scale):
    """Ten seconds of another noise at another level: a sensor that was not yet on."""
    z = record(240.0)
    z[:1000] = scale * np.random.default_rng(2).standard_normal(1000)
    expected, known = filtered(record(220.0), method, motion)
    got, f = filtered(z, method, motion)
    assert late_error(got) <= 1.3 * late_error(expected) + 0.003
    assert f.bias_sigma == pytest.approx(known.bias_sigma, rel=0.6)


@pytest.mark.parametrize("method", ["kf", "akf", "fading", "auto"])
@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_status_and_count_say_so(method, scale):
    f = zr.DriftFilter(rate=RATE, method=method, motion="ignore", output="estimate")
    f.process(scale * record(10.0))
    assert f.restart_count == 0
    statuses = set()
    for z in record(60.0):
        f.update(z)
        statuses.add(f.status)
    assert statuses == {"at rest", "restarting"}
    assert f.restart_count == 1
    assert f.samples_seen == 7000


@pytest.mark.parametrize("method", ["kf", "fading", "auto"])
def test_a_scale_that_was_told_stays(method):
    f = zr.DriftFilter(rate=RATE, method=method, motion="ignore", scale=1e-9, output="estimate")
    f.process(record(60.0))
    assert (f.restart_count, f.status) == (0, "at rest")


@pytest.mark.parametrize("scale", [1e-150, 1e-9, 1e9, 1e150])
def test_a_model_whose_scale_is_proved_wrong_begins_anew(scale):
    rng = np.random.default_rng(3)
    z = record(60.0)
    model, fresh = (
        zr.identification.RecursiveLeastSquares((1, 0)),
        zr.identification.RecursiveLeastSquares((1, 0)),
    )
    model.process(np.concatenate([scale * rng.standard_normal(1000), z]))
    fresh.process(z[-4000:])
    # Both have learned white noise about the same level from thousands of samples.
    np.testing.assert_allclose(model.coefficients, fresh.coefficients, atol=0.03)
    assert abs(model.coefficients[-1] / (1.0 - model.coefficients[0]) - LEVEL) < 0.01


@BY_LEARNING
def test_the_rest_of_a_wild_ride_is_no_proof(method, motion):
    """A quiet sensor in fast motion: 3e5 deviations, 3e4 for `auto`, which no scale need follow."""
    quiet = 1e-3 * record(120.0)
    size = 3.0 if method == "auto" else 30.0
    ride = size * np.sin(2.0 * np.pi * 1.7 * np.arange(6000) / RATE)
    f = filtered(np.concatenate([quiet, quiet[:6000] + ride, quiet]), method, motion)[1]
    assert f.restart_count == 0


@pytest.mark.parametrize("method", ["kf", "akf", "fading"])
def test_channels_that_begin_anew_at_different_times_share_registers(method):
    """Each equals itself alone to the last bit, in one batch or in many."""
    z = np.stack([record(80.0, seed) for seed in range(7)], axis=1)
    for c, begin in enumerate([0, 0, 1500, 1500, 2000, 3111, 6000]):
        z[begin:, c] *= 1e8
    together = zr.DriftFilter(
        rate=RATE, method=method, channels=7, motion="ignore", output="estimate"
    )
    answers = together.process(z)
    pieces = zr.DriftFilter(
        rate=RATE, method=method, channels=7, motion="ignore", output="estimate"
    )
    parts = [pieces.process(part) for part in np.split(z, [0, 1, 700, 777, 2048, 4000])]
    assert_same_bits(np.concatenate(parts), answers)
    for c in range(7):
        alone = zr.DriftFilter(rate=RATE, method=method, motion="ignore", output="estimate")
        assert_same_bits(alone.process(z[:, c].copy()), answers[:, c])
        assert alone.restart_count == together.restart_count[c] == (c >= 2)


SPOILT = {
    "spike first": lambda z: np.concatenate([[1e15], z]),
    "spikes": lambda z: np.concatenate([np.where(np.arange(90) % 17 == 5, 1e6, z[:90]), z]),
    "silent": lambda z: np.concatenate([1e-9 * z[:700], z]),
    "loud": lambda z: np.concatenate([1e7 * z[:700], z]),
    "lost": lambda z: np.concatenate([1e40 * z[:3], z[:500], np.full(90, np.nan), z]),
}


@pytest.mark.every(3)
@pytest.mark.parametrize("motion", ["hold", "ignore"])
@pytest.mark.parametrize("spoil", SPOILT)
def test_the_twin_of_auto_agrees(spoil, motion):
    z = SPOILT[spoil](record(50.0))
    trace = zr.DriftFilter(RATE, method="auto", motion=motion).trace(z)
    twin = oracle.AutoFilter(RATE, motion=motion).trace(z)
    np.testing.assert_array_equal(trace.at_rest, twin["at_rest"])
    settled = len(z) - 3000
    for name in ("estimate", "bias_sigma"):
        got, expected = getattr(trace, name)[settled:], twin[name][settled:]
        # Ticks count from the first sample: one of 5e6 rounds the rest to 1e-8 of their noise.
        tolerance = 1e-7 if spoil == "loud" else 1e-9
        np.testing.assert_allclose(got, expected, rtol=tolerance, err_msg=name)


@pytest.mark.every(9)
@pytest.mark.parametrize("method", ["kf", "akf", "fading"])
@pytest.mark.parametrize("spoil", SPOILT)
def test_the_twin_of_the_published_filters_agrees(spoil, method):
    z = SPOILT[spoil](record(50.0))
    trace = zr.DriftFilter(RATE, method=method, motion="ignore").trace(z)
    twin = oracle.DriftFilter(RATE, method=method).trace(z)
    settled = len(z) - 2000
    for name in ("estimate", "measurement_noise", "covariance"):
        got, expected = getattr(trace, name)[settled:], twin[name][settled:]
        np.testing.assert_allclose(got, expected, rtol=1e-8, err_msg=name)
